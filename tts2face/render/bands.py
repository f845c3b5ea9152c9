"""Sorting of projected triangles into bands of rows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel
from tts2face.render.raster import GRID_SHIFT, N_PHASES, NOT_DRAWN

Array = NDArray[Any]


@kernel
def sort_into_bands(batch: Any, count: int, rows: tuple[int, int], starts: Array, members: Array) -> None:
    """Sort triangles stably by the bands of rows that they overlap, and by phase within a band (counting sort).

    Phase p of band b is ``members[starts[4 * b + p]:starts[4 * b + p + 1]]``. With `members` too short, only `starts`
    is written.

    Parameters
    ----------
    batch
        Boxes and source of `gather_triangles`, and the phase of the front and the back of each triangle (F, 2).
    rows
        Rows of a band, and the rows beyond it that it draws as well, on either side.
    """
    boxes, source, phase = batch
    n_bands = (len(starts) - 1) // N_PHASES
    band_rows, beyond = rows
    for bucket in range(len(starts)):
        starts[bucket] = 0
    for turn in range(2):
        for i in range(count):
            own = phase[source[i], 0] if source[i] >= 0 else phase[~source[i], 1]
            if own == NOT_DRAWN:
                continue
            low: Any = (np.int64(boxes[i, 2]) >> GRID_SHIFT) - beyond
            high: Any = (np.int64(boxes[i, 3]) >> GRID_SHIFT) + beyond
            for band in range(max(low // band_rows, 0), min(high // band_rows, n_bands - 1) + 1):
                bucket = band * N_PHASES + own
                if turn == 0:
                    starts[bucket + 1] += 1
                else:
                    members[starts[bucket]] = i
                    starts[bucket] += 1
        if turn == 0:
            for bucket in range(len(starts) - 1):
                starts[bucket + 1] += starts[bucket]
            if starts[-1] > len(members):
                return
    for bucket in range(len(starts) - 1, 0, -1):
        starts[bucket] = starts[bucket - 1]
    starts[0] = 0
