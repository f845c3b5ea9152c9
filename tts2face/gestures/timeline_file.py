"""Timeline files in JSON (docs/file-formats.md)."""

import math
from collections.abc import Mapping
from dataclasses import fields, make_dataclass
from itertools import chain
from pathlib import Path
from types import GenericAlias, MappingProxyType
from typing import Any

from lexicon.errors import InputError
from lexicon.values.checks import format_value
from lexicon.values.files import read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from lexicon.values.records import checked, errors_at
from tts2face.gestures.elements import Gains, Gesture, StyleSpan, check_feature
from tts2face.gestures.kinds import KINDS
from tts2face.gestures.timeline import ALL_FEATURES, Timeline, expand_feature, parse_style
from tts2face.models.palette import FEATURES

PARTS = tuple(part.name for part in fields(Timeline))
EARLIER = MappingProxyType({"nods": "nod", "brow_raises": "brows_up"})  # parts of earlier files: gestures of one name
_Written: Any = make_dataclass("_Written", [(part, Any, None) for part in (*PARTS, *EARLIER)])
_Span = make_dataclass("_Span", [("feature", str), ("style", str), ("start", float), ("end", float, math.inf)])
_INSTANTS: Any = GenericAlias(tuple, (make_dataclass("_Instant", [("time", float), ("size", float, 1.0)]), ...))
_SPANS: Any = GenericAlias(tuple, (_Span, ...))


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
    parts = {part: content for part, content in vars(checked(_Written, data, name)).items() if content is not None}
    made: dict[str, Any] = {part: _parse_part(part, parts[part], f"{name}, {part}") for part in parts}
    earlier = [element for part in EARLIER if part in made for element in made.pop(part)]
    if earlier:
        made["gestures"] = (*made.get("gestures", ()), *earlier)
    with errors_at(name):
        return Timeline(**made)


def timeline_json(timeline: Timeline) -> dict[str, Any]:
    """The timeline as an object of JSON without empty parts; `parse_timeline` reads it back as an equal timeline."""
    maps = {"style": dict(timeline.style), "gains": dict(timeline.gains.factors), "seeds": dict(timeline.seeds)}
    parts = {name: maps[name] if name in maps else [*map(_element_json, getattr(timeline, name))] for name in PARTS}
    return {name: part for name, part in parts.items() if part}


def _element_json(element: Any) -> dict[str, Any]:
    """Fields of an element; JSON has no infinite end."""
    # an end that is not stated is infinite, which JSON cannot write
    parts = {field.name: getattr(element, field.name) for field in fields(element)}
    if "keys" in parts:
        parts["keys"] = [list(pair) for pair in parts["keys"]]
    return {name: part for name, part in parts.items() if part is not None and part != math.inf}


def _parse_part(part: str, content: Any, place: str) -> Any:
    if part == "seeds":
        return checked(dict[str, int], content, place)
    if part == "spans":
        return tuple(
            chain(*(_spans_of(written, f"{place}[{at}]") for at, written in enumerate(checked(_SPANS, content, place))))
        )
    if part in EARLIER:
        instants = checked(_INSTANTS, content, place)
        return tuple(_earlier(instant, EARLIER[part], f"{place}[{at}]") for at, instant in enumerate(instants))
    if part in KINDS:
        elements: Any = GenericAlias(tuple, (KINDS[part].record, ...))
        return checked(elements, content, place)
    if part == "style":
        return _parse_styles(content, place)
    factors = checked(dict[str, float], content, place)
    with errors_at(place):
        return Gains(factors)


def _earlier(written: Any, name: str, place: str) -> Gesture:
    """A nod or a raise of the brows of an earlier file."""
    with errors_at(place):
        return Gesture(written.time, name, written.size)


def _spans_of(written: StyleSpan, place: str) -> list[StyleSpan]:
    """A span of several features as one of each."""
    with errors_at(place):
        every = expand_feature(written.feature)
        return [StyleSpan(feature, written.style, written.start, written.end) for feature in every]


def _parse_styles(content: Any, place: str) -> Mapping[str, str]:
    named = checked(dict[str, str], content, place) if isinstance(content, dict) else {}
    base = named.pop(ALL_FEATURES, None)
    with errors_at(place):
        if isinstance(content, str):
            return parse_style(content)
        if not isinstance(content, dict):
            raise InputError(f"give a name, or a style for each feature, not {format_value(content)}")
        return (dict.fromkeys(FEATURES, base) if base else {}) | {check_feature(name): named[name] for name in named}
