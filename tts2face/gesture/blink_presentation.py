"""Presented blinks: recorded profiles at the rate and the places of conversation.

Recorded blinks are removed from the lids, whose remaining motion is sampled as before; recorded profiles of closing and
opening are played at pauses and phrase ends.
"""

from collections.abc import Iterator
from copy import copy, deepcopy
from itertools import pairwise
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from tts2face.gesture.presentation import FloatArray, FrameContext
from tts2face.models.palette import GESTURE_FPS, Style

OPEN, SHUT = 0.2, 0.5  # closures below which lids count as open, and above which as shut
HALF_OPEN = 0.25  # largest closure between blinks
FULL = 0.8  # least closure of a profile that is played
PROFILE_LIMITS_S = (0.1, 0.5)  # from open to open; longer closures are not blinks
MAX_EDGE = 5  # frames before and after a blink in which the lid leaves and reaches its rest
N_TAPER_FRAMES = 3  # in which a profile rises from rest and returns to it
MAX_PROFILES = 256
# Seconds between blinks: a gamma distribution. In conversation 10 to 26 blinks a minute are usual, most of them at
# pauses and ends of phrases (Bentivoglio et al. 1997, Movement Disorders 12; Nakano and Kitazawa 2010, Experimental
# Brain Research 205).
MEAN_INTERVAL_S, INTERVAL_SHAPE, MIN_INTERVAL_S = 4.7, 10.0, 1.5
EARLY_SHARE = 0.6  # of the interval after which a phrase end is used
PATIENCE_S = 1.6  # an overdue blink waits this long for a pause
PAUSE_DB = -20.0  # intensity of a pause, relative to the mean level of speech
PHRASE_END_FRAMES = 3  # of a pause, after which a phrase has ended; most closures of plosives are shorter

Float32Array = NDArray[np.float32]


def find_blinks(lids: FloatArray) -> Iterator[tuple[int, int]]:
    """First frame and frame behind the last one of each complete blink in lid closures (T,), with its slow edges."""
    closed = lids > OPEN
    ends = np.flatnonzero(closed[:-1] & ~closed[1:]) + 1
    for begin in (np.flatnonzero(~closed[:-1] & closed[1:]) + 1).tolist():
        end = int(ends[ends > begin].min(initial=len(lids)))
        if end == len(lids) or float(lids[begin:end].max()) <= SHUT:
            continue
        first, last = begin - 1, end
        while first > max(0, begin - MAX_EDGE) and lids[first - 1] < lids[first]:
            first -= 1
        while last < min(len(lids) - 1, end + MAX_EDGE) and lids[last + 1] < lids[last]:
            last += 1
        yield first, last + 1


def blink_profiles(style: Style) -> tuple[FloatArray, ...]:
    """Profiles (n, 2) of recorded blinks, 0 at rest and 1 closed; at most `MAX_PROFILES`, of all recordings."""
    profiles = []
    taper = np.linspace(0.0, 1.0, N_TAPER_FRAMES + 1)[:-1, None]
    for part in _recordings(style):
        rest = _rest(part)
        for first, end in find_blinks(part.mean(axis=1)):
            blink = np.clip((part[first:end] - rest) / (1.0 - rest), 0.0, 1.0)
            profile = np.concatenate([taper * blink[0], blink, taper[::-1] * blink[-1]])
            closure = profile.mean(axis=1)
            n_closings = (np.diff((closure > SHUT).astype(int)) > 0).sum()
            seconds = (closure > OPEN).sum() / GESTURE_FPS
            is_usual = closure.max() >= FULL and PROFILE_LIMITS_S[0] <= seconds <= PROFILE_LIMITS_S[1]
            if n_closings == 1 and is_usual:
                profiles.append(profile)
    chosen = np.linspace(0, len(profiles) - 1, min(len(profiles), MAX_PROFILES)).round().astype(int)
    return tuple(profiles[at] for at in chosen)


