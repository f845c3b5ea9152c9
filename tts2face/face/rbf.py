"""Scattered-data interpolation: displacements known at a few places, carried smoothly to all others.

Theobald et al. 2007, eqs 3 and 4, after Pighin et al. 1998, but without an affine term, as the paper has it: far from
every centre nothing moves. A face is aligned first, so that only the rest of its shape is left to interpolate.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError

FloatArray = NDArray[np.float64]

DECAY_LENGTH = 64.0  # the basis function is exp(-r / 64) (eq. 4) ...
FACE_WIDTH = 200.0  # ... where a face is this wide: picture elements in the paper, whatever the unit here
MIN_CENTRE_DISTANCE = 1e-6  # of the reach; centres nearer than this are one place, whose matrix cannot be inverted
CHUNK_SIZE = 4096  # places evaluated at once, to bound memory


@dataclass(frozen=True, slots=True, eq=False)
class Interpolant:
    """f of eq. 4.

    Parameters
    ----------
    centres : (N, D)
        Where the displacement is known.
    coefficients : (N, E)
        c of eq. 4.
    reach
        Distance in which the basis function falls to 1 / e, in the unit of the centres.
    """

    centres: FloatArray
    coefficients: FloatArray
    decay_length: float

    def __call__(self, places: NDArray[np.floating]) -> FloatArray:
        """(P, E) displacements at places (P, D)."""
        found = np.zeros((len(places), self.coefficients.shape[1]))
        for first in range(0, len(places), CHUNK_SIZE):
            span = slice(first, first + CHUNK_SIZE)
            found[span] = rbf_values(places[span], self.centres, self.decay_length) @ self.coefficients
        return found


def fit_interpolant(
    centres: NDArray[np.floating], displacements: NDArray[np.floating], face_width: float
) -> Interpolant:
    """The function that takes the given displacements at the centres exactly (eqs 3 and 4).

    Parameters
    ----------
    centres : (N, D)
        Constrained places of the mesh in its default position.
    displacements : (N, E)
        u of eq. 3: where each shall be, less where it is.
    face_width
        Width of the face in the unit of the centres; the basis function reaches 64 / 200 of it.

    Raises
    ------
    InputError
        Numbers of centres and displacements differ, there is none, one is not finite, or the face has no width.
    DataError
        Two centres lie in one place.

    Examples
    --------
    >>> import numpy as np
    >>> moved = interpolant(np.array([[0.0], [50.0]]), np.array([[1.0], [2.0]]), 200.0)
    >>> moved(np.array([[0.0], [50.0]])).round(9).ravel().tolist()
    [1.0, 2.0]
    """
    from scipy.linalg import solve
    from scipy.spatial.distance import pdist

    places, wanted = check_centres(centres, displacements)
    if not face_width > 0:
        raise InputError(f"the face's width must be above 0, not {face_width}")
    reach = DECAY_LENGTH / FACE_WIDTH * face_width
    if len(places) > 1 and float(pdist(places).min()) < MIN_CENTRE_DISTANCE * reach:
        raise DataError("two centres lie in one place; give each place one displacement")
    coefficients = solve(rbf_values(places, places, reach), wanted, assume_a="pos")
    return Interpolant(places, coefficients, reach)


def check_centres(centres: NDArray[np.floating], displacements: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """Places (N, D) and what is known there (N, E), if they are finite and as many, and at least one; InputError."""
    places, wanted = np.asarray(centres, np.float64), np.asarray(displacements, np.float64)
    if places.ndim != 2 or wanted.ndim != 2 or len(places) != len(wanted) or not len(places):
        raise InputError(f"centres {places.shape} and displacements {wanted.shape} must have the same rows, at least 1")
    if not (np.isfinite(places).all() and np.isfinite(wanted).all()):
        raise InputError("centres and displacements must be finite; leave out places that were not seen")
    return places, wanted


def rbf_values(places: NDArray[np.floating], centres: NDArray[np.floating], reach: float) -> FloatArray:
    """(P, N) values of exp(-r / reach) for the distances of places (P, D) from centres (N, D)."""
    from scipy.spatial.distance import cdist

    values: FloatArray = np.exp(-cdist(places, centres) / reach)
    return values
