"""Streams of results as HTTP answers."""

from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, aclosing
from typing import Any

from fastapi import Request as HttpRequest
from fastapi import WebSocket
from fastapi.responses import StreamingResponse

from tts2face.processes.message import Message
from tts2face.service.state import ServiceState
from tts2face.service.synthesis.work import Work


def service_state(request: HttpRequest | WebSocket) -> ServiceState:
    """State of the service that received a request."""
    state: ServiceState = request.app.state.service
    return state


async def stream_work(
    request: HttpRequest,
    work: Work,
    media_type: str,
    *,
    convert: "Callable[[AsyncIterator[Message]], AsyncIterator[bytes]] | None" = None,
    resources: AsyncExitStack | None = None,
) -> StreamingResponse:
    """Answer that sends a result while it is made.

    It begins with the first bytes, so that errors before them have their own status. A client that leaves cancels it.

    Parameters
    ----------
    convert
        Converts messages to bytes; None: the bytes of all data.
    resources
        Closed when the answer is complete or has failed.
    """
    state, stack = service_state(request), resources or AsyncExitStack()
    messages = state.messages(work, request.state.key)
    chunks = (convert or data_bytes)(messages)
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

    return StreamingResponse(body(), media_type=media_type)


async def data_bytes(messages: AsyncIterator[Message]) -> AsyncIterator[bytes]:
    """Bytes of the data of a result."""
    async for message in messages:
        if message.payload:
            yield message.payload


async def timed_speech(request: HttpRequest | WebSocket, work: Work) -> tuple[list[dict[str, Any]], bytes]:
    """All events of a work of kind ``speech``, and its sound as 16-bit PCM."""
    events: list[dict[str, Any]] = []
    sound = bytearray()
    state = service_state(request)
    async with aclosing(state.messages(work, request.state.key)) as messages:  # type: ignore[type-var]
        async for message in messages:
            sound += message.payload
            if "event" in message.content:
                events.append(message.content["event"])
    return events, bytes(sound)
