"""Elements of a timeline: styles, expressions, gaze, gestures and curves.

Times are seconds on the clock of the whole clip; spans are half open. Between keys a curve eases from one value to the
next, with zero slope at each; before the first key and after the last one it is constant.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from lexicon.errors import InputError
from lexicon.marked_text import GESTURE_DEG_LIMITS, check_gesture
from lexicon.values.checks import check_limits
from lexicon.values.fields import check_fields
from tts2face.models.palette import EXPRESSIONS, FEATURES
from tts2face.numeric.arrays import FloatArray, smoothstep

EXPRESSION_WEIGHT_LIMITS = (-0.5, 1.5)  # -e to 1 + e with e = 0.5, the middle of what Ju and Lee 2008 (section 4) allow
GAIN_LIMITS = (0.0, 3.0)  # beyond three times as far, lids and brows of any face are at their limits
GAIN_NAMES = (*FEATURES, "jaw", "lips")
GAZE_LIMITS_DEG = GESTURE_DEG_LIMITS
CHANNEL_OFFSET_LIMITS = (-1000.0, 1000.0)  # weights lie within 2; the head's position is in millimetres
MAX_KEYS = 100_000  # of one curve: a key at each frame of half an hour
Keys = tuple[Annotated[tuple[float, float], "[seconds, value]"], ...]


def span_weights(times: ArrayLike, start: float, end: float, ease_s: float) -> FloatArray:
    """(T,) weights of a span at T times in seconds: 0 outside, 1 inside, 0.5 at its edges.

    The edges are smoothed by a raised cosine of width `ease_s`, so that the weights of adjacent spans add up to 1. A
    span that starts at or before 0 s has no rising edge, an infinite one no falling edge.
    """
    seconds = np.asarray(times, np.float64)
    begun = np.ones(seconds.shape) if start <= 0.0 else _raised_cosine_integral((seconds - start) / ease_s)
    ended = np.zeros(seconds.shape) if np.isinf(end) else _raised_cosine_integral((seconds - end) / ease_s)
    return begun - ended


def _raised_cosine_integral(share: FloatArray) -> FloatArray:
    """Integral of a raised cosine: 0 at -1/2, 1 at 1/2."""
    at = np.clip(2 * share, -1.0, 1.0)
    return 0.5 * (1 + at + np.sin(np.pi * at) / np.pi)


def interpolate_keys(times: ArrayLike, keys: Keys) -> FloatArray:
    """(T,) values at T times of a curve through (time, value) keys with zero slope at each; constant outside."""
    seconds = np.asarray(times, np.float64)
    at, values = np.array(keys).T
    if len(keys) == 1:
        return np.full(seconds.shape, values[0])
    behind = np.clip(np.searchsorted(at, seconds, side="right"), 1, len(at) - 1)
    before = behind - 1
    share = smoothstep((seconds - at[before]) / (at[behind] - at[before]))
    curve: FloatArray = values[before] + (values[behind] - values[before]) * share
    return curve


def check_feature(feature: str, known: Sequence[str] = FEATURES) -> str:
    """A feature's name.

    Raises
    ------
    InputError
        There is no such feature.
    """
    if feature not in known:
        raise InputError(f"there is no feature {feature!r}; choose {', '.join(known)}")
    return feature


def check_expression(expression: str) -> None:
    """Refuse unknown expressions, and the neutral one."""
    if expression == "neutral":
        raise InputError("the expression neutral has no effect because it is the face at rest; remove it")
    if expression not in EXPRESSIONS:
        raise InputError(f"there is no expression {expression!r}; choose {', '.join(EXPRESSIONS)}")


def check_style(style: str) -> None:
    """Refuse a style without a name."""
    if not style.strip():
        raise InputError("a style needs a name; give one of the palette's")


def _check_span(what: str, start: float, end: float) -> None:
    if not 0.0 <= start < math.inf:
        raise InputError(f"{what} must begin at 0 s or later, not at {start:g} s")
    if not start < end:
        raise InputError(f"{what} must end after it begins, not run from {start:g} to {end:g} s")


def check_keys(what: str, keys: Sequence[Sequence[float]], limits: tuple[float, float]) -> Keys:
    """Keys as pairs of seconds and value."""
    if not 0 < len(keys) <= MAX_KEYS:
        raise InputError(f"{what} has {len(keys)} keys; give 1 to {MAX_KEYS}")
    pairs = tuple((float(time), float(value)) for time, value in keys)
    for time, value in pairs:
        if not 0.0 <= time < math.inf:
            raise InputError(f"{what} has a key at {time:g} s; give times of 0 s or more")
        check_limits(what, value, limits)
    for (before, _), (after, _) in pairwise(pairs):
        if not before < after:
            raise InputError(f"{what} has keys at {before:g} s and then {after:g} s; give times that increase")
    return pairs


@dataclass(frozen=True, slots=True)
class StyleSpan:
    """One feature follows a style in [start, end); `end` may be infinite."""

    feature: str
    style: str
    start: float
    end: float = math.inf

    def __post_init__(self) -> None:
        """Refuse unknown features and times that do not run forward."""
        check_fields(self)
        check_feature(self.feature)
        check_style(self.style)
        _check_span(f"the span of {self.feature}", self.start, self.end)


@dataclass(frozen=True, slots=True)
class ExpressionSpan:
    """A basis expression is added with a weight in [start, end), with eased edges; `end` may be infinite."""

    expression: str
    weight: float
    start: float = 0.0
    end: float = math.inf

    def __post_init__(self) -> None:
        """Refuse unknown expressions, weights out of range, and times that do not run forward."""
        check_fields(self)
        check_expression(self.expression)
        check_limits(f"the weight of {self.expression}", self.weight, EXPRESSION_WEIGHT_LIMITS)
        _check_span(f"the span of {self.expression}", self.start, self.end)


@dataclass(frozen=True, slots=True)
class GazeTarget:
    """The eyes look in one direction of the scene in [start, end), while the head moves; `end` may be infinite.

    Degrees down and to the person's own left; 0 and 0 is the viewer in front of the resting head.
    """

    down_deg: float
    left_deg: float
    start: float = 0.0
    end: float = math.inf

    def __post_init__(self) -> None:
        """Refuse directions beyond the eyes' range and times that do not run forward."""
        check_fields(self)
        for name, angle in (("down", self.down_deg), ("left", self.left_deg)):
            check_limits(f"the gaze {name} in degrees", angle, GAZE_LIMITS_DEG)
        _check_span("the gaze", self.start, self.end)


