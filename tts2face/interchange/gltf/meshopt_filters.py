"""Filters of EXT_meshopt_compression and KHR_meshopt_compression: how the numbers of a decoded stream are to be read.

Source: the Khronos glTF extensions of these names, appendix B.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray

Bytes = NDArray[np.uint8]
NO_FILTER = "NONE"
OF_FOUR: Mapping[int, tuple[Any, Any]] = {
    4: (np.uint8, np.int8),
    8: (np.uint16, np.int16),
}  # types of four numbers, by their bytes together


def apply_filter(content: Bytes, name: str, stride: int) -> Bytes:
    """Bytes of the elements, of `stride` bytes each, that the bytes of a decoded stream stand for."""
    if name == NO_FILTER:
        return content
    sizes, read = _FILTERS.get(name, ((), _exponential))
    if stride not in sizes:
        raise DataError(f"a meshopt stream has the filter {name!r:.20} of elements of {stride} bytes; export it again")
    return np.frombuffer(read(content, stride).tobytes(), np.uint8)


def _exponential(content: Bytes, _: int) -> NDArray[Any]:
    """Floats of 32 bits that pairs of exponent (8 bits) and mantissa (24 bits) stand for."""
    packed = np.frombuffer(content.tobytes(), np.int32)
    values: FloatArray = np.ldexp(((packed << 8) >> 8).astype(np.float64), packed >> 24)
    return values.astype(np.float32)


def _octahedral(content: Bytes, stride: int) -> NDArray[Any]:
    """Unit vectors (n, 4) of signed integers, of two sides of an octahedron over the third; the fourth is kept."""
    kind = OF_FOUR[stride][1]
    packed = np.frombuffer(content.tobytes(), kind).reshape(-1, 4)
    sides = packed[:, :2] / np.maximum(packed[:, 2:3].astype(np.float64), 1.0)
    up = 1.0 - np.abs(sides).sum(axis=1, keepdims=True)
    # the lower half is folded outwards
    sides -= np.copysign(np.maximum(-up, 0.0), sides)
    vectors = np.hstack([sides, up])
    vectors *= np.iinfo(kind).max / np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.column_stack([np.rint(vectors).astype(kind), packed[:, 3]])


def _quaternion(content: Bytes, _: int) -> NDArray[Any]:
    """Unit quaternions (n, 4) of their three smaller values; two bits of the fourth say which one is left out."""
    packed = np.frombuffer(content.tobytes(), np.int16).reshape(-1, 4).astype(np.int64)
    largest, unit = packed[:, 3] & 3, packed[:, 3] | 3
    smaller = packed[:, :3] / (np.sqrt(2.0) * unit[:, None])
    left_out = np.sqrt(np.maximum(1.0 - (smaller**2).sum(axis=1), 0.0))
    places = (largest[:, None] + [1, 2, 3, 0]) % 4
    turned = np.zeros(packed.shape)
    turned[np.arange(len(turned))[:, None], places] = np.column_stack([smaller, left_out])
    return np.rint(turned * np.iinfo(np.int16).max).astype(np.int16)


def _color(content: Bytes, stride: int) -> NDArray[Any]:
    """Red, green, blue and alpha, of 8 or 16 bits, that luma and two differences of colours stand for.

    The highest bit of the fourth value says how many bits all have, and the others are alpha without its lowest bit.
    """
    unsigned, signed = OF_FOUR[stride]
    packed = np.frombuffer(content.tobytes(), unsigned).reshape(-1, 4)
    orange, green = np.frombuffer(content.tobytes(), signed).reshape(-1, 4)[:, 1:3].astype(np.float64).T
    luma, stated = packed[:, 0].astype(np.float64), packed[:, 3].astype(np.int64)
    n_bits = np.frexp(np.maximum(stated, 1).astype(np.float64))[1]
    full = (1 << n_bits.astype(np.int64)) - 1
    alpha = stated & (full >> 1)
    alpha = (alpha << 1) | (alpha & 1)
    colours = np.column_stack([luma + orange - green, luma + green, luma - orange - green, alpha])
    scaled = np.rint(colours * (np.iinfo(unsigned).max / full)[:, None])
    clipped: FloatArray = np.clip(scaled, 0, np.iinfo(unsigned).max)
    return clipped.astype(unsigned)


_FILTERS: Mapping[str, tuple[Any, Callable[[Bytes, int], NDArray[Any]]]] = {
    "EXPONENTIAL": (range(4, 257, 4), _exponential),
    "OCTAHEDRAL": ((4, 8), _octahedral),
    "QUATERNION": ((8,), _quaternion),
    "COLOR": ((4, 8), _color),
}
