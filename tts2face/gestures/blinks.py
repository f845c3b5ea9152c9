"""Presented blinks: recorded profiles at the rate and the places of conversation.

Recorded blinks are removed from the lids, whose remaining motion is sampled as before; recorded profiles of closing and
opening are played at pauses and phrase ends.
"""

from copy import copy, deepcopy
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.presentation import FrameContext
from tts2face.models.palette import GESTURE_FPS, Style
from tts2face.numeric.arrays import Float32Array, FloatArray, IntArray

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
MEAN_INTERVAL_S = 4.7
# of the gamma distribution of intervals: the larger, the more regular
INTERVAL_SHAPE = 10.0
# seconds, between two presented blinks
MIN_INTERVAL_S = 1.5
LISTENING_INTERVALS = 26 / 17  # of those of speech: 17 blinks a minute at rest, 26 in conversation (Bentivoglio)
EARLY_SHARE = 0.6  # of the interval after which a phrase end is used
PATIENCE_S = 1.6  # an overdue blink waits this long for a pause
PAUSE_DB = -20.0  # intensity of a pause, relative to the mean level of speech
PHRASE_END_FRAMES = 3  # of a pause, after which a phrase has ended; most closures of plosives are shorter


def find_blinks(closure: FloatArray, lengths: NDArray[np.integer]) -> IntArray:
    """First frame and frame behind the last one (B, 2) of each complete blink, with its slow edges.

    Parameters
    ----------
    closure : (T,)
        Of the lids, recording after recording.
    lengths : (R,)
        Frames of each recording.
    """
    borders = np.concatenate([[0], np.cumsum(lengths)])
    closed, begins_recording = closure > OPEN, np.zeros(len(closure) + 1, bool)
    begins_recording[borders] = True
    changes = np.flatnonzero((closed[1:] != closed[:-1]) & ~begins_recording[1:-1]) + 1
    starts, opened = changes[closed[changes]], changes[~closed[changes]]
    ends = np.append(opened, len(closure))[np.searchsorted(opened, starts)]
    after = borders[np.searchsorted(borders, starts, side="right")]  # the recording
    starts, ends = starts[ends < after], ends[ends < after]
    if not len(starts):
        return np.zeros((0, 2), np.int64)
    is_shut = np.maximum.reduceat(closure, np.stack([starts, ends], axis=1).ravel())[::2] > SHUT
    starts, ends = starts[is_shut], ends[is_shut]
    recording = np.searchsorted(borders, starts, side="right")
    lowest = np.maximum(borders[recording - 1], starts - MAX_EDGE)
    highest = np.minimum(borders[recording] - 1, ends + MAX_EDGE)
    first, last = starts - 1, ends.copy()
    for _ in range(MAX_EDGE):
        first -= (first > lowest) & (closure[first - 1] < closure[first])
        # lids open slowly: the end is where they no longer rise
        last += (last < highest) & (closure[np.minimum(last + 1, highest)] < closure[last])
    return np.stack([first, last + 1], axis=1)


def blink_profiles(style: Style) -> tuple[FloatArray, ...]:
    """Profiles (n, 2) of recorded blinks, 0 at rest and 1 closed; at most `MAX_PROFILES`, of all recordings."""
    lids = style.motion["blink"].astype(np.float64)
    blinks = find_blinks(lids.mean(axis=1), style.lengths)
    if not len(blinks):
        return ()
    recording = np.searchsorted(np.cumsum(style.lengths), blinks[:, 0], side="right")
    sizes = blinks[:, 1] - blinks[:, 0]
    of_blink, step = _steps(sizes + 2 * N_TAPER_FRAMES)
    step -= N_TAPER_FRAMES
    outside = np.maximum(np.maximum(-step, step - sizes[of_blink] + 1), 0)
    taper = np.linspace(0.0, 1.0, N_TAPER_FRAMES + 1)[N_TAPER_FRAMES - outside]
    frames = np.clip(blinks[of_blink, 0] + step, blinks[of_blink, 0], blinks[of_blink, 1] - 1)
    rests = _rests(lids, style.lengths)[recording[of_blink]]
    profiles = taper[:, None] * np.clip((lids[frames] - rests) / (1.0 - rests), 0.0, 1.0)
    borders = np.concatenate([[0], np.cumsum(sizes + 2 * N_TAPER_FRAMES)])
    usual = np.flatnonzero(_are_usual(profiles.mean(axis=1), borders[:-1]))
    chosen = usual[np.linspace(0, len(usual) - 1, min(len(usual), MAX_PROFILES)).round().astype(int)]
    return tuple(profiles[borders[number] : borders[number + 1]].copy() for number in chosen)


