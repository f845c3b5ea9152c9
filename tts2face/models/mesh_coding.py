"""Texture coordinates and tangents of meshes in files: whole numbers of 16 and of 8 bits."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

UV_STEPS = 65535
PLACE_STEP = 6e-6  # of the extent of a mesh, 0.002 mm of a head
TANGENT_STEPS = 127


def round_places(vertices: NDArray[np.floating]) -> NDArray[np.float32]:
    """Vertices (V, 3) in steps of a power of two, whose last bits can be packed; those at one place stay there."""
    step = 2.0 ** np.floor(np.log2(max(float(np.ptp(vertices, axis=0).max()), 1e-6) * PLACE_STEP))
    rounded: NDArray[np.float32] = (np.rint(vertices / step) * step).astype(np.float32)
    return rounded


def encode_uv(uv: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Texture coordinates (V, 2); those outside 0 to 1 are cut there."""
    return np.rint(np.clip(uv, 0, 1) * UV_STEPS).astype(np.uint16)


def decode_uv(content: NDArray[Any]) -> NDArray[np.float32]:
    """Texture coordinates (V, 2), the inverse of `encode_uv` but for rounding."""
    return (content / UV_STEPS).astype(np.float32)


def encode_tangents(tangents: NDArray[np.float32]) -> NDArray[np.int8]:
    """Unit vectors (V, 3)."""
    return np.rint(tangents * TANGENT_STEPS).astype(np.int8)


def decode_tangents(content: NDArray[Any]) -> NDArray[np.float32]:
    """Unit vectors (V, 3), the inverse of `encode_tangents` but for rounding."""
    return (content / TANGENT_STEPS).astype(np.float32)
