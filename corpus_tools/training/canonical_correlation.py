"""Canonical correlation analysis (Hotelling 1936)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.arrays import RealArray

RANK_TOLERANCE = 1e-10  # singular values below this share of the largest count as zero


@dataclass(frozen=True, slots=True, eq=False)
class CanonicalFactors:
    """Canonical factor pairs, strongest first.

    Parameters
    ----------
    correlations : (K,)
        Of the factors of a pair, falling, in [0, 1].
    weights_a : (D, K)
        ``(a - mean_a) @ weights_a`` are factors of unit variance.
    weights_b : (E, K)
    mean_a, mean_b : (D,), (E,)
    """

    correlations: NDArray[np.float64]
    weights_a: NDArray[np.float64]
    weights_b: NDArray[np.float64]
    mean_a: NDArray[np.float64]
    mean_b: NDArray[np.float64]


def canonical_correlation(a: RealArray, b: RealArray) -> CanonicalFactors:
    """Canonical correlations of paired measurements (T, D) and (T, E).

    Notes
    -----
    QR of each centred set, SVD of the product of their orthonormal parts (Bjorck and Golub 1973).
    """
    if len(a) != len(b):
        raise InputError(f"canonical correlation needs paired measurements, not {len(a)} and {len(b)}")
    if len(a) <= max(a.shape[1], b.shape[1]) + 1:
        raise InputError(f"{len(a)} frames are too few for {a.shape[1]} and {b.shape[1]} measurements; give more")
    centred_a, centred_b = (np.asarray(item - item.mean(axis=0), np.float64) for item in (a, b))
    basis_a, back_a = _orthonormal_basis(centred_a)
    basis_b, back_b = _orthonormal_basis(centred_b)
    left, correlations, right = np.linalg.svd(basis_a.T @ basis_b, full_matrices=False)
    scale = np.sqrt(len(a))
    weights_a, weights_b = back_a @ left * scale, back_b @ right.T * scale
    return CanonicalFactors(
        np.clip(correlations, 0.0, 1.0),
        weights_a,
        weights_b,
        a.mean(axis=0, dtype=np.float64),
        b.mean(axis=0, dtype=np.float64),
    )


def _orthonormal_basis(centred: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Orthonormal columns (T, R) that span the measurements, and the weights (D, R) that compute them."""
    spread = centred.std(axis=0)
    if not (spread > 0.0).any():
        raise InputError("constant measurements have no correlation; give others")
    scale = np.where(spread > 0.0, spread, 1.0)
    q, r = np.linalg.qr(centred / scale)
    left, sizes, right = np.linalg.svd(r)
    kept = sizes > RANK_TOLERANCE * sizes[0]
    return q @ left[:, kept], (right[kept].T / sizes[kept]) / scale[:, None]
