"""Tables between 8-bit sRGB and linear light."""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import decode_srgb, encode_srgb

TONE_STEPS = 8192  # entries of the table from linear light to 8 bits; resolves the darkest step
TONE_TABLES = (decode_srgb(np.arange(256) / 255.0).astype(np.float32), encode_srgb(np.linspace(0.0, 1.0, TONE_STEPS)))


def linear_light(srgb: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Linear light in [0, 1] of 8-bit sRGB values (IEC 61966-2-1)."""
    return TONE_TABLES[0][srgb]


def encoding_table(n_steps: int) -> NDArray[np.uint8]:
    """8-bit sRGB values (n_steps,) of linear light from 0 to 1 in equal steps."""
    return encode_srgb(np.linspace(0.0, 1.0, n_steps))
