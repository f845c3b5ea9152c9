"""Checks of the fields of options: dataclasses, whose annotations say the types."""

import math
import operator
import sys
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from itertools import repeat
from numbers import Integral, Real
from pathlib import Path
from types import MappingProxyType, UnionType
from typing import Annotated, Any, get_args, get_origin

from lexicon.errors import InputError
from lexicon.values.checks import EXPECTED, check_type, format_value, is_number

_PLAIN: Mapping[Any, Callable[[Any], bool]] = MappingProxyType(
    {str: lambda _: True, float: math.isfinite, int: lambda value: value.bit_length() < sys.float_info.max_exp}
)
_NUMBERS: Mapping[Any, Any] = MappingProxyType({int: Integral, float: Real})  # also those of numpy and fractions


def check_fields(options: Any) -> None:
    """Refuse options, a dataclass, whose values are not of the types of its fields.

    Texts and paths become each other, and lists tuples or sets. A value that equals the default is not checked: it may
    be infinite.

    Raises
    ------
    InputError
        A value has another type, is no finite number, or is a path with the character U+0000.
    """
    for name, kind, default in _fields_of(options.__class__):
        value = getattr(options, name)
        if type(value) is type(default) and value == default:
            continue
        found = _convert(name, value, kind)
        if found is not value:
            object.__setattr__(options, name, found)


@cache
def _fields_of(options: type) -> tuple[tuple[str, Any, Any], ...]:
    """Name, annotation and default of each field of a dataclass."""
    return tuple((one.name, one.type, one.default) for one in fields(options))


def _convert(name: str, value: Any, kind: Any) -> Any:
    """A value of the type of an annotation, itself where nothing is converted; errors as `check_fields`."""
    if type(value) is kind and kind in _PLAIN and _PLAIN[kind](value):  # of curves and words, of which there are many
        return value
    origin, inner = _parts(kind)
    if origin is UnionType and value is None:
        return None
    if origin in (UnionType, Annotated):  # X | None
        return _convert(name, value, inner[0])
    if origin in (tuple, frozenset):
        return _convert_list(name, value, origin, inner)
    if origin is Mapping and isinstance(value, Mapping):
        found = {_convert(f"each name of {name}", key, inner[0]): one for key, one in value.items()}
        found = {key: _convert(f"{key} of {name}", one, inner[1]) for key, one in found.items()}
        return value if all(found.get(key) is one for key, one in value.items()) else found
    return _convert_single(name, value, origin or kind)


def _convert_single(name: str, value: Any, kind: Any) -> Any:
    if kind in (str, Path) and isinstance(value, str | Path):
        if kind is Path and "\0" in str(value):
            raise InputError(f"{name} is a path with the character U+0000, {format_value(value)}; remove it")
        return kind(value)
    if kind in _NUMBERS:
        is_right = isinstance(value, _NUMBERS[kind]) and is_number(value)
    else:
        is_right = kind is Any or (kind not in EXPECTED and isinstance(value, kind))
    return value if is_right else check_type(name, value, kind)


def _convert_list(name: str, value: Any, kind: Any, inner: tuple[Any, ...]) -> Any:
    """A tuple or set of values of one type, or a tuple of one type for each of its values."""
    if not isinstance(value, list | kind):
        raise InputError(f"{name} must be {EXPECTED[list]}, not {format_value(value)}")
    is_fixed, each = kind is tuple and inner[-1] is not Ellipsis, f"each value of {name}"
    if is_fixed and len(value) != len(inner):
        raise InputError(f"{name} must be a list of {len(inner)} values, not of {len(value)}")
    kinds = inner if is_fixed else repeat(inner[0])
    found = [_convert(each, one, of) for one, of in zip(value, kinds, strict=False)]
    is_same = isinstance(value, kind) and all(map(operator.is_, value, found))
    return value if is_same else kind(found)


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    """Origin and arguments of an annotation."""
    return get_origin(kind), get_args(kind)
