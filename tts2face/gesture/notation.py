"""Parsers of styles, gains and expressions: ``brows=annoyed,head=delighted``, ``happy=0.6@1.2-3.4``."""

import math
from collections.abc import Iterator, Mapping

from lexicon.errors import InputError
from tts2face.gesture.elements import GAIN_NAMES, ExpressionSpan, Gains, check_feature
from tts2face.models.palette import FEATURES

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