@dataclass(frozen=True, slots=True)
class ListeningSpan:
    """The face listens to its partner in [start, end); `end` may be infinite.

    It nods and raises the brows at intervals as listeners do, unless ``reacts`` is False: what is known of the other's
    speech then gives the nods.
    """

    start: float = 0.0
    end: float = math.inf
    reacts: bool = True

    def __post_init__(self) -> None:
        """Refuse times that do not run forward."""
        check_fields(self)
        _check_span("listening", self.start, self.end)


@dataclass(frozen=True, slots=True)
class Gesture:
    """A gesture of `lexicon.gesture_names.GESTURES` that begins at `time` seconds; a nod of size 1 is 6 degrees.

    Parameters
    ----------
    seconds
        Its duration; None is its usual one.
    down_deg, left_deg
        Its direction, as of `GazeTarget`; None is its usual one. Of a wink or a tilt, left or right is its side.
    """

    time: float
    name: str = "nod"
    size: float = 1.0
    seconds: float | None = None
    down_deg: float | None = None
    left_deg: float | None = None

    def __post_init__(self) -> None:
        """Refuse times before the clip, unknown names, and values out of range."""
        check_fields(self)
        check_gesture(self)
        if not 0.0 <= self.time < math.inf:
            raise InputError(f"a gesture needs a time of 0 s or more, not {self.time:g}")


@dataclass(frozen=True, slots=True)
class StrengthCurve:
    """Factor of a feature's motion over time, multiplied by the feature's gain."""

    feature: str
    keys: Keys

    def __post_init__(self) -> None:
        """Refuse unknown features, factors out of range, and times that do not increase."""
        check_fields(self)
        check_feature(self.feature)
        object.__setattr__(self, "keys", check_keys(f"the strength of {self.feature}", self.keys, GAIN_LIMITS))


@dataclass(frozen=True, slots=True)
class ExpressionCurve:
    """Weight of a basis expression over time, added to those of the spans."""

    expression: str
    keys: Keys

    def __post_init__(self) -> None:
        """Refuse unknown expressions, weights out of range, and times that do not increase."""
        check_fields(self)
        check_expression(self.expression)
        what = f"the weight of {self.expression}"
        object.__setattr__(self, "keys", check_keys(what, self.keys, EXPRESSION_WEIGHT_LIMITS))


@dataclass(frozen=True, slots=True)
class ChannelEdit:
    """Offset over time that is added to a channel of the finished motion: a shape's weight or a part of the head pose.

    Units are those of the channel: weights, radians of rotations, millimetres of positions.
    """

    channel: str
    keys: Keys

    def __post_init__(self) -> None:
        """Refuse a missing name, offsets out of range, and times that do not increase."""
        check_fields(self)
        if not self.channel.strip():
            raise InputError("an edit needs a channel; give the name of a shape or of a part of the head pose")
        what = f"the edit of {self.channel}"
        object.__setattr__(self, "keys", check_keys(what, self.keys, CHANNEL_OFFSET_LIMITS))


@dataclass(frozen=True, slots=True)
class Gains:
    """Factors of the motion of features; those of jaw and lips apply to the speech motion."""

    factors: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse unknown features and factors out of range."""
        check_fields(self)
        for feature, factor in self.factors.items():
            check_feature(feature, GAIN_NAMES)
            check_limits(f"the gain of {feature}", factor, GAIN_LIMITS)
        object.__setattr__(self, "factors", MappingProxyType(dict(self.factors)))

    def of(self, feature: str) -> float:
        """The factor of a feature, 1 where none was chosen."""
        return self.factors.get(check_feature(feature, GAIN_NAMES), 1.0)
