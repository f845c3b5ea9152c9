"""Messages between the server and its synthesis processes.

Commands to a process are lines of JSON. Messages from it are a header (number of the task, kind, length, seconds of
speech) and a payload.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

HEADER = struct.Struct("<IBIf")
MAX_PAYLOAD_BYTES = 1 << 28
CANCELS = frozenset({"cancel", "interrupt"})  # two names of one message of live streams
DEFECT = "InternalError"  # kind of an error that is none of the project's own


class MessageKind(IntEnum):
    """What the payload of a message is."""

    READY = 0  # of the process: models are loaded; JSON
    DATA = 1  # bytes of the result
    EVENT = 2  # JSON object of the result
    END = 3  # the task is done; JSON with its measures
    ERROR = 4  # the task has failed; JSON with kind and message
    CANCELLED = 5  # the task has been cancelled and has released what it held; JSON with the seconds that took


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a task."""

    task: int
    kind: MessageKind
    payload: bytes
    seconds: float = 0.0  # of speech that it adds to the result

    def encode(self) -> bytes:
        """Header and payload."""
        return HEADER.pack(self.task, self.kind, len(self.payload), self.seconds) + self.payload


@dataclass(frozen=True, slots=True)
class Wait:
    """A task has nothing to do until it gets input, or until the given seconds have passed."""

    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """A JSON object as a part of a result, and the seconds of speech that it adds."""

    content: dict[str, Any]
    seconds: float = 0.0
    is_answer: bool = False  # to an urgent input
