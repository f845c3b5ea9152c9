"""Calls of a session for event loops; asyncio is loaded with the first one."""

from collections.abc import AsyncIterator, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from tts2face.request import Request
from tts2face.session.outputs import WrittenClip
from tts2face.session.prepared import PreparedRequest
from tts2face.session.speech_stream import Piece
from tts2face.types import Chunk, Clip

AnyText = str | Request | PreparedRequest


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
        from tts2face.session.asynchronous import whole_clip

        return await whole_clip(self.astream(text, **options))

    async def astream(self, text: AnyText, **options: Any) -> AsyncIterator[Piece]:
        """As `Session.stream`."""
        from tts2face.session.asynchronous import iterate

        async for piece in iterate(lambda: self.stream(text, **options)):
            yield piece

    async def astream_file(self, text: AnyText, format: str = "mp4", **options: Any) -> AsyncIterator[Chunk]:
        """As `Session.stream_file`."""
        from tts2face.session.asynchronous import iterate

        async for chunk in iterate(lambda: self.stream_file(text, format, **options)):
            yield chunk

    async def awrite(self, text: AnyText, out: str | Path, **options: Any) -> WrittenClip:
        """As `Session.write`, without `on_piece`; no partial file remains when the task is cancelled."""
        from tts2face.session.asynchronous import run_with_task

        return await run_with_task(lambda check: self.write(text, out, on_piece=check, **options))

    async def aexport(self, text: AnyText, paths: str | Path | Sequence[str | Path], **options: Any) -> WrittenClip:
        """As `Session.export`, without `on_piece`."""
        from tts2face.session.asynchronous import run_with_task

        return await run_with_task(lambda check: self.export(text, paths, on_piece=check, **options))
