"""Units of a capture's weights and turns, and cells that no face can have.

The bulk of the cells decides on a unit. A single one that lies far from all others is damaged: it becomes missing.
"""

import numpy as np

from tts2face.numeric.arrays import FloatArray, IntArray, Mask

LARGEST_UNIT_WEIGHT = 1.5  # three quarters of the weights of a face lie below a third of it
LARGEST_TURN_RAD = 2 * np.pi  # a turn beyond it is no turn
LARGEST_SWING_RAD = 1.2  # of the head from its usual pose, seen by a camera: larger ones are in degrees
SEEN_WEIGHT = 1e-6  # weights below it say nothing about the unit
BULK, NEARLY_ALL = 0.75, 0.95  # shares of cells
WILD_QUANTILE = 0.995  # of weights: twice what it is, within the next two limits, is beyond what the take has
LEAST_WILD_WEIGHT, MOST_WILD_WEIGHT = 2.0, 10.0
LEAST_SPIKE = 1.1  # a weight beyond one
LARGEST_LEAP = 1.0  # of such a weight from those of the rows around
LARGEST_VALUE = 1e6  # of any shape
MAX_QUOTED = 2  # cells quoted in a note


def read_weights(cells: FloatArray, is_known: Mask, notes: list[str]) -> FloatArray:
    """Weights (T, C) of cells, NaN where one is damaged; ARKit's shapes, as `is_known` (C,), decide on the unit."""
    sizes = np.abs(cells[:, is_known])
    sizes = sizes[sizes > SEEN_WEIGHT]
    if not len(sizes):
        return np.where(np.abs(cells) > LARGEST_VALUE, np.nan, cells)
    weights = cells
    if np.quantile(sizes, BULK) > LARGEST_UNIT_WEIGHT:
        notes.append(f"its weights go beyond {LARGEST_UNIT_WEIGHT:g}; they are taken for per cent")
        weights, sizes = cells / 100.0, sizes / 100.0
    usual = 2 * float(np.quantile(sizes, WILD_QUANTILE, method="lower"))
    limits = np.where(is_known, np.clip(usual, LEAST_WILD_WEIGHT, MOST_WILD_WEIGHT), LARGEST_VALUE)
    return _without_spikes(np.where(np.abs(weights) > limits, np.nan, weights), is_known)


def _without_spikes(weights: FloatArray, is_known: Mask) -> FloatArray:
    """Weights (T, C), NaN where one of ARKit's is large and leaves the median of five rows for a row or two."""
    rows, columns = np.nonzero((np.abs(weights) > LEAST_SPIKE) & is_known)
    around = np.clip(rows[:, None] + np.arange(-2, 3), 0, len(weights) - 1)
    usual = np.nanmedian(weights[around, columns[:, None]], axis=1)
    is_spike = np.abs(weights[rows, columns] - usual) > LARGEST_LEAP
    whole = weights.copy()
    whole[rows[is_spike], columns[is_spike]] = np.nan
    return whole


def read_turns(cells: FloatArray, notes: list[str]) -> FloatArray:
    """Turns (T, 3) of a head in radians, NaN where a cell is damaged."""
    whole = [column[np.isfinite(column)] for column in cells.T]
    # a turn may leap from half a circle to minus half
    swings = [np.abs(unwrapped - np.median(unwrapped)) for unwrapped in map(np.unwrap, whole)]
    turns = cells
    if max(float(np.quantile(swing, NEARLY_ALL)) for swing in swings) > LARGEST_SWING_RAD:
        notes.append(f"its head turns by more than {LARGEST_SWING_RAD:g} radians; its turns are taken for degrees")
        turns = np.radians(cells)
    return np.where(np.abs(turns) > LARGEST_TURN_RAD, np.nan, turns)


def describe_damage(before: FloatArray, after: FloatArray, names: list[str], times: FloatArray) -> list[str]:
    """A note on cells (T, C) that became missing, by the columns' names and the rows' times (T,)."""
    at: IntArray = np.argwhere(np.isfinite(before) & np.isnan(after))
    if not len(at):
        return []
    quoted = ", ".join(f"{names[c]} {before[r, c]:g} at {times[r]:.2f} s" for r, c in at[:MAX_QUOTED])
    more = f" and {len(at) - MAX_QUOTED} more" if len(at) > MAX_QUOTED else ""
    return [f"cells that no face can have are left out: {quoted}{more}"]
