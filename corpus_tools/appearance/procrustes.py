"""Similarity Procrustes analysis of shapes (T07 section 2, before equation 1)."""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray

N_ROUNDS = 5  # the mean changes by less than 1e-4 px after three


def fit_similarities(
    shapes: NDArray[np.floating], target: NDArray[np.floating]
) -> tuple[NDArray[np.complex128], FloatArray]:
    """Least-squares similarity transforms from shapes to a target.

    Parameters
    ----------
    shapes, target : (T, N, 2), (N, 2)

    Returns
    -------
    turns, shifts : (T,), (T, 2)
        ``target ~ turn * shape + shift`` with points read as complex numbers x + i y.
    """
    here, there = to_complex(shapes), to_complex(target)
    middle, aim = here.mean(axis=1), there.mean()
    centred = here - middle[:, None]
    turns = (np.conj(centred) * (there - aim)).sum(axis=1) / (np.abs(centred) ** 2).sum(axis=1)
    offsets = aim - turns * middle
    return turns, np.stack([offsets.real, offsets.imag], axis=-1)


def apply_similarities(shapes: NDArray[np.floating], turns: NDArray[np.complex128], shifts: FloatArray) -> FloatArray:
    """(T, N, 2) shapes under similarity transforms."""
    there = turns[:, None] * to_complex(shapes)
    return np.stack([there.real, there.imag], axis=-1) + shifts[:, None]


def align_shapes(shapes: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """(T, N, 2) shapes aligned with their mean, and the mean (N, 2), of the mean size of the shapes.

    Generalised Procrustes analysis (Goodall 1991); the mean keeps position, size and rotation of the arithmetic mean of
    the shapes.
    """
    mean = shapes.mean(axis=0, dtype=np.float64)
    anchor = mean
    placed = np.asarray(shapes, np.float64)
    for _ in range(N_ROUNDS):
        placed = apply_similarities(shapes, *fit_similarities(shapes, mean))
        mean = placed.mean(axis=0)
        mean = apply_similarities(mean[None], *fit_similarities(mean[None], anchor))[0]
    return apply_similarities(shapes, *fit_similarities(shapes, mean)), mean


def to_complex(points: NDArray[np.floating]) -> NDArray[np.complex128]:
    """(..., N) complex numbers of (..., N, 2) points."""
    return np.asarray(points[..., 0] + 1j * points[..., 1], np.complex128)
