"""Arrays of meshes as files hold them: texture coordinates and tangents in whole numbers, deflated occlusion."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.codec import Stored
from tts2face.storage.deflated import deflate, inflate
from tts2face.storage.schema import Tensor

Bits = NDArray[np.uint8]
MAX_OCCLUSION_BYTES = 128  # of one vertex: 1,024 directions; planes of one bit for each direction take a third more
# of 16 bits: a sixteenth of a texel of 4096
UV_STEPS = 65535
PLACE_STEP = 6e-6  # of the extent of a mesh, 0.002 mm of a head
# of 8 bits: half a degree
TANGENT_STEPS = 127


def encode_occlusion(bits: Bits) -> Bits:
    """Bytes (N,) of occlusion (P, V, D / 8)."""
    return deflate(np.ascontiguousarray(bits).tobytes())


def decode_occlusion(content: NDArray[Any], shape: tuple[int, int, int], path: Path) -> Bits:
    """Occlusion (P, V, D / 8) of a given shape."""
    return np.frombuffer(inflate(content, math.prod(shape), "occlusion", path), np.uint8).reshape(shape)


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


UV = Stored(Tensor("uint16", ("vertices", 2)), encode=encode_uv, decode=decode_uv)
TANGENTS = Stored(Tensor("int8", ("vertices", 3)), encode=encode_tangents, decode=decode_tangents)
