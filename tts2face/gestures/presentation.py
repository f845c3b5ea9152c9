"""Presentation of derived styles: recorded gestures retimed and scaled for viewers (docs/gestures.md).

Recorded people blink and move as the recording situation demands: readers sit still and blink after each sentence.
Derived styles keep the form of the recorded motion (profiles of blinks, slow part of the head motion) and change how
often and how far; recorded styles and the style ``measured`` are unchanged.
"""

from copy import copy, deepcopy
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.prosody import QUIET_DB
from tts2face.models.palette import GESTURE_FPS
from tts2face.numeric.arrays import Float32Array, FloatArray

SMOOTHING_STAGES = 4  # low-pass stages in series: 80 dB per decade, so that scaled motion adds nothing above 6 Hz
LOUD_DB = 0.0  # intensity relative to the mean level of speech at which the loudness is 1
# Emphasis of a mood's expression: share in silence, gain with the smoothed loudness, and spread of a slow random part.
SILENT_EMPHASIS = 0.86
LOUDNESS_EMPHASIS = 0.21
RANDOM_EMPHASIS = 0.07
LISTENING_LOUDNESS = 1.2  # a listener shows the mood as in loud speech: a friendly one smiles
EMPHASIS_HZ, RANDOM_HZ = 0.9, 0.25
EMPHASIS_LIMITS = (0.6, 1.35)


@dataclass(frozen=True, slots=True, eq=False)
class FrameContext:
    """Frames for which gestures are presented.

    Parameters
    ----------
    times : (n,)
        Increasing seconds of the whole clip.
    intensity : (n,)
        Sound level in dB relative to the mean level of speech.
    accents : (m, 2)
        Seconds and strength (0 to 1) of the accents of the current piece of sound.
    is_presented : (n,)
        Whether the style of each frame is a derived one.
    is_listening : (n,)
        Whether the face listens.
    """

    times: FloatArray
    intensity: Float32Array
    accents: FloatArray
    is_presented: NDArray[np.bool_]
    is_listening: NDArray[np.bool_]


class Presentation(Protocol):
    """Change of a feature's sampled frames; keeps its state from piece to piece."""

    def copy(self) -> Self:
        """A presentation that continues as this one, independently of it."""

    def apply(self, values: Float32Array, frames: FrameContext) -> Float32Array:
        """Presented values (n, k) of sampled values (n, k)."""


class LowPass:
    """Causal low-pass filter of `SMOOTHING_STAGES` equal stages without overshoot, at `GESTURE_FPS`.

    Parameters
    ----------
    cutoff_hz
        Frequency at which each stage attenuates by 3 dB.
    first : (k,)
        Value before the first frame.
    """

    def __init__(self, cutoff_hz: float, first: FloatArray) -> None:
        self._share = 1.0 - np.exp(-2.0 * np.pi * cutoff_hz / GESTURE_FPS)
        self._stages = np.tile(np.asarray(first, np.float64), (SMOOTHING_STAGES, 1))

    def copy(self) -> "LowPass":
        """A filter that continues as this one, independently of it."""
        new = copy(self)
        new._stages = self._stages.copy()
        return new

    def filter(self, values: FloatArray) -> FloatArray:
        """Filtered values (n, k) of the next values (n, k)."""
        share, stages = float(self._share), self._stages.T.tolist()  # Python's numbers cost less than rows
        columns = np.asarray(values, np.float64).T.tolist()
        for column, stage in zip(columns, stages, strict=True):
            for at, value in enumerate(column):
                passed = value
                for number in range(SMOOTHING_STAGES):
                    stage[number] += share * (passed - stage[number])
                    passed = stage[number]
                column[at] = passed
        self._stages = np.array(stages).T
        return np.array(columns).T.reshape(values.shape)


def filtered_spread(values: FloatArray, cutoff_hz: float) -> FloatArray:
    """(k,) standard deviations of values (n, k) of mean 0 after `LowPass`, from their spectrum."""
    share = 1.0 - np.exp(-2.0 * np.pi * cutoff_hz / GESTURE_FPS)
    turns = np.exp(-2j * np.pi * np.fft.fftfreq(len(values)))
    response = np.abs(share / (1.0 - (1.0 - share) * turns)) ** SMOOTHING_STAGES
    spectrum = np.abs(np.fft.fft(values, axis=0)) * response[:, None]
    return np.asarray(np.sqrt(np.square(spectrum).sum(axis=0)) / len(values))


class Emphasis:
    """Emphasis of the expression of a mood: it grows with the loudness and varies slowly and randomly."""

    def __init__(self, seed: list[int]) -> None:
        self._generator = np.random.default_rng(seed)
        self._loudness, self._random = LowPass(EMPHASIS_HZ, np.zeros(1)), LowPass(RANDOM_HZ, np.zeros(1))
        # long enough for the response of the filter to end
        impulse = np.zeros((round(20 * GESTURE_FPS / RANDOM_HZ), 1))
        impulse[0] = np.sqrt(len(impulse))  # its spectrum is that of white noise of standard deviation 1
        self._random_gain = float(1.0 / filtered_spread(impulse, RANDOM_HZ)[0])

    def copy(self) -> "Emphasis":
        """An emphasis that continues as this one, independently of it."""
        return deepcopy(self)

    def next(self, frames: FrameContext) -> FloatArray:
        """(n,) factors of a mood's expression at the next frames; 1 where the style is a recorded one."""
        loudness = np.clip((frames.intensity.astype(np.float64) - QUIET_DB) / (LOUD_DB - QUIET_DB), 0.0, 1.3)
        loudness = np.where(frames.is_listening, LISTENING_LOUDNESS, loudness)
        loud = self._loudness.filter(np.square(loudness)[:, None])[:, 0]
        noise = self._random.filter(self._generator.normal(size=(len(frames.times), 1)))[:, 0]
        emphasis = SILENT_EMPHASIS + LOUDNESS_EMPHASIS * loud + RANDOM_EMPHASIS * self._random_gain * noise
        return np.where(frames.is_presented, np.clip(emphasis, *EMPHASIS_LIMITS), 1.0)