def _are_usual(closure: FloatArray, starts: IntArray) -> NDArray[np.bool_]:
    """(B,) whether profiles close once, fully, and for a usual time; `begins`: first frames of `closures` (T,)."""
    is_shut = closure > SHUT
    shuts = np.concatenate([[False], is_shut[1:] & ~is_shut[:-1]])
    shuts[starts] = False
    n_closings, n_closed = (np.add.reduceat(found.astype(int), starts) for found in (shuts, closure > OPEN))
    seconds = n_closed / GESTURE_FPS
    is_full = np.maximum.reduceat(closure, starts) >= FULL
    shortest, longest = PROFILE_LIMITS_S
    return np.asarray((n_closings == 1) & is_full & (shortest <= seconds) & (seconds <= longest))


def _rests(lids: FloatArray, lengths: NDArray[np.integer]) -> FloatArray:
    """(R, 2) median closure of the open lids (T, 2) of each recording."""
    is_open = lids.mean(axis=1) < OPEN
    recording = np.repeat(np.arange(len(lengths)), lengths)[is_open]
    counts = np.bincount(recording, minlength=len(lengths))
    first, known = np.cumsum(counts) - counts, counts > 0
    rests = np.zeros((len(lengths), 2))
    for side in range(2):
        values = lids[is_open, side]
        ordered = values[np.lexsort((values, recording))]
        middle = ordered[(first + (counts - 1) // 2)[known]] + ordered[(first + counts // 2)[known]]
        rests[known, side] = middle / 2
    return rests


def _steps(sizes: IntArray) -> tuple[IntArray, IntArray]:
    """Number (T,) of the span and step (T,) within it, for spans of the given sizes (B,), one after the other."""
    span = np.repeat(np.arange(len(sizes)), sizes)
    return span, np.arange(len(span)) - (np.cumsum(sizes) - sizes)[span]


def lids_without_blinks(style: Style) -> Float32Array:
    """Recorded lid closures (T, 2) with straight lines in place of blinks, at most `HALF_OPEN`."""
    lids = style.motion["blink"].astype(np.float64)
    blinks = find_blinks(lids.mean(axis=1), style.lengths)
    span, step = _steps(blinks[:, 1] - blinks[:, 0])
    start, last = lids[blinks[:, 0]], lids[blinks[:, 1] - 1]
    slope = (last - start) / (blinks[:, 1] - blinks[:, 0] - 1)[:, None]
    lines = start[span] + step[:, None] * slope[span]
    opened = lids.copy()
    opened[blinks[span, 0] + step] = lines
    opened[blinks[:, 1] - 1] = last
    return np.minimum(opened, HALF_OPEN).astype(np.float32)  # also blinks that a recording cuts


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
        self._paused_frames = 0
        self._frame = 0
        self._time = 0.0
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
        listens = bool(frames.is_listening[at])
        if frames.is_presented[at] and self._frame >= len(self._profile) and self._begins(listens=listens):
            self._interval, self._waited = self._draw_interval(float(chances[0])), 0.0
            self._profile, self._frame = self._profiles[int(chances[1] * len(self._profiles))], 0
        self._frame += 1
        return self._profile[self._frame - 1] if self._frame <= len(self._profile) else np.zeros(2)

    def _begins(self, *, listens: bool) -> bool:
        if self._waited < MIN_INTERVAL_S:
            return False
        if not listens and self._paused_frames == PHRASE_END_FRAMES and self._waited >= EARLY_SHARE * self._interval:
            return True
        overdue = self._waited - (LISTENING_INTERVALS if listens else 1.0) * self._interval
        return overdue >= (0.0 if self._paused_frames >= PHRASE_END_FRAMES else PATIENCE_S)

    def _draw_interval(self, chance: float) -> float:
        """Quantile `chance` of the distribution of intervals (Wilson and Hilferty 1931 for the gamma distribution)."""
        # Wilson and Hilferty: the cube root of a gamma variable is nearly normal
        spread = 1.0 / (9.0 * INTERVAL_SHAPE)
        # the quantiles of 0 and 1 are infinite
        normal = NormalDist().inv_cdf(min(max(chance, 1e-6), 1.0 - 1e-6))
        return float(max(MEAN_INTERVAL_S * (1.0 - spread + normal * np.sqrt(spread)) ** 3, MIN_INTERVAL_S))
