"""Line spectral frequencies of prediction polynomials."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError


def line_spectral_frequencies(coefficients: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T, M) angles in (0, pi), increasing, of T all-pole filters ``1 / A(z)``.

    Parameters
    ----------
    coefficients : (T, M)
        ``a_1 ... a_M`` of ``A(z) = 1 + sum_k a_k z^-k``; M is even, and A has its roots inside the unit circle.

    Raises
    ------
    InputError
        M is odd or 0.

    Notes
    -----
    ``P, Q = A(z) +- z^-(M+1) A(1/z)`` have their roots on the unit circle (Itakura 1975). Without those at z = -1 and
    z = 1 each is a polynomial in cos w, written in Chebyshev polynomials; its roots are the eigenvalues of their
    colleague matrix (Good 1961).
    """
    n_frames, order = coefficients.shape
    if order == 0 or order % 2:
        raise InputError(f"line spectral frequencies need an even number of coefficients above 0, not {order}")
    filters = np.concatenate([np.ones((n_frames, 1)), coefficients, np.zeros((n_frames, 1))], axis=1)
    mirrored = filters[:, ::-1]
    signs = (-1.0) ** np.arange(order + 2)
    half = order // 2
    quotients = (  # long division by 1 + z^-1 and 1 - z^-1; the first half, middle included, of a symmetric polynomial
        (signs * np.cumsum(signs * (filters + mirrored), axis=1))[:, : half + 1],
        np.cumsum(filters - mirrored, axis=1)[:, : half + 1],
    )
    angles = [np.arccos(np.clip(_chebyshev_roots(quotient[:, ::-1]), -1.0, 1.0)) for quotient in quotients]
    return np.sort(np.concatenate(angles, axis=1), axis=1)


def _chebyshev_roots(middle_out: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, n) real roots of ``c_0 / 2 + sum_k c_k T_k(x)``, doubled, for (T, n + 1) coefficients c."""
    n = middle_out.shape[1] - 1
    series = 2.0 * middle_out
    series[:, 0] /= 2.0
    colleague = np.zeros((len(series), n, n))
    rows = np.arange(n - 1)
    colleague[:, rows, rows + 1] = 0.5
    colleague[:, rows + 1, rows] = 0.5
    if n > 1:
        colleague[:, 0, 1] = 1.0
    leading = series[:, n:] * (2.0 if n > 1 else 1.0)
    colleague[:, n - 1] -= series[:, :n] / leading
    return np.asarray(np.linalg.eigvals(colleague).real, np.float64)
