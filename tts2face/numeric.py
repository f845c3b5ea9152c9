"""Numerical functions shared by several packages."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
AnyFloat = TypeVar("AnyFloat", np.float32, np.float64)


def ordered_product(a: NDArray[np.floating], b: NDArray[np.floating]) -> FloatArray:
    """Matrix product whose result is bit-identical for any number of threads, unlike that of a threaded BLAS."""
    summed: FloatArray = np.einsum("...k,kj->...j" if b.ndim > 1 else "...k,k->...", a, b)
    return summed


def smoothstep(share: NDArray[AnyFloat]) -> NDArray[AnyFloat]:
    """``3 s^2 - 2 s^3``: from 0 to 1 with zero slope at both ends, for shares in [0, 1]."""
    curve: NDArray[AnyFloat] = share * share * (3.0 - 2.0 * share)
    return curve


def nearest_rotation(matrix: NDArray[np.floating]) -> FloatArray:
    """The rotation (3, 3) nearest to a matrix (3, 3) in least squares; never a reflection (Kabsch 1976)."""
    left, _, right = np.linalg.svd(matrix)
    signs = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation: FloatArray = left @ signs @ right
    return rotation