def _rest(lids: FloatArray) -> FloatArray:
    """(2,) median closure of open lids."""
    is_open = lids.mean(axis=1) < OPEN
    return np.asarray(np.median(lids[is_open], axis=0)) if is_open.any() else np.zeros(lids.shape[1])


def lids_without_blinks(style: Style) -> Float32Array:
    """Recorded lid closures (T, 2) with straight lines in place of blinks, at most `HALF_OPEN`."""
    opened = []
    for part in _recordings(style):
        lids = part.copy()
        for first, end in find_blinks(part.mean(axis=1)):
            lids[first:end] = np.linspace(part[first], part[end - 1], end - first)
        opened.append(np.minimum(lids, HALF_OPEN))  # also blinks that a recording cuts
    return np.concatenate(opened).astype(np.float32)


def _recordings(style: Style) -> Iterator[FloatArray]:
    edges = [0, *np.cumsum(style.lengths).tolist()]
    for first, end in pairwise(edges):
        yield style.motion["blink"][first:end].astype(np.float64)


class BlinkPresentation:
    """Blinks of derived styles, played on lids that were sampled without blinks.

    Parameters
    ----------
    profiles
        Recorded profiles (n, 2).
    seed
        Seed of the intervals and of the choice of profiles.
    """

    def __init__(self, profiles: tuple[FloatArray, ...], seed: list[int]) -> None:
        self._profiles, self._generator = profiles, np.random.default_rng(seed)
        self._interval = self._draw_interval(self._generator.random())
        self._waited = self._interval * self._generator.random()
        self._paused_frames, self._frame, self._time = 0, 0, 0.0
        self._profile = np.zeros((0, 2))

    def copy(self) -> "BlinkPresentation":
        """A presentation that continues as this one, independently of it."""
        new = copy(self)
        new._generator = deepcopy(self._generator)  # all else is replaced, not changed
        return new

    def apply(self, values: Float32Array, frames: FrameContext) -> Float32Array:
        """Lid closures (n, 2) with blinks."""
        if not self._profiles:
            return values
        chances = self._generator.random((len(frames.times), 2))
        shut = np.stack([self._closure(frames, at, chances[at]) for at in range(len(frames.times))])
        return np.asarray(values + shut * (1.0 - values), np.float32)

    def _closure(self, frames: FrameContext, at: int, chances: FloatArray) -> FloatArray:
        """Closure (2,) of the lids by blinks at a frame."""
        time = float(frames.times[at])
        self._waited, self._time = self._waited + time - self._time, time
        self._paused_frames = self._paused_frames + 1 if frames.intensity[at] < PAUSE_DB else 0
        if frames.is_presented[at] and self._frame >= len(self._profile) and self._begins():
            self._interval, self._waited = self._draw_interval(float(chances[0])), 0.0
            self._profile, self._frame = self._profiles[int(chances[1] * len(self._profiles))], 0
        self._frame += 1
        return self._profile[self._frame - 1] if self._frame <= len(self._profile) else np.zeros(2)

    def _begins(self) -> bool:
        if self._waited < MIN_INTERVAL_S:
            return False
        if self._paused_frames == PHRASE_END_FRAMES and self._waited >= EARLY_SHARE * self._interval:
            return True
        overdue = self._waited - self._interval
        return overdue >= (0.0 if self._paused_frames >= PHRASE_END_FRAMES else PATIENCE_S)

    def _draw_interval(self, chance: float) -> float:
        """Quantile `chance` of the distribution of intervals (Wilson and Hilferty 1931 for the gamma distribution)."""
        spread = 1.0 / (9.0 * INTERVAL_SHAPE)
        normal = NormalDist().inv_cdf(min(max(chance, 1e-6), 1.0 - 1e-6))
        return float(max(MEAN_INTERVAL_S * (1.0 - spread + normal * np.sqrt(spread)) ** 3, MIN_INTERVAL_S))
