"""Messages between a process and its children: one line of JSON, then bytes."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

# Kinds of messages: calls have the name of their handler.
# to a child, of a live call: a further input, or its control
MORE = "more"
PAUSE = "pause"
GO = "go"
STOP = "stop"
CONTROLS = frozenset({MORE, PAUSE, GO, STOP})
# from a child, of a call
EVENT = "event"
RESULT = "result"
ERROR = "error"

# of the JSON of a message
MAX_LINE_BYTES = 16 << 20
# of the bytes behind it; what names more is a damaged pipe
MAX_PAYLOAD_BYTES = 256 << 20


@dataclass(frozen=True, slots=True)
class Message:
    """One message.

    Parameters
    ----------
    kind
        A handler's name or one of `CONTROLS` to a child, `EVENT`, `RESULT` or `ERROR` from it.
    content
        What JSON can hold.
    id
        The call that it belongs to.
    """

    kind: str
    content: Mapping[str, Any] = field(default_factory=dict)
    payload: bytes = b""
    id: int = 0

    def encoded(self) -> bytes:
        """The line and the bytes."""
        head = {"id": self.id, "kind": self.kind, "n_bytes": len(self.payload), "content": dict(self.content)}
        return json.dumps(head).encode() + b"\n" + self.payload


def read_message(file: BinaryIO) -> Message | None:
    """The next message of a pipe; None where it ends."""
    head = parse_head(file.readline(MAX_LINE_BYTES))
    if head is None:
        return None
    payload = file.read(head["n_bytes"])
    return message_of(head, payload) if len(payload) == head["n_bytes"] else None


def parse_head(line: bytes) -> dict[str, Any] | None:
    """The object of a line; None where the line is cut off, or names more than `MAX_PAYLOAD_BYTES`."""
    if not line.endswith(b"\n"):
        return None
    head: dict[str, Any] = json.loads(line)
    return head if head["n_bytes"] <= MAX_PAYLOAD_BYTES else None


def message_of(head: Mapping[str, Any], payload: bytes) -> Message:
    """The message of an object that `parse_head` returned."""
    return Message(head["kind"], head["content"], payload, head["id"])
