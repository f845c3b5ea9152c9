"""Typed access to the objects of a glTF file's JSON, which may hold anything."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from lexicon.errors import DataError, Tts2faceError
from lexicon.values.checks import Check, Place, check_that, flag, is_object, whole

# JavaScript writes no larger whole number exactly
MAX_INTEGER = 2**53
MAX_NUMBER = 1e12


class _Missing:
    def __repr__(self) -> str:
        return "missing"


MISSING = _Missing()  # a field that an object does not have


class _GltfPlace(Place):
    __slots__ = ()

    def show(self, value: Any) -> str:
        return repr(value)[:40]


@dataclass(frozen=True, slots=True)
class Fields:
    """Object of a JSON file; each method returns a field of one type, or raises `DataError` with its place.

    Parameters
    ----------
    content
        The object.
    place
        File and path of the object, as ``head.glb: nodes[3]``.
    """

    content: Mapping[str, Any]
    place: str

    def has(self, key: str) -> bool:
        """Whether the object has the field."""
        return key in self.content

    def integer(self, key: str, default: Any = MISSING, *, low: int = 0, high: int = MAX_INTEGER) -> int:
        """Integer within [low, high]."""
        return int(self._value(key, whole(low, high, "an integer from {} to {}"), default))

    def index(self, key: str, size: int, what: str) -> int | None:
        """Index into a list of `size` entries; None if the field is missing."""
        if key not in self.content:
            return None
        return int(self._value(key, whole(0, size - 1, f"the index of one of {size} {what}")))

    def indices(self, key: str, size: int, what: str) -> list[int]:
        """List of indices into a list of `size` entries; empty if the field is missing."""
        return self._values(
            key, lambda value: type(value) is int and 0 <= value < size, f"a list of indices of {size} {what}"
        )

    def number(self, key: str, default: float) -> float:
        """Finite number."""
        return float(self._value(key, check_that(_is_number, "a number"), default))

    def numbers(self, key: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...] | None:
        """Tuple of `count` finite numbers, or the default if the field is missing."""
        if key not in self.content:
            return default
        return tuple(map(float, self._values(key, _is_number, f"{count} numbers", count)))

    def text(self, key: str, default: str = "") -> str:
        """Text."""
        return str(self._value(key, check_that(_is_text, "a text"), default))

    def texts(self, key: str) -> list[str]:
        """List of texts; empty if the field is missing."""
        return self._values(key, _is_text, "a list of texts")

    def flag(self, key: str) -> bool:
        """Truth value; False if the field is missing."""
        return bool(self._value(key, flag, False))

    def child(self, key: str) -> "Fields":
        """Object; an empty one if the field is missing."""
        return Fields(self._value(key, is_object, {}), f"{self.place}.{key}")

    def children(self, key: str) -> "list[Fields]":
        """List of objects; empty if the field is missing."""
        values = self._values(key, lambda value: isinstance(value, dict), "a list of objects")
        return [Fields(value, f"{self.place}.{key}[{number}]") for number, value in enumerate(values)]

    def extension(self, name: str) -> "Fields | None":
        """Object of an extension; None if the object does not use it."""
        extensions = self.child("extensions")
        return extensions.child(name) if extensions.has(name) else None

    def wrong(self, key: str, expected: str, value: object) -> Tts2faceError:
        """Error for a field of another type or value."""
        return self._place(key).wrong(expected, value)

    def _place(self, key: str) -> Place:
        return _GltfPlace(key, f"{self.place}: ", DataError, "; export the character again")

    def _value(self, key: str, check: Check, default: Any = MISSING) -> Any:
        return check(self.content.get(key, default), self._place(key))

    def _values(self, key: str, is_right: Callable[[Any], bool], expected: str, count: int | None = None) -> list[Any]:
        """List of values that all satisfy a condition; empty if the field is missing."""

        def are_right(values: Any) -> bool:
            return isinstance(values, list) and count in (None, len(values)) and all(map(is_right, values))

        return list(self._value(key, check_that(are_right, expected), []))


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= MAX_NUMBER


def _is_text(value: Any) -> bool:
    return isinstance(value, str)
