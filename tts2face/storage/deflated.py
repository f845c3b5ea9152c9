"""Bytes that are deflated in a file, and arrays that are deflated as one.

Before that, numbers of an array that lie next to each other along one axis are replaced by their steps where it takes
fewer bytes then: steps of indices, and of places and displacements of vertices, are small. Floats count as the whole
numbers that their bits are, so that nothing is lost.
"""

import math
import zlib
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.checks import Place, choice, list_of, row, text, whole
from tts2face.storage.schema import ModelPlace, refuse

LEVEL, DRAFT_LEVEL = 9, 1  # of zlib: in files, and to choose between ways to write an array
STRATEGIES = (zlib.Z_DEFAULT_STRATEGY, zlib.Z_FILTERED)  # the second is better for pictures of small numbers
MAX_BYTES = 64_000_000  # of arrays that are deflated as one; a shipped face has 5,000,000, its light 4,000,000
MAX_AXES = 4
FIRST, LAST = 0, -1  # axis of the steps
TYPES = ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "float16", "float32", "float64")
_PLAIN = (text, choice(*TYPES), list_of(whole(0, MAX_BYTES)))


def deflate(content: bytes) -> NDArray[np.uint8]:
    """Deflated bytes (N,)."""

    def compress(strategy: int) -> bytes:
        stream = zlib.compressobj(LEVEL, strategy=strategy)
        return stream.compress(content) + stream.flush()

    with ThreadPoolExecutor(len(STRATEGIES)) as pool:  # zlib lets other threads run
        return np.frombuffer(min(pool.map(compress, STRATEGIES), key=len), np.uint8)


def inflate(content: NDArray[Any], size: int, what: str, path: Path) -> bytes:
    """So many bytes of what `deflate` returned; `what` names them in messages.

    Raises
    ------
    DataError
        The bytes are damaged or of another size.
    """
    try:
        found = zlib.decompressobj().decompress(content.tobytes(), size + 1)
    except zlib.error as error:
        raise DataError(f"{path}: the {what} cannot be inflated ({error}); build or copy the file again") from error
    # the size is checked while inflating: a small file can unpack to any number of bytes
    if not size or len(found) != size:
        raise DataError(f"{path}: the {what} is not of {size} bytes; build or copy the file again")
    return found


def pack_arrays(arrays: Mapping[str, NDArray[Any]]) -> tuple[NDArray[np.uint8], list[list[Any]]]:
    """Arrays deflated as one (N,), and for each its name, type and shape, and the axis of its steps if it has any."""
    contents, listed = [], []
    for name, array in arrays.items():
        ways: dict[tuple[int, ...], bytes] = {(): array.tobytes()}
        ways |= {(axis,): _steps(array, axis) for axis in (FIRST, LAST)}
        way = min(ways, key=lambda axes: len(zlib.compress(ways[axes], DRAFT_LEVEL)))
        contents.append(ways[way])
        listed.append([name, array.dtype.name, list(array.shape), *way])
    return deflate(b"".join(contents)), listed


def unpack_arrays(content: NDArray[Any], listed: Any, what: str, path: Path) -> dict[str, NDArray[Any]]:
    """Arrays by name, of what `pack_arrays` returned; `what` names them in messages.

    Raises
    ------
    DataError
        They are damaged, or have more bytes than `MAX_BYTES`.
    """
    where = f"{path}: metadata: {what}"
    list_of(_check_entry)(listed, ModelPlace(where))
    names = [name for name, *_ in listed]
    if len(set(names)) < len(names):
        refuse(f"{where} lists two arrays of the same name")
    sizes = [math.prod(shape) * np.dtype(kind).itemsize for _, kind, shape, *_ in listed]
    if sum(sizes) > MAX_BYTES:
        refuse(f"{where} lists arrays of {sum(sizes)} bytes, more than {MAX_BYTES}")
    raw = inflate(content, sum(sizes), what, path)
    found, at = {}, 0
    for (name, kind, shape, *way), size in zip(listed, sizes, strict=True):
        part = np.frombuffer(raw, np.uint8, size, at)
        found[name] = _sums(part, np.dtype(kind), shape, way[0]) if way else part.copy().view(kind).reshape(shape)
        at += size
    return found


def _check_entry(value: Any, place: Place) -> None:
    has_steps = isinstance(value, list) and len(value) > len(_PLAIN)
    row(*_PLAIN, *([whole(LAST, FIRST)] if has_steps else []))(value, place)
    if not 1 <= len(value[2]) <= MAX_AXES:
        refuse(f"{place.name} has {len(value[2])} axes, not 1 to {MAX_AXES}")


def _steps(array: NDArray[Any], axis: int) -> bytes:
    """Steps along an axis, the last axis of the array outermost: their first bytes, their second ones, ..."""
    numbers = array.view(f"u{array.itemsize}")
    steps = np.diff(numbers, axis=axis, prepend=numbers.dtype.type(0)).T.view(f"i{array.itemsize}")
    small = np.ascontiguousarray((steps << 1) ^ (steps >> (8 * array.itemsize - 1)))  # 0, -1, 1, -2, ... as 0, 1, 2
    return small.reshape(-1, 1).view(np.uint8).T.tobytes()


def _sums(content: NDArray[np.uint8], kind: np.dtype[Any], shape: list[int], axis: int) -> NDArray[Any]:
    """The array of what `_steps` returned."""
    unsigned = np.dtype(f"u{kind.itemsize}")
    first, *others = content.reshape(kind.itemsize, -1)
    numbers = first.astype(unsigned)
    for place, plane in enumerate(others, 1):
        if plane.any():
            # low bytes first: high ones are mostly 0, and deflate to nothing (decision 167)
            numbers |= np.left_shift(plane, 8 * place, dtype=unsigned)
    sums = ((numbers >> 1) ^ -(numbers & 1)).reshape(shape[::-1])
    np.cumsum(sums, axis=LAST - axis, out=sums)
    return np.ascontiguousarray(sums.T).view(kind)
