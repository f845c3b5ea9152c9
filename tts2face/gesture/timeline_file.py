"""Timelines in files: JSON (docs/file-formats.md), read with one sentence for each thing that can be wrong."""

import json
import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.inputs import LARGEST_JSON_BYTES, parse_json, read_text
from tts2face.gesture.notation import ALL, features_of, style_of
from tts2face.gesture.spans import ExpressionSpan, Gains, Nod, StyleSpan, check_feature
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import FEATURES

KEYS = ("style", "spans", "expressions", "nods", "gains")

Made = TypeVar("Made")


def read_timeline(path: Path) -> Timeline:
    """A timeline from a JSON file.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is not JSON, or not a timeline; the message names the place and the value.
    """
    try:
        content = read_text(path, LARGEST_JSON_BYTES)
    except OSError as refused:
        raise InputError(f"cannot read the timeline {path}: {refused.strerror}; check the path") from refused
    return parse_timeline(content, str(path))


def parse_timeline(content: str, name: str = "timeline") -> Timeline:
    """A timeline from the text of a JSON file; errors as `read_timeline`."""
    told = parse_json(content, name)
    parts = _at(name, lambda: _object(told, {}, dict.fromkeys(KEYS)))
    spans = _each(f"{name}, spans", parts["spans"], _spans)
    expressions = _each(f"{name}, expressions", parts["expressions"], _expression)
    nods = _each(f"{name}, nods", parts["nods"], _nod)
    style = _at(f"{name}, style", lambda: _style(parts["style"]))
    gains = _at(f"{name}, gains", lambda: _gains(parts["gains"]))
    return _at(name, lambda: Timeline(style, tuple(chain(*spans)), tuple(expressions), tuple(nods), gains))


def _at(place: str, make: Callable[[], Made]) -> Made:
    try:
        return make()
    except InputError as wrong:
        raise DataError(f"{place}: {wrong}") from wrong


def _each(place: str, told: Any, make: Callable[[Any], Made]) -> list[Made]:
    if told is None:
        return []
    if not isinstance(told, list):
        raise DataError(f"{place} must be a list in square brackets, not {_shown(told)}")
    return [_at(f"{place}[{number}]", partial(make, one)) for number, one in enumerate(told)]


def _spans(told: Any) -> tuple[StyleSpan, ...]:
    parts = _object(told, {"feature": str, "style": str, "start": float}, {"end": math.inf})
    end = _typed("end", parts["end"], float)
    return tuple(StyleSpan(feature, parts["style"], parts["start"], end) for feature in features_of(parts["feature"]))


def _expression(told: Any) -> ExpressionSpan:
    parts = _object(told, {"expression": str, "weight": float}, {"start": 0.0, "end": math.inf})
    start, end = (_typed(name, parts[name], float) for name in ("start", "end"))
    return ExpressionSpan(parts["expression"], parts["weight"], start, end)


def _nod(told: Any) -> Nod:
    parts = _object(told, {"time": float}, {"size": 1.0})
    return Nod(parts["time"], _typed("size", parts["size"], float))


def _style(told: Any) -> Mapping[str, str]:
    if told is None:
        return {}
    if isinstance(told, str):
        return style_of(told)
    if not isinstance(told, dict):
        raise InputError(f"give a name, or a style for each feature, not {_shown(told)}")
    named = {name: _typed(name, style, str) for name, style in told.items()}
    base = named.pop(ALL, None)
    return {**(dict.fromkeys(FEATURES, base) if base else {}), **{check_feature(name): named[name] for name in named}}


def _gains(told: Any) -> Gains:
    if told is None:
        return Gains()
    if not isinstance(told, dict):
        raise InputError(f"give a factor for each feature, not {_shown(told)}")
    return Gains({name: _typed(name, factor, float) for name, factor in told.items()})


def _object(told: Any, required: Mapping[str, type], optional: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a JSON object: all that are required, of their type, and no unknown one."""
    if not isinstance(told, dict):
        raise InputError(f"give an object in curly brackets, not {_shown(told)}")
    for name in told:
        if name not in required and name not in optional:
            raise InputError(f"there is no {name!r} here; choose {', '.join([*required, *optional])}")
    for name in required:
        if name not in told:
            raise InputError(f"{name} is missing")
    return {**optional, **told, **{name: _typed(name, told[name], kind) for name, kind in required.items()}}


def _typed(name: str, value: Any, kind: type) -> Any:
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return _finite(name, value)
    if kind is str and isinstance(value, str):
        return value
    raise InputError(f"{name} must be {'a number' if kind is float else 'a text in quotes'}, not {_shown(value)}")


def _finite(name: str, value: float) -> float:
    """A number as JSON has them; infinity is only ever our own default."""
    try:
        return float(value)
    except OverflowError as huge:
        raise InputError(f"{name} is too large a number") from huge


def _shown(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)[:40]
