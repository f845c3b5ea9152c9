"""Gestures from noise, as a baseline for comparison (Perlin 1985, 1995).

Amplitudes and blink rates are those of the recordings; the timing is independent of the sound.
"""

from collections.abc import Mapping
from copy import copy
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.speech_plan import NO_PLAN, SpeechPlan
from tts2face.gestures.stream import NO_SEEDS, GestureFields, GestureValues, style_median
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import GESTURE_FPS
from tts2face.numeric.arrays import Float32Array
from tts2face.types import Waveform

OCTAVES_HZ = (0.5, 1.0, 2.0)  # each half as strong as the last (Perlin 1985)
NOISE_STANDARD_DEVIATION = 0.164  # standard deviation of the octaves' sum, over two hours of it
BLINK_DURATION_S = 0.2  # from open to open
CLOSED_SHARE = 0.5  # share from which a lid counts as shut


class NoiseStream:
    """Gestures of one clip from noise, piece by piece, as `GestureStream` gives them."""

    def __init__(
        self, fields: GestureFields, *, style: str, seed: int, fps: float, seeds: Mapping[str, int] = NO_SEEDS
    ) -> None:
        self._fields = fields
        self._style = fields.palette.require(style)
        self._fps = fps
        self._seeds = {name: seeds.get(name, seed) for name in fields.features}
        self._n_frames = 0

    def copy(self) -> "NoiseStream":
        """A stream that continues as this one, independently of it."""
        return copy(self)

    def next(self, sound: Waveform, n_frames: int, timeline: Timeline, plan: SpeechPlan = NO_PLAN) -> GestureValues:
        """Values (n_frames, k) of each feature for the next frames; neither sound nor plan is used."""
        times = (self._n_frames + np.arange(n_frames)) / self._fps
        self._n_frames += n_frames
        return {
            name: self._fields.apply_timeline(name, self._values(name, times), times, timeline)
            for name in self._fields.features
        }

    def _values(self, feature: str, times: NDArray[np.float64]) -> Float32Array:
        style = self._fields.palette.styles[self._fields.source(self._style, feature)]
        motion, key = style.motion[feature], (self._seeds[feature] << 32) + crc32(feature.encode())
        if feature == "blink":
            shut = blink_closure(times, blinks_per_second(motion), key)
            return np.repeat(shut[:, None], motion.shape[1], axis=1).astype(np.float32)
        noise = np.stack([perlin_noise(times, key + channel) for channel in range(motion.shape[1])], axis=1)
        return np.asarray(style_median(style, feature) + motion.std(axis=0) * noise, np.float32)


def perlin_noise(times: NDArray[np.float64], key: int) -> NDArray[np.float64]:
    """(T,) gradient noise at instants, octaves added, standard deviation 1; the same for the same key.

    Between whole numbers of a clock two random slopes are blended by 6 t^5 - 15 t^4 + 10 t^3 (Perlin 2002).
    """
    total = np.zeros(len(times))
    for octave, rate in enumerate(OCTAVES_HZ):
        at = times * rate
        low = np.floor(at).astype(np.int64)
        part = at - low
        # Perlin's second fade curve, whose second derivative is 0 at both ends (2002)
        blend = part**3 * (part * (6 * part - 15) + 10)
        left, right = _hash_noise(low, key, octave) * part, _hash_noise(low + 1, key, octave) * (part - 1)
        total += 0.5**octave * ((1 - blend) * left + blend * right)
    return total / NOISE_STANDARD_DEVIATION


def blink_closure(times: NDArray[np.float64], rate: float, key: int) -> NDArray[np.float64]:
    """(T,) closure of the lids at rising times, in [0, 1]: raised cosines at random, on average `rate` per second."""
    cell = BLINK_DURATION_S / 2
    first = int(np.floor(times[0] / cell)) - 2
    numbers = np.arange(first, int(np.floor(times[-1] / cell)) + 1)
    starts = numbers[(_hash_noise(numbers, key, 0) + 1) / 2 < rate * cell] * cell
    shut = np.zeros(len(times))
    nearby = np.searchsorted(times, np.add.outer(starts, (-cell, BLINK_DURATION_S + cell))).tolist()
    for start, (first, last) in zip(starts, nearby, strict=True):
        distance = np.abs(times[first:last] - start - BLINK_DURATION_S / 2) / (BLINK_DURATION_S / 2)
        closure = np.where(distance < 1, 0.5 + 0.5 * np.cos(np.pi * distance), 0.0)
        shut[first:last] = np.maximum(shut[first:last], closure)
    return shut


def blinks_per_second(shut: Float32Array) -> float:
    """Mean number of blinks per second in recorded lid closures (T, 2)."""
    is_shut = shut.mean(axis=1) > CLOSED_SHARE
    return float((np.diff(is_shut.astype(np.int8)) > 0).sum()) * GESTURE_FPS / max(len(shut), 1)


def _hash_noise(numbers: NDArray[np.int64], key: int, octave: int) -> NDArray[np.float64]:
    """(N,) hash values in [-1, 1) of N integers (SplitMix64; Steele, Lea and Flood 2014)."""
    mixed = numbers.astype(np.uint64) * np.uint64(3) + np.uint64(octave) + np.uint64((key * 0x9E3779B97F4A7C15) % 2**64)
    # constants of SplitMix64
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB), (31, 1)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    return mixed.astype(np.float64) / 2.0**63 - 1.0
