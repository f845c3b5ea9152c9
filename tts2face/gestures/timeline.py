"""The timeline of a clip: styles of each feature over time, expressions, gestures and gains.

Times are seconds on the clock of the whole clip; spans are half open. Styles, gains and expressions are written as
``brows=annoyed,head=delighted``, ``happy=0.6@1.2-3.4``.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from tts2face.gestures.elements import (
    GAIN_NAMES,
    ChannelEdit,
    ExpressionCurve,
    ExpressionSpan,
    Gains,
    GazeTarget,
    Gesture,
    ListeningSpan,
    StrengthCurve,
    StyleSpan,
    check_feature,
    check_style,
    interpolate_keys,
    span_weights,
)
from tts2face.gestures.kinds import KINDS, ElementKind
from tts2face.gestures.movements import channel_values, gesture_end, timed, turned_gaze
from tts2face.models.palette import EXPRESSIONS, FEATURES, Palette
from tts2face.numeric.arrays import FloatArray

BLEND_S = 0.3  # transition between two styles; as long as a blink
# Of an expression: a smile's onset takes about as long whatever the occasion (Schmidt, Cohn and Tian 2003, Biological
# Psychology 65); faster changes within speech appear as discontinuities.
ONSET_S = 0.6
LISTENING_HOLD_S = 0.1  # after a span: gestures of a piece are drawn two frames ahead, before the next span is known
SACCADE_S = 0.06  # transition to a gaze target; saccades of 10 degrees take 50 ms (Bahill et al. 1975)


@dataclass(frozen=True, slots=True)
class Timeline:
    """Requested gestures of a clip.

    Parameters
    ----------
    style
        Style of each feature outside its spans; features without an entry use the default style.
    spans, expressions
        Spans, sorted by time; those of one feature or expression may be adjacent but not overlap.
    gestures
        Named gestures, sorted by time.
    gains
        Factors of the motion of features.
    gaze
        Directions in which the eyes look, sorted by time.
    listens
        Spans in which the face listens, sorted by time.
    strengths, curves, edits
        Strengths of features, weights of expressions, and offsets of finished channels through key points; one for each
        feature, expression and channel.
    seeds
        Seeds of features that differ from the request's.

    Raises
    ------
    InputError
        A value has another type, a feature is unknown, a style has no name, spans overlap, a seed is negative, or one
        feature, expression or channel has two curves.
    """

    style: Mapping[str, str] = field(default_factory=dict)
    spans: tuple[StyleSpan, ...] = ()
    expressions: tuple[ExpressionSpan, ...] = ()
    gestures: tuple[Gesture, ...] = ()
    gains: Gains = field(default_factory=Gains)
    gaze: tuple[GazeTarget, ...] = ()
    listens: tuple[ListeningSpan, ...] = ()
    strengths: tuple[StrengthCurve, ...] = ()
    curves: tuple[ExpressionCurve, ...] = ()
    edits: tuple[ChannelEdit, ...] = ()
    seeds: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse values of other types, unknown features and overlapping spans; put the rest in order of time."""
        check_fields(self)
        for feature, style in self.style.items():
            check_feature(feature)
            check_style(style)
        object.__setattr__(self, "style", MappingProxyType(dict(self.style)))
        for name, kind in KINDS.items():
            object.__setattr__(self, name, kind.ordered(getattr(self, name)))
        for feature, seed in self.seeds.items():
            check_feature(feature)
            if seed < 0:
                raise InputError(f"the seed of {feature} must be 0 or more, not {seed}")
        object.__setattr__(self, "seeds", MappingProxyType(dict(self.seeds)))

    @property
    def style_names(self) -> tuple[str, ...]:
        """Names of all requested styles in order of first use."""
        return tuple(dict.fromkeys([*self.style.values(), *(span.style for span in self.spans)]))

    def style_at(self, feature: str, times: ArrayLike, *, default: str) -> tuple[str, ...]:
        """Style of a feature at each of T times, without blending; `default` if none is requested."""
        find = self.style_finder(feature, default=default)
        return tuple(find(second) for second in np.atleast_1d(np.asarray(times, np.float64)).tolist())

    def style_finder(self, feature: str, *, default: str) -> Callable[[float], str]:
        """Function that returns the style of a feature at a time, as `style_at`, for times that are not yet known."""
        base = self.style.get(check_feature(feature), default)
        spans = [span for span in self.spans if span.feature == feature]
        starts = [span.start for span in spans]

        def find(second: float) -> str:
            at = bisect_right(starts, second) - 1
            return spans[at].style if at >= 0 and second < spans[at].end else base

        return find

    def style_shares(self, feature: str, times: ArrayLike, *, default: str) -> dict[str, FloatArray]:
        """(T,) weights of each style of a feature at T times, with sum 1.

        Styles are cross-faded within `BLEND_S` (those of the feature ``expression`` within `ONSET_S`).
        """
        seconds = np.atleast_1d(np.asarray(times, np.float64))
        base = self.style.get(check_feature(feature), default)
        shares = {base: np.ones(len(seconds))}
        for span in self.spans:
            if span.feature == feature:
                share = span_weights(seconds, span.start, span.end, ONSET_S if feature == "expression" else BLEND_S)
                shares[base] = shares[base] - share
                shares[span.style] = shares.get(span.style, np.zeros(len(seconds))) + share
        return {style: np.clip(share, 0.0, 1.0) for style, share in shares.items()}

    def expression_weights(self, times: ArrayLike) -> FloatArray:
        """Weights (T, 5) added to `EXPRESSIONS` at T times; they rise and fall within `ONSET_S` around the edges."""
        seconds = np.atleast_1d(np.asarray(times, np.float64))
        weights = np.zeros((len(seconds), len(EXPRESSIONS)))
        for span in self.expressions:
            column = EXPRESSIONS.index(span.expression)
            weights[:, column] += span.weight * span_weights(seconds, span.start, span.end, ONSET_S)
        for curve in self.curves:
            weights[:, EXPRESSIONS.index(curve.expression)] += interpolate_keys(seconds, curve.keys)
        moving = timed(self.gestures, seconds)
        for column, expression in enumerate(EXPRESSIONS):
            weights[:, column] += channel_values(moving, expression, seconds)
        return weights

    def strength(self, feature: str, times: ArrayLike) -> FloatArray:
        """(T,) factors of a feature's motion at T times: its gain times its strength."""
        seconds, gain = np.atleast_1d(np.asarray(times, np.float64)), self.gains.of(feature)
        for curve in self.strengths:
            if curve.feature == feature:
                return gain * interpolate_keys(seconds, curve.keys)
        return np.full(len(seconds), gain)

    def apply_gaze(self, times: ArrayLike, gaze: NDArray[np.floating]) -> FloatArray:
        """(T, 2) gaze at T times, in radians down and left of the scene, moved to the targets within `SACCADE_S`.

        Gestures that look somewhere have their direction whatever the targets.
        """
        moved = np.array(gaze, np.float64)
        for target in self.gaze:
            share = span_weights(times, target.start, target.end, SACCADE_S)[:, None]
            moved += share * (np.radians([target.down_deg, target.left_deg]) - gaze)
        seconds = np.atleast_1d(np.asarray(times, np.float64))
        return turned_gaze(timed(self.gestures, seconds), seconds, moved)

    def is_listening(self, times: ArrayLike) -> NDArray[np.bool_]:
        """(T,) whether the face listens at T times, or did within `LISTENING_HOLD_S` before."""
        seconds = np.atleast_1d(np.asarray(times, np.float64))
        found = np.zeros(len(seconds), bool)
        for span in self.listens:
            found |= (span.start <= seconds) & (seconds < span.end + LISTENING_HOLD_S)
        return found

    def merge(self, later: "Timeline") -> "Timeline":
        """Merge with another timeline, which takes precedence where both overlap."""
        return Timeline(
            style={**self.style, **later.style},
            gains=Gains({**self.gains.factors, **later.gains.factors}),
            seeds={**self.seeds, **later.seeds},
            **{name: kind.merged(getattr(self, name), getattr(later, name)) for name, kind in KINDS.items()},
        )

    def shift(self, seconds: float, *, holds_start: bool = False) -> "Timeline":
        """The same timeline, delayed by `seconds`; with `holds_start`, spans from 0 s on still begin there."""
        return self._changed(lambda kind, elements: kind.shifted(elements, seconds, holds_start=holds_start))

    def restrict(self, start: float, end: float) -> "Timeline":
        """The elements within [start, end), with spans cut to this range and whole curves; times are unchanged."""
        return self._changed(lambda kind, elements: kind.restricted(elements, start, end))

    def lasting(self, second: float) -> "Timeline":
        """The elements that still have an effect after a second of the clip; spans are cut to it."""
        kept = tuple(gesture for gesture in self.gestures if gesture_end(gesture) > second)
        return replace(self.restrict(second, math.inf), gestures=kept)

    def _changed(self, change: Callable[[ElementKind, Sequence[Any]], tuple[Any, ...]]) -> "Timeline":
        """The same timeline with other elements of each kind."""
        elements: dict[str, Any] = {name: change(kind, getattr(self, name)) for name, kind in KINDS.items()}
        return replace(self, **elements)

    def check_styles(self, palette: Palette) -> None:
        """Refuse styles that a palette lacks.

        Raises
        ------
        InputError
            A style is unknown.
        """
        for name in self.style_names:
            palette.require(name)

    @property
    def latest_s(self) -> float:
        """Second that a clip must go beyond to hold all elements; below 0 where any clip does."""
        seconds = [kind.latest_s(element) for name, kind in KINDS.items() for element in getattr(self, name)]
        return max(seconds, default=-1.0)

    def check_duration(self, duration: float) -> None:
        """Refuse times beyond the end of a clip.

        Raises
        ------
        InputError
            A span or gesture lies behind the end.
        """
        for name, kind in KINDS.items():
            kind.check_duration(getattr(self, name), duration)


