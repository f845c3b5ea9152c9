"""Incremental principal component analysis of data larger than memory."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array, fix_signs


@dataclass(slots=True)
class IncrementalPca:
    """Incremental principal components; memory does not depend on the number of rows.

    Sequential Karhunen-Loeve (Levey and Lindenbaum 2000), with the mean of Ross et al. 2008.

    Parameters
    ----------
    n_kept
        Components kept between blocks; use fewer of them.
    """

    n_kept: int
    n_rows: int = 0
    mean: Float32Array = field(default_factory=lambda: np.zeros(0, np.float32))
    basis: Float32Array = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    singular_values: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    total_variance: float = 0.0

    def add(self, rows: NDArray[np.floating]) -> None:
        """Update with (B, D) rows."""
        rows = np.asarray(rows, np.float32)
        n_new = len(rows)
        if not n_new:
            return
        mean = rows.mean(axis=0, dtype=np.float64).astype(np.float32)
        parts = [rows - mean]
        self.total_variance += float(np.square(parts[0], dtype=np.float64).sum())
        if self.n_rows:
            n_all = self.n_rows + n_new
            between = np.sqrt(self.n_rows * n_new / n_all) * (self.mean - mean).astype(np.float64)
            self.total_variance += float(between @ between)
            parts = [
                self.singular_values[:, None].astype(np.float32) * self.basis,
                *parts,
                between[None].astype(np.float32),
            ]
            mean = ((self.n_rows * self.mean.astype(np.float64) + n_new * mean.astype(np.float64)) / n_all).astype(
                np.float32
            )
        self.mean, self.n_rows = mean, self.n_rows + n_new
        self.basis, self.singular_values = _truncated_svd(np.concatenate(parts), self.n_kept)

    def spread(self) -> NDArray[np.float64]:
        """(K,) standard deviation along each component."""
        deviations: NDArray[np.float64] = self.singular_values / np.sqrt(max(self.n_rows, 1))
        return deviations

    def explained_variance(self) -> NDArray[np.float64]:
        """(K,) share of the variance in the first 1, 2, ... components."""
        shares: NDArray[np.float64] = np.cumsum(self.singular_values**2) / max(self.total_variance, 1e-300)
        return shares


def _truncated_svd(rows: Float32Array, n_kept: int) -> tuple[Float32Array, NDArray[np.float64]]:
    """Leading right singular vectors (K, D) and singular values (K,) of (B, D) rows, by the smaller Gram matrix."""
    products = rows @ rows.T if len(rows) <= rows.shape[1] else rows.T @ rows
    values, vectors = np.linalg.eigh(products.astype(np.float64))
    # smaller values are rounding
    order = np.argsort(values)[::-1][: min(n_kept, int((values > values.max(initial=0.0) * 1e-10).sum()))]
    scales = np.sqrt(values[order])
    # the smaller of both products of rows and columns has the same values
    if len(rows) <= rows.shape[1]:
        basis = (vectors[:, order] / scales).T.astype(np.float32) @ rows
    else:
        basis = vectors[:, order].T.astype(np.float32)
    return fix_signs(basis), scales
