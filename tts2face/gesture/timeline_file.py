"""Timeline files in JSON (docs/file-formats.md)."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.inputs import LARGEST_JSON_BYTES, parse_json, read_text
from lexicon.json_values import check_object, check_type, format_value
from tts2face.gesture.key_curves import AnyCurve, ChannelEdit, ExpressionCurve, StrengthCurve
from tts2face.gesture.notation import ALL_FEATURES, expand_feature, parse_style
from tts2face.gesture.spans import ExpressionSpan, Gains, GazeTarget, Nod, StyleSpan, check_feature
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import FEATURES

TIMELINE_KEYS = (
    "style", "spans", "expressions", "nods", "gains", "gaze", "strengths", "curves", "edits", "seeds",
)  # fmt: skip

CURVE_KINDS: Mapping[str, tuple[Callable[[str, Any], Any], str]] = MappingProxyType(
    {
        "strengths": (StrengthCurve, "feature"),
        "curves": (ExpressionCurve, "expression"),
        "edits": (ChannelEdit, "channel"),
    }
)  # constructor, and what the curve belongs to

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
    return parse_timeline_object(parse_json(content, name), name)


def parse_timeline_object(data: Any, name: str = "timeline") -> Timeline:
    """A timeline from its object of JSON; errors as `read_timeline`."""
    parts = _add_place_to_errors(name, lambda: check_object(data, {}, dict.fromkeys(TIMELINE_KEYS)))
    spans = _parse_each(f"{name}, spans", parts["spans"], _parse_spans)
    expressions = _parse_each(f"{name}, expressions", parts["expressions"], _parse_expression)
    nods = _parse_each(f"{name}, nods", parts["nods"], _parse_nod)
    style = _add_place_to_errors(f"{name}, style", lambda: _parse_styles(parts["style"]))
    gains = _add_place_to_errors(f"{name}, gains", lambda: _parse_gains(parts["gains"]))
    gaze = _parse_each(f"{name}, gaze", parts["gaze"], _parse_gaze)
    strengths, curves, edits = (
        _parse_each(f"{name}, {key}", parts[key], partial(_parse_curve, kind, owner))
        for key, (kind, owner) in CURVE_KINDS.items()
    )
    seeds = _add_place_to_errors(f"{name}, seeds", lambda: _parse_seeds(parts["seeds"]))
    return _add_place_to_errors(
        name,
        lambda: Timeline(
            style, tuple(chain(*spans)), tuple(expressions), tuple(nods), gains,
            tuple(gaze), tuple(strengths), tuple(curves), tuple(edits), seeds,
        ),
    )  # fmt: skip


def timeline_json(timeline: Timeline) -> dict[str, Any]:
    """The timeline as an object of JSON without empty parts; `parse_timeline` reads it back as an equal timeline."""
    parts: dict[str, Any] = {
        "style": dict(timeline.style),
        "spans": [_span_json(span, {"feature": span.feature, "style": span.style}) for span in timeline.spans],
        "expressions": [
            _span_json(span, {"expression": span.expression, "weight": span.weight}) for span in timeline.expressions
        ],
        "nods": [{"time": nod.time, "size": nod.size} for nod in timeline.nods],
        "gains": dict(timeline.gains.factors),
        "gaze": [
            _span_json(target, {"down_deg": target.down_deg, "left_deg": target.left_deg}) for target in timeline.gaze
        ],
        "strengths": [_curve_json("feature", curve) for curve in timeline.strengths],
        "curves": [_curve_json("expression", curve) for curve in timeline.curves],
        "edits": [_curve_json("channel", curve) for curve in timeline.edits],
        "seeds": dict(timeline.seeds),
    }
    return {key: part for key, part in parts.items() if part}


def _curve_json(owner: str, curve: StrengthCurve | ExpressionCurve | ChannelEdit) -> dict[str, Any]:
    return {owner: curve.lane, "keys": [list(pair) for pair in curve.keys]}


def _span_json(span: StyleSpan | ExpressionSpan | GazeTarget, content: dict[str, Any]) -> dict[str, Any]:
    return {**content, "start": span.start, **({} if math.isinf(span.end) else {"end": span.end})}


def _add_place_to_errors(place: str, make: Callable[[], Made]) -> Made:
    try:
        return make()
    except InputError as wrong:
        raise DataError(f"{place}: {wrong}") from wrong


def _parse_each(place: str, content: Any, make: Callable[[Any], Made]) -> list[Made]:
    if content is None:
        return []
    if not isinstance(content, list):
        raise DataError(f"{place} must be a list in square brackets, not {format_value(content)}")
    return [_add_place_to_errors(f"{place}[{number}]", partial(make, one)) for number, one in enumerate(content)]


def _parse_spans(content: Any) -> tuple[StyleSpan, ...]:
    parts = check_object(content, {"feature": str, "style": str, "start": float}, {"end": math.inf})
    return tuple(
        StyleSpan(feature, parts["style"], parts["start"], _end(parts)) for feature in expand_feature(parts["feature"])
    )


def _parse_expression(content: Any) -> ExpressionSpan:
    parts = check_object(content, {"expression": str, "weight": float}, {"start": 0.0, "end": math.inf})
    start = check_type("start", parts["start"], float)
    return ExpressionSpan(parts["expression"], parts["weight"], start, _end(parts))


def _parse_nod(content: Any) -> Nod:
    parts = check_object(content, {"time": float}, {"size": 1.0})
    return Nod(parts["time"], check_type("size", parts["size"], float))


def _parse_gaze(content: Any) -> GazeTarget:
    parts = check_object(content, {"down_deg": float, "left_deg": float}, {"start": 0.0, "end": math.inf})
    start = check_type("start", parts["start"], float)
    return GazeTarget(parts["down_deg"], parts["left_deg"], start, _end(parts))


def _end(parts: Mapping[str, Any]) -> float:
    """End of a span; infinite, which JSON cannot say, only where none is given."""
    return math.inf if parts["end"] == math.inf else float(check_type("end", parts["end"], float))


def _parse_curve(kind: Callable[[str, Any], AnyCurve], owner: str, content: Any) -> AnyCurve:
    parts = check_object(content, {owner: str}, {"keys": None})
    keys = parts["keys"]
    if not isinstance(keys, list) or not all(isinstance(key, list) and len(key) == 2 for key in keys):
        raise InputError(f"keys must be a list of [seconds, value], not {format_value(keys)}")
    return kind(parts[owner], tuple(tuple(check_type("a number of a key", one, float) for one in key) for key in keys))


def _parse_seeds(content: Any) -> Mapping[str, int]:
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise InputError(f"give a seed for each feature, not {format_value(content)}")
    for name, seed in content.items():
        check_type(f"the seed of {name}", seed, int)
    return content


def _parse_styles(content: Any) -> Mapping[str, str]:
    if content is None:
        return {}
    if isinstance(content, str):
        return parse_style(content)
    if not isinstance(content, dict):
        raise InputError(f"give a name, or a style for each feature, not {format_value(content)}")
    named = {name: check_type(name, style, str) for name, style in content.items()}
    base = named.pop(ALL_FEATURES, None)
    return {**(dict.fromkeys(FEATURES, base) if base else {}), **{check_feature(name): named[name] for name in named}}


def _parse_gains(content: Any) -> Gains:
    if content is None:
        return Gains()
    if not isinstance(content, dict):
        raise InputError(f"give a factor for each feature, not {format_value(content)}")
    return Gains({name: check_type(name, factor, float) for name, factor in content.items()})
