"""Sessions of a process by the names of their models; the least recently used ones are released."""

import gc
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tts2face.session import Session


@dataclass(frozen=True, slots=True)
class Models:
    """Models that show and move a speaker, by name or path."""

    talker: str = "grid_s1"
    face: str = "head"
    identity: str | None = None
    palette: str = "starter"


class SessionCache:
    """Loads sessions at their first use and keeps the last `n_sessions`; a second one takes 250 MB."""

    def __init__(self, n_sessions: int = 1) -> None:
        self._n_sessions = n_sessions
        self._sessions: OrderedDict[Models, Session] = OrderedDict()

    def get(self, models: Models) -> "Session":
        """Session of these models; raises as `Session`."""
        from tts2face.session import Session  # a second of imports

        if models in self._sessions:
            self._sessions.move_to_end(models)
        else:
            while len(self._sessions) >= self._n_sessions:
                self._sessions.popitem(last=False)
            gc.collect()  # sessions hold themselves in circles
            self._sessions[models] = Session(
                models.talker, models.face, identity=models.identity, palette=models.palette
            )
        return self._sessions[models]
