"""Radial basis function interpolation of displacements that are known at a few points.

Theobald et al. 2007, eqs 3 and 4, after Pighin et al. 1998 and, as in the paper, without an affine term: displacements
vanish far from every centre. The face is aligned beforehand, so that only its shape difference is interpolated.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.numeric.arrays import FloatArray

DECAY_LENGTH = 64.0  # the basis function is exp(-r / 64) (eq. 4)
FACE_WIDTH = 200.0  # width of the face in the unit of `DECAY_LENGTH`: pixels in the paper
MIN_CENTRE_DISTANCE = 1e-6  # relative to the decay length; closer centres make the matrix singular
CHUNK_SIZE = 512  # points evaluated at once, whose values of 500 centres stay in the cache of a core


@dataclass(frozen=True, slots=True, eq=False)
class Interpolant:
    """Interpolating function f of eq. 4, or another sum of basis functions about the centres.

    Parameters
    ----------
    centres : (N, D)
        Points where the displacement is known.
    coefficients : (N, E)
        c of eq. 4.
    reach
        Length scale of the basis functions, in the unit of the centres.
    basis
        Returns values (P, N) of the basis functions for points (P, D), the centres and `reach`.
    """

    centres: FloatArray
    coefficients: FloatArray
    reach: float
    basis: Callable[[NDArray[np.floating], FloatArray, float], FloatArray]

    def __call__(self, points: NDArray[np.floating]) -> FloatArray:
        """Displacements (P, E) at points (P, D)."""
        values = np.zeros((len(points), self.coefficients.shape[1]))
        rows = np.ascontiguousarray(self.coefficients.T)
        for first in range(0, len(points), CHUNK_SIZE):
            span = slice(first, first + CHUNK_SIZE)
            basis = self.basis(points[span], self.centres, self.reach)
            values[span] = np.einsum("pn,en->pe", basis, rows)  # no threaded BLAS, which waits in callers' threads
        return values


def fit_interpolant(
    centres: NDArray[np.floating], displacements: NDArray[np.floating], face_width: float
) -> Interpolant:
    """Interpolant that equals the given displacements at the centres (eqs 3 and 4).

    Parameters
    ----------
    centres : (N, D)
        Constrained points of the mesh in its default position.
    displacements : (N, E)
        u of eq. 3: target position minus present position.
    face_width
        Width of the face in the unit of the centres; the decay length is 64 / 200 of it.

    Raises
    ------
    InputError
        The numbers of centres and displacements differ or are 0, a value is not finite, or the width is not positive.
    DataError
        Two centres coincide.

    Examples
    --------
    >>> import numpy as np
    >>> field = fit_interpolant(np.array([[0.0], [50.0]]), np.array([[1.0], [2.0]]), 200.0)
    >>> field(np.array([[0.0], [50.0]])).round(9).ravel().tolist()
    [1.0, 2.0]
    """
    from scipy.linalg import solve
    from scipy.spatial.distance import pdist

    points, targets = check_centres(centres, displacements)
    if not face_width > 0:
        raise InputError(f"the face's width must be above 0, not {face_width}")
    decay_length = DECAY_LENGTH / FACE_WIDTH * face_width
    if len(points) > 1 and float(pdist(points).min()) < MIN_CENTRE_DISTANCE * decay_length:
        raise DataError("two centres lie in one place; pass one displacement for each point")
    coefficients = solve(rbf_values(points, points, decay_length), targets, assume_a="pos")
    return Interpolant(points, coefficients, decay_length, rbf_values)


def check_centres(centres: NDArray[np.floating], displacements: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """Centres (N, D) and displacements (N, E) as float64, checked."""
    points, targets = np.asarray(centres, np.float64), np.asarray(displacements, np.float64)
    if points.ndim != 2 or targets.ndim != 2 or len(points) != len(targets) or not len(points):
        raise InputError(
            f"centres {points.shape} and displacements {targets.shape} must have the same rows, at least 1"
        )
    if not (np.isfinite(points).all() and np.isfinite(targets).all()):
        raise InputError("centres and displacements must be finite; remove points that were not tracked")
    return points, targets


def rbf_values(points: NDArray[np.floating], centres: NDArray[np.floating], decay_length: float) -> FloatArray:
    """Values (P, N) of ``exp(-r / decay_length)`` for the distances r of points (P, D) from centres (N, D)."""
    from scipy.spatial.distance import cdist

    values: FloatArray = cdist(points, centres)
    values /= -decay_length
    return np.exp(values, out=values)
