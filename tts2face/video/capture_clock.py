"""One clock for the rows of a capture: without repetitions and jumps, across midnight; and its frame rate."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tts2face.numeric.arrays import FloatArray, IntArray, Mask, longest_increasing
from tts2face.video.timecode import FrameClock

MAX_SHORT_GAP_S = 0.5  # a longer one hides a word: the pose in it is not interpolated
MAX_LONG_GAP_S = 60.0  # a longer one is a clock that was set, or another take
MAX_ASTRAY_END = 2  # rows before the first leap, or after the last one, that are damaged and no take
MAX_ASTRAY_RUNS = 3  # beside each other, each with times of its own
STANDARD_RATES = (12.0, 15.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0)
NTSC_RATES = tuple(nominal * 1000 / 1001 for nominal in (24, 30, 48, 60, 120))
RATE_TOLERANCE = 0.02  # of a rate: a capture of few frames is that far from it
NTSC_TOLERANCE = 3e-4  # of a rate, as 29.97 is .1 % from 30; a camera of 60 had 59.904
GAP_STEPS = 1.5  # of the usual step: a longer one is a gap of frames


@dataclass(frozen=True, slots=True, eq=False)
class CaptureTimes:
    """Numbers (N,) of the rows that are frames, their times (N,) from 0 on, increasing, and the frame rate."""

    rows: IntArray
    times: FloatArray
    fps: float
    notes: tuple[str, ...]


def order_frames(clock: FrameClock, still_fps: float) -> CaptureTimes:
    """Frames of a capture in order of time.

    Parameters
    ----------
    still_fps
        Frame rate where the clock stands still.
    """
    rows, notes = np.flatnonzero(np.isfinite(clock.times)), list(clock.notes)
    times = clock.times[rows]
    if len(rows) > 1 and not np.ptp(times):
        notes.append(f"its clock stands still; its rows are taken for {still_fps:g} frames a second")
        times = np.arange(len(rows)) / still_fps
    times = _cross_midnight(times, clock.day_s)
    keep = ~_astray(times)
    rows, times = rows[keep], _continue_clock(times[keep], notes)
    ahead = longest_increasing(times)
    n_lost = len(clock.times) - int(ahead.sum())
    if n_lost:
        notes.append(f"rows left out, as their time is missing, damaged or no later one: {n_lost}")
    rows, times = rows[ahead], times[ahead]
    return CaptureTimes(rows, times - (times[0] if len(times) else 0.0), _frame_rate(times), tuple(notes))


def _cross_midnight(times: FloatArray, day_s: float) -> FloatArray:
    """Times that go on where a day begins: the shorter way round from row to row."""
    if not len(times) or not np.isfinite(day_s):
        return times
    steps = np.diff(times)
    passed = np.where(np.abs(steps) > day_s / 2, steps - np.sign(steps) * day_s, steps)
    return np.cumsum(np.concatenate([times[:1], passed]))


def _astray(times: FloatArray) -> Mask:
    """Rows (T,) of runs whose times lie far from those on both sides, which fit each other; a row or two at an end."""
    found: Mask = np.zeros(len(times), np.bool_)
    if not len(times):
        return found
    runs = _runs(times)
    at = 0
    while at < len(runs):
        last = times[runs[at][1] - 1]
        beyond = runs[at + 2 : at + 2 + MAX_ASTRAY_RUNS]
        fitting = (number for number, run in enumerate(beyond) if 0 < times[run[0]] - last <= MAX_SHORT_GAP_S)
        n_astray = next(fitting, -1) + 1
        if n_astray:
            found[runs[at][1] : runs[at + 1 + n_astray][0]] = True
        at += 1 + n_astray
    kept = np.flatnonzero(~found)
    runs = _runs(times[kept])
    for first, end in (runs[0], runs[-1]):
        if len(runs) > 1 and end - first <= MAX_ASTRAY_END:
            found[kept[first:end]] = True
    return found


def _runs(times: FloatArray) -> list[tuple[int, int]]:
    """First row and one past the last of each run of times without a leap."""
    return list(pairwise([0, *(np.flatnonzero(np.abs(np.diff(times)) > MAX_SHORT_GAP_S) + 1).tolist(), len(times)]))


def _continue_clock(times: FloatArray, notes: list[str]) -> FloatArray:
    """Times without leaps: where the clock was set, the next row follows by the usual step."""
    steps = np.diff(times)
    inner = steps[(steps > 0) & (steps <= MAX_SHORT_GAP_S)]
    is_set = (steps > MAX_LONG_GAP_S) | (steps < -MAX_SHORT_GAP_S)
    if is_set.any() and len(inner):
        usual = float(np.median(inner))
        is_set |= _is_set_back(steps, usual)
        steps = np.where(is_set, usual, steps)
        at = np.concatenate([[0.0], np.cumsum(steps)])[:-1][is_set]
        notes.append(
            f"its clock leaps at {', '.join(f'{second:.2f} s' for second in at[:4])}{' ...' if len(at) > 4 else ''}; "
            "the rows after it follow without a pause"
        )
    return np.concatenate([times[:1], times[:1] + np.cumsum(steps)])


def _is_set_back(steps: FloatArray, usual: float) -> Mask:
    """Steps (T - 1,) of a leap that the next one takes back, of which the forward one alone would be a gap."""
    found: Mask = np.zeros(len(steps), np.bool_)
    leaps = np.flatnonzero(np.abs(steps) > MAX_SHORT_GAP_S)
    for first, second in pairwise(leaps):
        passed = steps[first : second + 1].sum()
        if steps[first] * steps[second] < 0 and 0 < passed <= MAX_SHORT_GAP_S + 2 * usual * (second - first):
            found[[first, second]] = True
    return found


def _frame_rate(times: FloatArray) -> float:
    """Frames a second of increasing times, from all steps without a gap; 0 of fewer than two."""
    steps = np.diff(times)
    if not len(steps):
        return 0.0
    rate = 1.0 / float(steps[steps < GAP_STEPS * np.median(steps)].mean())
    for rates, tolerance in ((NTSC_RATES, NTSC_TOLERANCE), (STANDARD_RATES, RATE_TOLERANCE)):
        nearest = min(rates, key=lambda standard: abs(standard - rate))
        if abs(nearest - rate) <= tolerance * rate:
            return nearest
    return round(rate, 2)
