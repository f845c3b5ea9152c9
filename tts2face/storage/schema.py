"""What a model file must hold, as tables: type, shape and range of each array, and types of its metadata.

Every check raises DataError with the file, what is wrong, which value, and what to do. A named dimension has one size
in the whole file; it is at least 1 unless the array may be empty.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError

MOST_MM = 1e4  # of any coordinate: a head of 10 m is in another unit
MOST_TEXT = 100_000  # characters of one text in the metadata
MOST_DEPTH = 16  # levels of lists and objects in metadata whose form is free
SHOWN = 60  # characters of a value in an error
Check = Callable[[Any, str], None]  # raises DataError where a value, at a named place, is not what it must be


@dataclass(frozen=True, slots=True)
class Tensor:
    """What an array must be.

    Parameters
    ----------
    dtype
        NumPy's name of the type of its numbers, such as ``float32``.
    shape
        Sizes, or names of sizes.
    low, high
        Least and greatest number; no check of the range of integers without them. Numbers are always finite.
    may_be_empty, is_optional
        Whether dimensions may be 0, and whether the array may be absent.
    may_be_nan
        Whether NaN stands for an unknown value.
    """

    dtype: str
    shape: tuple[int | str, ...]
    low: float | None = None
    high: float | None = None
    may_be_empty: bool = False
    is_optional: bool = False
    may_be_nan: bool = False


def millimetres(*shape: int | str, dtype: str = "float32", most: float = MOST_MM) -> Tensor:
    """Lengths of either sign."""
    return Tensor(dtype, shape, -most, most)


@dataclass(slots=True)
class Contents:
    """Arrays and metadata of a file while they are checked; ``sizes`` are the named dimensions seen so far."""

    path: Path
    kind: str
    arrays: Mapping[str, NDArray[Any]]
    header: Mapping[str, Any]
    sizes: dict[str, int] = field(default_factory=dict)
    known: set[str] = field(default_factory=set)

    def fail(self, what: str) -> NoReturn:
        """Refuse the file."""
        refuse(f"{self.path}: {what}", self.kind)

    def require(self, holds: bool, what: str) -> None:
        """Refuse the file unless a condition holds."""
        if not holds:
            self.fail(what)

    def tensors(self, specs: Mapping[str, Tensor]) -> None:
        """Check arrays by name."""
        for name, spec in specs.items():
            self.known.add(name)
            if name in self.arrays:
                self._tensor(name, spec)
            elif not spec.is_optional:
                self.fail(f"lacks the array {name}")

    def metadata(self, specs: Mapping[str, Check]) -> None:
        """Check keys of the metadata, all of them required; others must be JSON of limited depth."""
        where = f"{self.path}: metadata"
        record(specs)({key: self.header[key] for key in specs if key in self.header}, where)
        for key in self.header.keys() - specs.keys():
            anything(self.header[key], f"{where}: {_shown(key)}")

    def only_known(self) -> None:
        """Refuse arrays that no table names."""
        unknown = sorted(self.arrays.keys() - self.known)
        if unknown:
            self.fail(f"holds the array {_shown(unknown[0])}, which no {self.kind} has")

    def indices(self, name: str, n: int, of_what: str) -> None:
        """Check that an array's numbers are indices of n things."""
        values = self.arrays[name]
        if values.size and not 0 <= int(values.min()) <= int(values.max()) < n:
            wrong = values.min() if values.min() < 0 else values.max()
            self.fail(f"{name} holds {wrong}, beyond its {n} {of_what}")

    def sums_to(self, name: str, n: int, what: str) -> None:
        """Check that counts, each at least 1, add up to a number."""
        values = self.arrays[name]
        self.require(int(values.min(initial=1)) >= 1, f"{name} holds {values.min(initial=1)}; every count is above 0")
        total = int(values.sum(dtype=np.int64))
        self.require(total == n, f"{name} adds up to {total}, but there are {n} {what}")

    def distinct(self, name: str) -> None:
        """Check that no number of an array occurs twice."""
        values = self.arrays[name]
        self.require(len(np.unique(values)) == values.size, f"{name} holds a number twice")

    def orthonormal(self, name: str) -> None:
        """Check that the rows (k, ...) of an array are orthonormal, to 1 %."""
        rows = self.arrays[name].astype(np.float32).reshape(len(self.arrays[name]), -1)
        away = float(np.abs(rows @ rows.T - np.eye(len(rows), dtype=np.float32)).max())
        self.require(away < 0.01, f"{name} is not orthonormal: products of its rows are off by {away:.3g}")

    def _tensor(self, name: str, spec: Tensor) -> None:
        array = self.arrays[name]
        if array.dtype.name != spec.dtype:
            self.fail(f"{name} is {array.dtype.name}, not {spec.dtype}")
        wanted = tuple(self.sizes.get(size, size) if isinstance(size, str) else size for size in spec.shape)
        fits = array.ndim == len(wanted) and all(
            isinstance(size, str) or size == n for size, n in zip(wanted, array.shape, strict=True)
        )
        if not fits:
            self.fail(f"{name} has the shape {array.shape}, not ({', '.join(map(str, wanted))})")
        if not spec.may_be_empty and 0 in array.shape:
            self.fail(f"{name} is empty")
        self.sizes |= {size: n for size, n in zip(wanted, array.shape, strict=True) if isinstance(size, str)}
        if array.size and (spec.low is not None or array.dtype.kind == "f"):
            self._range(name, array, spec)

    def _range(self, name: str, array: NDArray[Any], spec: Tensor) -> None:
        if spec.may_be_nan:
            array = array[~np.isnan(array)]
        low, high = (array.min(), array.max()) if array.size else (np.float32(0), np.float32(0))
        if not (np.isfinite(low) and np.isfinite(high)):
            self.fail(f"{name} holds {low if not np.isfinite(low) else high}; its numbers must be finite")
        for bound, value, is_low in ((spec.low, low, True), (spec.high, high, False)):
            if bound is not None and (value < bound if is_low else value > bound):
                self.fail(f"{name} holds {value}; its {'least' if is_low else 'greatest'} number is {bound:g}")


