"""Messages between a process and its children: one line of JSON, then bytes."""

import asyncio
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

# Kinds of messages: calls have the name of their handler.
MORE, PAUSE, GO, STOP = "more", "pause", "go", "stop"  # to a child, of a live call: a further input, or its control
CONTROLS = frozenset({MORE, PAUSE, GO, STOP})
EVENT, RESULT, ERROR = "event", "result", "error"  # from a child, of a call

MAX_LINE_BYTES = 16 << 20
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
    head = _head(file.readline(MAX_LINE_BYTES))
    if head is None:
        return None
    payload = file.read(head["n_bytes"])
    return _message(head, payload) if len(payload) == head["n_bytes"] else None


async def receive_message(stream: asyncio.StreamReader) -> Message | None:
    """The next message of a pipe; None where it ends, or sends what is none."""
    try:
        head = _head(await stream.readline())
        return None if head is None else _message(head, await stream.readexactly(head["n_bytes"]))
    except (ValueError, asyncio.IncompleteReadError, ConnectionError):  # a line that is too long, or half a message
        return None


def _head(line: bytes) -> dict[str, Any] | None:
    if not line.endswith(b"\n"):
        return None
    head: dict[str, Any] = json.loads(line)
    return head if head["n_bytes"] <= MAX_PAYLOAD_BYTES else None


def _message(head: Mapping[str, Any], payload: bytes) -> Message:
    return Message(head["kind"], head["content"], payload, head["id"])
