"""Measures of the similarity of two motions of the lips, as functions of arrays."""

import numpy as np

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.blending import frame_distances, path_cost, warp_path
from tts2face.numeric.arrays import RealArray

DTW_BAND_S = 0.12  # half width of the warping band: lead or lag of synthesis without cost
SPEECH_MARGIN_S = 0.1  # compared from this long before the first phone to this long after the last
TIME_TOLERANCE_S = 1e-6  # a frame on an edge counts, in spite of rounding


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


def pearson(first: RealArray, other: RealArray) -> float:
    """Pearson's r of two series (T,); NaN where one of them is constant."""
    a, b = first - first.mean(dtype=np.float64), other - other.mean(dtype=np.float64)
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-9 * len(a) else float("nan")


def correlation(real: RealArray, synthesised: RealArray) -> float:
    """Pearson's r of two series (T,); 0 where one of them is constant."""
    return float(np.nan_to_num(pearson(real, synthesised)))


def range_ratio(real: RealArray, synthesised: RealArray) -> float:
    """Standard deviation of the synthesised series over that of the real one; 1 is equal articulation."""
    return float(synthesised.std(dtype=np.float64) / real.std(dtype=np.float64))


def warping_cost(real: RealArray, synthesised: RealArray, spread: RealArray, band: int | None) -> float:
    """Mean distance of motions (T, D) and (U, D) in units of `spread` (D,), along the cheapest warp within a band."""
    cost = frame_distances(real / spread, synthesised / spread)
    path = warp_path(cost, band=band)
    return path_cost(cost, path) / len(path)
