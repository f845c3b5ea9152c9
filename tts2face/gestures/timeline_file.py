"""Timeline files in JSON (docs/file-formats.md)."""

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.inputs import LARGEST_JSON_BYTES, check_object, check_type, format_value, parse_json, read_text
from tts2face.gestures.elements import KINDS, ElementKind, Gains, StyleSpan, check_feature
from tts2face.gestures.timeline import ALL_FEATURES, Timeline, expand_feature, parse_style
from tts2face.models.palette import FEATURES

PARTS = tuple(one.name for one in fields(Timeline))
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
    parts = _add_place_to_errors(name, lambda: check_object(data, {}, dict.fromkeys(PARTS)))
    made: dict[str, Any] = {
        part: tuple(chain(*_parse_each(f"{name}, {part}", parts[part], partial(_parse_element, kind))))
        for part, kind in KINDS.items()
    }
    for part, parse in (("style", _parse_styles), ("gains", _parse_gains), ("seeds", _parse_seeds)):
        made[part] = _add_place_to_errors(f"{name}, {part}", partial(parse, parts[part]))
    return _add_place_to_errors(name, lambda: Timeline(**made))


def timeline_json(timeline: Timeline) -> dict[str, Any]:
    """The timeline as an object of JSON without empty parts; `parse_timeline` reads it back as an equal timeline."""
    maps = {"style": dict(timeline.style), "gains": dict(timeline.gains.factors), "seeds": dict(timeline.seeds)}
    parts = {name: maps[name] if name in maps else [*map(_element_json, getattr(timeline, name))] for name in PARTS}
    return {name: part for name, part in parts.items() if part}


def _element_json(element: Any) -> dict[str, Any]:
    """Fields of an element; JSON has no infinite end."""
    parts = {one.name: getattr(element, one.name) for one in fields(element)}
    if "keys" in parts:
        parts["keys"] = [list(pair) for pair in parts["keys"]]
    return {name: part for name, part in parts.items() if part != math.inf}


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


def _parse_element(kind: ElementKind, content: Any) -> list[Any]:
    """Elements of an object of JSON: a span of several features is one of each."""
    required: dict[str, Any] = {one.name: one.type for one in fields(kind.record) if one.name not in kind.optional}
    parts = check_object(content, required, kind.optional)
    for name in kind.optional:
        parts[name] = _parse_keys(parts[name]) if name == "keys" else _parse_number(name, parts[name])
    if kind.record is StyleSpan:
        return [StyleSpan(**parts | {"feature": feature}) for feature in expand_feature(parts["feature"])]
    return [kind.record(**parts)]


def _parse_number(name: str, value: Any) -> float:
    """Number of an optional field; infinite, which JSON cannot say, only where no end is given."""
    return math.inf if (name, value) == ("end", math.inf) else float(check_type(name, value, float))


def _parse_keys(content: Any) -> tuple[tuple[float, ...], ...]:
    if not isinstance(content, list) or not all(isinstance(key, list) and len(key) == 2 for key in content):
        raise InputError(f"keys must be a list of [seconds, value], not {format_value(content)}")
    return tuple(tuple(check_type("a number of a key", one, float) for one in key) for key in content)


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
