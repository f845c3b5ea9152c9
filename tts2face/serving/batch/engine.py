"""Engines that render segments: processes of this machine, or workers of a database (`tts2face.serving.work`)."""

import os
import queue
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.batch.render_process import RenderProcess
from tts2face.serving.batch.segment import SEGMENT_SUFFIX, Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import Store, wait_for_store

MAX_TRIES = 3  # of a segment whose process ended; then it counts as failed
MIN_FREE_BYTES = 200 << 20  # below which work pauses
PAUSE_S = 2.0  # between two checks of a full disk

OnMessage = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Rendered:
    """A segment that is stored, or the reason why it is not."""

    address: str
    result: SegmentResult | None
    reason: str = ""


class Engine(Protocol):
    """Renders segments into a store, in any order."""

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""


class SegmentRenderer(Protocol):
    """A renderer of this process, or a child process."""

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        """Render a segment into a file."""


@dataclass(frozen=True, slots=True)
class LocalEngine:
    """Processes of this machine; one job renders in this process."""

    n_jobs: int = 1
    on_message: OnMessage = lambda _: None

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        # no process of its own for one job
        if self.n_jobs == 1:
            from tts2face.serving.batch.render import SegmentRenderer

            renderer = SegmentRenderer()
            for segment in segments.values():
                yield render_into(store, segment, renderer, self.on_message)
            return
        waiting: queue.SimpleQueue[Segment] = queue.SimpleQueue()
        for segment in segments.values():
            waiting.put(segment)
        done: queue.SimpleQueue[Rendered | Exception] = queue.SimpleQueue()
        with _processes(min(self.n_jobs, len(segments))) as processes:
            for process in processes:  # daemons: one that waits for a full disk does not keep the command from ending
                arguments = (process, waiting, partial(render_into, store, on_message=self.on_message), done)
                threading.Thread(target=_render_waiting, args=arguments, name="render", daemon=True).start()
            for _ in segments:
                found = done.get()
                if isinstance(found, Exception):
                    raise found
                yield found


def _render_waiting(
    process: RenderProcess,
    waiting: "queue.SimpleQueue[Segment]",
    render: Callable[..., Rendered],
    done: "queue.SimpleQueue[Rendered | Exception]",
) -> None:
    """Render segments by a process until none waits, or the process has been closed."""
    with suppress(queue.Empty):
        while not process.is_closed:
            segment = waiting.get_nowait()
            try:
                done.put(render(segment=segment, renderer=process))
            except Exception as defect:  # noqa: BLE001 - raised again by the thread that waits for the results
                done.put(defect)


@contextmanager
def _processes(n_jobs: int) -> Iterator[list[RenderProcess]]:
    """Child processes, each bound to a core; they end at once with the context, whatever they render."""
    # the cores that a container allows; not on macOS and Windows
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    processes = [RenderProcess(cores[number % len(cores)] if cores else None) for number in range(n_jobs)]
    try:
        yield processes
    finally:
        for process in processes:
            process.close()


def render_into(store: Store, segment: Segment, renderer: SegmentRenderer, on_message: OnMessage) -> Rendered:
    """Render a segment unless the store has it; errors become the reason.

    A process that ends is tried again up to `MAX_TRIES` times. A full disk and a store that cannot be reached are
    waited for.
    """
    address = segment.address
    reason = ""
    tries = 0
    while tries < MAX_TRIES:
        try:
            found = wait_for_store(partial(store.result, address), on_message)
            if found is not None:
                return Rendered(address, found)
            with _scratch(store) as folder:
                wait_for_space(folder, on_message)
                movie = folder / f"{address}-{os.getpid()}-{threading.get_ident()}{SEGMENT_SUFFIX}"
                try:
                    result = renderer.render(segment, movie)
                    wait_for_store(partial(store.put, address, movie, result), on_message)
                finally:
                    movie.unlink(missing_ok=True)
            return Rendered(address, result)
        except ChildEndedError as died:
            reason = str(died)
            tries += 1
        except Tts2faceError as wrong:
            # a full disk is no fault of the segment: the try does not count
            if isinstance(wrong, BackendError) and _is_full(store):
                continue
            return Rendered(address, None, str(wrong))
    return Rendered(address, None, f"{reason} ({MAX_TRIES} tries)")


@contextmanager
def _scratch(store: Store) -> Iterator[Path]:
    folder = store.scratch()
    if folder is not None:
        yield folder
        return
    with TemporaryDirectory(prefix="tts2face-") as temporary:
        yield Path(temporary)


def _is_full(store: Store) -> bool:
    with _scratch(store) as folder:
        return free_bytes(folder) < MIN_FREE_BYTES


def free_bytes(folder: Path) -> int:
    """Free bytes of the disk of a folder."""
    return shutil.disk_usage(folder).free


def wait_for_space(folder: Path, on_message: OnMessage) -> None:
    """Wait until the disk of a folder has `MIN_FREE_BYTES`, and say so."""
    is_waiting = False
    while free_bytes(folder) < MIN_FREE_BYTES:
        if not is_waiting:
            on_message(f"paused: the disk of {folder} is full; free {MIN_FREE_BYTES >> 20} MB to continue")
            is_waiting = True
        time.sleep(PAUSE_S)
    if is_waiting:
        on_message(f"continued: the disk of {folder} has space again")


def lack_of_room(folder: Path, noun: str) -> str:
    """Why work on the disk of a folder pauses; empty where it does not."""
    try:
        free = free_bytes(folder)
    except OSError as refused:
        return f"the {noun} cannot be read ({refused.strerror}); check its place and its rights"
    if free >= MIN_FREE_BYTES:
        return ""
    return f"the disk of the {noun} has {free >> 20} MB free, and work needs {MIN_FREE_BYTES >> 20}; free some space"


def lack_of_folder(folder: Path, noun: str) -> str:
    """Why a folder cannot serve, which is found out by writing a file; empty if it can."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"0")
    except OSError as refused:
        return f"the {noun} cannot be written ({refused.strerror}); check its place, its rights and its disk"
    return lack_of_room(folder, noun)
