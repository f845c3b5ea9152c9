"""Coding of occlusion bits in model files: deflated."""

import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError

Bits = NDArray[np.uint8]
LEVEL = 9  # of zlib; planes of one bit for each direction take a third more
MAX_OCCLUSION_BYTES = 128  # of one vertex: 1,024 directions


def encode_occlusion(bits: Bits) -> Bits:
    """Bytes (N,) of occlusion (P, V, D / 8)."""
    return np.frombuffer(zlib.compress(np.ascontiguousarray(bits).tobytes(), LEVEL), np.uint8)


def decode_occlusion(content: NDArray[Any], shape: tuple[int, int, int], path: Path) -> Bits:
    """Occlusion (P, V, D / 8) of a given shape.

    Raises
    ------
    DataError
        The bytes are damaged or of another size.
    """
    size = shape[0] * shape[1] * shape[2]
    try:
        bits = zlib.decompressobj().decompress(content.tobytes(), size + 1)
    except zlib.error as error:
        raise DataError(f"{path}: the occlusion cannot be inflated ({error}); build or copy the file again") from error
    if not size or len(bits) != size:
        raise DataError(
            f"{path}: the occlusion is not of {shape[1]} vertices with {shape[2]} bytes; build or copy the file again"
        )
    return np.frombuffer(bits, np.uint8).reshape(shape)