def text(value: Any, where: str) -> None:
    """Check a text."""
    if type(value) is not str or len(value) > MOST_TEXT:
        refuse(f"{where} is {_shown(value)}, not a text of at most {MOST_TEXT} characters")


def flag(value: Any, where: str) -> None:
    """Check a truth value."""
    if type(value) is not bool:
        refuse(f"{where} is {_shown(value)}, not true or false")


def whole(low: int, high: int) -> Check:
    """Check of a whole number."""

    def check(value: Any, where: str) -> None:
        if type(value) is not int or not low <= value <= high:
            refuse(f"{where} is {_shown(value)}, not a whole number from {low} to {high}")

    return check


def number(low: float, high: float) -> Check:
    """Check of a number."""

    def check(value: Any, where: str) -> None:
        if type(value) not in (int, float) or not low <= value <= high:
            refuse(f"{where} is {_shown(value)}, not a number from {low:g} to {high:g}")

    return check


def listed(item: Check, length: int | None = None) -> Check:
    """Check of a list, and of each of its items."""

    def check(value: Any, where: str) -> None:
        if type(value) is not list or length not in (None, len(value)):
            refuse(f"{where} is {_shown(value)}, not a list{'' if length is None else f' of {length}'}")
        for at, one in enumerate(value):
            item(one, f"{where}[{at}]")

    return check


def row(*items: Check) -> Check:
    """Check of a list whose items differ in kind."""

    def check(value: Any, where: str) -> None:
        if type(value) is not list or len(value) != len(items):
            refuse(f"{where} is {_shown(value)}, not a list of {len(items)}")
        for at, (item, one) in enumerate(zip(items, value, strict=True)):
            item(one, f"{where}[{at}]")

    return check


def record(fields: Mapping[str, Check], optional: Mapping[str, Check] | None = None) -> Check:
    """Check of an object with these keys and no others."""
    every = {**fields, **(optional or {})}

    def check(value: Any, where: str) -> None:
        if type(value) is not dict:
            refuse(f"{where} is {_shown(value)}, not an object")
        for key in fields.keys() - value.keys():
            refuse(f"{where} lacks {key}")
        for key, one in value.items():
            if key not in every:
                refuse(f"{where} holds {_shown(key)}, which is not one of {', '.join(every)}")
            every[key](one, f"{where}: {key}")

    return check


def table(item: Check) -> Check:
    """Check of an object with any keys, and of each of its values."""

    def check(value: Any, where: str) -> None:
        if type(value) is not dict:
            refuse(f"{where} is {_shown(value)}, not an object")
        for key, one in value.items():
            item(one, f"{where}: {_shown(key)}")

    return check


def anything(value: Any, where: str, depth: int = MOST_DEPTH) -> None:
    """Check JSON of any form: its depth, and the length of its texts."""
    if type(value) is str:
        text(value, where)
    if depth == 0 and isinstance(value, list | dict):
        refuse(f"{where} is nested deeper than {MOST_DEPTH} levels")
    for one in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        anything(one, where, depth - 1)


def free(value: Any, where: str) -> None:
    """Check an object of any keys."""
    table(anything)(value, where)


def refuse(what: str, kind: str = "file") -> NoReturn:
    """Refuse a file.

    Raises
    ------
    DataError
        Always.
    """
    raise DataError(f"{what}; build or copy the {kind} again")


def _shown(value: Any) -> str:
    if isinstance(value, list | dict):
        return f"a {'list' if isinstance(value, list) else 'n object'} of {len(value)}".replace("a n ", "an ")
    if isinstance(value, int) and value.bit_length() > 200:
        return "a number of more than 60 digits"
    written = repr(value[: SHOWN + 1] if isinstance(value, str) else value)
    return written if len(written) <= SHOWN else written[:SHOWN] + "..."
