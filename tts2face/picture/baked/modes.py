"""Sums of modes of baked light."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import BLACK_SHARE, N_PAGES
from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, ZERO, vectorized_kernel

LIGHT_BITS, LIGHT_MASK = 10, 1023  # of each of the three numbers in a texel of changing light
LIGHT_STEP, LIGHT_ZERO = np.float32(0.5), np.float32(512)  # of 255 a step, and the number of no change
LEAST_WEIGHT = np.float32(1e-4)


@vectorized_kernel
def add_modes(base: Array, modes: Array, weights: Array, out: Array) -> None:
    """Write the sum (N,) of a base (N,) and modes (C, N) by their weights (C,)."""
    for i in range(len(base)):
        out[i] = np.float32(base[i])
    last = len(weights) - 1
    for c in range(0, last + 1, 2):  # two at once: the sums are read and written half as often
        d = min(c + 1, last)
        first = weights[c] if abs(weights[c]) >= LEAST_WEIGHT else ZERO
        second = weights[d] if (d > c) & (abs(weights[d]) >= LEAST_WEIGHT) else ZERO
        for i in range(len(base)):
            out[i] += first * np.float32(modes[c, i]) + second * np.float32(modes[d, i])


@vectorized_kernel
def pack_change(change: Array, texels: Array) -> None:
    """Write changes of colour (3, N) into texels (N,) of three numbers."""
    top = np.float32(LIGHT_MASK)
    per_step = np.float32(1) / LIGHT_STEP
    for i in range(len(texels)):
        red = min(max(change[0, i] * per_step + LIGHT_ZERO + HALF, np.float32(0)), top)
        green = min(max(change[1, i] * per_step + LIGHT_ZERO + HALF, np.float32(0)), top)
        blue = min(max(change[2, i] * per_step + LIGHT_ZERO + HALF, np.float32(0)), top)
        texels[i] = np.int32(red) | np.int32(green) << LIGHT_BITS | np.int32(blue) << (2 * LIGHT_BITS)


def still_change(side: int) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Texels of no change of light, for pages of a side, and (width, height)."""
    height = N_PAGES * side + side // BLACK_SHARE
    zero = int(LIGHT_ZERO)
    return np.full(height * side, zero | zero << LIGHT_BITS | zero << 2 * LIGHT_BITS, np.int32), (side, height)
