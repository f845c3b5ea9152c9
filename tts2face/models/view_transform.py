"""View transform: linear light to colours of a display, as a table over its logarithm."""

import numpy as np
from numpy.typing import NDArray

TABLE_SIDE = 33  # entries of the view transform along each colour
OFFSET = 0.004  # of the logarithm
MOST = 16.0  # linear light
# powers of two from 0 to the brightest light of the table
SPAN = float(np.log2(MOST / OFFSET + 1))


def table_levels() -> NDArray[np.float64]:
    """(33,) levels of linear light, evenly in the logarithm of light plus an offset."""
    levels: NDArray[np.float64] = OFFSET * 2 ** (np.linspace(0, 1, TABLE_SIDE) * SPAN) - OFFSET
    return levels


def grey_curves(view: NDArray[np.uint8]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Curves of a view transform (33, 33, 33, 3) along its greys, which undo and do it for each channel alone.

    Returns
    -------
    light : (3, 256)
        Linear light of each displayed level.
    bounds : (3, 255)
        Linear light from which the next level is displayed.
    """
    grey = np.arange(TABLE_SIDE)
    at = np.arange(0.0, 255.5, 0.5)
    found = []
    for levels in view[grey, grey, grey].T.astype(np.float64):
        rising = np.flatnonzero(np.diff(levels) > 0)
        used = np.append(rising, rising[-1] + 1)  # the last entry of black and the first of white
        place = np.interp(at, levels[used], used) / (TABLE_SIDE - 1)
        found.append(OFFSET * 2 ** (place * SPAN) - OFFSET)
    curves = np.array(found, np.float32)
    return curves[:, ::2], curves[:, 1::2]
