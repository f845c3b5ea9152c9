"""The preview of a project: made by synthesis processes, given up when a newer edit arrives, sent by differences."""

import asyncio
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import aclosing, suppress
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.processes.message import Message
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import in_background
from tts2face.serving.service.messages import Work
from tts2face.serving.studio.preview_bundle import DIGEST_LENGTH, Preview, bundle
from tts2face.serving.studio.requests import events_of
from tts2face.storage.memory import ResultMemory

MAX_REVISIONS = 30  # that a page may have and is sent the difference to
MAX_TRIES = 3  # of a preview whose process ended
PARTIAL_S = 0.15  # between states of a preview that is not complete yet
Ask = Callable[[tuple[str, ...]], "asyncio.Future[Work] | Any"]  # makes the work, given the digests that are here
Stream = Callable[[Work], AsyncIterator[Message]]


class ProjectPreview:
    """The preview of one project.

    Parameters
    ----------
    stream
        Messages of an order.
    memory
        Contents of pieces, shared by all projects.
    on_change
        Called after each new revision, in the event loop.
    on_fit
        Called with the complete preview, the sentences whose edges were dropped, and the seconds to which the timeline
        was cut (None: not); returns notes.
    on_speech
        Called with the seconds of speech that were made and not only repeated.
    """

    def __init__(
        self,
        stream: Stream,
        memory: ResultMemory,
        *,
        on_change: Callable[[], None],
        on_fit: Callable[[Preview, list[tuple[str, int]], float | None], list[str]],
        on_speech: Callable[[float], None] = lambda _: None,
    ) -> None:
        self._stream, self._memory = stream, memory
        self._on_change = on_change
        self._on_fit = on_fit
        self._on_speech = on_speech
        self._revisions: OrderedDict[int, Preview] = OrderedDict()
        self._task: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()
        self._ask: Ask | None = None
        self.current = Preview()
        self.is_made = False  # the current one is that of the last `start`, and was neither given up nor refused

    @property
    def is_running(self) -> bool:
        """Whether a preview is being made."""
        return self._task is not None and not self._task.done()

    def start(self, ask: Ask) -> None:
        """Make the preview of a changed project; one that is being made is given up."""
        self.cancel()
        self._ask, self.is_made = ask, False
        self._task = in_background(self._run(ask))

    def cancel(self) -> None:
        """Give up the preview that is being made."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def wait(self, seconds: float) -> None:
        """Wait until no preview is being made, at most so many seconds."""
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while self.is_running:
                    self._changed.clear()
                    await self._changed.wait()

    def bundle(self, have: int | None) -> bytes | None:
        """Bytes for a page that has a revision; None if they must be made again, which is then begun."""
        made = bundle(self.current, self._memory, self._revisions.get(have) if have is not None else None)
        # contents that memory has dropped
        if made is None and self._ask is not None and not self.is_running:
            self.start(self._ask)
        return made

    async def _run(self, ask: Ask) -> None:
        try:
            for number in range(MAX_TRIES):
                try:
                    await self._make(await ask(self._kept()))
                    self.is_made = True
                    return None
                except (RefusedError, Tts2faceError) as wrong:
                    # only the end of a process is an accident
                    if not _has_ended(wrong) or number == MAX_TRIES - 1:
                        return self._fail(wrong)
        finally:
            if asyncio.current_task() is self._task:
                self._task = None
            self._changed.set()

    async def _make(self, work: Work) -> None:
        loop = asyncio.get_running_loop()
        pieces = list[dict[str, Any]]()
        fps = 30.0
        before, shown_at = self.current, loop.time()
        async with aclosing(self._stream(work)) as messages:  # type: ignore[type-var]
            async for event, content in events_of(messages):
                if event["type"] == "begin":
                    pieces, fps = [], event["fps"]
                elif event["type"] == "piece":
                    if content:
                        self._memory.put(event["digest"], content, len(content))
                    pieces.append(event)
                    if loop.time() > shown_at + PARTIAL_S:
                        self._show_part(before, pieces, fps)
                        shown_at = loop.time()
                else:
                    self._finish(before, pieces, fps, event)

    def _finish(self, before: Preview, pieces: list[dict[str, Any]], fps: float, end: Mapping[str, Any]) -> None:
        dropped = [(text, occurrence) for text, occurrence in end["dropped"]]
        notes = self._on_fit(Preview(0, fps, tuple(pieces)), dropped, end["cut_to"])
        notes += [note for piece in pieces for note in piece["notes"]]
        known = {_sound(piece) for piece in before.pieces}
        self._on_speech(sum(piece["seconds"] for piece in pieces if _sound(piece) not in known))
        self._publish(Preview(0, fps, tuple(pieces), is_complete=True, notes=tuple(notes)))

    def _show_part(self, before: Preview, pieces: list[dict[str, Any]], fps: float) -> None:
        """Show new pieces before the old rest if that has the same frames, or alone if nothing was there before."""
        rest = before.pieces[len(pieces) :]
        lengths = [piece["n_frames"] for piece in pieces]
        fits = lengths == [piece["n_frames"] for piece in before.pieces[: len(pieces)]] and fps == before.fps
        has_channels = bool(before.pieces) and pieces[0]["channels"] == before.pieces[0]["channels"]
        if rest and fits and has_channels:
            self._publish(Preview(0, fps, (*pieces, *rest)))
        elif not before.is_complete:
            self._publish(Preview(0, fps, tuple(pieces)))

    def _fail(self, wrong: RefusedError | Tts2faceError) -> None:
        self.fail(wrong.message if isinstance(wrong, RefusedError) else str(wrong))

    def fail(self, message: str) -> None:
        """Say why there is no preview; the last one stays."""
        shown = self.current
        self._publish(Preview(0, shown.fps, shown.pieces, is_complete=True, error=" ".join(message.split())))

    def _publish(self, preview: Preview) -> None:
        number = self.current.revision + 1
        self.current = Preview(
            number, preview.fps, preview.pieces, preview.is_complete, preview.notes, preview.error, preview.extras
        )
        self._revisions[number] = self.current
        while len(self._revisions) > MAX_REVISIONS:
            self._revisions.popitem(last=False)
        if preview.is_complete:  # whoever waits sees no task that has nothing left to do
            self._task = None
        self._changed.set()
        self._on_change()

    def _kept(self) -> tuple[str, ...]:
        digests = (piece["digest"] for piece in self.current.pieces)
        return tuple(digest for digest in digests if self._memory.get(digest) is not None)


def _sound(piece: Mapping[str, Any]) -> str:
    return str(piece["digest"][2 * DIGEST_LENGTH :])


def _has_ended(wrong: Exception) -> bool:
    """Whether the process ended, which says nothing about what it was asked for."""
    return isinstance(wrong, ChildEndedError) or isinstance(wrong.__cause__, ChildEndedError)
