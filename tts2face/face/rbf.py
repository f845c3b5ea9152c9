"""Radial basis function interpolation of displacements that are known at a few points.

Theobald et al. 2007, eqs 3 and 4, after Pighin et al. 1998 and, as in the paper, without an affine term: displacements
vanish far from every centre. The face is aligned beforehand, so that only its shape difference is interpolated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError

FloatArray = NDArray[np.float64]

DECAY_LENGTH = 64.0  # the basis function is exp(-r / 64) (eq. 4)
FACE_WIDTH = 200.0  # width of the face in the unit of `DECAY_LENGTH`: pixels in the paper
MIN_CENTRE_DISTANCE = 1e-6  # relative to the decay length; closer centres make the matrix singular
CHUNK_SIZE = 4096  # points evaluated at once, which bounds memory


@dataclass(frozen=True, slots=True, eq=False)
class Interpolant:
    """Interpolating function f of eq. 4.

    Parameters
    ----------
    centres : (N, D)
        Points where the displacement is known.
    coefficients : (N, E)
        c of eq. 4.
    decay_length
        Distance over which the basis function falls to 1 / e, in the unit of the centres.
    """

    centres: FloatArray
    coefficients: FloatArray
    decay_length: float

    def __call__(self, places: NDArray[np.floating]) -> FloatArray:
        """Displacements (P, E) at points (P, D)."""
        found = np.zeros((len(places), self.coefficients.shape[1]))
        for first in range(0, len(places), CHUNK_SIZE):
            span = slice(first, first + CHUNK_SIZE)
            found[span] = rbf_values(places[span], self.centres, self.decay_length) @ self.coefficients
        return found


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

    places, wanted = check_centres(centres, displacements)
    if not face_width > 0:
        raise InputError(f"the face's width must be above 0, not {face_width}")
    decay_length = DECAY_LENGTH / FACE_WIDTH * face_width
    if len(places) > 1 and float(pdist(places).min()) < MIN_CENTRE_DISTANCE * decay_length:
        raise DataError("two centres lie in one place; pass one displacement for each point")
    coefficients = solve(rbf_values(places, places, decay_length), wanted, assume_a="pos")
    return Interpolant(places, coefficients, decay_length)


def check_centres(centres: NDArray[np.floating], displacements: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """Centres (N, D) and displacements (N, E) as float64, checked.

    Raises
    ------
    InputError
        Their numbers differ or are 0, or a value is not finite.
    """
    places, wanted = np.asarray(centres, np.float64), np.asarray(displacements, np.float64)
    if places.ndim != 2 or wanted.ndim != 2 or len(places) != len(wanted) or not len(places):
        raise InputError(f"centres {places.shape} and displacements {wanted.shape} must have the same rows, at least 1")
    if not (np.isfinite(places).all() and np.isfinite(wanted).all()):
        raise InputError("centres and displacements must be finite; remove points that were not tracked")
    return places, wanted


def rbf_values(places: NDArray[np.floating], centres: NDArray[np.floating], decay_length: float) -> FloatArray:
    """Values (P, N) of ``exp(-r / decay_length)`` for the distances r of points (P, D) from centres (N, D)."""
    from scipy.spatial.distance import cdist

    values: FloatArray = np.exp(-cdist(places, centres) / decay_length)
    return values
