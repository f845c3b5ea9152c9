"""Results of synthesis processes as HTTP answers."""

import json
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, aclosing
from dataclasses import dataclass
from typing import Any, Protocol

from fastapi import Request as HttpRequest
from fastapi import WebSocket
from fastapi.responses import StreamingResponse

from tts2face.processes.message import Message
from tts2face.serving.service.exchange import ERROR_FIELD
from tts2face.serving.service.messages import Work
from tts2face.serving.service.state import service_state
from tts2face.session.encoded_stream import LINES


async def stream_work(
    request: HttpRequest,
    work: Work,
    media_type: str,
    *,
    convert: "Converter | None" = None,
    resources: AsyncExitStack | None = None,
) -> StreamingResponse:
    """Answer that sends a result while it is made.

    It begins with the first bytes, so that errors before them have their own status. A client that leaves cancels it.

    Parameters
    ----------
    convert
        Converts messages to bytes, and an error to what ends them; None: the bytes of all data.
    resources
        Closed when the answer is complete or has failed.
    """
    state, stack = service_state(request), resources or AsyncExitStack()
    messages = state.results.messages(work, request.state.key)
    convert = convert or DataBytes(media_type)
    chunks = convert(messages)
    try:
        first = await anext(chunks)
    except StopAsyncIteration:
        first = b""
    except BaseException:
        await messages.aclose()  # type: ignore[attr-defined]
        await stack.aclose()
        raise

    async def body() -> AsyncIterator[bytes]:
        async with stack, aclosing(messages):  # type: ignore[type-var]
            yield first
            async for chunk in chunks:
                yield chunk

    request.state.exchange.ending = convert.failed
    headers = {} if convert.failed({}) else {"Trailer": ERROR_FIELD}
    return StreamingResponse(body(), media_type=media_type, headers=headers)


class Converter(Protocol):
    """Converts the messages of a result to the bytes of an answer."""

    def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The bytes, as they come."""
        ...

    def failed(self, content: dict[str, Any]) -> bytes:
        """Bytes that follow those so far when the result ends with an error; empty: their form has no place for it."""
        ...


@dataclass(frozen=True, slots=True)
class DataBytes:
    """The bytes of the data of a result, as they are."""

    media_type: str

    async def __call__(self, messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
        """The bytes."""
        async for message in messages:
            if message.payload:
                yield message.payload

    def failed(self, content: dict[str, Any]) -> bytes:
        """A line, after lines of JSON."""
        return json_line(content) if self.media_type == LINES else b""


def error_event(content: dict[str, Any]) -> bytes:
    """Server-sent event with an error, the last one of a stream."""
    return b"event: error\ndata: " + json_line({"type": "error", **content}) + b"\n"


def json_line(content: Any) -> bytes:
    """Compact JSON on a line."""
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"


async def timed_speech(request: HttpRequest | WebSocket, work: Work) -> tuple[list[dict[str, Any]], bytes]:
    """All events of a task of kind ``speech``, and its sound as 16-bit PCM."""
    events: list[dict[str, Any]] = []
    sound = bytearray()
    state = service_state(request)
    async with aclosing(state.results.messages(work, request.state.key)) as messages:  # type: ignore[type-var]
        async for message in messages:
            sound += message.payload
            if "event" in message.content:
                events.append(message.content["event"])
    return events, bytes(sound)
