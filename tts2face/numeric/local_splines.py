"""Local interpolation of displacements that are known at a few points, with compact support.

Ju and Lee 2008, section 5.2: bell-shaped cubic B-splines as basis functions, without a linear term, whose support
would be infinite. The paper takes the spline of the distance, which is not positive definite in three dimensions: on
the landmarks of a dense face mesh its equations are nearly singular, and skin between landmarks moves by centimetres.
Here the basis function of a centre is the product of the splines along the axes. Its spectrum, powers of sinc**4, is
never negative: the solution is unique and does not oscillate between the centres.
"""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.kernels import kernel
from tts2face.numeric.splines import Interpolant, check_centres

# Of the interpolation matrix; beyond it, half of the digits of the coefficients are rounding errors.
MAX_CONDITION = 1e9


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
