"""Reader of timeline files in JSON (docs/file-formats.md)."""

import json
import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.inputs import LARGEST_JSON_BYTES, parse_json, read_text
from tts2face.gesture.notation import ALL_FEATURES, expand_feature, parse_style
from tts2face.gesture.spans import ExpressionSpan, Gains, Nod, StyleSpan, check_feature
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import FEATURES

TIMELINE_KEYS = ("style", "spans", "expressions", "nods", "gains")

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
    data = parse_json(content, name)
    parts = _add_place_to_errors(name, lambda: _check_object(data, {}, dict.fromkeys(TIMELINE_KEYS)))
    spans = _parse_each(f"{name}, spans", parts["spans"], _parse_spans)
    expressions = _parse_each(f"{name}, expressions", parts["expressions"], _parse_expression)
    nods = _parse_each(f"{name}, nods", parts["nods"], _parse_nod)
    style = _add_place_to_errors(f"{name}, style", lambda: _parse_styles(parts["style"]))
    gains = _add_place_to_errors(f"{name}, gains", lambda: _parse_gains(parts["gains"]))
    return _add_place_to_errors(
        name, lambda: Timeline(style, tuple(chain(*spans)), tuple(expressions), tuple(nods), gains)
    )


def _add_place_to_errors(place: str, make: Callable[[], Made]) -> Made:
    try:
        return make()
    except InputError as wrong:
        raise DataError(f"{place}: {wrong}") from wrong


def _parse_each(place: str, content: Any, make: Callable[[Any], Made]) -> list[Made]:
    if content is None:
        return []
    if not isinstance(content, list):
        raise DataError(f"{place} must be a list in square brackets, not {_format_value(content)}")
    return [_add_place_to_errors(f"{place}[{number}]", partial(make, one)) for number, one in enumerate(content)]


def _parse_spans(content: Any) -> tuple[StyleSpan, ...]:
    parts = _check_object(content, {"feature": str, "style": str, "start": float}, {"end": math.inf})
    end = _check_type("end", parts["end"], float)
    return tuple(
        StyleSpan(feature, parts["style"], parts["start"], end) for feature in expand_feature(parts["feature"])
    )


def _parse_expression(content: Any) -> ExpressionSpan:
    parts = _check_object(content, {"expression": str, "weight": float}, {"start": 0.0, "end": math.inf})
    start, end = (_check_type(name, parts[name], float) for name in ("start", "end"))
    return ExpressionSpan(parts["expression"], parts["weight"], start, end)


def _parse_nod(content: Any) -> Nod:
    parts = _check_object(content, {"time": float}, {"size": 1.0})
    return Nod(parts["time"], _check_type("size", parts["size"], float))


def _parse_styles(content: Any) -> Mapping[str, str]:
    if content is None:
        return {}
    if isinstance(content, str):
        return parse_style(content)
    if not isinstance(content, dict):
        raise InputError(f"give a name, or a style for each feature, not {_format_value(content)}")
    named = {name: _check_type(name, style, str) for name, style in content.items()}
    base = named.pop(ALL_FEATURES, None)
    return {**(dict.fromkeys(FEATURES, base) if base else {}), **{check_feature(name): named[name] for name in named}}


def _parse_gains(content: Any) -> Gains:
    if content is None:
        return Gains()
    if not isinstance(content, dict):
        raise InputError(f"give a factor for each feature, not {_format_value(content)}")
    return Gains({name: _check_type(name, factor, float) for name, factor in content.items()})


def _check_object(content: Any, required: Mapping[str, type], optional: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a JSON object: all that are required, of their type, and no unknown one."""
    if not isinstance(content, dict):
        raise InputError(f"give an object in curly brackets, not {_format_value(content)}")
    for name in content:
        if name not in required and name not in optional:
            raise InputError(f"there is no {name!r} here; choose {', '.join([*required, *optional])}")
    for name in required:
        if name not in content:
            raise InputError(f"{name} is missing")
    return {**optional, **content, **{name: _check_type(name, content[name], kind) for name, kind in required.items()}}


def _check_type(name: str, value: Any, kind: type) -> Any:
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return _check_finite(name, value)
    if kind is str and isinstance(value, str):
        return value
    raise InputError(
        f"{name} must be {'a number' if kind is float else 'a text in quotes'}, not {_format_value(value)}"
    )


def _check_finite(name: str, value: float) -> float:
    """A number as JSON has them; infinity is only ever our own default."""
    try:
        return float(value)
    except OverflowError as huge:
        raise InputError(f"{name} is too large a number") from huge


def _format_value(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)[:40]
