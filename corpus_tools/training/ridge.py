"""Ridge regression with regularisation chosen by leave-one-out cross-validation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray

REGULARISATIONS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0)  # for terms of unit spread


@dataclass(frozen=True, slots=True, eq=False)
class RidgeFit:
    """Weights (K, V) of terms about their ``mean`` (K,), and the leave-one-out sum of squared errors."""

    mean: FloatArray
    weights: FloatArray
    left_out_error: float


def fit_ridge(terms: FloatArray, targets: FloatArray, regularisations: Sequence[float] = REGULARISATIONS) -> RidgeFit:
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
    error, weights = min(found, key=lambda fitted: fitted[0])
    return RidgeFit(mean, weights, error)


def _fit_and_cross_validate(
    centred: FloatArray, targets: FloatArray, normal: FloatArray, right: FloatArray
) -> tuple[float, FloatArray]:
    inverse = np.linalg.inv(normal)
    weights: FloatArray = inverse @ right
    leverage = np.einsum("rk,kj,rj->r", centred, inverse, centred) + 1.0 / len(centred)
    errors = (targets - centred @ weights) / (1.0 - leverage)[:, None]
    return float(np.square(errors).sum()), weights
