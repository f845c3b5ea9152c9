"""Sessions kept by the names of their models, for processes that serve many requests."""

import gc
import os
from collections import OrderedDict
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tts2face.processes.shared import free_unused
from tts2face.session.named_models import Models

if TYPE_CHECKING:
    from tts2face.session.session import Session
    from tts2face.sound.voice_pool import VoicePool
    from tts2face.storage.signing import Signer


class SessionCache:
    """Loads sessions at their first use and keeps the last ones; a second one takes 250 MB.

    Parameters
    ----------
    n_sessions
        Sessions to keep.
    voices
        Loaded voices that all sessions share; None: each has its own.
    max_bytes
        Memory of this process beyond which the least recently used sessions are released, all but one; None: any.
    memory_mb
        Finished sentences that a session with an owner keeps, as for `Session`.
    signer
        Who signs the files of all sessions; None: nobody.
    """

    def __init__(
        self,
        n_sessions: int = 1,
        *,
        voices: "VoicePool | None" = None,
        max_bytes: int | None = None,
        memory_mb: float = 0.0,
        signer: "Signer | None" = None,
    ) -> None:
        self._n_sessions = n_sessions
        self._voices = voices
        self._max_bytes = max_bytes
        self._memory_mb = memory_mb
        self._signer = signer
        self._sessions: OrderedDict[tuple[Models, str, tuple[int, ...]], Session] = OrderedDict()

    def get(self, models: Models, owner: str = "") -> "Session":
        """Session of these models; a new one if a file has changed; raises as `Session`.

        Parameters
        ----------
        owner
            For whom the session keeps finished sentences, and for nobody else; empty: it keeps none.
        """
        key = (models, owner, _file_times(models))
        if key in self._sessions:
            self._sessions.move_to_end(key)
        else:
            while len(self._sessions) >= self._n_sessions:
                self._sessions.popitem(last=False)
            gc.collect()  # sessions hold themselves in circles
            session = models.open_session(self._voices, memory_mb=self._memory_mb if owner else 0.0)
            self._sessions[key] = session if self._signer is None else session.signed_by(self._signer)
            free_unused()  # models of the released sessions that the new one does not share
        while self._max_bytes is not None and len(self._sessions) > 1 and resident_bytes() > self._max_bytes:
            self._sessions.popitem(last=False)
            free_unused()
            gc.collect()
        return self._sessions[key]


def _file_times(models: Models) -> tuple[int, ...]:
    """Times of the last change of those models that are files, in nanoseconds."""
    found = []
    for name in (models.talker, models.face, models.palette):
        # shipped models have names without folders, and do not change
        if name is not None and os.sep in name:
            with suppress(OSError):
                found.append(os.stat(name).st_mtime_ns)
    return tuple(found)


def resident_bytes() -> int:
    """Memory of this process in bytes; 0 where the system does not tell."""
    with suppress(OSError):
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0
