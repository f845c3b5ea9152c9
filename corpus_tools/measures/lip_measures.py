"""Measures of the similarity of synthesised and real lip motion, as functions of arrays.

Openings are those of `tts2face.models.landmarks.lip_opening`; frame i is the instant i / fps of the phones' clock.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import look_up_phone, vowel_symbols
from lexicon.sequence import PhoneSequence
from tts2face.numeric.arrays import RealArray

CLOSURE_MARGIN_S = 0.03  # a closure may lie this far outside its phone: frames are 40 ms, edges accurate to 10 ms
CLOSURE_QUANTILE = 0.9  # quantile of the minimum openings of real closures that is the threshold of a closure
N_DTW_PARAMETERS = 6  # shape parameters that the warping cost compares: 95 % of the motion
PEAK_MARGIN_S = 0.06  # the maximum opening of a vowel may lie this far outside its edges
BILABIALS = ("p", "b", "m")
OPEN_HEIGHTS = ("open", "near-open", "open-mid")


def rmse_z(real: RealArray, synthesised: RealArray, spread: RealArray) -> float:
    """Root mean square difference of (T, D) parameters in units of their training spread (D,)."""
    return float(np.sqrt(np.mean(np.square((real - synthesised) / spread))))


def min_openings(
    opening: RealArray, phones: PhoneSequence, fps: float, labels: Collection[str] = BILABIALS
) -> NDArray[np.float64]:
    """Minimum opening within each phone with one of the labels, extended by `CLOSURE_MARGIN_S` on both sides."""
    times = np.arange(len(opening)) / fps
    least = []
    for at, label in enumerate(phones.phones):
        start, end = phones.edges[at] - CLOSURE_MARGIN_S, phones.edges[at + 1] + CLOSURE_MARGIN_S
        low, high = np.searchsorted(times, (start, end))
        if label in labels and low < high:
            least.append(float(opening[low:high].min()))
    return np.array(least, np.float64)


def midpoint_openings(opening: RealArray, phones: PhoneSequence, fps: float) -> NDArray[np.float64]:
    """Opening in the middle of each open vowel."""
    labels = open_vowels()
    middles = (phones.edges[:-1] + phones.edges[1:]) / 2
    wanted = np.array([label in labels for label in phones.phones])
    return np.asarray(np.interp(middles[wanted], np.arange(len(opening)) / fps, opening))


def open_vowels() -> frozenset[str]:
    """Open vowels, and diphthongs that begin with one."""
    first = {label: look_up_phone(label).parts[0] if look_up_phone(label).parts else label for label in vowel_symbols()}
    heights = {label: look_up_phone(start) for label, start in first.items()}
    return frozenset(label for label, phone in heights.items() if phone.height in OPEN_HEIGHTS and not phone.nasality)


def closure_threshold(real_least: RealArray) -> float:
    """Opening below which `CLOSURE_QUANTILE` of the real closures lie."""
    return float(np.quantile(real_least, CLOSURE_QUANTILE)) if len(real_least) else 0.0


def peak_times(opening: RealArray, phones: PhoneSequence, fps: float) -> NDArray[np.float64]:
    """Instant of the maximum opening in each open vowel, extended by `PEAK_MARGIN_S` on both sides, in seconds.

    Vertex of the parabola through the highest frame and its neighbours; NaN if the maximum is at the border.
    """
    wanted, peaks = open_vowels(), []
    for at, label in enumerate(phones.phones):
        if label in wanted:
            low = max(1, int(np.ceil((phones.edges[at] - PEAK_MARGIN_S) * fps)))
            high = min(len(opening) - 2, int(np.floor((phones.edges[at + 1] + PEAK_MARGIN_S) * fps)))
            peaks.append(_peak_position(opening, low, high) / fps if low < high else np.nan)
    return np.array(peaks, np.float64)


def _peak_position(curve: RealArray, low: int, high: int) -> float:
    top = low + int(np.argmax(curve[low : high + 1]))
    before, here, behind = (float(value) for value in curve[top - 1 : top + 2])
    # a flat curve has no peak
    if not (here >= before and here >= behind and here > min(before, behind)):
        return np.nan
    return top + 0.5 * (before - behind) / (before - 2 * here + behind)
