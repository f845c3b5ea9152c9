"""Sums of modes of baked light."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import vectorized_kernel

Array = NDArray[Any]

LIGHT_BITS, LIGHT_MASK = 10, 1023  # of each of the three numbers in a texel of changing light
LIGHT_STEP, LIGHT_ZERO = np.float32(0.5), np.float32(512)  # of 255 a step, and the number of no change
LEAST_WEIGHT = np.float32(1e-4)


@vectorized_kernel
def add_modes(base: Array, modes: Array, weights: Array, out: Array) -> None:
    """Write the sum (N,) of a base (N,) and modes (C, N) by their weights (C,)."""
    for i in range(len(base)):
        out[i] = np.float32(base[i])
    for c in range(len(weights)):
        weight = weights[c]
        if abs(weight) < LEAST_WEIGHT:
            continue
        for i in range(len(base)):
            out[i] += weight * np.float32(modes[c, i])


@vectorized_kernel
def pack_change(change: Array, texels: Array) -> None:
    """Write changes of colour (3, N) into texels (N,) of three numbers."""
    half, top = np.float32(0.5), np.float32(LIGHT_MASK)
    per_step = np.float32(1) / LIGHT_STEP
    for i in range(len(texels)):
        red = min(max(change[0, i] * per_step + LIGHT_ZERO + half, np.float32(0)), top)
        green = min(max(change[1, i] * per_step + LIGHT_ZERO + half, np.float32(0)), top)
        blue = min(max(change[2, i] * per_step + LIGHT_ZERO + half, np.float32(0)), top)
        texels[i] = np.int32(red) | np.int32(green) << LIGHT_BITS | np.int32(blue) << (2 * LIGHT_BITS)
