"""Presented head motion: the slow part of the recorded motion, scaled to what viewers see, and nods at accents."""

from collections.abc import Mapping
from copy import copy, deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.presentation import FrameContext, LowPass, filtered_spread
from tts2face.gestures.prosody import prosody_features
from tts2face.models.palette import GESTURE_FPS, Style
from tts2face.numeric.arrays import Float32Array, FloatArray, smooth_gaussian, smoothstep
from tts2face.sound.praat import IntensityTrack
from tts2face.storage.array_cache import computed_once
from tts2face.types import HEAD_CHANNELS, Waveform

SLOW_HZ = 0.7  # cut-off of the part that is scaled: turns and tilts that last a phrase
RETURN_HZ = 0.12  # cut-off of what is subtracted, so that the head drifts back to the viewer within some 10 s
# Standard deviation in radians to which the slow part is scaled, and the largest angle of it. Speakers who look at a
# listener move by 2 to 5 degrees (yaw) about the direction to the listener.
TARGET_SPREAD = {"pitch": np.radians(1.2), "yaw": np.radians(4.0), "roll": np.radians(1.2)}
LARGEST_RATIO = 2.6  # of the slow part, in units of its target spread; approached smoothly
# of a style that hardly moves: more would scale the noise of its tracking
MAX_SCALE = 20.0
STILL_S, LISTENING_MOTION = 1.0, 0.4  # listeners turn the head far less than speakers (Hadar et al. 1983)
ONSET_S = 0.3  # transition from and to recorded styles
# Nods at accents: size in radians of strength 1, and a sum of Gaussians (seconds from the accent, share): a slight
# lift, the nod, and a slight overshoot. Gaussians of 0.1 s hold no power above 6 Hz.
NOD_RAD = np.radians(4.5)
# seconds from the accent and share of the depth: up before it, down, and back
NOD_PARTS = ((-0.30, -0.18), (0.02, 1.0), (0.36, -0.15))
NOD_WIDTH_S = (0.095, 0.135)  # least and greatest width of a nod
NOD_SHARE = 0.8  # of accents get a nod
NOD_REACH_S = 0.7  # a nod lies within this of its accent
ROLL_SHARE = 0.35  # largest roll and yaw of a nod, relative to its pitch
MIN_LEAD_S = 0.12  # accents earlier than this in a piece of sound get no nod; until then the head may already be shown
ONSET_RAMP_S = 0.2  # a nod that would begin before its piece fades in
# seconds between the instants at which accents are sought
ACCENT_STEP_S = 0.01
# seconds, standard deviation: shorter than a syllable
ACCENT_SMOOTHING_S = 0.06
# seconds, least distance of two nods
ACCENT_GAP_S = 0.75
ACCENT_DB = -8.0  # least smoothed intensity of an accent, relative to the mean level of speech
ACCENT_RANGE_DB = 6.0  # from the weakest to the strongest accent
CACHE_KIND, CACHE_VERSION = "head-spread", 1  # raised when the spread of the same recordings changes


class Glide:
    """Share of a state that begins and ends within some seconds; at first at once."""

    def __init__(self, seconds: float) -> None:
        self._change, self._share = 1.0 / (seconds * GESTURE_FPS), -1.0

    def next(self, holds: NDArray[np.bool_]) -> FloatArray:
        """(n,) shares at the next frames, in which the state holds or not."""
        shares = np.zeros(len(holds))
        for at, target in enumerate(holds.astype(np.float64).tolist()):
            change = self._change if self._share >= 0.0 else 2.0
            self._share = float(np.clip(target, self._share - change, self._share + change))
            shares[at] = self._share
        return shares


def find_accents(sound: Waveform, track: IntensityTrack | None) -> FloatArray:
    """Seconds and strength (0 to 1) of the accents of a sound (m, 2): its loudest long syllables.

    `track` is its `speech_intensity`.

    Peaks of the smoothed intensity, the highest first, at least `ACCENT_GAP_S` apart. Smoothing favours long syllables,
    so that both correlates of stress that do not need pitch, loudness and duration, count.
    """
    times = np.arange(0.0, sound.duration, ACCENT_STEP_S)
    if len(times) < 3:
        return np.zeros((0, 2))
    level = prosody_features(sound, times, track, with_pitch=False)[:, 0].astype(np.float64)
    spread = ACCENT_SMOOTHING_S / ACCENT_STEP_S
    smooth = smooth_gaussian(level, spread, round(3 * spread))
    inner = smooth[1:-1]
    peaks = 1 + np.flatnonzero((inner > smooth[:-2]) & (inner >= smooth[2:]) & (inner > ACCENT_DB))
    chosen: list[int] = []
    for peak in peaks[np.argsort(-smooth[peaks], kind="stable")].tolist():
        if all(abs(peak - other) * ACCENT_STEP_S >= ACCENT_GAP_S for other in chosen):
            chosen.append(peak)
    chosen.sort()
    if not chosen:
        return np.zeros((0, 2))
    levels = smooth[chosen]
    strength = np.clip(0.5 + (levels - np.median(levels)) / ACCENT_RANGE_DB, 0.0, 1.0)
    return np.stack([times[chosen], strength], axis=1)