ALL_FEATURES = "all"  # every feature


def expand_feature(name: str) -> tuple[str, ...]:
    """The features that a name stands for: itself, or every one of them for ``all``."""
    return FEATURES if name == ALL_FEATURES else (check_feature(name),)


def parse_style(written: str) -> Mapping[str, str]:
    """Style of each feature from ``delighted``, ``brows=annoyed,head=delighted`` or ``delighted,brows=annoyed``.

    A name without a feature applies to all other features.

    Raises
    ------
    InputError
        A part is empty, names an unknown feature, or a feature occurs twice.
    """
    chosen: dict[str, str] = {}
    hint = "a style is a name, or features with styles such as brows=annoyed,head=delighted"
    for name, style in _parse_pairs(written, hint, is_named=False):
        if (name or ALL_FEATURES) in chosen:
            raise InputError(f"{written!r} chooses a style for {name or ALL_FEATURES} twice; keep one")
        if name not in {"", ALL_FEATURES}:
            check_feature(name)
        chosen[name or ALL_FEATURES] = style
    base = chosen.pop(ALL_FEATURES, None)
    return (dict.fromkeys(FEATURES, base) if base is not None else {}) | chosen


def parse_gains(written: str) -> Gains:
    """Gains from ``head=1.5,blink=0.8,jaw=1.2``; ``all=0.5`` applies to all other gestures.

    Raises
    ------
    InputError
        A part is no feature with a number, or a feature occurs twice, or a gain is out of range.
    """
    hint = "gains are written as head=1.5,blink=0.8"
    chosen: dict[str, float] = {}
    for name, number in _parse_pairs(written, hint):
        if name in chosen:
            raise InputError(f"{written!r} chooses a gain for {name} twice; keep one")
        if name != ALL_FEATURES:
            check_feature(name, GAIN_NAMES)
        chosen[name] = _parse_number(number, hint)
    base = chosen.pop(ALL_FEATURES, None)
    return Gains((dict.fromkeys(FEATURES, base) if base is not None else {}) | chosen)


