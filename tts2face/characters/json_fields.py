"""Typed access to the objects of a glTF file's JSON, which may hold anything."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lexicon.errors import DataError

MAX_INTEGER = 2**53
MAX_NUMBER = 1e12


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

    def integer(self, key: str, default: int | None = None, *, low: int = 0, high: int = MAX_INTEGER) -> int:
        """Integer within [low, high]."""
        value = self.content.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise self.wrong(key, f"an integer from {low} to {high}", value)
        return value

    def index(self, key: str, size: int, what: str) -> int | None:
        """Index into a list of `size` entries; None if the field is missing."""
        if key not in self.content:
            return None
        value = self.content[key]
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < size:
            raise self.wrong(key, f"the index of one of {size} {what}", value)
        return value

    def indices(self, key: str, size: int, what: str) -> list[int]:
        """List of indices into a list of `size` entries; empty if the field is missing."""
        values = self.content.get(key, [])
        if not isinstance(values, list) or not all(type(value) is int and 0 <= value < size for value in values):
            raise self.wrong(key, f"a list of indices of {size} {what}", values)
        return values

    def number(self, key: str, default: float) -> float:
        """Finite number."""
        value = self.content.get(key, default)
        if not _is_number(value):
            raise self.wrong(key, "a number", value)
        return float(value)

    def numbers(self, key: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...] | None:
        """Tuple of `count` finite numbers, or the default if the field is missing."""
        values = self.content.get(key)
        if values is None and key not in self.content:
            return default
        if not isinstance(values, list) or len(values) != count or not all(map(_is_number, values)):
            raise self.wrong(key, f"{count} numbers", values)
        return tuple(float(value) for value in values)

    def text(self, key: str, default: str = "") -> str:
        """Text."""
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.wrong(key, "a text", value)
        return value

    def texts(self, key: str) -> list[str]:
        """List of texts; empty if the field is missing."""
        values = self.content.get(key, [])
        if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
            raise self.wrong(key, "a list of texts", values)
        return values

    def flag(self, key: str) -> bool:
        """Truth value; False if the field is missing."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false", value)
        return value

    def child(self, key: str) -> "Fields":
        """Object; an empty one if the field is missing."""
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(key, "an object", value)
        return Fields(value, f"{self.place}.{key}")

    def children(self, key: str) -> "list[Fields]":
        """List of objects; empty if the field is missing."""
        values = self.content.get(key, [])
        if not isinstance(values, list) or not all(isinstance(value, dict) for value in values):
            raise self.wrong(key, "a list of objects", values)
        return [Fields(value, f"{self.place}.{key}[{number}]") for number, value in enumerate(values)]

    def extension(self, name: str) -> "Fields | None":
        """Object of an extension; None if the object does not use it."""
        extensions = self.child("extensions")
        return extensions.child(name) if extensions.has(name) else None

    def wrong(self, key: str, expected: str, value: object) -> DataError:
        """Error for a field of another type or value."""
        shown = "missing" if value is None and key not in self.content else repr(value)[:40]
        return DataError(f"{self.place}: {key} must be {expected}, not {shown}; export the character again")


def _is_number(value: object) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value) and abs(value) <= MAX_NUMBER  # type: ignore[arg-type]
