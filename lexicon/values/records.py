"""Records from the contents of JSON and TOML files: standard dataclasses, which pydantic checks.

Types are strict, unknown names are refused, and fields without a default are required; the first error becomes one
sentence. A list of fixed length says its form: ``Annotated[tuple[float, float], "[x, y] in pixels"]``.
"""

import json
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache
from types import GenericAlias, MappingProxyType, NoneType
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, cast, get_args, get_origin, get_type_hints

from lexicon.errors import DataError, InputError, Tts2faceError
from lexicon.values.checks import EXPECTED, format_value

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from pydantic_core import ErrorDetails

T = TypeVar("T")
Place = Sequence[int | str]  # in a content: indices of lists and names
_TYPES: Mapping[str, type] = MappingProxyType({  # that errors of pydantic name
    "float_type": float, "finite_number": float, "int_type": int, "string_type": str, "bool_type": bool,
    "list_type": list, "tuple_type": list, "frozen_set_type": list, "dict_type": dict, "dataclass_type": dict,
})  # fmt: skip


def checked(kind: type[T], content: Any, where: str, error: type[Tts2faceError] = DataError) -> T:
    """Value of a type, such as a dataclass, from parsed JSON or TOML; lists become tuples and sets.

    Raises
    ------
    DataError, or `error`
        A name is unknown or missing, a value has another type or is out of range, or a constructor refuses it; the
        message begins with `where` and the place in the content.
    """
    from pydantic import ValidationError

    try:
        (found,) = _adapter(cast(Hashable, kind)).validate_json(json.dumps([content], default=_foreign))
    except ValidationError as wrong:
        raise error(where + _sentence(wrong.errors(include_url=False)[0], kind)) from wrong
    return cast(T, found)


@contextmanager
def errors_at(place: str) -> Iterator[None]:
    """Say of errors in a content where it has them; a wrong value is one of the file."""
    try:
        yield
    except (InputError, DataError) as wrong:
        raise DataError(f"{place}: {wrong}") from wrong


@cache
def _adapter(kind: Hashable) -> "TypeAdapter[Any]":
    from pydantic import ConfigDict, TypeAdapter

    alone: Any = GenericAlias(list, (kind,))  # a dataclass itself takes no settings
    return TypeAdapter(alone, config=ConfigDict(strict=True, extra="forbid", allow_inf_nan=False))


def _foreign(value: Any) -> Any:
    """What stands for a value that JSON does not have, such as a date of TOML: of no type that is expected."""
    return {type(value).__name__: str(value)}


def _sentence(error: "ErrorDetails", kind: Any) -> str:
    """Error after its place: ``, spans[2]: start must be a number, not "x"``."""
    place: Place = error["loc"][1:]
    if error["type"] in {"value_error", "json_invalid"}:  # of a constructor, or half a surrogate pair
        return f"{_path(place)}: {error['ctx']['error']}"
    expected = EXPECTED.get(_TYPES.get(error["type"], object), error["msg"].removeprefix("Input should be "))
    is_short = error["type"] == "missing" and isinstance(place[-1], int)
    if is_short or error["type"] == "too_long":
        place = place[:-1] if is_short else place
        expected = _type_at(kind, place).__metadata__[0]
    at = max((number for number, part in enumerate(place) if isinstance(part, str)), default=len(place))
    name, begin = _path(place[at:]).removeprefix(", "), f"{_path(place[:at])}: "
    if error["type"] == "unexpected_keyword_argument":
        known = ", ".join(one.name for one in fields(_type_at(kind, place[:at])))
        return f"{begin}there is no {name!r} here; choose {known}"
    if error["type"] == "missing" and not is_short:
        return f"{begin}{name} is missing"
    return f"{begin}{name + ' must be' if name else 'give'} {expected}, not {format_value(error['input'])}"


def _path(place: Place) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f", {part}" for part in place)


def _type_at(kind: Any, place: Place) -> Any:
    """Type of a place in a content of a type; of an optional one, that without None."""
    for part in place:
        bare = get_args(kind)[0] if get_origin(kind) is Annotated else kind
        hints = get_type_hints(bare, include_extras=True) if is_dataclass(bare) else {}
        kind = hints[str(part)] if hints else get_args(bare)[-isinstance(part, str)]
        kind = get_args(kind)[0] if NoneType in get_args(kind) else kind
    return kind
