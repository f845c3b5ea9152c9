"""Elements of a timeline: style spans, expression spans, nods and gains, and operations on spans.

Times are seconds; spans are half open.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType
from typing import TypeVar

from lexicon.errors import InputError
from lexicon.inputs import check_limits
from tts2face.models.palette import EXPRESSIONS, FEATURES

EXPRESSION_WEIGHT_LIMITS = (-0.5, 1.5)  # -e to 1 + e with e = 0.5, the middle of what Ju and Lee 2008 (section 4) allow
GAIN_LIMITS = (0.0, 3.0)  # beyond three times as far, lids and brows of any face are at their limits
GAIN_NAMES = (*FEATURES, "jaw", "lips")
GAZE_LIMITS_DEG = (-35.0, 35.0)  # farther, people turn the head (Stahl 1999, Experimental Brain Research 126)
NOD_SIZE_LIMITS = (0.1, 2.0)  # above 12 degrees a nod is a bow


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


@dataclass(frozen=True, slots=True)
class StyleSpan:
    """One feature follows a style in [start, end); `end` may be infinite."""

    feature: str
    style: str
    start: float
    end: float

    def __post_init__(self) -> None:
        """Refuse unknown features and times that do not run forward."""
        check_feature(self.feature)
        check_style(self.style)
        _check_span(f"the span of {self.feature}", self.start, self.end)

    @property
    def lane(self) -> str:
        """Key by which overlaps are rejected: the feature."""
        return self.feature


@dataclass(frozen=True, slots=True)
class ExpressionSpan:
    """A basis expression is added with a weight in [start, end), with eased edges; `end` may be infinite."""

    expression: str
    weight: float
    start: float
    end: float

    def __post_init__(self) -> None:
        """Refuse unknown expressions, weights out of range, and times that do not run forward."""
        check_expression(self.expression)
        check_limits(f"the weight of {self.expression}", self.weight, EXPRESSION_WEIGHT_LIMITS)
        _check_span(f"the span of {self.expression}", self.start, self.end)

    @property
    def lane(self) -> str:
        """Key by which overlaps are rejected: the expression."""
        return self.expression


@dataclass(frozen=True, slots=True)
class GazeTarget:
    """The eyes look in one direction of the scene in [start, end), while the head moves; `end` may be infinite.

    Degrees down and to the person's own left; 0 and 0 is the viewer in front of the resting head.
    """

    down_deg: float
    left_deg: float
    start: float
    end: float

    def __post_init__(self) -> None:
        """Refuse directions beyond the eyes' range and times that do not run forward."""
        for name, angle in (("down", self.down_deg), ("left", self.left_deg)):
            check_limits(f"the gaze {name} in degrees", angle, GAZE_LIMITS_DEG)
        _check_span("the gaze", self.start, self.end)

    @property
    def lane(self) -> str:
        """Key by which overlaps are rejected: there is one gaze."""
        return "the gaze"


@dataclass(frozen=True, slots=True)
class Nod:
    """A nod that starts at `time` seconds; size 1 is 6 degrees."""

    time: float
    size: float = 1.0

    def __post_init__(self) -> None:
        """Refuse times before the clip and sizes out of range."""
        if not 0.0 <= self.time < math.inf:
            raise InputError(f"a nod needs a time of 0 s or more, not {self.time:g}")
        check_limits("the size of a nod", self.size, NOD_SIZE_LIMITS)


@dataclass(frozen=True, slots=True)
class Gains:
    """Factors of the motion of features; those of jaw and lips apply to the speech motion."""

    factors: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse unknown features and factors out of range."""
        for feature, factor in self.factors.items():
            check_feature(feature, GAIN_NAMES)
            check_limits(f"the gain of {feature}", factor, GAIN_LIMITS)
        object.__setattr__(self, "factors", MappingProxyType(dict(self.factors)))

    def of(self, feature: str) -> float:
        """The factor of a feature, 1 where none was chosen."""
        return self.factors.get(check_feature(feature, GAIN_NAMES), 1.0)


AnySpan = TypeVar("AnySpan", StyleSpan, ExpressionSpan, GazeTarget)


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


def sort_spans(spans: Iterable[AnySpan]) -> tuple[AnySpan, ...]:
    """Spans by time.

    Raises
    ------
    InputError
        Two of one feature or expression overlap.
    """
    ordered = tuple(sorted(spans, key=lambda span: (span.start, span.end)))
    lanes: dict[str, list[AnySpan]] = {}
    for span in ordered:
        lanes.setdefault(span.lane, []).append(span)
    for lane, lane_spans in lanes.items():
        for before, after in pairwise(lane_spans):
            if after.start < before.end:
                raise InputError(
                    f"two spans of {lane} overlap: {before.start:g}-{before.end:g} s and {after.start:g}-{after.end:g} "
                    "s; let one end before the other begins"
                )
    return ordered


def shift_span(span: AnySpan, seconds: float) -> AnySpan:
    """The same span, so many seconds later."""
    return replace(span, start=span.start + seconds, end=span.end + seconds)


def cut_spans(spans: Iterable[AnySpan], start: float, end: float) -> tuple[AnySpan, ...]:
    """What of some spans lies in [start, end)."""
    return tuple(
        replace(span, start=max(span.start, start), end=min(span.end, end))
        for span in spans
        if span.start < end and span.end > start
    )


def overlay_spans(under: Sequence[AnySpan], over: Sequence[AnySpan]) -> tuple[AnySpan, ...]:
    """Spans `under`, replaced by the spans `over` where both overlap."""
    merged = list(under)
    for top in over:
        same_lane = [span for span in merged if span.lane == top.lane]
        merged = [span for span in merged if span.lane != top.lane]
        merged.extend(cut_spans(same_lane, -1.0, top.start))
        merged.extend(cut_spans(same_lane, top.end, math.inf))
    merged.extend(over)
    return tuple(merged)
