"""Presented blinks: recorded profiles at the rate and the places of conversation.

Recorded blinks are removed from the lids, whose remaining motion is sampled as before; recorded profiles of closing and
opening are played at pauses and phrase ends.
"""

from copy import copy, deepcopy
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.presentation import FrameContext
from tts2face.gestures.prosody import PAUSE_DB
from tts2face.models.palette import GESTURE_FPS, Style
from tts2face.numeric.arrays import Float32Array, FloatArray, IntArray

OPEN, SHUT = 0.2, 0.5  # closures below which lids count as open, and above which as shut
HALF_OPEN = 0.25  # largest closure between blinks
FULL = 0.8  # least closure of a profile that is played
PROFILE_LIMITS_S = (0.1, 0.5)  # from open to open; longer closures are not blinks
MAX_EDGE = 5  # frames before and after a blink in which the lid leaves and reaches its rest
N_TAPER_FRAMES = 3  # in which a profile rises from rest and returns to it
MAX_PROFILES = 256
OPEN_AT_END, OPENING_S = 0.3, 0.2  # largest closure at the last frame of a clip, and from when on lids open for it
# Intervals of a gamma distribution about 2.3 s in speech and 3.5 s in silence: 26 and 17 blinks a minute (Bentivoglio
# et al. 1997, Movement Disorders 12); their coefficient of variation is about .78 (decision 265).
MEAN_INTERVAL_S = 2.5  # edges of phrases make it shorter
INTERVAL_SHAPE = 1.0  # of the gamma distribution: the larger, the more regular
MIN_INTERVAL_S = 0.5  # between the starts of two blinks
LISTENING_INTERVALS = 26 / 17  # of those of speech
# Blinks fall at edges of phrases more often than chance (Nakano and Kitazawa 2010, Experimental Brain Research 205).
EDGE_SHARE = 0.42  # of edges of phrases have one, where a share of the interval has passed
EARLY_SHARE = 0.5
EDGE_DELAY_S = 0.3  # behind an edge, at most
PATIENCE_S = 0.7  # a blink that is due waits so long for an edge that comes
TURN_PAUSE_S = 1.0  # of silence behind which a face no longer speaks


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
    """Blinks of derived styles, played on lids that were sampled without blinks; none is cut by the end of a clip.

    Parameters
    ----------
    profiles
        Recorded profiles (n, 2).
    seed
        Seed of the intervals, of their places and of the choice of profiles.
    """

    def __init__(self, profiles: tuple[FloatArray, ...], seed: list[int]) -> None:
        self._profiles, self._generator = profiles, np.random.default_rng(seed)
        self._waited = MEAN_INTERVAL_S * self._generator.random()
        self._due = _interval(self._generator.random())  # seconds of speech after the last blink
        self._edge: float | None = None  # seconds of the clip at which one begins because of an edge
        self._quiet_s = 0.0
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
        chances = self._generator.random((len(frames.times), 4))
        at_edge, before_edge = _near_edges(frames)
        shown = np.zeros(values.shape)
        is_calm = frames.is_listening.tolist()
        for at, (time, chance) in enumerate(zip(frames.times.tolist(), chances.tolist(), strict=True)):
            step, self._time = time - self._time, time
            self._quiet_s = self._quiet_s + step if frames.intensity[at] < PAUSE_DB else 0.0
            self._waited += step / (LISTENING_INTERVALS if is_calm[at] or self._quiet_s > TURN_PAUSE_S else 1.0)
            if at_edge[at] and chance[2] < EDGE_SHARE and self._waited >= EARLY_SHARE * self._due:
                self._edge = time + EDGE_DELAY_S * chance[3]
            due = self._due + (PATIENCE_S if before_edge[at] else 0.0)
            is_free = frames.is_presented[at] and self._waited >= MIN_INTERVAL_S and self._frame >= len(self._profile)
            if is_free and (self._waited >= due if self._edge is None else time >= self._edge):
                self._begin(time, frames.end, chance)
            if self._frame < len(self._profile):
                shown[at] = self._profile[self._frame]
            self._frame += 1
        return np.asarray(values + shown * (1.0 - values), np.float32)

    def _begin(self, time: float, end: float, chances: list[float]) -> None:
        """Begin a blink, unless the clip ends before it does."""
        profile = self._profiles[int(chances[0] * len(self._profiles))]
        if time + (len(profile) + 1) / GESTURE_FPS < end:
            self._due, self._waited = _interval(chances[1]), 0.0
            self._edge = None
            self._profile, self._frame = profile, 0


def _near_edges(frames: FrameContext) -> tuple[list[bool], list[bool]]:
    """(n,) whether each frame is the first at an edge of a phrase, and whether one follows within `PATIENCE_S`."""
    edges = np.array([*frames.plan.edges, np.inf])
    places = np.searchsorted(edges, frames.times, side="right")
    return (np.diff(places, prepend=places[:1]) > 0).tolist(), (edges[places] - frames.times <= PATIENCE_S).tolist()


def _interval(chance: float) -> float:
    """Quantile `chance` of the distribution of intervals (Wilson and Hilferty 1931 for the gamma distribution)."""
    # Wilson and Hilferty: the cube root of a gamma variable is nearly normal
    spread = 1.0 / (9.0 * INTERVAL_SHAPE)
    # the quantiles of 0 and 1 are infinite
    normal = NormalDist().inv_cdf(min(max(chance, 1e-6), 1.0 - 1e-6))
    return float(MEAN_INTERVAL_S * max(1.0 - spread + normal * np.sqrt(spread), 0.0) ** 3)


def open_at_end(closure: Float32Array, times: FloatArray, end: float) -> Float32Array:
    """Lid closures (T, 2) at times (T,) that leave the eyes open at the end of a clip, in seconds."""
    most = OPEN_AT_END + (1.0 - OPEN_AT_END) * np.clip((end - times) / OPENING_S, 0.0, 1.0)
    return np.minimum(closure, most[:, None].astype(np.float32))
