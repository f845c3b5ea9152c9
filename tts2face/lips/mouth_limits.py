"""Last steps of articulation: limited speed of the mouth, and lips that meet in bilabials and pauses."""

import numpy as np

from tts2face.face.lip_constraints import LipConstraints
from tts2face.numeric.arrays import FloatArray, ordered_product

# Largest change of a shape's weight per second, .3 per 1/60 s; closing the lips afterwards adds a little. The fastest
# score of the mouth in 14 recordings of GRID s1 (mouthPucker) changes by .34 per 1/60 s (99.9th percentile), that of
# the Live Link capture (mouthFunnel) by .25.
# weights a second
LARGEST_SPEED_PER_S = 18.0
# Speed at which the lips of a mouth of 50 mm open or close (99.9th percentile of GRID s1: 265 and 310 mm/s), and the
# time in which they reach half of it.
# contacts come last, at most 300 mm/s (decision 102)
LIP_SPEED_MM_PER_S, LIP_ONSET_S = 300.0, 0.01
FIRM_POWER = 6  # of the smooth minimum of a gap and its bound: a bound of twice the gap lowers it by .3 %
LEAST_CHANGE_MM = 1e-4  # of a gap; frames that would change less are unchanged


def limit_speed(values: FloatArray, fps: float) -> FloatArray:
    """Values (T, K) whose changes from frame to frame are limited; values that change slowly enough are unchanged.

    Notes
    -----
    The mean of the least function above the values, and of the greatest below them, whose slopes are within the limit.
    """
    largest = LARGEST_SPEED_PER_S / fps
    above, below = values.copy(), values.copy()
    for order in (range(1, len(values)), range(len(values) - 2, -1, -1)):
        back = -1 if order.step > 0 else 1
        for t in order:
            above[t] = np.maximum(above[t], above[t + back] - largest)
            below[t] = np.minimum(below[t], below[t + back] + largest)
    return (above + below) / 2


def largest_gaps(seconds: FloatArray, mouth_share: float) -> FloatArray:
    """Largest gaps (T,), mm, of lips that touch in `seconds` (T,), on a mouth of a share of the default head's."""
    far = np.minimum(seconds, 1e3)
    return mouth_share * LIP_SPEED_MM_PER_S * far * far / (far + LIP_ONSET_S)


def close_lips(
    mouth: LipConstraints, speech: FloatArray, rest_gaps: FloatArray, bounds: FloatArray, closure: FloatArray
) -> FloatArray:
    """Speech (T, K) whose lip gaps are within bounds (T,), mm, and smaller by shares `closure` (T,).

    All gaps of a frame shrink by the same share. Overlapping lips, whose gap is negative, stay as they are.

    Parameters
    ----------
    rest_gaps : (P,)
        Gaps of the face at rest that are to be closed, mm.
    """
    displaced = ordered_product(speech, mouth.gaps.T)
    gaps = np.maximum(displaced + rest_gaps, 0.0)
    widest = gaps.max(axis=1)
    ratio = np.divide(widest, bounds, out=np.full(len(widest), np.inf), where=bounds > 0)
    kept = (1.0 - closure) * (1.0 + ratio**FIRM_POWER) ** (-1.0 / FIRM_POWER)
    changed = (1.0 - kept) * widest > LEAST_CHANGE_MM
    targets = displaced - (1.0 - kept)[:, None] * gaps
    return mouth.solve(speech, np.zeros_like(speech), targets, changed)
