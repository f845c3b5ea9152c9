"""Micro-saccades: eyes that rest on a place jump a little about it, and drift back.

Source: Martinez-Conde et al. 2004 (one to two a second, below a degree, more along than across the horizon).
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CELL_S, SHARE = 0.75, 0.85  # at most one jump a cell, in a share of them: 1.1 a second
MARGIN = 0.1  # of a cell, between jumps of neighbours
SPREAD_RAD = np.radians([0.12, 0.28])  # of places in pitch and yaw
DRIFT_S = 0.8  # in which two thirds of a jump are taken back


def microsaccades(times: FloatArray, seed: int) -> FloatArray:
    """Offset (T, 2) of pitch and yaw in radians at times (T,) of the whole clip, whatever its pieces."""
    cells = np.floor(times / CELL_S).astype(np.int64)
    found = np.zeros((len(times), 2))
    for cell in range(int(cells.min(initial=0)) - 1, int(cells.max(initial=-1)) + 1):
        if cell < 0:
            continue
        draws = np.random.default_rng((seed, cell))
        jumps, begin = draws.uniform() < SHARE, CELL_S * (cell + draws.uniform(MARGIN, 1 - MARGIN))
        place = draws.normal(size=2) * SPREAD_RAD
        if jumps:
            later = times >= begin
            found[later] = place * np.exp(-(times[later, None] - begin) / DRIFT_S)
    return found
