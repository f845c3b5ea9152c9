"""Clips into a file while they are drawn: .mp4, .webm, .gif, or a folder of .png."""

import contextlib
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType

import numpy as np

from lexicon.errors import InputError
from tts2face.clock import exact_rate, first_sample
from tts2face.render.encoder_thread import EncoderThread, Sink
from tts2face.render.gif import GifWriter
from tts2face.render.movie import MP4_MOVIE, WEBM_MOVIE, MovieWriter
from tts2face.render.output_path import (
    FOLDER,
    GIF,
    WEBM,
    check_output,
    make_temporary,
    move_into_place,
    output_kind,
    translate_disk_errors,
)
from tts2face.render.png_folder import PngFolderWriter
from tts2face.render.renderer import FrameRenderer
from tts2face.storage.temporary import Temporary
from tts2face.types import Clip

N_SWATCHES = 6  # frames of the first clip from which a GIF's palette is made

Progress = Callable[[int, int], None]


class ClipWriter:
    """Writes clips one behind the other into one file, drawing and encoding at the same time.

    The file appears under its name when all is done; after an error or an interruption nothing is left. Each clip
    begins on the frame that follows the clip before it, its sound on the very sample of that frame: over hours, picture
    and sound stay together.

    Parameters
    ----------
    path
        What is written, by suffix: .mp4, .webm, .gif; a folder of .png pictures with a slash at its end or no suffix.
    renderer
        What draws the clips' frames.
    on_progress
        Called with frames done and frames given so far.
    threads
        How many pictures are drawn at a time; as many as there are cores without it.

    Raises
    ------
    InputError
        The suffix is unknown, or the folder does not exist; clips do not share fps and sound rate; there is no clip.
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
        on_progress: Progress | None = None,
        threads: int | None = None,
    ) -> None:
        self.path, self._kind = check_output(path), output_kind(path)
        self._renderer = renderer
        self._on_progress, self._threads = on_progress, threads
        self._n_frames = self._n_given = self._n_samples = 0
        self._clock: tuple[float, int] | None = None
        self._encoder: EncoderThread | None = None
        self._beside: Temporary | None = None

    def __enter__(self) -> "ClipWriter":
        """Take a place on the disk."""
        self._beside = make_temporary(self.path, self._kind)
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
        with translate_disk_errors(self.path):
            lane = self._encoder or self._open_encoder(clip)
            if self._clock != (clip.fps, clip.speech.waveform.rate):
                raise InputError(f"clips of one file must share fps and sound rate; this one has {clip.fps:g} fps")
            begin = self._first_sample(self._n_frames)
            lane.put(samples=np.zeros(begin - self._n_samples, np.float32))  # the clip before ended within a frame
            self._n_given += len(clip.motion)
            at, samples = 0, clip.speech.waveform.samples
            for pixels in self._renderer.frames(clip, threads=self._threads, first=self._n_frames):
                self._n_frames += 1
                until = min(self._first_sample(self._n_frames) - begin, len(samples))
                lane.put(pixels, samples[at:until])
                at = until
                if self._on_progress:
                    self._on_progress(self._n_frames, self._n_given)
            self._n_samples = begin + at

    def _first_sample(self, frame: int) -> int:
        fps, rate = self._clock or (1.0, 1)
        return first_sample(frame, rate, exact_rate(fps))

    def _open_encoder(self, clip: Clip) -> EncoderThread:
        self._clock = (clip.fps, clip.speech.waveform.rate)
        self._encoder = EncoderThread(self._sink(clip))
        return self._encoder

    def _sink(self, clip: Clip) -> Sink:
        if self._beside is None:
            raise InputError("a clip writer is used in a with statement")
        fps, rate, picture = exact_rate(clip.fps), clip.speech.waveform.rate, self._renderer.picture
        if self._kind == FOLDER:
            return PngFolderWriter(self._beside.path, rate, self._renderer.notice)
        if self._kind == GIF:
            chosen = np.linspace(0, len(clip.motion) - 1, N_SWATCHES).astype(int)
            pictures = [self._renderer.frame(clip, int(i)) for i in chosen]
            return GifWriter(self._beside.path, pictures, fps, self._renderer.notice)
        shape = (picture.height, picture.width, picture.channels)
        return MovieWriter(
            self._beside.path,
            WEBM_MOVIE if self._kind == WEBM else MP4_MOVIE,
            shape,
            (fps, rate),
            self._renderer.notice,
        )

    def _complete(self) -> None:
        if self._encoder is None or self._beside is None:
            raise InputError(f"there is no clip to write to {self.path}")
        with translate_disk_errors(self.path):
            self._encoder.finish()
        self._encoder = None
        move_into_place(self._beside, self.path)
        self._beside = None

    def _clear(self) -> None:
        if self._encoder is not None:
            with contextlib.suppress(OSError):  # the file goes anyway
                self._encoder.abandon()
            self._encoder = None
        if self._beside is not None:
            self._beside.remove()
            self._beside = None


def write_clips(
    path: Path | str, clips: Iterable[Clip], renderer: FrameRenderer, *, on_progress: Progress | None = None
) -> None:
    """Write clips one behind the other; see `ClipWriter`."""
    with ClipWriter(path, renderer, on_progress=on_progress) as writer:
        for clip in clips:
            writer.add(clip)
