"""Encoding of clips while they are drawn: .mp4, .webm, .mov, .gif, or a folder of .png pictures.

Output paths: their kind, their checks, and the temporary file or folder that replaces them when complete.

An encoder that runs in its own thread behind a bounded queue.
"""

import contextlib
import os
import queue
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from types import TracebackType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.picture.frames import GifWriter, PngFolderWriter, is_png_folder
from tts2face.picture.movie import MKV_MOVIE, MOV_MOVIE, MP4_MOVIE, WEBM_MOVIE, ClipFrames, MovieWriter
from tts2face.picture.renderer import FrameRenderer
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.output_paths import MOVIE_SUFFIXES, check_name
from tts2face.storage.temporary import Temporary
from tts2face.types import Clip, Progress, exact_rate

FILE_SUFFIXES = MP4, WEBM, MOV, GIF = MOVIE_SUFFIXES
FOLDER = ""


def output_kind(path: Path | str) -> str:
    """Kind of an output path: one of `FILE_SUFFIXES`, or `FOLDER`.

    Raises
    ------
    InputError
        The suffix is unknown.
    """
    suffix = Path(path).suffix.lower()
    if str(path).endswith(("/", os.sep)) or suffix == "" or (suffix not in FILE_SUFFIXES and Path(path).is_dir()):
        return FOLDER
    if suffix not in FILE_SUFFIXES:
        raise InputError(
            f"{path} has the unknown suffix {suffix}; give one of {', '.join(FILE_SUFFIXES)}, "
            "a folder without a suffix for .png pictures, or a suffix that `tts2face formats` lists"
        )
    return suffix


def check_output(path: Path | str) -> Path:
    """Checked path of an output.

    Raises
    ------
    InputError
        The suffix is unknown, the parent folder does not exist, the name is only a suffix or too long, or the path is
        a folder of other files.
    BackendError
        The parent folder cannot be written.
    """
    output = Path(path)
    check_name(output)
    kind = output_kind(path)
    if kind == FOLDER and output.exists() and not (output.is_dir() and is_png_folder(output)):
        raise InputError(f"{output} contains files other than the pictures of a clip; choose another folder")
    if kind != FOLDER and output.is_dir():
        raise InputError(f"{output} is a folder; choose another name")
    return output


def make_temporary(path: Path, kind: str) -> Temporary:
    """New, empty, hidden file or folder in the same folder as a path.

    Raises
    ------
    BackendError
        The folder cannot be written.
    """
    with translate_disk_errors(path):
        return Temporary(path, is_folder=kind == FOLDER)


def move_into_place(temporary: Temporary, path: Path) -> None:
    """Rename a temporary file or folder to `path`, replacing what exists there.

    Raises
    ------
    BackendError
        The folder cannot be written.
    """
    with translate_disk_errors(path):
        temporary.replace(path)


QUEUE_LENGTH = 8  # pictures that may be queued
POLL_INTERVAL_S = 0.05  # interval at which the state of the encoder is checked

Pixels = NDArray[np.uint8] | None
SoundBlock = NDArray[np.float32] | None


class Sink(Protocol):
    """Receiver of pictures and sound in order of time."""

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        """Append one picture (H, W, 3 or 4)."""

    def sound(self, samples: NDArray[np.float32]) -> None:
        """Append mono samples (n,)."""

    def finish(self) -> None:
        """Complete and close the output."""

    def abandon(self) -> None:
        """Close the output without completing it."""


class EncoderThread:
    """Feeds a sink from a thread; an error in the thread is raised by the next call of `put` or `finish`."""

    def __init__(self, sink: Sink) -> None:
        self._sink, self._stopped = sink, False
        self._queue: queue.Queue[tuple[Pixels, SoundBlock] | None] = queue.Queue(QUEUE_LENGTH)
        self._pool = ThreadPoolExecutor(1, "encode")
        try:
            self._work: Future[None] = self._pool.submit(self._run)
        except BaseException:  # an interruption, after which the thread runs or not
            self._queue.put_nowait(None)
            raise

    def _run(self) -> None:
        while (item := self._queue.get()) is not None and not self._stopped:
            pixels, samples = item
            if pixels is not None:
                self._sink.picture(pixels)
            if samples is not None and len(samples):
                self._sink.sound(samples)

    def put(self, pixels: Pixels = None, samples: SoundBlock = None) -> None:
        """Append a picture and the samples of its frame; blocks while the queue is full."""
        self._put((pixels, samples))

    def _put(self, item: tuple[Pixels, SoundBlock] | None) -> None:
        while not self._work.done():
            try:
                return self._queue.put(item, timeout=POLL_INTERVAL_S)
            except queue.Full:
                continue
        return self._work.result()

    def finish(self) -> None:
        """Wait for the encoder, then complete the output."""
        self._put(None)
        self._work.result()
        self._pool.shutdown()
        self._sink.finish()

    def abandon(self) -> None:
        """Stop the encoder at once and close the output without completing it."""
        self._stopped = True
        while not self._work.done():  # the queue may be full and the thread ended by an error
            with contextlib.suppress(queue.Full):
                self._queue.put_nowait(None)
            wait([self._work], POLL_INTERVAL_S)
        self._pool.shutdown()
        self._sink.abandon()


