"""Pictures of consecutive clips, each with the sound of its frame."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.clock import exact_rate, first_sample
from tts2face.render.renderer import FrameRenderer
from tts2face.types import Clip

FrameSound = tuple[NDArray[np.uint8] | None, NDArray[np.float32]]  # a picture, or sound only, and its samples


class ClipFrames:
    """Frames of consecutive clips in one film.

    Each clip begins on the frame after the previous clip, and its sound on the sample of that frame, so that picture
    and sound do not drift apart.

    Parameters
    ----------
    renderer
        Renderer of the clips' frames.
    threads
        Number of frames drawn in advance; None for one on each core.
    """

    def __init__(self, renderer: FrameRenderer, threads: int | None = None) -> None:
        self.n_frames = self.n_added = 0
        self._renderer, self._threads = renderer, threads
        self._n_samples = 0
        self._clock: tuple[float, int] | None = None

    def add(self, clip: Clip) -> Iterator[FrameSound]:
        """Draw the frames of one more clip.

        Yields
        ------
        pixels : (H, W, 3 or 4) or None
            Picture; None for the first item, which is the silence up to the clip's first frame.
        samples : (n,)
            Sound of the frame.

        Raises
        ------
        InputError
            Its fps or sound rate differs from those of the first clip, or its channels are not those of the face.
        """
        if self._clock is None:
            self._clock = (clip.fps, clip.speech.waveform.rate)
        if self._clock != (clip.fps, clip.speech.waveform.rate):
            raise InputError(f"clips of one file must share fps and sound rate; this one has {clip.fps:g} fps")
        begin = self._first_sample(self.n_frames)
        yield None, np.zeros(begin - self._n_samples, np.float32)  # the previous clip ended within a frame
        self.n_added += len(clip.motion)
        at, samples = 0, clip.speech.waveform.samples
        for pixels in self._renderer.frames(clip, threads=self._threads, first=self.n_frames):
            self.n_frames += 1
            until = min(self._first_sample(self.n_frames) - begin, len(samples))
            yield pixels, samples[at:until]
            at = until
        self._n_samples = begin + at

    def _first_sample(self, frame: int) -> int:
        fps, rate = self._clock or (1.0, 1)
        return first_sample(frame, rate, exact_rate(fps))
