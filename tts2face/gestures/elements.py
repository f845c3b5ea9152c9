"""Elements of a timeline: their records, their kinds, and what timelines do with the elements of a kind.

Times are seconds on the clock of the whole clip; spans are half open. Between keys a curve eases from one value to the
next, with zero slope at each; before the first key and after the last one it is constant.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lexicon.errors import InputError
from lexicon.marked_text import NOD_SIZE_LIMITS
from lexicon.values.checks import check_limits
from lexicon.values.fields import check_fields
from tts2face.models.palette import EXPRESSIONS, FEATURES
from tts2face.numeric.arrays import smoothstep

EXPRESSION_WEIGHT_LIMITS = (-0.5, 1.5)  # -e to 1 + e with e = 0.5, the middle of what Ju and Lee 2008 (section 4) allow
GAIN_LIMITS = (0.0, 3.0)  # beyond three times as far, lids and brows of any face are at their limits
GAIN_NAMES = (*FEATURES, "jaw", "lips")
GAZE_LIMITS_DEG = (-35.0, 35.0)  # farther, people turn the head (Stahl 1999, Experimental Brain Research 126)
CHANNEL_OFFSET_LIMITS = (-1000.0, 1000.0)  # weights lie within 2; the head's position is in millimetres
MAX_KEYS = 100_000  # of one curve: a key at each frame of half an hour
MAX_OVERRUN_S = 0.05  # tolerance for spans that end after the clip: times are often rounded to tenths of a second
FloatArray = NDArray[np.float64]
Keys = tuple[Annotated[tuple[float, float], "[seconds, value]"], ...]


class BeyondClipError(InputError):
    """An element lies beyond the end of a clip of `duration` seconds."""

    def __init__(self, what: str, duration: float, advice: str) -> None:
        self.duration = duration
        super().__init__(f"{what} lies beyond the clip, which lasts {duration:.2f} s; {advice}")


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
    """Keys as pairs of seconds and value.

    Raises
    ------
    InputError
        There are none or too many, a time is below 0 s or does not increase, or a value lies outside `limits`.
    """
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
class Nod:
    """A nod that starts at `time` seconds; size 1 is 6 degrees."""

    time: float
    size: float = 1.0

    def __post_init__(self) -> None:
        """Refuse times before the clip and sizes out of range."""
        check_fields(self)
        if not 0.0 <= self.time < math.inf:
            raise InputError(f"a nod needs a time of 0 s or more, not {self.time:g}")
        check_limits("the size of a nod", self.size, NOD_SIZE_LIMITS)


@dataclass(frozen=True, slots=True)
class BrowRaise:
    """Brows that go up at `time` seconds and down again; size 1 is 4 mm."""

    time: float
    size: float = 1.0

    def __post_init__(self) -> None:
        """Refuse times before the clip and sizes out of range."""
        check_fields(self)
        if not 0.0 <= self.time < math.inf:
            raise InputError(f"a brow raise needs a time of 0 s or more, not {self.time:g}")
        check_limits("the size of a brow raise", self.size, NOD_SIZE_LIMITS)


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


@dataclass(frozen=True, slots=True)
class ElementKind:
    """One kind of element of a timeline, and what is done with all elements of this kind.

    Parameters
    ----------
    name
        Field of the timeline, and key in its files.
    record
        Class of the elements. Spans have ``start`` and ``end``, curves ``keys``, and instants a ``time``.
    owner
        Field that tells lanes apart: spans of one lane may not overlap, and each lane has one curve. Empty where all
        elements are in one lane.
    noun
        What messages call an element, or all of them, where lanes have no names.
    """

    name: str
    record: type[Any]
    shape: Literal["span", "curve", "instant"]
    owner: str
    noun: str = ""

    def lane(self, element: Any) -> str:
        """Lane of an element as messages name it."""
        return str(getattr(element, self.owner)) if self.owner else self.noun

    def ordered(self, elements: Iterable[Any]) -> tuple[Any, ...]:
        """Elements in order of time; curves as they are.

        Raises
        ------
        InputError
            Two spans of one lane overlap, or a lane has two curves.
        """
        if self.shape == "instant":
            return tuple(sorted(elements, key=lambda instant: instant.time))
        if self.shape == "span":
            elements = sorted(elements, key=lambda span: (span.start, span.end))
        found, lanes = tuple(elements), dict[str, list[Any]]()
        for one in found:
            lanes.setdefault(self.lane(one), []).append(one)
        for lane, members in lanes.items():
            if self.shape == "curve" and len(members) > 1:
                raise InputError(f"{lane} has {len(members)} curves of one kind; join their keys in one curve")
            for before, after in pairwise(members):
                if after.start < before.end:
                    raise InputError(
                        f"two spans of {lane} overlap: {_span_text(before, '-')} and {_span_text(after, '-')}; "
                        "let one end before the other begins"
                    )
        return found

    def merged(self, under: Sequence[Any], over: Sequence[Any]) -> tuple[Any, ...]:
        """Elements of two timelines: spans `over` replace those `under` where they overlap, curves those of a lane."""
        kept = list(under)
        for top in over if self.shape != "instant" else ():
            lane = [one for one in kept if self.lane(one) == self.lane(top)]
            kept = [one for one in kept if self.lane(one) != self.lane(top)]
            if self.shape == "span":
                kept += [*self.restricted(lane, -1.0, top.start), *self.restricted(lane, top.end, math.inf)]
        return (*kept, *over)

    def shifted(self, elements: Sequence[Any], seconds: float) -> tuple[Any, ...]:
        """The same elements, so many seconds later."""
        if self.shape == "curve":
            return tuple(replace(one, keys=tuple((at + seconds, to) for at, to in one.keys)) for one in elements)
        times = ("start", "end") if self.shape == "span" else ("time",)
        return tuple(replace(one, **{name: getattr(one, name) + seconds for name in times}) for one in elements)

    def restricted(self, elements: Sequence[Any], start: float, end: float) -> tuple[Any, ...]:
        """What of some elements lies in [start, end): parts of spans, and whole curves."""
        if self.shape == "curve":
            return tuple(elements)
        if self.shape == "instant":
            return tuple(one for one in elements if start <= one.time < end)
        return tuple(
            replace(one, start=max(one.start, start), end=min(one.end, end))
            for one in elements
            if one.start < end and one.end > start
        )

    def check_duration(self, elements: Sequence[Any], duration: float) -> None:
        """Refuse spans and instants beyond a clip of `duration` seconds.

        Raises
        ------
        BeyondClipError
            One lies there.
        """
        for one in elements:
            if self.latest_s(one) < duration:
                continue
            if self.shape == "span":
                what = f"the span of {self.lane(one)} from {_span_text(one, ' to ')}"
                raise BeyondClipError(what, duration, "shorten it" if one.start < duration else "let it begin earlier")
            raise BeyondClipError(f"the {self.noun} at {one.time:g} s", duration, "move it")

    def latest_s(self, element: Any) -> float:
        """Second that a clip must go beyond to hold an element; below 0 for a curve, which any clip holds."""
        if self.shape == "curve":
            return -1.0
        if self.shape == "instant":
            return float(element.time)
        return float(element.start if math.isinf(element.end) else max(element.start, element.end - MAX_OVERRUN_S))


def _span_text(span: Any, between: str) -> str:
    """Seconds of a span in a message."""
    return f"{span.start:g} s to the end" if math.isinf(span.end) else f"{span.start:g}{between}{span.end:g} s"


KINDS: Mapping[str, ElementKind] = MappingProxyType({
    kind.name: kind
    for kind in (
        ElementKind("spans", StyleSpan, "span", "feature"),
        ElementKind("expressions", ExpressionSpan, "span", "expression"),
        ElementKind("gaze", GazeTarget, "span", "", "the gaze"),
        ElementKind("listens", ListeningSpan, "span", "", "listening"),
        ElementKind("nods", Nod, "instant", "", "nod"),
        ElementKind("brow_raises", BrowRaise, "instant", "", "brow raise"),
        ElementKind("strengths", StrengthCurve, "curve", "feature"),
        ElementKind("curves", ExpressionCurve, "curve", "expression"),
        ElementKind("edits", ChannelEdit, "curve", "channel"),
    )
})  # fmt: skip
