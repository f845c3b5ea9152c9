"""A synthesis process of the server: it keeps sessions warm and makes several results in turn."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import Program
from tts2face.serving.service.logs import configure_logs, log_event
from tts2face.serving.service.messages import SERVE, SYNTHESISE, DefectError, Step, Task, Work
from tts2face.serving.service.scheduler import OneAtATime, Turns, give_turn
from tts2face.serving.service.tasks import TASKS
from tts2face.session import warm_up
from tts2face.session.named_models import Models
from tts2face.session.session_cache import SessionCache
from tts2face.sound.voice_pool import VoicePool


class Synthesis:
    """Handlers that share sessions and take turns; `tasks` by the kinds of their tasks."""

    def __init__(self, sessions: SessionCache, tasks: Mapping[str, Task] = TASKS) -> None:
        self._sessions, self._tasks = sessions, tasks
        self._turns = Turns()

    def synthesise(self, call: Call) -> Mapping[str, float]:
        """Send the parts of the result of a ``work``; its measures."""
        try:
            return self._turns.run(call, lambda: self._steps(call), call.content["priority"], call.content["key"])
        except Tts2faceError:
            raise
        except Exception as error:
            log_event("defect", level=logging.ERROR, error=error, id=call.content["id"])
            raise DefectError(f"internal error: {type(error).__name__}; see the log of the service") from error

    def _steps(self, call: Call) -> Iterator[Step]:
        work = Work(**call.content["work"])
        return self._tasks[work.kind](self._sessions.get(Models(**work.models), work.owner), work, call.inputs)


def serve(call: Call) -> Mapping[str, Any]:
    """Send an event as soon as the process has loaded; the call lasts as long as the process."""
    call.event({})
    return call.more().content


def handlers(
    *, log_format: str, log_text: bool, n_sessions: int, memory_mb: int, sentences_mb: int, tasks: Sequence[str] = ()
) -> Mapping[str, Handler]:
    """Handlers of a process with the settings of the service.

    Parameters
    ----------
    tasks
        ``module:NAME`` of further tables of tasks by kind.
    """
    configure_logs(log_format, with_text=log_text)
    sessions = SessionCache(
        n_sessions, voices=VoicePool(OneAtATime(), give_turn), max_bytes=memory_mb * 1_000_000 or None,
        memory_mb=sentences_mb,
    )  # fmt: skip
    known = dict(TASKS)
    for table in tasks:
        known |= Program(table).load()
    return {SYNTHESISE: Synthesis(sessions, known).synthesise, SERVE: serve, **warm_up.HANDLERS}
