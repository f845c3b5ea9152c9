"""Calls of a session for event loops: each works in a thread, and ends with the task that waits for it."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Protocol, TypeVar

from tts2face.request import Request
from tts2face.session.outputs import WrittenClip
from tts2face.session.prepared import PreparedRequest
from tts2face.session.speech_stream import Piece
from tts2face.types import Chunk, Clip, concatenate_clips

Item = TypeVar("Item")
Result = TypeVar("Result")
AnyText = str | Request | PreparedRequest
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


class AsyncCalls(Protocol):
    """Calls of a session as coroutines, with the same arguments, results and errors as those without the ``a``."""

    def stream(self, text: AnyText, **options: Any) -> Iterator[Piece]:
        """Pieces of a clip."""

    def stream_file(self, text: AnyText, format: str = "mp4", **options: Any) -> Iterator[Chunk]:
        """Chunks of a file."""

    def write(self, text: AnyText, out: str | Path, **options: Any) -> WrittenClip:
        """Write a file."""

    def export(self, text: AnyText, paths: str | Path | Sequence[str | Path], **options: Any) -> WrittenClip:
        """Write files of other programs."""

    async def aclip(self, text: AnyText, **options: Any) -> Clip:
        """As `Session.clip`; when the task is cancelled, synthesis ends behind the present sentence."""
        clips = [piece.clip async for piece in self.astream(text, **options)]
        return await asyncio.to_thread(concatenate_clips, clips)

    async def astream(self, text: AnyText, **options: Any) -> AsyncIterator[Piece]:
        """As `Session.stream`."""
        async for piece in iterate(lambda: self.stream(text, **options)):
            yield piece

    async def astream_file(self, text: AnyText, format: str = "mp4", **options: Any) -> AsyncIterator[Chunk]:
        """As `Session.stream_file`."""
        async for chunk in iterate(lambda: self.stream_file(text, format, **options)):
            yield chunk

    async def awrite(self, text: AnyText, out: str | Path, **options: Any) -> WrittenClip:
        """As `Session.write`, without `on_piece`; no partial file remains when the task is cancelled."""
        return await run_with_task(lambda check: self.write(text, out, on_piece=check, **options))

    async def aexport(self, text: AnyText, paths: str | Path | Sequence[str | Path], **options: Any) -> WrittenClip:
        """As `Session.export`, without `on_piece`."""
        return await run_with_task(lambda check: self.export(text, paths, on_piece=check, **options))
