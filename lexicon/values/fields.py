"""Checks of the fields of options: dataclasses, whose annotations say the types."""

import math
import operator
import sys
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from itertools import repeat
from numbers import Integral, Real
from pathlib import Path
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin

from lexicon.values.checks import EXPECTED, Check, Place, is_number, typed

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
    for place, check, default in _fields_of(options.__class__):
        value = getattr(options, place.name)
        if type(value) is type(default) and value == default:
            continue
        found = check(value, place)
        if found is not value:
            object.__setattr__(options, place.name, found)


@cache
def _fields_of(options: type) -> tuple[tuple[Place, Check, Any], ...]:
    """Place, check and default of each field of a dataclass."""
    return tuple((Place(option.name), _check_of(option.type), option.default) for option in fields(options))


def _check_of(kind: Any) -> Check:
    """Check for values of the type of an annotation; returns the value itself where nothing is converted."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _check_of(inner[0])
    if origin is UnionType:  # X | None, or several records
        first = _check_of(inner[0])
        others = tuple(kind for kind in inner if isinstance(kind, type) and (kind is NoneType or is_dataclass(kind)))
        return lambda value, place: value if isinstance(value, others) else first(value, place)
    if origin in (tuple, frozenset):
        return _check_of_list(origin, inner)
    if origin is Mapping:
        return _check_of_mapping(*map(_check_of, inner))
    return _check_of_single(origin or kind)


def _check_of_single(kind: Any) -> Check:
    is_plain, numbers = _PLAIN.get(kind), _NUMBERS.get(kind, ())

    def check(value: Any, place: Place) -> Any:
        if is_plain and type(value) is kind and is_plain(value):  # of curves and words, of which there are many
            return value
        if kind in (str, Path) and isinstance(value, str | Path):
            if kind is Path and "\0" in str(value):
                raise place.refusal(f"is a path with the character U+0000, {place.show(value)}; remove it")
            return kind(value)
        if numbers:
            is_right = isinstance(value, numbers) and is_number(value)
        else:
            is_right = kind is Any or (kind not in EXPECTED and isinstance(value, kind))
        return value if is_right else typed(kind)(value, place)

    return check


def _check_of_list(kind: Any, inner: tuple[Any, ...]) -> Check:
    """Check for a tuple or set of values of one type, or a tuple of one type for each of its values."""
    is_fixed = kind is tuple and inner[-1] is not Ellipsis
    checks = [_check_of(each) for each in inner if each is not Ellipsis]

    def check(value: Any, place: Place) -> Any:
        if not isinstance(value, list | kind):
            raise place.wrong(EXPECTED[list], value)
        if is_fixed and len(value) != len(inner):
            raise place.refusal(f"must be a list of {len(inner)} values, not of {len(value)}")
        each = place.item(0)
        pairs = zip(value, checks if is_fixed else repeat(checks[0]), strict=False)
        found = [check_item(item, each) for item, check_item in pairs]
        is_same = isinstance(value, kind) and all(map(operator.is_, value, found))
        return value if is_same else kind(found)

    return check


def _check_of_mapping(check_name: Check, check_value: Check) -> Check:
    def check(value: Any, place: Place) -> Any:
        if not isinstance(value, Mapping):
            raise place.wrong(EXPECTED[Mapping], value)
        each = Place(f"each name of {place.name}")
        found = {check_name(key, each): item for key, item in value.items()}
        found = {key: check_value(item, place.item(key)) for key, item in found.items()}
        return value if all(found.get(key) is item for key, item in value.items()) else found

    return check
