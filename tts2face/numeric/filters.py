"""Moving means, minima and Gaussians along the first axis of arrays, whose ends are held, with the bits of SciPy's.

Importing `scipy.ndimage` takes longer than all filters of a clip.
"""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray

TRUNCATED_AT = 4.0  # standard deviations, as `scipy.ndimage.gaussian_filter1d`


def moving_mean(values: FloatArray, width: int) -> FloatArray:
    """(n,) means of an odd number of values around each of (n,) values, one at least.

    Each sum is the one before it and its change, as `scipy.ndimage.uniform_filter1d` adds them up.
    """
    held = np.pad(values, width // 2, mode="edge")
    first = np.cumsum(held[:width])[-1:]
    means: FloatArray = np.cumsum(np.concatenate([first, held[width:] - held[:-width]])) / width
    return means


def moving_minimum(values: FloatArray, width: int, beyond: float) -> FloatArray:
    """(n,) least of an odd number of values around each of (n,) values, with `beyond` before and after them."""
    padded = np.pad(values, width // 2, constant_values=beyond)
    covered = 1
    # log2(width) passes in place of width
    while covered < width:  # the least of two runs that overlap
        step = min(covered, width - covered)
        padded, covered = np.minimum(padded[:-step], padded[step:]), covered + step
    return padded


def gaussian(values: NDArray[np.floating], sigma: float) -> NDArray[np.floating]:
    """(n, D) values smoothed by a Gaussian with a standard deviation in values; sums are in double precision."""
    half = int(TRUNCATED_AT * sigma + 0.5)
    weights = np.exp(-0.5 / (sigma * sigma) * np.arange(-half, half + 1) ** 2)
    weights /= weights.sum()
    held = np.pad(values.astype(np.float64), ((half, half), (0, 0)), mode="edge")
    n = len(values)
    sums = held[half : half + n] * weights[half]
    for at in range(half):
        sums += (held[at : at + n] + held[2 * half - at : 2 * half - at + n]) * weights[at]
    smooth: NDArray[np.floating] = sums.astype(values.dtype)
    return smooth
