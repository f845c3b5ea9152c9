"""Coding of occlusion bits in model files: deflated."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.storage.deflated import deflate, inflate

Bits = NDArray[np.uint8]
MAX_OCCLUSION_BYTES = 128  # of one vertex: 1,024 directions; planes of one bit for each direction take a third more


def encode_occlusion(bits: Bits) -> Bits:
    """Bytes (N,) of occlusion (P, V, D / 8)."""
    return deflate(np.ascontiguousarray(bits).tobytes())


def decode_occlusion(content: NDArray[Any], shape: tuple[int, int, int], path: Path) -> Bits:
    """Occlusion (P, V, D / 8) of a given shape.

    Raises
    ------
    DataError
        The bytes are damaged or of another size.
    """
    return np.frombuffer(inflate(content, math.prod(shape), "occlusion", path), np.uint8).reshape(shape)
