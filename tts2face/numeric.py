"""Numerical building blocks that several rooms share."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def ordered_product(a: NDArray[np.floating], b: NDArray[np.floating]) -> FloatArray:
    """Matrix product whose bits do not depend on the number of threads, as those of a threaded BLAS do."""
    summed: FloatArray = np.einsum("...k,kj->...j" if b.ndim > 1 else "...k,k->...", a, b)
    return summed
