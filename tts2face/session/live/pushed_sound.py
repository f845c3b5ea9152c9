"""Speech that arrives as sound, in whole frames: lips, sound at `SOUND_RATE`, and gestures that follow it."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.arrays import Float32Array, interpolate_columns
from tts2face.session.live.blocks import Block
from tts2face.session.live.lips import LiveLips
from tts2face.session.live.speech import LiveSpeech
from tts2face.types import SOUND_RATE, Trajectory, Waveform, exact_rate, first_sample


class PushedSound:
    """Sound of one utterance. Not thread-safe.

    Parameters
    ----------
    lips
        Of the sound.
    rate
        Its sample rate in Hz.
    number
        Of the utterance.
    """

    def __init__(self, lips: LiveLips, rate: int, number: int) -> None:
        self.number, self.rate = number, rate
        self.is_ended = False
        self._lips, self._resampler = lips, _resampler(rate)
        self._seconds = 0.0  # of all sound
        self._sound = np.zeros(0, np.float32)  # at `SOUND_RATE`, of frames that are not made
        self._channels: tuple[str, ...] = ()
        self._mouth = np.zeros((0, 0), np.float32)  # (M, K) at the rate of the lips, from `_first` on
        self._first = 0
        self._n_made = 0

    def add(self, samples: NDArray[np.floating]) -> None:
        """Append samples (m,) in [-1, 1]; errors as of `LiveLips.add_samples`."""
        if self.is_ended:
            raise InputError("the sound has ended; push the next sound as another utterance")
        self._add_motion(self._lips.add_samples(samples))
        block = np.clip(samples, -1.0, 1.0).astype(np.float32)
        self._seconds += len(block) / self.rate
        self._add_sound(block if self._resampler is None else self._resampler.resample_chunk(block))

    def end(self) -> None:
        """End the sound: the rest of it is known now."""
        self.is_ended = True
        self._add_motion(self._lips.finish())
        if self._resampler is not None:
            self._add_sound(self._resampler.resample_chunk(np.zeros(0, np.float32), last=True))

    def n_ready(self, fps: float) -> int:
        """Frames at a rate that can be made now."""
        if self.is_ended:
            return math.ceil(self._seconds * fps - 0.01) - self._n_made
        known = self._first + len(self._mouth) - 1
        return max(int(known / self._lips.fps * fps) + 1 - self._n_made, 0) if known >= 0 else 0

    def make(self, n_frames: int, speech: LiveSpeech) -> Block:
        """The next frames, appended to a live clip, whose gestures follow the sound."""
        fps = speech.fps
        times = (self._n_made + np.arange(n_frames)) / fps * self._lips.fps - self._first
        known = np.arange(len(self._mouth), dtype=np.float64)
        lips = Trajectory(self._channels, interpolate_columns(self._mouth, known, times), fps)
        samples = [first_sample(self._n_made + n, SOUND_RATE, exact_rate(fps)) for n in (0, n_frames)]
        sound = Waveform(self._sound[: samples[1] - samples[0]], SOUND_RATE).padded(samples[1] - samples[0])
        piece = speech.follow(sound, lips)
        self._n_made += n_frames
        self._forget(samples[1] - samples[0], fps)
        return Block(piece.clip.motion, piece.clip.head, "sound", sound, self.number, shown=speech.shown(piece.begin))

    def _forget(self, n_samples: int, fps: float) -> None:
        self._sound = self._sound[n_samples:]
        passed = max(min(int(self._n_made / fps * self._lips.fps) - self._first, len(self._mouth) - 1), 0)
        self._mouth, self._first = self._mouth[passed:], self._first + passed

    def _add_motion(self, motion: Trajectory | None) -> None:
        if motion is not None:
            self._channels = motion.channels
            self._mouth = np.concatenate([self._mouth, motion.values]) if len(self._mouth) else motion.values

    def _add_sound(self, samples: Float32Array) -> None:
        self._sound = np.concatenate([self._sound, np.clip(samples, -1.0, 1.0)])


def _resampler(rate: int) -> Any:
    """Stream of sound at `SOUND_RATE`; None where it has that rate."""
    import soxr

    return None if rate == SOUND_RATE else soxr.ResampleStream(rate, SOUND_RATE, 1, dtype="float32")
