"""Measures of the similarity of synthesised and real lip motion, as functions of arrays.

Openings are those of `tts2face.models.landmarks.lip_opening`; frame i is the instant i / fps of the phones' clock.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.phones import look_up_phone, vowel_symbols
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.exemplar.time_warping import frame_distances, path_cost, warp_path

SPEECH_MARGIN_S = 0.1  # evaluated from this long before the first phone to this long after the last
CLOSURE_MARGIN_S = 0.03  # a closure may lie this far outside its phone: frames are 40 ms, edges accurate to 10 ms
CLOSURE_QUANTILE = 0.9  # quantile of the minimum openings of real closures that is the threshold of a closure
DTW_BAND_S = 0.12  # half width of the warping band: lead or lag of synthesis without cost
N_DTW_PARAMETERS = 6  # shape parameters that the warping cost compares: 95 % of the motion
TIME_TOLERANCE_S = 1e-6  # a frame on an edge counts, in spite of rounding
PEAK_MARGIN_S = 0.06  # the maximum opening of a vowel may lie this far outside its edges
BILABIALS = ("p", "b", "m")
OPEN_HEIGHTS = ("open", "near-open", "open-mid")

Values = NDArray[np.floating]


def speech_frames(phones: PhoneSequence, n_frames: int, fps: float) -> slice:
    """Frames from `SPEECH_MARGIN_S` before the first sounding phone to as much behind the last.

    Raises
    ------
    InputError
        All phones are silence.
    """
    sounding = [at for at, label in enumerate(phones.phones) if label != SILENCE]
    if not sounding:
        raise InputError("an utterance without speech cannot be evaluated; remove it")
    start = phones.edges[sounding[0]] - SPEECH_MARGIN_S - TIME_TOLERANCE_S
    end = phones.edges[sounding[-1] + 1] + SPEECH_MARGIN_S + TIME_TOLERANCE_S
    times = np.arange(n_frames) / fps
    return slice(int(np.searchsorted(times, start)), int(np.searchsorted(times, end, side="right")))


def pearson(one: Values, other: Values) -> float:
    """Pearson's r of two series (T,); NaN where one of them is constant."""
    a, b = one - one.mean(dtype=np.float64), other - other.mean(dtype=np.float64)
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-9 * len(a) else float("nan")


def correlation(real: Values, synthesised: Values) -> float:
    """Pearson's r of two series (T,); 0 where one of them is constant."""
    return float(np.nan_to_num(pearson(real, synthesised)))


def range_ratio(real: Values, synthesised: Values) -> float:
    """Standard deviation of the synthesised series over that of the real one; 1 is equal articulation."""
    return float(synthesised.std(dtype=np.float64) / real.std(dtype=np.float64))


def rmse_z(real: Values, synthesised: Values, spread: Values) -> float:
    """Root mean square difference of (T, D) parameters in units of their training spread (D,)."""
    return float(np.sqrt(np.mean(np.square((real - synthesised) / spread))))


def warping_cost(real: Values, synthesised: Values, spread: Values, band: int | None) -> float:
    """Mean distance of motions (T, D) and (U, D) in units of `spread` (D,), along the cheapest warp within a band."""
    cost = frame_distances(real / spread, synthesised / spread)
    path = warp_path(cost, band=band)
    return path_cost(cost, path) / len(path)


def min_openings(
    opening: Values, phones: PhoneSequence, fps: float, labels: Collection[str] = BILABIALS
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


def midpoint_openings(opening: Values, phones: PhoneSequence, fps: float) -> NDArray[np.float64]:
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


def closure_threshold(real_least: Values) -> float:
    """Opening below which `CLOSURE_QUANTILE` of the real closures lie."""
    return float(np.quantile(real_least, CLOSURE_QUANTILE)) if len(real_least) else 0.0


def peak_times(opening: Values, phones: PhoneSequence, fps: float) -> NDArray[np.float64]:
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


def _peak_position(curve: Values, low: int, high: int) -> float:
    top = low + int(np.argmax(curve[low : high + 1]))
    before, here, behind = (float(value) for value in curve[top - 1 : top + 2])
    if not (here >= before and here >= behind and here > min(before, behind)):
        return np.nan
    return top + 0.5 * (before - behind) / (before - 2 * here + behind)