OPAQUE = frozenset({MP4, MOV})  # H.264 as players know it has no coverage
MKV = ".mkv"  # parts of a .webm file
_MOVIES = {MP4: MP4_MOVIE, WEBM: WEBM_MOVIE, MOV: MOV_MOVIE, MKV: MKV_MOVIE}
N_SWATCHES = 6  # frames of the first clip from which the palette of a GIF is computed


class ClipWriter:
    """Writer of consecutive clips to one file; drawing and encoding run in parallel.

    The file appears under its name when it is complete; after an error or an interruption no file remains. Clips follow
    each other as in `ClipFrames`.

    Parameters
    ----------
    path
        Output, by suffix: .mp4, .webm, .mov, .gif; a folder of .png pictures with a trailing slash or without a suffix.
    renderer
        Renderer of the clips' frames.
    kind
        Kind of the file, for a path with another suffix; None: that of its suffix.
    on_progress
        Called with the number of frames written and the number of frames added so far.

    Raises
    ------
    InputError
        The suffix is unknown or has no transparency, the folder does not exist, clips differ in fps or sound rate, or
        no clip was added.
    BackendError
        The disk is full or cannot be written.

    Examples
    --------
    >>> with ClipWriter("talk.mp4", renderer) as writer:  # doctest: +SKIP
    ...     for clip in clips:
    ...         writer.add(clip)
    """

    def __init__(
        self,
        path: Path | str,
        renderer: FrameRenderer,
        *,
        kind: str | None = None,
        on_progress: Progress | None = None,
    ) -> None:
        self.path, self._kind = check_output(path), kind or output_kind(path)
        if self._kind in OPAQUE and renderer.picture.is_transparent:
            raise InputError(f"{self.path} cannot be transparent; give .webm, .gif or a folder, or another background")
        self._renderer = renderer
        self._on_progress = on_progress
        self._frames = ClipFrames(renderer)
        self._encoder: EncoderThread | None = None
        self._temporary: Temporary | None = None

    def __enter__(self) -> "ClipWriter":
        """Create the temporary file or folder."""
        self._temporary = make_temporary(self.path, self._kind)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Complete the file, or remove it after an error."""
        try:
            if kind is None:
                self._complete()
        finally:
            self._clear()

    def add(self, clip: Clip) -> None:
        """Draw and encode one more clip.

        Raises
        ------
        InputError
            Its fps or sound rate differs from those of the first clip, or its channels are not those of the face.
        BackendError
            The disk is full or cannot be written.
        """
        with translate_disk_errors(self.path):
            for pixels, samples in self._frames.add(clip):
                encoder = self._encoder or self._open_encoder(clip)
                encoder.put(pixels, samples)
                if self._on_progress and pixels is not None:
                    self._on_progress(self._frames.n_frames, self._frames.n_added)

    def add_sound(self, samples: NDArray[np.float32]) -> None:
        """Append sound (n,) that lasts longer than the pictures of the clips before it; errors as `add`."""
        if self._encoder is not None:
            with translate_disk_errors(self.path):
                self._encoder.put(None, samples)

    def _open_encoder(self, clip: Clip) -> EncoderThread:
        self._encoder = EncoderThread(self._open_sink(clip))
        return self._encoder

    def _open_sink(self, clip: Clip) -> Sink:
        if self._temporary is None:
            raise InputError("ClipWriter writes only within a with statement; open it as `with ClipWriter(...)`")
        fps, rate, picture = exact_rate(clip.fps), clip.speech.waveform.rate, self._renderer.picture
        if self._kind == FOLDER:
            return PngFolderWriter(self._temporary.path, rate, self._renderer.notice)
        if self._kind == GIF:
            frames = np.linspace(0, len(clip.motion) - 1, N_SWATCHES).astype(int)
            pictures = [self._renderer.frame(clip, int(i)) for i in frames]
            return GifWriter(self._temporary.path, pictures, fps, self._renderer.notice)
        shape = (picture.height, picture.width, picture.channels)
        return MovieWriter(
            self._temporary.path,
            _MOVIES[self._kind],
            shape,
            (fps, rate),
            self._renderer.notice,
        )

    def _complete(self) -> None:
        if self._encoder is None or self._temporary is None:
            raise InputError(f"there is no clip to write to {self.path}")
        with translate_disk_errors(self.path):
            self._encoder.finish()
        self._encoder = None
        move_into_place(self._temporary, self.path)
        self._temporary = None

    def _clear(self) -> None:
        if self._encoder is not None:
            with contextlib.suppress(OSError):  # the file is removed in any case
                self._encoder.abandon()
            self._encoder = None
        if self._temporary is not None:
            self._temporary.remove()
            self._temporary = None


def write_clips(
    path: Path | str, clips: Iterable[Clip], renderer: FrameRenderer, *, on_progress: Progress | None = None
) -> None:
    """Write consecutive clips to one file; parameters and errors as `ClipWriter`."""
    with ClipWriter(path, renderer, on_progress=on_progress) as writer:
        for clip in clips:
            writer.add(clip)
