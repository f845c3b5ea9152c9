"""Rendering of segments from the queue in a child process, which is ended when a segment is cancelled."""

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from lexicon.errors import DataError, InputError, Tts2faceError
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.batch.engine import OnMessage, SegmentRenderer, render_into
from tts2face.serving.batch.render_process import RenderProcess
from tts2face.serving.batch.segment import Segment, segment_from_json
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import Store, wait_for_store
from tts2face.serving.work.blobs import BlobStore, place_segment_files
from tts2face.storage.temporary import Temporary


def is_cancelled(name: str) -> bool:
    """Whether a job of the queue was cancelled."""
    from dbos import DBOS

    found = DBOS.list_workflows(workflow_ids=[name], load_input=False, load_output=False)
    return any(job.status == "CANCELLED" for job in found)


class SegmentFailedError(RuntimeError):
    """A segment that cannot be rendered; the reason is kept in the database."""


class SegmentWorker:
    """Renders one segment at a time.

    Parameters
    ----------
    blobs
        Stores of the files that segments of jobs name; the first that has a file gives it.
    renderer
        What renders; None: a child process.
    core
        Core to which the child process is bound; None: all.
    """

    def __init__(
        self,
        store: Store,
        blobs: Callable[[], tuple[BlobStore, ...]],
        *,
        renderer: SegmentRenderer | None = None,
        core: int | None = None,
        on_message: OnMessage = lambda _: None,
    ) -> None:
        self._store = store
        self._blobs = blobs
        self._on_message = on_message
        self._process = RenderProcess(core) if renderer is None else None
        self._renderer: SegmentRenderer = renderer or self
        self._rendering = threading.Lock()  # one segment at a time
        self._files: Temporary | None = None
        self._current: str | None = None
        self._is_cancelled = False
        self.n_rendered = 0

    def work(self, name: str, address: str, content: dict[str, Any]) -> dict[str, Any]:
        """Render a segment unless it is stored; after a death it runs again and has no other effect.

        Parameters
        ----------
        name
            Name of the job of the queue.

        Raises
        ------
        SegmentFailedError
            It cannot be rendered.
        """
        try:
            found = wait_for_store(partial(self._store.result, address), self._on_message)
            if found is not None:
                return found.as_json()
            segment = place_segment_files(segment_from_json(content), self._blobs, self._folder)
            if replace(segment, file_hashes=segment.input_hashes()).address != address:
                raise DataError(
                    "a model, voice, file or program version of this machine differs from that of the batch; "
                    "install and copy the same ones"
                )
        except Tts2faceError as wrong:
            raise SegmentFailedError(str(wrong)) from None
        with self._rendering:
            self._current, self._is_cancelled = name, False
            rendered = render_into(self._store, segment, self._renderer, self._on_message)
            self._current = None
        if rendered.result is None:
            raise SegmentFailedError(rendered.reason)
        self.n_rendered += 1
        return rendered.result.as_json()

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        """Render a segment in the child process; after `end_cancelled` there is no other try.

        Raises
        ------
        InputError
            It was cancelled; or as the child process.
        """
        assert self._process is not None
        try:
            return self._process.render(segment, out)
        except ChildEndedError:
            if self._is_cancelled:
                raise InputError("cancelled") from None
            raise

    def end_cancelled(self, is_cancelled: Callable[[str], bool]) -> None:
        """End the rendering of the present segment if its job was cancelled."""
        name = self._current
        if name is None or self._process is None or not is_cancelled(name):
            return
        self._is_cancelled = True
        if name == self._current:
            self._process.kill()

    def close(self) -> None:
        """End the child process."""
        if self._process is not None:
            self._process.close()
        if self._files is not None:
            self._files.remove()

    def _folder(self) -> Path:
        """Folder of the files of jobs on this machine, removed by a later worker if this one is killed."""
        if self._files is None:
            folder = self._store.scratch() or Path(gettempdir())
            self._files = Temporary(folder / "inputs", is_folder=True)
        return self._files.path
