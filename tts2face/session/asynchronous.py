"""Calls in threads for event loops, which end with the task that waits for them."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from tts2face.session.speech_stream import Piece
from tts2face.types import Clip, concatenate_clips

Item = TypeVar("Item")
Result = TypeVar("Result")
_END = object()


class _CancelledError(Exception):
    """The task that waited for the result has been cancelled."""


async def iterate(make: Callable[[], Iterator[Item]]) -> AsyncIterator[Item]:
    """Items of an iterator that a thread makes, one ahead; after a cancellation it ends behind the present item."""
    loop, thread = asyncio.get_running_loop(), ThreadPoolExecutor(1, "asynchronous")
    try:
        items = await loop.run_in_executor(thread, make)
        try:
            following = loop.run_in_executor(thread, next, items, _END)
            while (item := await following) is not _END:
                following = loop.run_in_executor(thread, next, items, _END)
                yield item  # type: ignore[misc]
        finally:
            following.cancel()
            thread.submit(getattr(items, "close", lambda: None))
    finally:
        thread.shutdown(wait=False)


async def run_with_task(call: Callable[[Callable[[Piece], None]], Result]) -> Result:
    """Result of a call in a thread, which gets what it calls with each piece; it ends there after a cancellation."""
    is_cancelled = threading.Event()

    def check(_: Piece) -> None:
        if is_cancelled.is_set():
            raise _CancelledError

    try:
        return await asyncio.get_running_loop().run_in_executor(None, call, check)
    except asyncio.CancelledError:
        is_cancelled.set()
        raise


async def whole_clip(pieces: AsyncIterator[Piece]) -> Clip:
    """Clip of all pieces."""
    clips = [piece.clip async for piece in pieces]
    return await asyncio.to_thread(concatenate_clips, clips)
