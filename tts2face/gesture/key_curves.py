"""Curves through key points over time: strengths of features, weights of expressions, corrections of channels.

Times are seconds on the clock of the whole clip. Between keys a curve eases from one value to the next, with zero slope
at each; before the first key and after the last one it is constant.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

from lexicon.errors import InputError
from lexicon.inputs import check_limits
from tts2face.gesture.easing import Keys
from tts2face.gesture.spans import EXPRESSION_WEIGHT_LIMITS, GAIN_LIMITS, check_expression, check_feature

CHANNEL_OFFSET_LIMITS = (-1000.0, 1000.0)  # weights lie within 2; the head's position is in millimetres
MAX_KEYS = 100_000  # of one curve: a key at each frame of half an hour


@dataclass(frozen=True, slots=True)
class StrengthCurve:
    """Factor of a feature's motion over time, multiplied by the feature's gain."""

    feature: str
    keys: Keys

    def __post_init__(self) -> None:
        """Refuse unknown features, factors out of range, and times that do not increase."""
        check_feature(self.feature)
        object.__setattr__(self, "keys", check_keys(f"the strength of {self.feature}", self.keys, GAIN_LIMITS))

    @property
    def lane(self) -> str:
        """Key by which a second curve is rejected: the feature."""
        return self.feature


@dataclass(frozen=True, slots=True)
class ExpressionCurve:
    """Weight of a basis expression over time, added to those of the spans."""

    expression: str
    keys: Keys

    def __post_init__(self) -> None:
        """Refuse unknown expressions, weights out of range, and times that do not increase."""
        check_expression(self.expression)
        what = f"the weight of {self.expression}"
        object.__setattr__(self, "keys", check_keys(what, self.keys, EXPRESSION_WEIGHT_LIMITS))

    @property
    def lane(self) -> str:
        """Key by which a second curve is rejected: the expression."""
        return self.expression


@dataclass(frozen=True, slots=True)
class ChannelEdit:
    """Offset over time that is added to a channel of the finished motion: a shape's weight or a part of the head pose.

    Units are those of the channel: weights, radians of rotations, millimetres of positions.
    """

    channel: str
    keys: Keys

    def __post_init__(self) -> None:
        """Refuse a missing name, offsets out of range, and times that do not increase."""
        if not self.channel.strip():
            raise InputError("an edit needs a channel; give the name of a shape or of a part of the head pose")
        what = f"the edit of {self.channel}"
        object.__setattr__(self, "keys", check_keys(what, self.keys, CHANNEL_OFFSET_LIMITS))

    @property
    def lane(self) -> str:
        """Key by which a second curve is rejected: the channel."""
        return self.channel


AnyCurve = TypeVar("AnyCurve", StrengthCurve, ExpressionCurve, ChannelEdit)


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


def shift_keys(curve: AnyCurve, seconds: float) -> AnyCurve:
    """The same curve, so many seconds later."""
    return replace(curve, keys=tuple((time + seconds, value) for time, value in curve.keys))


def override_curves(under: Sequence[AnyCurve], over: Sequence[AnyCurve]) -> tuple[AnyCurve, ...]:
    """Curves `under`, replaced by those `over` of the same lane."""
    replaced = {curve.lane for curve in over}
    return tuple(curve for curve in under if curve.lane not in replaced) + tuple(over)


def check_lanes(curves: Sequence[AnyCurve]) -> None:
    """Refuse two curves of one lane."""
    lanes = [curve.lane for curve in curves]
    for lane in lanes:
        if lanes.count(lane) > 1:
            raise InputError(f"{lane} has {lanes.count(lane)} curves of one kind; join their keys in one curve")
