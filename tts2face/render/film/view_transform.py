"""View transform: linear light to colours of a display, as a table over its logarithm."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import TABLE_SIDE

OFFSET, MOST = 0.004, 16.0  # of the logarithm, and the range of linear light
SPAN = float(np.log2(MOST / OFFSET + 1))


def table_levels() -> NDArray[np.float64]:
    """(33,) levels of linear light, evenly in the logarithm of light plus an offset."""
    levels: NDArray[np.float64] = OFFSET * 2 ** (np.linspace(0, 1, TABLE_SIDE) * SPAN) - OFFSET
    return levels
