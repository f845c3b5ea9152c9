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
from lexicon.values.checks import EXPECTED, Place

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from pydantic_core import ErrorDetails

T = TypeVar("T")
Path = Sequence[int | str]  # of a value in a content: indices of lists and names
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
        raise _refusal(wrong.errors(include_url=False)[0], kind, where, error) from wrong
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
    """Stand-in of a value that JSON does not have, such as a date of TOML: of no type that is expected."""
    return {type(value).__name__: str(value)}


def _refusal(found: "ErrorDetails", kind: Any, where: str, error: type[Tts2faceError]) -> Tts2faceError:
    """Error with its place: ``clip.json, spans[2]: start must be a number, not "x"``."""
    path: Path = found["loc"][1:]
    if found["type"] in {"value_error", "json_invalid"}:  # of a constructor, or half a surrogate pair
        return error(f"{where}{_written(path)}: {found['ctx']['error']}")
    expected = EXPECTED.get(_TYPES.get(found["type"], object), found["msg"].removeprefix("Input should be "))
    is_short = found["type"] == "missing" and isinstance(path[-1], int)
    if is_short or found["type"] == "too_long":
        path = path[:-1] if is_short else path
        expected = _type_at(kind, path).__metadata__[0]
    at = max((number for number, part in enumerate(path) if isinstance(part, str)), default=len(path))
    before = f"{where}{_written(path[:at])}: "
    place = Place(_written(path[at:]).removeprefix(", ") or "give", before, error)
    if found["type"] == "unexpected_keyword_argument":
        known = ", ".join(field.name for field in fields(_type_at(kind, path[:at])))
        return error(f"{before}there is no {place.name!r} here; choose {known}")
    if found["type"] == "missing" and not is_short:
        return place.refusal("is missing")
    if not path[at:]:
        return place.refusal(f"{expected}, not {place.show(found['input'])}")
    return place.wrong(expected, found["input"])


def _written(path: Path) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f", {part}" for part in path)


def _type_at(kind: Any, path: Path) -> Any:
    """Type of a value in a content of a type; of an optional one, that without None."""
    for part in path:
        bare = get_args(kind)[0] if get_origin(kind) is Annotated else kind
        hints = get_type_hints(bare, include_extras=True) if is_dataclass(bare) else {}
        kind = hints[str(part)] if hints else get_args(bare)[-isinstance(part, str)]
        kind = get_args(kind)[0] if NoneType in get_args(kind) else kind
    return kind