def slow_scales(style: Style) -> FloatArray:
    """(6,) factors by which the slow part of a style's recorded head motion reaches `TARGET_SPREAD`; 1 or more."""
    recorded = style.motion["head"]

    def compute() -> dict[str, FloatArray]:
        head = recorded.astype(np.float64)
        return {"spread": filtered_spread(head - np.median(head, axis=0), SLOW_HZ)}

    def fits(kept: Mapping[str, NDArray[Any]]) -> bool:
        return [(name, array.dtype.str, array.shape) for name, array in kept.items()] == [("spread", "<f8", (6,))]

    spread = computed_once(CACHE_KIND, CACHE_VERSION, [recorded], compute, fits)["spread"]
    targets = np.array([TARGET_SPREAD.get(channel, 0.0) for channel in HEAD_CHANNELS])
    return np.clip(targets / np.maximum(spread, 1e-9), 1.0, MAX_SCALE)


class HeadPresentation:
    """Head motion of derived styles: the slow part of the sampled motion is scaled, and accents are nodded.

    Parameters
    ----------
    middle, scales : (6,)
        Median of the recordings, and factors of the slow part (`slow_scales`).
    seed
        Seed of the nods.
    """

    def __init__(self, middle: Float32Array, scales: FloatArray, seed: list[int]) -> None:
        self._middle, self._scales = middle.astype(np.float64), scales
        self._generator = np.random.default_rng(seed)
        self._slow, self._lasting = (LowPass(cutoff, np.zeros(len(scales))) for cutoff in (SLOW_HZ, RETURN_HZ))
        self._limits = np.array([LARGEST_RATIO * TARGET_SPREAD.get(channel, 1e9) for channel in HEAD_CHANNELS])
        self._presented, self._still = Glide(ONSET_S), Glide(STILL_S)
        self._nods: list[_Nod] = []
        self._last_accent = -ACCENT_GAP_S

    def copy(self) -> "HeadPresentation":
        """A presentation that continues as this one, independently of it."""
        new = copy(self)
        new._generator, new._nods = deepcopy(self._generator), self._nods.copy()
        new._slow, new._lasting = self._slow.copy(), self._lasting.copy()
        new._presented, new._still = copy(self._presented), copy(self._still)
        return new

    def apply(self, values: Float32Array, frames: FrameContext) -> Float32Array:
        """Head poses (n, 6) with the slow part scaled and nods added."""
        self._add_nods(frames)
        slow = self._slow.filter(values.astype(np.float64) - self._middle)
        slow = slow - self._lasting.filter(slow)
        scaled = self._limits * np.tanh(slow * (self._scales - 1.0) / self._limits)
        scaled *= 1.0 - (1.0 - LISTENING_MOTION) * self._still.next(frames.is_listening)[:, None]
        added = scaled + self._nodded(frames.times)
        return np.asarray(values + self._presented.next(frames.is_presented)[:, None] * added, np.float32)

    def _add_nods(self, frames: FrameContext) -> None:
        start = float(frames.times[0])
        self._nods = [nod for nod in self._nods if nod.time + NOD_REACH_S > start]
        for time, strength in frames.accents.tolist():
            if time < self._last_accent + ACCENT_GAP_S:
                continue
            self._last_accent = time
            chance, size, width, yaw, roll = self._generator.random(5).tolist()
            if chance > NOD_SHARE or time < start + MIN_LEAD_S:
                continue
            pitch = NOD_RAD * (0.35 + 0.65 * strength) * (0.7 + 0.6 * size)
            direction = np.array([1.0, ROLL_SHARE * (2 * yaw - 1), ROLL_SHARE * (2 * roll - 1), 0.0, 0.0, 0.0])
            low, high = NOD_WIDTH_S
            self._nods.append(_Nod(time, low + (high - low) * width, pitch * direction, start))

    def _nodded(self, times: FloatArray) -> FloatArray:
        total = np.zeros((len(times), len(HEAD_CHANNELS)))
        for nod in self._nods:
            total += np.outer(nod.curve(times), nod.direction)
        return total


@dataclass(frozen=True, slots=True, eq=False)
class _Nod:
    """A nod at an accent: its seconds, width in seconds, size (6,), and the seconds from which it is shown."""

    time: float
    width: float
    direction: FloatArray
    start: float

    def curve(self, times: FloatArray) -> FloatArray:
        """(T,) shares of the nod's size at T times."""
        curve = np.zeros(len(times))
        for shift, share in NOD_PARTS:
            curve += share * np.exp(-0.5 * np.square((times - self.time - shift) / self.width))
        return curve * smoothstep(times, self.start, self.start + ONSET_RAMP_S)
