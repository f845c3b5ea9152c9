"""Radial basis function interpolation of displacements that are known at a few points.

Theobald et al. 2007, eqs 3 and 4, after Pighin et al. 1998 and, as in the paper, without an affine term: displacements
vanish far from every centre. The face is aligned beforehand, so that only its shape difference is interpolated.

Local interpolation of displacements that are known at a few points, with compact support.

Ju and Lee 2008, section 5.2: bell-shaped cubic B-splines as basis functions, without a linear term, whose support
would be infinite. The paper takes the spline of the distance, which is not positive definite in three dimensions: on
the landmarks of a dense face mesh its equations are nearly singular, and skin between landmarks moves by centimetres.
Here the basis function of a centre is the product of the splines along the axes. Its spectrum, powers of sinc**4, is
never negative: the solution is unique and does not oscillate between the centres.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.numeric.kernels import kernel

FloatArray = NDArray[np.float64]

DECAY_LENGTH = 64.0  # the basis function is exp(-r / 64) (eq. 4)
FACE_WIDTH = 200.0  # width of the face in the unit of `DECAY_LENGTH`: pixels in the paper
MIN_CENTRE_DISTANCE = 1e-6  # relative to the decay length; closer centres make the matrix singular
CHUNK_SIZE = 512  # points evaluated at once, whose values of 500 centres stay in the cache of a core
# Of the interpolation matrix; beyond it, half of the digits of the coefficients are rounding errors.
MAX_CONDITION = 1e9


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


def fit_local_interpolant(
    centres: NDArray[np.floating], displacements: NDArray[np.floating], support: float
) -> Interpolant:
    """Interpolant that equals the given displacements at the centres; exactly 0 beyond the support of every centre.

    Parameters
    ----------
    centres : (N, D)
        Distinct points.
    displacements : (N, E)
        Values at the centres.
    support
        Distance along any axis at which a centre's influence ends, in the unit of the centres.

    Raises
    ------
    InputError
        The numbers of centres and displacements differ or are 0, a value is not finite, or the support is not
        positive.
    DataError
        Centres are so close together that the equations are ill-conditioned.

    Examples
    --------
    >>> import numpy as np
    >>> field = fit_local_interpolant(np.array([[0.0], [5.0]]), np.array([[1.0], [2.0]]), 20.0)
    >>> field(np.array([[0.0], [5.0], [25.0]])).round(9).ravel().tolist()
    [1.0, 2.0, 0.0]
    """
    points, targets = check_centres(centres, displacements)
    if not support > 0:
        raise InputError(f"the support must be above 0, not {support}")
    matrix = bspline_values(points, points, support)
    if np.linalg.cond(matrix) > MAX_CONDITION:
        raise DataError("centres are too close together for their support; remove some centres or reduce the support")
    coefficients: FloatArray = np.linalg.solve(matrix, targets).astype(np.float64)
    return Interpolant(points, coefficients, float(support), bspline_values)


def cubic_bspline(share: NDArray[np.floating]) -> FloatArray:
    """Cubic B-spline of a distance as a share of the support: 1 at 0, 1/4 at a half, 0 from 1 on, smooth throughout."""
    twice = 2.0 * np.asarray(share, np.float64)
    values: FloatArray = np.maximum(2.0 - twice, 0.0) ** 3 / 4.0 - np.maximum(1.0 - twice, 0.0) ** 3
    return values


def bspline_values(points: NDArray[np.floating], centres: FloatArray, support: float) -> FloatArray:
    """Values (P, N) of every centre's basis function at points (P, D)."""
    values: FloatArray = np.zeros((len(points), len(centres)))
    _write_products(np.asarray(points, np.float64), np.asarray(centres, np.float64), float(support), values)
    return values


@kernel
def _write_products(points, centres, support, values):  # type: ignore[no-untyped-def]
    """Write the product of `cubic_bspline` along the axes; most points are beyond the support of most centres."""
    for p in range(len(points)):
        for n in range(len(centres)):
            product = 1.0
            for axis in range(points.shape[1]):
                twice = 2.0 * (abs(points[p, axis] - centres[n, axis]) / support)
                if twice >= 2.0:
                    product = 0.0
                    break
                outer, inner = 2.0 - twice, max(1.0 - twice, 0.0)
                product *= outer * outer * outer / 4.0 - inner * inner * inner
            values[p, n] = product
