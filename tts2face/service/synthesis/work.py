"""What a synthesis process is asked to make, and the parts of its results."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError
from tts2face.processes.message import Message
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session import Session

Inputs = deque[Message]  # that a task has not read yet
SYNTHESISE, SERVE = "synthesise", "serve"  # calls of a synthesis process
CANCELS = frozenset({"cancel", "interrupt"})  # two names of one input of live streams


class DefectError(BackendError):
    """A defect of the synthesis; the log has its traceback."""


@dataclass(frozen=True, slots=True)
class Work:
    """What a task makes; all values are JSON.

    Parameters
    ----------
    kind
        Name of a task: one of `tts2face.service.synthesis.tasks.TASKS`, or of a table given to the service.
    models
        Fields of `tts2face.session_cache.Models` that differ from their defaults.
    request, picture
        Fields of `Request` and `Picture` that differ from their defaults.
    format
        Format of `Session.stream_file`; empty: the result is not such a file.
    owner
        For whom finished sentences are kept in memory (`SessionCache.get`); empty: none are.
    affinity
        Works of equal affinity run in the same process if it is free, which keeps their sentences; empty: any.
    """

    kind: str = "file"
    models: Mapping[str, Any] = field(default_factory=dict)
    request: Mapping[str, Any] = field(default_factory=dict)
    picture: Mapping[str, Any] = field(default_factory=dict)
    format: str = ""
    owner: str = ""
    affinity: str = ""

    def as_json(self) -> dict[str, Any]:
        """JSON object of the fields."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Wait:
    """A task has nothing to do until it gets input, or until the given seconds have passed."""

    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """A JSON object as a part of a result, and the seconds of speech that it adds."""

    content: dict[str, Any]
    seconds: float = 0.0


# A part of a result, or a wait. The messages of a part have its ``seconds`` of speech and either bytes as their
# payload or an ``event``; the last message has ``seconds`` and ``cpu_s`` of the whole.
Step = Chunk | Event | Wait
Task = Callable[["Session", Work, Inputs], Iterator[Step]]  # makes a result step by step
