"""Errors of weights of basis expressions."""

import numpy as np
from numpy.typing import NDArray


def approximation_error(
    displacements: NDArray[np.floating], basis: NDArray[np.floating], weights: NDArray[np.floating]
) -> NDArray[np.float64]:
    """(T,) root mean square over landmarks, in mm, of the residual of displacements (T, L, 3) for weights (T, B)."""
    residual = np.asarray(displacements, np.float64) - np.tensordot(weights, np.asarray(basis, np.float64), axes=1)
    error: NDArray[np.float64] = np.sqrt(np.square(residual).sum(axis=-1).mean(axis=-1))
    return error
