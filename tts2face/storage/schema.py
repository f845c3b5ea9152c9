"""Schema checks of model files: type, shape and range of each array, and types of the metadata.

Every check raises a DataError that names the file, the array or key, the value, and the remedy. A named dimension has
one size in the whole file; it is at least 1 unless the array may be empty.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, Tts2faceError
from lexicon.values.checks import Check, Place, anything, record

MAX_MM = 1e4  # of any coordinate; larger values indicate another unit
REMEDY = "; build or copy the {} again"
MAX_SHOWN_CHARACTERS = 60  # characters of a value in an error message


@dataclass(frozen=True, slots=True)
class Tensor:
    """Requirements of an array.

    Parameters
    ----------
    dtype
        NumPy name of the data type, such as ``float32``.
    shape
        Sizes, or names of dimensions.
    low, high
        Least and greatest value; None for no limit. Values must be finite.
    may_be_empty, is_optional
        Whether dimensions may be 0, and whether the array may be absent.
    may_be_nan
        Whether NaN is allowed for an unknown value.
    """

    dtype: str
    shape: tuple[int | str, ...]
    low: float | None = None
    high: float | None = None
    may_be_empty: bool = False
    is_optional: bool = False
    may_be_nan: bool = False


def millimetres(*shape: int | str, most: float = MAX_MM) -> Tensor:
    """Requirements of an array of lengths or coordinates, mm, of magnitude up to `most`."""
    return Tensor("float32", shape, -most, most)


class ModelPlace(Place):
    """Place of a value in the metadata of a model file: its refusals advise to build or copy the file again."""

    __slots__ = ()

    def refusal(self, what: str) -> Tts2faceError:
        """Error about the value."""
        return DataError(f"{self.name} {what}{REMEDY.format('file')}")

    def wrong(self, expected: str, value: Any) -> Tts2faceError:
        """Error about a value that is not as expected."""
        return self.refusal(f"is {self.show(value)}, not {expected}")

    def item(self, part: int | str) -> Self:
        """Place of a value of a list, or of a name in an object."""
        return type(self)(f"{self.name}[{part}]" if isinstance(part, int) else f"{self.name}: {part}")

    def show(self, value: Any) -> str:
        """A value in a refusal."""
        return _abbreviate(value)


@dataclass(slots=True)
class Contents:
    """Arrays and metadata of a file under check; ``sizes`` holds the named dimensions found so far."""

    path: Path
    kind: str
    arrays: Mapping[str, NDArray[Any]]
    header: Mapping[str, Any]
    sizes: dict[str, int] = field(default_factory=dict)
    known: set[str] = field(default_factory=set)

    def fail(self, what: str) -> NoReturn:
        """Raise a DataError about the file."""
        refuse(f"{self.path}: {what}", self.kind)

    def require(self, condition: bool, what: str) -> None:
        """Raise a DataError about the file unless a condition holds."""
        if not condition:
            self.fail(what)

    def tensors(self, specs: Mapping[str, Tensor]) -> None:
        """Check arrays by name and record their dimensions."""
        for name, spec in specs.items():
            self.known.add(name)
            if name in self.arrays:
                self._tensor(name, spec)
            elif not spec.is_optional:
                self.fail(f"lacks the array {name}")

    def metadata(self, specs: Mapping[str, Check]) -> None:
        """Check the metadata: the keys of `specs` are required; others must be JSON of limited depth."""
        place = ModelPlace(f"{self.path}: metadata")
        record(specs)({key: self.header[key] for key in specs if key in self.header}, place)
        for key in self.header.keys() - specs.keys():
            anything(self.header[key], place.item(place.show(key)))

    def only_known(self) -> None:
        """Check that there are no other arrays than those already checked."""
        unknown = sorted(self.arrays.keys() - self.known)
        if unknown:
            self.fail(f"holds the array {_abbreviate(unknown[0])}, which no {self.kind} has")

    def indices(self, name: str, n: int, of_what: str) -> None:
        """Check that the values of an array are indices in [0, n); `of_what` names the indexed items."""
        values = self.arrays[name]
        if values.size and not 0 <= int(values.min()) <= int(values.max()) < n:
            wrong = values.min() if values.min() < 0 else values.max()
            self.fail(f"{name} holds {wrong}, beyond its {n} {of_what}")

    def sums_to(self, name: str, n: int, what: str) -> None:
        """Check that counts, each at least 1, add up to n."""
        values = self.arrays[name]
        self.require(int(values.min(initial=1)) >= 1, f"{name} holds {values.min(initial=1)}; counts must be above 0")
        total = int(values.sum(dtype=np.int64))
        self.require(total == n, f"{name} adds up to {total}, but there are {n} {what}")

    def distinct(self, name: str) -> None:
        """Check that the values of an array are distinct."""
        values = self.arrays[name]
        self.require(len(np.unique(values)) == values.size, f"{name} holds a duplicate number")

    def orthonormal(self, name: str) -> None:
        """Check that the rows (k, ...) of an array are orthonormal within 1 %."""
        rows = self.arrays[name].astype(np.float32).reshape(len(self.arrays[name]), -1)
        error = float(np.abs(rows @ rows.T - np.eye(len(rows), dtype=np.float32)).max())
        self.require(error < 0.01, f"{name} is not orthonormal: products of its rows differ by {error:.3g}")

    def _tensor(self, name: str, spec: Tensor) -> None:
        array = self.arrays[name]
        if array.dtype.name != spec.dtype:
            self.fail(f"{name} is {array.dtype.name}, not {spec.dtype}")
        expected = tuple(self.sizes.get(size, size) if isinstance(size, str) else size for size in spec.shape)
        fits = array.ndim == len(expected) and all(
            isinstance(size, str) or size == n for size, n in zip(expected, array.shape, strict=True)
        )
        if not fits:
            self.fail(f"{name} has the shape {array.shape}, not ({', '.join(map(str, expected))})")
        if not spec.may_be_empty and 0 in array.shape:
            self.fail(f"{name} is empty")
        self.sizes |= {size: n for size, n in zip(expected, array.shape, strict=True) if isinstance(size, str)}
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


def refuse(what: str, kind: str = "file") -> NoReturn:
    """Raise a DataError that ends with the advice to build or copy the file again.

    Raises
    ------
    DataError
        Always.
    """
    raise DataError(what + REMEDY.format(kind))


def _abbreviate(value: Any) -> str:
    if isinstance(value, list | dict):
        return f"a {'list' if isinstance(value, list) else 'n object'} of {len(value)}".replace("a n ", "an ")
    # Python refuses to write numbers of more than 4,300 digits
    if isinstance(value, int) and value.bit_length() > 200:
        return "a number of more than 60 digits"
    shown = repr(value[: MAX_SHOWN_CHARACTERS + 1] if isinstance(value, str) else value)
    return shown if len(shown) <= MAX_SHOWN_CHARACTERS else shown[:MAX_SHOWN_CHARACTERS] + "..."