def parse_expressions(written: str) -> tuple[ExpressionSpan, ...]:
    """Expressions from ``happy=0.6@1.2-3.4,sad=0.3``: weight, and seconds from and to; without times the whole clip.

    ``@1.2`` or ``@1.2-`` lasts to the end.

    Raises
    ------
    InputError
        A part is written in another way, or as `ExpressionSpan`.
    """
    hint = "an expression is written as happy=0.6, or with seconds as happy=0.6@1.2-3.4"
    spans = []
    for name, value in _parse_pairs(written, hint):
        weight, has_times, times = value.partition("@")
        start, _, end = times.partition("-")
        spans.append(
            ExpressionSpan(
                name,
                _parse_number(weight, hint),
                _parse_number(start, hint) if has_times else 0.0,
                _parse_number(end, hint) if end.strip() else math.inf,
            )
        )
    return tuple(spans)


def _parse_pairs(written: str, hint: str, *, is_named: bool = True) -> Iterator[tuple[str, str]]:
    for part in written.split(","):
        name, is_pair, value = (piece.strip() for piece in part.rpartition("="))
        if not value or "=" in name or bool(is_pair) != bool(name) or (is_named and not name):
            raise InputError(f"cannot read {part.strip()!r} in {written[:80]!r}; {hint}")
        yield name, value


def _parse_number(written: str, hint: str) -> float:
    try:
        number = float(written)
    except ValueError as wrong:
        raise InputError(f"{written.strip()!r} is not a number; {hint}") from wrong
    if not math.isfinite(number):
        raise InputError(f"{written.strip()!r} is not a finite number; {hint}")
    return number
