"""The linear audio map: features are mapped to shape parameters through canonical factors (T07 eqs 6-8).

Canonical correlation analysis (Hotelling 1936).

Ridge regression with regularisation chosen by leave-one-out cross-validation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.audio_map import AudioMap, context_windows

Values = NDArray[np.floating]
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


def canonical_correlation(a: Values, b: Values) -> CanonicalFactors:
    """Canonical correlations of paired measurements (T, D) and (T, E).

    Raises
    ------
    InputError
        Lengths differ, there are not more frames than measurements, or one set is constant.

    Notes
    -----
    QR of each centred set, SVD of the product of their orthonormal parts (Bjorck and Golub 1973).
    """
    if len(a) != len(b):
        raise InputError(f"canonical correlation needs paired measurements, not {len(a)} and {len(b)}")
    if len(a) <= max(a.shape[1], b.shape[1]) + 1:
        raise InputError(f"{len(a)} frames are too few for {a.shape[1]} and {b.shape[1]} measurements; give more")
    centred_a, centred_b = (np.asarray(one - one.mean(axis=0), np.float64) for one in (a, b))
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


@dataclass(frozen=True, slots=True, eq=False)
class TrainingUtterance:
    """One utterance to learn from: features (T, D) and shape parameters (T, S) on the same frames."""

    features: NDArray[np.float32]
    parameters: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check that both are on the same frames."""
        if len(self.features) != len(self.parameters) or not len(self.features):
            raise InputError(
                f"a training utterance needs features and parameters of the same frames, not {len(self.features)} and "
                f"{len(self.parameters)}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class TrainingData:
    """Training data: standardised windows (N, W), parameters (N, S), mean and standard deviation of the features."""

    features: NDArray[np.float32]
    targets: NDArray[np.float32]
    mean: NDArray[np.float32]
    spread: NDArray[np.float32]


def learn_linear_map(
    utterances: Sequence[TrainingUtterance], *, feature: str, before: int = 0, after: int = 0
) -> AudioMap:
    """Linear audio map through canonical factors, by default without context as in the paper.

    Raises
    ------
    InputError
        There are not more frames than values in a window, or the parameters are constant.
    """
    data = build_training_data(utterances, before, after)
    factors = canonical_correlation(data.features, data.targets)
    projected = (data.features - factors.mean_a) @ factors.weights_a  # eq. 6
    offsets = data.targets - factors.mean_b
    mapping = np.linalg.lstsq(projected, offsets, rcond=None)[0].T  # eq. 7
    inner = factors.weights_a.T
    return AudioMap(
        feature,
        before,
        after,
        data.mean,
        data.spread,
        (inner.astype(np.float32), mapping.astype(np.float32)),
        ((-inner @ factors.mean_a).astype(np.float32), factors.mean_b.astype(np.float32)),
        "linear",
    )


def build_training_data(utterances: Sequence[TrainingUtterance], before: int, after: int) -> TrainingData:
    """Standardised windows of all utterances, extended at both ends by the first and the last frame.

    Raises
    ------
    InputError
        There is no utterance.
    """
    if not utterances:
        raise InputError("an audio map needs training utterances with sound; give some")
    every = np.concatenate([one.features for one in utterances])
    mean, spread = every.mean(axis=0, dtype=np.float64), every.std(axis=0, dtype=np.float64)
    mean32, spread32 = mean.astype(np.float32), np.where(spread > 0.0, spread, 1.0).astype(np.float32)
    windows = [standardised_windows(one.features, (mean32, spread32), before, after) for one in utterances]
    return TrainingData(
        np.concatenate(windows), np.concatenate([one.parameters for one in utterances]), mean32, spread32
    )


def standardised_windows(
    features: NDArray[np.floating], standard: tuple[NDArray[np.float32], NDArray[np.float32]], before: int, after: int
) -> NDArray[np.float32]:
    """(T, W) standardised windows of an utterance's (T, D) features."""
    mean, spread = standard
    padded = np.pad(features, ((before, after), (0, 0)), mode="edge")
    return context_windows((padded - mean) / spread, before, after).astype(np.float32)


REGULARISATIONS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)  # for terms of unit spread
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RidgeFit:
    """Weights (K, V) of terms about their ``mean`` (K,), and the leave-one-out sum of squared errors."""

    mean: Floats
    weights: Floats
    left_out_error: float


def fit_ridge(terms: Floats, targets: Floats, regularisations: Sequence[float] = REGULARISATIONS) -> RidgeFit:
    """The best regression of (R, V) values, whose mean is 0, on (R, K) terms.

    Each row's error when it is left out follows from its leverage. Source: Allen 1974 (PRESS).
    """
    mean = terms.mean(axis=0)
    centred = terms - mean
    normal, right = centred.T @ centred, centred.T @ targets
    found = [
        _fit_and_cross_validate(centred, targets, normal + regularisation * np.eye(terms.shape[1]), right)
        for regularisation in regularisations
    ]
    error, weights = min(found, key=lambda one: one[0])
    return RidgeFit(mean, weights, error)


def _fit_and_cross_validate(centred: Floats, targets: Floats, normal: Floats, right: Floats) -> tuple[float, Floats]:
    inverse = np.linalg.inv(normal)
    weights: Floats = inverse @ right
    leverage = np.einsum("rk,kj,rj->r", centred, inverse, centred) + 1.0 / len(centred)
    errors = (targets - centred @ weights) / (1.0 - leverage)[:, None]
    return float(np.square(errors).sum()), weights
