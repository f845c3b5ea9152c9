"""Weights c_i of basis expressions in a face's slow displacement: Ju and Lee 2008, section 4.1, and least squares.

Both estimators obey ``-slack <= c_i <= 1 + slack`` (the paper's epsilon). The paper draws random weights, stores their
faces in a k-d tree and averages those nearest to the observed face; least squares within the same limits has the
lowest error of all estimators.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.least_squares import bounded_least_squares

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


N_AVERAGED = 41  # frames at 30 a second, 1.36 s: speech and small gestures average out (Ju and Lee 2008, section 4.1)
N_SAMPLES, N_NEAREST = 1000, 60  # Ju and Lee 2008, section 4.1
MAX_SLACK = 1.0  # Ju and Lee 2008, section 4.1
MIN_CONDITION = 1e-9  # of the largest singular value: below it the weights of expressions are not unique
CHUNK_SIZE = 4096  # frames per query, to bound memory


class Estimator(Protocol):
    """Estimator of weights (T, B) from displacements (T, ...)."""

    def weights(self, displacements: NDArray[np.floating]) -> FloatArray:
        """Weights (T, B) of the basis expressions in displacements (T, ...) from the face at rest, in mm."""


@dataclass(frozen=True, slots=True, eq=False)
class ReducedBasis:
    """A basis in its own span: ``basis = rows @ axes.T``, so that distances within the span are kept exactly.

    Parameters
    ----------
    axes : (n, B)
        Orthonormal columns.
    rows : (B, B)
        Each expression in these axes.
    slack
        The paper's epsilon.
    """

    axes: FloatArray
    rows: FloatArray
    slack: float

    def split(self, displacements: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
        """(T, B) displacements within the span, and (T,) their squared distance from it."""
        flat = np.asarray(displacements, np.float64).reshape(len(displacements), -1)
        if flat.shape[1] != len(self.axes):
            raise InputError(f"displacements have {flat.shape[1]} coordinates, the expressions {len(self.axes)}")
        within = flat @ self.axes
        beyond = np.maximum(np.square(flat).sum(axis=1) - np.square(within).sum(axis=1), 0.0)
        return within, beyond


@dataclass(frozen=True, slots=True, eq=False)
class LeastSquaresEstimator:
    """The weights of least squared error within the limits."""

    basis: ReducedBasis

    def weights(self, displacements: NDArray[np.floating]) -> FloatArray:
        """As `Estimator`; exact up to rounding."""
        within, _ = self.basis.split(displacements)
        rows, slack = self.basis.rows, self.basis.slack
        limits = np.tile([-slack, 1.0 + slack], (len(rows), 1))
        solved: FloatArray = bounded_least_squares(rows @ rows.T, within @ rows.T, limits)
        return solved


@dataclass(frozen=True, slots=True, eq=False)
class NearestSamplesEstimator:
    """The paper's estimator.

    Parameters
    ----------
    samples : (S, B)
        Random weights c^k within the limits.
    tree
        Of their faces F_k, in the span of the basis.
    n_nearest
        n_k of the paper.
    """

    basis: ReducedBasis
    samples: FloatArray
    tree: "cKDTree[Any]"
    n_nearest: int

    def weights(self, displacements: NDArray[np.floating]) -> FloatArray:
        """As `Estimator`.

        Notes
        -----
        ``a_k`` is inversely proportional to the distance of F_k in all coordinates; the part beyond the span adds the
        same squared distance to every sample. The search is exact; the paper's is approximate within a small bound.
        """
        found = np.zeros((len(displacements), self.samples.shape[1]))
        for first in range(0, len(displacements), CHUNK_SIZE):
            span = slice(first, first + CHUNK_SIZE)
            found[span] = self._mix_samples(*self.basis.split(displacements[span]))
        return found

    def _mix_samples(self, within: FloatArray, beyond: FloatArray) -> FloatArray:
        near, at = self.tree.query(within, k=self.n_nearest)
        shape = (len(within), self.n_nearest)
        squares = np.reshape(near, shape) ** 2 + beyond[:, None]
        # a sample that is the frame itself has no distance
        least = np.maximum(squares.min(axis=1, keepdims=True), np.finfo(np.float64).tiny)
        shares = np.sqrt(least / np.maximum(squares, least))  # relative to the nearest: no distance divides by 0
        shares /= shares.sum(axis=1, keepdims=True)
        mixed: FloatArray = np.einsum("tk,tkb->tb", shares, self.samples[np.reshape(at, shape)])
        return mixed


def moving_average(motion: NDArray[np.floating]) -> FloatArray:
    """(T, ...) centred mean of the `N_AVERAGED` frames about each; beyond a recording's ends its motion is mirrored.

    With mirrored ends all windows have the same length; windows that shorten towards an end would leave the lips of the
    first frame unsmoothed (docs/gestures.md).
    """
    from scipy.ndimage import uniform_filter1d

    mean: FloatArray = uniform_filter1d(np.asarray(motion, np.float64), N_AVERAGED, axis=0, mode="reflect")
    return mean


def build_least_squares_estimator(basis: NDArray[np.floating], slack: float = 0.0) -> LeastSquaresEstimator:
    """Bounded least squares on a basis (B, ...) of displacements in mm; errors as `reduce_basis`."""
    return LeastSquaresEstimator(reduce_basis(basis, slack))


def build_nearest_samples_estimator(
    basis: NDArray[np.floating],
    generator: np.random.Generator,
    *,
    slack: float = 0.0,
    n_samples: int = N_SAMPLES,
    n_nearest: int = N_NEAREST,
) -> NearestSamplesEstimator:
    """The paper's estimator on a basis (B, ...) of displacements in mm.

    Raises
    ------
    InputError
        There are fewer samples than neighbours, no neighbour, or as `reduce_basis`.
    DataError
        As `reduce_basis`.
    """
    from scipy.spatial import cKDTree

    if not 1 <= n_nearest <= n_samples:
        raise InputError(f"{n_nearest} nearest of {n_samples} samples cannot be found; choose 1 to {n_samples}")
    within = reduce_basis(basis, slack)
    samples = generator.uniform(-slack, 1.0 + slack, (n_samples, len(within.rows)))
    return NearestSamplesEstimator(within, samples, cKDTree(samples @ within.rows), n_nearest)


def reduce_basis(basis: NDArray[np.floating], slack: float = 0.0) -> ReducedBasis:
    """A basis (B, ...) of displacements in the axes of its span."""
    if not 0.0 <= slack <= MAX_SLACK:
        raise InputError(f"weights may pass their limits by 0 to {MAX_SLACK:g}, not by {slack:g}")
    flat = np.asarray(basis, np.float64).reshape(len(basis), -1)
    if not np.isfinite(flat).all():
        raise DataError("a basis expression contains values that are not finite; capture it again")
    strengths = np.linalg.svd(flat, compute_uv=False)
    if len(flat) > flat.shape[1] or strengths[-1] <= MIN_CONDITION * strengths[0]:
        raise DataError("the basis expressions are linearly dependent; capture distinct expressions")
    axes, upper = np.linalg.qr(flat.T)
    return ReducedBasis(np.asarray(axes), np.asarray(upper).T, slack)
