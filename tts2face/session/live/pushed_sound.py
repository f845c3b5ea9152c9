"""Speech that arrives as sound, in whole frames: lips, sound at `SOUND_RATE`, and gestures that follow it."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.gestures.arriving_speech import ArrivingSpeech
from tts2face.gestures.speech_plan import SpeechPlan
from tts2face.numeric.arrays import Float32Array, interpolate_columns
from tts2face.session.live.blocks import Block
from tts2face.session.live.lips import LiveLips
from tts2face.session.live.speech import LiveSpeech
from tts2face.sound.features import FEATURE_RATE
from tts2face.types import SOUND_RATE, Trajectory, Waveform, exact_rate, first_sample

GATHERED_S = 0.04  # of sound that is followed at a time, since each block takes some ms: a frame of the audio map
LEAST_BLOCK_S = 0.06  # of frames, since each block takes some ms: two at 30 a second
BLOCK_S = 0.4  # of frames that are made at a time at most, so that the first ones are there soon
PLAN_AHEAD_S = 0.5  # of sound behind the frames of a block, if it is known, that gestures follow


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
        self._lips, self._resampler = lips, _resampler(rate, SOUND_RATE)
        self._seconds = 0.0  # of all sound
        self._gathered = np.zeros(0, np.float32)  # which the lips do not follow yet
        self._sound = np.zeros(0, np.float32)  # at `SOUND_RATE`, of frames that are not made
        self._channels: tuple[str, ...] = ()
        self._mouth = np.zeros((0, 0), np.float32)  # (M, K) at the rate of the lips, from `_first` on
        self._first = 0
        self._n_made = 0
        self._speech = ArrivingSpeech(FEATURE_RATE)
        self._to_plan, self._unplanned = _resampler(rate, FEATURE_RATE), np.zeros(0, np.float32)

    def add(self, samples: NDArray[np.floating]) -> None:
        """Append finite samples (m,) in [-1, 1]."""
        if self.is_ended:
            raise InputError("the sound has ended; push the next sound as another utterance")
        block = np.clip(samples, -1.0, 1.0).astype(np.float32)
        self._seconds += len(block) / self.rate
        self._gathered = np.concatenate([self._gathered, block])
        if len(self._gathered) >= GATHERED_S * self.rate:
            self._follow(is_last=False)

    def end(self) -> None:
        """End the sound: the rest of it is known now."""
        self.is_ended = True
        self._follow(is_last=True)

    def _follow(self, *, is_last: bool) -> None:
        """Find the motion of the sound that has been gathered."""
        block, self._gathered = self._gathered, np.zeros(0, np.float32)
        self._add_motion(self._lips.add_samples(block))
        if is_last:
            self._add_motion(self._lips.finish())
        self._add_sound(block, is_last=is_last)

    def is_ready(self, fps: float) -> bool:
        """Whether frames at a rate are made now: at least `LEAST_BLOCK_S` of them, or the last ones."""
        return self.is_ended or self.n_ready(fps) >= max(round(LEAST_BLOCK_S * fps), 1)

    def n_ready(self, fps: float) -> int:
        """Frames at a rate that can be made now."""
        if self.is_ended:
            return math.ceil(self._seconds * fps - 0.01) - self._n_made
        known = self._first + len(self._mouth) - 1
        return max(int(known / self._lips.fps * fps) + 1 - self._n_made, 0) if known >= 0 else 0

    def make(self, speech: LiveSpeech) -> Block:
        """The next frames, at most `BLOCK_S` of them, appended to a live clip, whose gestures follow the sound."""
        fps, first = speech.fps, self._n_made
        n_frames = min(self.n_ready(fps), max(round(BLOCK_S * fps), 1))
        times = (first + np.arange(n_frames)) / fps * self._lips.fps - self._first
        known = np.arange(len(self._mouth), dtype=np.float64)
        lips = Trajectory(self._channels, interpolate_columns(self._mouth, known, times), fps)
        start, end = (first_sample(first + n, SOUND_RATE, exact_rate(fps)) for n in (0, n_frames))
        sound = Waveform(self._sound[: end - start], SOUND_RATE).padded(end - start)
        followed = Waveform(self._sound[: end - start + round(PLAN_AHEAD_S * SOUND_RATE)], SOUND_RATE)
        piece = speech.follow(sound, lips, self._plan(first / fps, (first + n_frames) / fps), followed)
        self._n_made += n_frames
        self._sound = self._sound[end - start :]
        passed = max(min(int(self._n_made / fps * self._lips.fps) - self._first, len(self._mouth) - 1), 0)
        self._mouth, self._first = self._mouth[passed:], self._first + passed
        return Block(piece.clip.motion, piece.clip.head, "sound", sound, self.number, shown=speech.shown(piece.begin))

    def _plan(self, start: float, end: float) -> SpeechPlan:
        """Plan of frames from and to seconds of the sound, by the sound up to `PLAN_AHEAD_S` behind them."""
        until = max(round((end + PLAN_AHEAD_S - self._speech.seconds) * FEATURE_RATE), 0)
        self._speech.add(self._unplanned[:until])
        self._unplanned = self._unplanned[until:]
        return self._speech.plan(start, is_ended=self.is_ended and not len(self._unplanned))

    def _add_motion(self, motion: Trajectory | None) -> None:
        if motion is not None:
            self._channels = motion.channels
            self._mouth = np.concatenate([self._mouth, motion.values]) if len(self._mouth) else motion.values

    def _add_sound(self, samples: Float32Array, *, is_last: bool) -> None:
        more, quiet = (_resampled(stream, samples, is_last=is_last) for stream in (self._resampler, self._to_plan))
        self._sound = np.concatenate([self._sound, more])
        self._unplanned = np.concatenate([self._unplanned, quiet])


def _resampler(rate: int, to_rate: int) -> Any:
    """Stream of sound at another rate; None where it has that rate."""
    import soxr

    return None if rate == to_rate else soxr.ResampleStream(rate, to_rate, 1, dtype="float32")


def _resampled(stream: Any, samples: Float32Array, *, is_last: bool) -> Float32Array:
    return samples if stream is None else np.clip(stream.resample_chunk(samples, last=is_last), -1.0, 1.0)
