"""Tasks of a synthesis process, and the parts of their results."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError
from tts2face.processes.message import Message
from tts2face.processes.threads import available_cores
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session.session import Session

Inputs = deque[Message]  # that a task has not read yet
SYNTHESISE, SERVE = "synthesise", "serve"  # calls of a synthesis process
DRAWING_THREADS = min(
    4, available_cores()
)  # of a process, for all its movies: drawing takes 4 times as long as encoding
CANCEL = "cancel"  # input of live streams
QUALITY = "quality"  # type of an event: the pictures have another one from here on


class BusyError(BackendError):
    """Too many requests wait; the request may be repeated later."""

    retry_after_s = 2


class DefectError(BackendError):
    """A defect of the synthesis; the log has its traceback."""


@dataclass(frozen=True, slots=True)
class Work:
    """The result that a task is to make; all values are JSON.

    Parameters
    ----------
    kind
        Name of a task: one of `tts2face.serving.service.synthesis.TASKS`, or of a table given to the service.
    models
        Fields of `tts2face.session.named_models.Models` that differ from their defaults.
    request, picture
        Fields of `Request` and `Picture` that differ from their defaults.
    format
        Format of `Session.stream_file`; empty: the result is not such a file.
    owner
        For whom finished sentences are kept in memory (`SessionCache.get`); empty: none are.
    keeps_pace
        A movie has pictures of less quality rather than falling behind who sees it (`tts2face.picture.pace.Pace`).
    affinity
        Works of equal affinity run in the same process if it is free, which keeps their sentences; empty: any.
    is_complete
        The bytes come when all is made, as a file whose header has its length.
    """

    kind: str = "file"
    models: Mapping[str, Any] = field(default_factory=dict)
    request: Mapping[str, Any] = field(default_factory=dict)
    picture: Mapping[str, Any] = field(default_factory=dict)
    format: str = ""
    owner: str = ""
    keeps_pace: bool = False
    affinity: str = ""
    is_complete: bool = False

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


@dataclass(frozen=True, slots=True)
class Line:
    """The same as JSON that is written already, which the server passes on as it is."""

    content: bytes
    seconds: float = 0.0


# A part of a result, or a wait. The messages of a part have its ``seconds`` of speech and an ``event`` or bytes as
# their payload, which are JSON if ``is_json``; the last message has ``seconds`` and ``cpu_s`` of the whole.
Step = Chunk | Event | Line | Wait


Task = Callable[["Session", Work, Inputs], Iterator[Step]]  # makes a result step by step
