"""Places of the rows of a marker table on a clock of even frames, by their times and frame numbers, and its rate."""

from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray, IntArray, Mask, longest_increasing
from tts2face.types import NTSC_NOMINAL_RATES

GOOD_SHARE = 0.5  # of rows whose times, or numbers, come after those before: with fewer the column is no clock
GAP_STEPS = 1.5  # of the usual step: a longer one is a gap of frames
MAX_STEP_S = 0.15  # between frames in seconds: longer ones are milliseconds
MIN_DRIFT_FRAMES = 0.05  # of a rate over a whole take: smaller ones are digits that were not written
RESIDUALS = 2.0  # of the times about even ones, that a rate may drift: they are rounded
UNEVEN_FRAMES = 0.25  # times further from even ones are said
NEARLY_ALL = 0.95  # share of rows
SAME_FRAMES = 1.5  # a frame number and a time that are nearer agree: times may be rounded to hundredths
AGREEING_SHARE = 0.8  # of rows, if numbers count frames
FAR = 3.0  # of the distance that nearly all times have: those beyond are damaged
MAX_ASTRAY = 2  # rows at an end, beyond a gap longer than the take: damaged
SAME_TIME_S = 1e-9  # added from row to row: rounded times may repeat


@dataclass(frozen=True, slots=True, eq=False)
class RowClock:
    """Rows (N,) that are frames, their frames (N,) from 0 on, and the frame rate, 0 of a still without one."""

    rows: IntArray
    frames: IntArray
    fps: float


def place_rows(numbers: FloatArray, times: FloatArray, rate: float, notes: list[str]) -> RowClock:
    """Frames of the rows of a table from their frame numbers (T,) and times in seconds (T,), NaN where there is none.

    Parameters
    ----------
    rate
        That is stated for the file, or 0; good times overrule it.
    """
    seconds = _in_seconds(times, notes)
    at = np.rint(_frames_of_rows(numbers, seconds))
    rows = _without_astray_ends(np.flatnonzero(_increase(at)), at)
    frames = (at[rows] - at[rows[0]]).astype(np.int64)
    return RowClock(rows, frames, _frame_rate(frames, seconds[rows], rate, notes))


def _frames_of_rows(numbers: FloatArray, seconds: FloatArray) -> FloatArray:
    """Frames (T,) of rows, NaN where neither their number nor their time says one."""
    numbers = np.where(np.isfinite(numbers) & (numbers == np.rint(numbers)), numbers, np.nan)
    is_numbered, is_timed = _increase(numbers), _increase(seconds + SAME_TIME_S * np.arange(len(seconds)))
    if not _are_most(is_numbered):
        return _frames_of_times(seconds) if _are_most(_increase(seconds)) else np.arange(len(numbers), dtype=np.float64)
    counted = numbers / np.median(np.diff(numbers[is_numbered]))
    both = is_numbered & is_timed
    if not _are_most(both) or not np.ptp(seconds[both]) > 0:
        return np.where(is_numbered, counted, np.nan)
    slope, start, _ = _fit_line(counted[both], seconds[both])
    if slope <= SAME_TIME_S:
        return np.where(is_numbered, counted, np.nan)
    timed = (seconds - start) / slope
    is_same = np.abs(timed - counted) < SAME_FRAMES
    # numbers that go on over a pause, or leap where the times do not, are no frames
    if is_same[both].mean() < AGREEING_SHARE and _are_most(_increase(seconds)):
        return _frames_of_times(seconds)
    return np.where(is_same | (is_numbered & ~is_timed), counted, np.where(is_timed, timed, np.nan))


def _increase(values: FloatArray) -> Mask:
    """Rows (T,) of a longest increasing part of values, of which NaN are none."""
    found = np.isfinite(values)
    found[found] = longest_increasing(values[found])
    return found


def _are_most(rows: Mask) -> bool:
    return len(rows) > 1 and bool(rows.sum() > max(1, GOOD_SHARE * len(rows)))


def _in_seconds(times: FloatArray, notes: list[str]) -> FloatArray:
    known = times[np.isfinite(times)]
    if len(known) < 2 or np.median(np.abs(np.diff(known))) <= MAX_STEP_S:
        return times
    notes.append("its times are taken for milliseconds")
    return times / 1000.0


def _frames_of_times(seconds: FloatArray) -> FloatArray:
    """Frames (T,) from the first good time on, as real numbers."""
    known = seconds[_increase(seconds)]
    steps = np.diff(known)
    usual = float(steps[steps <= GAP_STEPS * np.median(steps)].mean())
    frames = np.concatenate([[0.0], np.cumsum(np.rint(steps / usual))])
    slope, start, _ = _fit_line(frames, known)
    return (seconds - start) / slope


def _fit_line(frames: FloatArray, times: FloatArray) -> tuple[float, float, float]:
    """Seconds from frame to frame, time of frame 0, and how far the times that are near lie at most.

    The median slope over half of the frames (after Theil 1950), then least squares without times far from it.
    """
    half = len(frames) // 2
    slope = float(np.median((times[half:] - times[:-half]) / (frames[half:] - frames[:-half])))
    start = float(np.median(times - slope * frames))
    away = np.abs(times - start - slope * frames)
    keep = away <= FAR * np.quantile(away, NEARLY_ALL, method="lower") + SAME_TIME_S
    centred = frames[keep] - frames[keep].mean()
    slope = float(centred @ times[keep] / (centred @ centred))
    start = float(times[keep].mean() - slope * frames[keep].mean())
    return slope, start, float(np.abs(times - start - slope * frames)[keep].max())


def _without_astray_ends(rows: IntArray, at: FloatArray) -> IntArray:
    """Rows without one or two at an end that lie further from all others than these from each other."""
    for n in range(1, MAX_ASTRAY + 1):
        if len(rows) < 2 * (n + 1):
            break
        if at[rows[n]] - at[rows[n - 1]] > at[rows[-1]] - at[rows[n]]:
            rows = rows[n:]
        if at[rows[-n]] - at[rows[-n - 1]] > at[rows[-n - 1]] - at[rows[0]]:
            rows = rows[:-n]
    return rows


def _frame_rate(frames: IntArray, seconds: FloatArray, rate: float, notes: list[str]) -> float:
    """The simplest rate that the times of the frames allow; the one stated, where they are none."""
    there = _increase(seconds + SAME_TIME_S * np.arange(len(seconds)))
    if not _are_most(there) or not np.ptp(seconds[there]) > 0:
        return rate
    at = frames[there].astype(np.float64)
    slope, _, uneven = _fit_line(at, seconds[there])
    # numbers and times that have nothing to do with each other
    if slope <= SAME_TIME_S or (rate > 0 and uneven > slope):
        return rate
    if uneven > UNEVEN_FRAMES * slope:
        notes.append(f"its times are not even; places are moved by up to {1000 * uneven:.1f} ms")
    allowed = max(RESIDUALS * uneven, MIN_DRIFT_FRAMES * slope)
    timed = 1.0 / slope
    ntsc = (nominal * 1000 / 1001 for nominal in NTSC_NOMINAL_RATES)
    for simple in (rate, round(timed), *ntsc, round(timed, 2)):
        if simple > 0 and abs(1.0 / simple - slope) * (at[-1] - at[0]) <= allowed:
            return float(simple)
    return timed
