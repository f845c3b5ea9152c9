"""Clips into a file while they are drawn: .mp4, .webm, .gif, or a folder of .png."""

import contextlib
import os
import queue
import shutil
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, InputError
from tts2face.face.model import Face
from tts2face.render.clock import exact_rate, first_sample
from tts2face.render.draw import Stage, frames, staged
from tts2face.render.movie import MP4, WEBM, Movie
from tts2face.render.picture import Picture
from tts2face.types import Clip

SUFFIXES = (".mp4", ".webm", ".gif")
AHEAD = 8  # pictures that may wait for the encoder


class Sink(Protocol):
    """Something that takes pictures and sound in turn."""

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture."""

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples."""

    def finish(self) -> None:
        """Complete what is written."""

    def abandon(self) -> None:
        """Let go of what is written so far."""


class ClipWriter:
    """Writes clips one behind the other into one file, drawing and encoding at the same time.

    The file appears under its name when all is done; after an error or an interruption nothing is left. Each clip
    begins on the frame that follows the clip before it, its sound on the very sample of that frame: over hours, picture
    and sound stay together.

    Parameters
    ----------
    path
        What is written, by suffix: .mp4, .webm, .gif; a folder of .png when there is no suffix.
    face
        The face, or a stage.
    picture
        How to draw.
    on_progress
        Called with frames done and frames given so far.
    threads
        How many pictures are drawn at a time; all cores without it.

    Raises
    ------
    InputError
        The suffix is unknown, or the folder does not exist; or no clip was given before the end.
    BackendError
        The disk is full or cannot be written.
    """

    def __init__(
        self,
        path: Path | str,
        face: Face | Stage,
        picture: Picture | None = None,
        *,
        on_progress: Callable[[int, int], None] | None = None,
        threads: int | None = None,
    ) -> None:
        self.path = checked_output(path)
        self._stage = face if isinstance(face, Stage) else staged(face, picture or Picture())
        self._on_progress, self._threads = on_progress, threads
        self._n_frames = self._n_given = self._n_samples = 0
        self._clock: tuple[float, int] | None = None
        self._lane: _Lane | None = None
        self._beside: Path | None = None

    def __enter__(self) -> "ClipWriter":
        """Give the writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Complete the file, or leave nothing."""
        try:
            if kind is None:
                self._complete()
        finally:
            self._clear()

    def add(self, clip: Clip) -> None:
        """Draw and encode one more clip."""
        lane = self._lane or self._opened(clip)
        if self._clock != (clip.fps, clip.speech.waveform.rate):
            raise InputError(f"clips of one file must share fps and sound rate; this one has {clip.fps:g} fps")
        samples, rate, fps = clip.speech.waveform.samples, clip.speech.waveform.rate, exact_rate(clip.fps)
        begin = first_sample(self._n_frames, rate, fps)
        if begin > self._n_samples:  # the clip before ended within its last frame
            lane.put(sound=np.zeros(begin - self._n_samples, np.float32))
        self._n_given += len(clip.motion)
        at = 0
        for pixels in frames(clip, self._stage, self._stage.picture, self._threads):
            self._n_frames += 1
            until = min(max(first_sample(self._n_frames, rate, fps) - begin, at), len(samples))
            lane.put(pixels, samples[at:until])
            at = until
            if self._on_progress:
                self._on_progress(self._n_frames, self._n_given)
        if at < len(samples):
            at_most = first_sample(self._n_frames, rate, fps) - begin
            lane.put(sound=samples[at : max(at, min(len(samples), at_most))])
        self._n_samples = begin + at

    def _opened(self, clip: Clip) -> "_Lane":
        self._clock = (clip.fps, clip.speech.waveform.rate)
        self._beside = _place_beside(self.path)
        picture = self._stage.picture
        shape = (picture.height, picture.width, picture.channels)
        with _refusals(self.path):
            sink = _sink(self.path, self._beside, shape, clip)
        self._lane = _Lane(sink, self.path)
        return self._lane

    def _complete(self) -> None:
        if self._lane is None or self._beside is None:
            raise InputError(f"there is no clip to write to {self.path}")
        self._lane.finish()
        self._lane = None
        with _refusals(self.path):
            if self.path.is_dir():
                shutil.rmtree(self.path)
            os.replace(self._beside, self.path)
        self._beside = None

    def _clear(self) -> None:
        if self._lane is not None:
            self._lane.abandon()
            self._lane = None
        if self._beside is not None:
            if self._beside.is_dir():
                shutil.rmtree(self._beside, ignore_errors=True)
            else:
                self._beside.unlink(missing_ok=True)
            self._beside = None


class _Lane:
    """The encoder in a thread of its own, behind a short queue."""

    def __init__(self, sink: Sink, path: Path) -> None:
        self._sink, self._path = sink, path
        self._queue: queue.Queue[tuple[Any, Any] | None] = queue.Queue(AHEAD)
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._work, name="encode", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            if self._error is not None:
                continue
            try:
                pixels, sound = item
                if pixels is not None:
                    self._sink.picture(pixels)
                if sound is not None and len(sound):
                    self._sink.sound(sound)
            except (OSError, ValueError, RuntimeError) as error:
                self._error = error

    def put(self, pixels: Any = None, sound: Any = None) -> None:
        self._check()
        self._queue.put((pixels, sound))

    def _check(self) -> None:
        if self._error is not None:
            with _refusals(self._path):
                raise self._error

    def finish(self) -> None:
        self._queue.put(None)
        self._thread.join()
        self._check()
        with _refusals(self._path):
            self._sink.finish()

    def abandon(self) -> None:
        if self._thread.is_alive():
            self._error = self._error or RuntimeError("abandoned")
            self._queue.put(None)
            self._thread.join()
        with contextlib.suppress(OSError, ValueError, RuntimeError):
            self._sink.abandon()


@contextlib.contextmanager
def _refusals(path: Path) -> Any:
    try:
        yield
    except OSError as refused:
        reason = os.strerror(refused.errno) if refused.errno else str(refused)
        raise BackendError(f"cannot write {path}: {reason}; free some space or choose another folder") from refused


def checked_output(path: Path | str) -> Path:
    """The path of what shall be written.

    Raises
    ------
    InputError
        The suffix is unknown, the folder does not exist, or the name belongs to something else.
    """
    where = Path(path)
    if where.suffix.lower() not in ("", *SUFFIXES):
        raise InputError(
            f"{where} has the unknown suffix {where.suffix}; give one of {', '.join(SUFFIXES)}, "
            "or a folder without a suffix for .png files"
        )
    if not where.parent.is_dir():
        raise InputError(f"there is no folder {where.parent} to write {where.name} to; make it first")
    return where


def _place_beside(path: Path) -> Path:
    try:
        if path.suffix:
            handle, beside = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.parent)
            os.close(handle)
            os.chmod(beside, 0o644)
            return Path(beside)
        return Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    except OSError as refused:
        raise BackendError(f"cannot write {path}: {refused.strerror}; choose another folder") from refused


def _sink(path: Path, beside: Path, shape: tuple[int, ...], clip: Clip) -> Sink:
    fps, rate = exact_rate(clip.fps), clip.speech.waveform.rate
    return Movie(beside, WEBM if path.suffix.lower() == ".webm" else MP4, shape, fps, rate)
