"""Pictures of consecutive clips, each with the sound of its frame."""

from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.pace import Pace
from tts2face.types import Clip, exact_rate, first_sample

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
    pace
        Of a movie that is seen while it is made: frames may have fewer samples, or none. None: all are drawn.
    """

    def __init__(self, renderer: FrameRenderer, threads: int | None = None, pace: Pace | None = None) -> None:
        self.n_frames = self.n_added = 0
        self._renderer = renderer
        self._threads = threads
        self._pace = pace
        self._n_samples = 0
        self._clock: tuple[float, int] | None = None

    def add(self, clip: Clip) -> Iterator[FrameSound]:
        """Draw the frames of one more clip.

        Yields
        ------
        pixels : (H, W, 3 or 4) or None
            Picture; None for the first item, which is the silence up to the clip's first frame, and for frames that
            are not drawn.
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
        first = self.n_frames
        start = self._first_sample(first)
        yield None, np.zeros(start - self._n_samples, np.float32)  # the previous clip ended within a frame
        self.n_added += len(clip.motion)
        at, samples = 0, clip.speech.waveform.samples
        for number, pixels in self._pictures(clip):
            while self.n_frames <= first + number:
                is_drawn = self.n_frames == first + number
                self.n_frames += 1
                until = min(self._first_sample(self.n_frames) - start, len(samples))
                yield pixels if is_drawn else None, samples[at:until]
                at = until
                if self._pace is not None:
                    self._pace.advance(clip.fps)
        self._n_samples = start + at

    def _pictures(self, clip: Clip) -> Iterator[tuple[int, NDArray[np.uint8]]]:
        """Numbers of the frames that are drawn, the first and the last among them, and their pictures."""
        pace = self._pace
        n_frames = len(clip.motion)
        first = self.n_frames
        if pace is None:
            yield from enumerate(self._renderer.frames(clip, threads=self._threads, first=first))
            return
        pace.begin()
        at, begun = 0, deque[int]()

        def choose(*, has_all_samples: bool) -> Iterator[int]:
            nonlocal at
            # the quality changes while frames are drawn (decision 182)
            while at < n_frames and pace.quality.has_all_samples == has_all_samples:
                begun.append(at)
                yield at
                at = at + 1 if at == n_frames - 1 else min(at + pace.quality.frame_step, n_frames - 1)

        while at < n_frames:
            has_all_samples = pace.quality.has_all_samples
            renderer = self._renderer if has_all_samples else self._renderer.with_fewest_samples()
            chosen = choose(has_all_samples=has_all_samples)
            for pixels in renderer.frames(clip, chosen, threads=self._threads, first=first):
                yield begun.popleft(), pixels

    def _first_sample(self, frame: int) -> int:
        fps, rate = self._clock or (1.0, 1)
        return first_sample(frame, rate, exact_rate(fps))
