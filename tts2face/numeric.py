"""Numerical functions shared by several packages."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def ordered_product(a: NDArray[np.floating], b: NDArray[np.floating]) -> FloatArray:
    """Matrix product whose result is bit-identical for any number of threads, unlike that of a threaded BLAS."""
    summed: FloatArray = np.einsum("...k,kj->...j" if b.ndim > 1 else "...k,k->...", a, b)
    return summed
