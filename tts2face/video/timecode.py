"""Times of frames that are labelled by timecodes, frame numbers or seconds.

Timecodes are ``HH:MM:SS:FF`` with fractions of frames. ``;`` or a point before two digits of frames says drop frame
(SMPTE ST 12-1): 30 or 60 frames are counted to a second that has 29.97 or 59.94, and in each minute but the tenth the
first 2 or 4 numbers are skipped.
"""

import re
from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray

TIMECODE_RATES = (24, 25, 30, 50, 60, 120)  # frames in a second of timecode
DEFAULT_TIMECODE_RATE = 60  # of Live Link Face
DROP_RATES = (30, 60, 120)  # that have numbers to skip: two of thirty
DAY_S = 86_400.0
RATE_OPTIONS = "--take-fps (mimic) or --marker-rate (corpus gestures) sets another rate"
MAX_STEP_S = 0.2  # between numbers that are seconds; numbers of frames are further apart
MAX_MISMATCH_STEPS = 2.5  # frames lost at every end of a second: above it the rate is not found there
_TIMECODE = re.compile(r"\s*(\d+):(\d+):(\d+)(?:([:;.,])(\d+)(?:[.,](\d+))?)?\s*")


@dataclass(frozen=True, slots=True, eq=False)
class FrameClock:
    """Times (T,) in seconds, NaN where a label is none; the length of a day of such labels; and what was guessed."""

    times: FloatArray
    day_s: float = DAY_S
    notes: tuple[str, ...] = ()


def parse_times(labels: list[str], rate: float | None = None) -> FrameClock:
    """Times of the labels of frames.

    Parameters
    ----------
    rate
        Frames that are counted to a second, where the labels do not show it.
    """
    found = [_TIMECODE.fullmatch(label) for label in labels]
    if not any(found):
        return _parse_numbers(labels, rate)
    fields = np.full((len(labels), 3), np.nan)
    signs = set()
    for row, match in enumerate(found):
        if match is None:
            continue
        hours, minutes, seconds, sign, frames, fraction = match.groups()
        fields[row] = 60 * int(hours) + int(minutes), int(seconds), float(f"{frames or 0}.{fraction or 0}")
        signs.add(sign)
    points = [match for match in found if match and match[4] in (".", ",")]
    # a point divides seconds: three digits or more, or more than any number of frames
    if points and not signs & {":", ";"} and any(len(match[5]) != 2 or int(match[5]) > 59 for match in points):
        seconds = [np.nan if m is None else float(f"{int(m[3])}.{m[5] or 0}") for m in found]
        return FrameClock(60.0 * fields[:, 0] + np.array(seconds))
    counted, notes = _counted_rate(fields, rate)
    is_drop = bool(signs & {";", ".", ","}) and counted in DROP_RATES and not _has_skipped_numbers(fields, counted)
    minutes, seconds, frames = fields.T
    number = (60.0 * minutes + seconds) * counted + frames
    if not is_drop:
        return FrameClock(number / counted, notes=notes)
    skipped = counted // 15
    number -= skipped * (minutes - minutes // 10)
    day = (DAY_S * counted - skipped * 9 * 144) * 1.001 / counted
    return FrameClock(number * 1.001 / counted, day, notes)


def _parse_numbers(labels: list[str], rate: float | None) -> FrameClock:
    """Seconds, or frame numbers."""
    numbers = np.array([_number(label) for label in labels])
    steps = np.diff(numbers[np.isfinite(numbers)])
    if not len(steps) or np.median(np.abs(steps)) <= MAX_STEP_S:
        return FrameClock(numbers, np.inf)
    if rate is not None:
        return FrameClock(numbers / rate, np.inf)
    note = (
        f"it has frame numbers, which are taken for {DEFAULT_TIMECODE_RATE} a second as in Live Link Face; "
        f"{RATE_OPTIONS}"
    )
    return FrameClock(numbers / DEFAULT_TIMECODE_RATE, np.inf, (note,))


def _number(label: str) -> float:
    try:
        return float(label.replace(",", "."))
    except ValueError:
        return np.nan


def _counted_rate(fields: FloatArray, rate: float | None) -> tuple[int, tuple[str, ...]]:
    """Frames counted to a second of timecode, and a note where the whole take does not show it.

    The last number of a second and the first of the next one are one step apart at the right rate.
    """
    known = fields[np.isfinite(fields[:, 0])]
    top = known[:, 2].max()
    possible = [counted for counted in TIMECODE_RATES if counted > top] or [int(top) + 1]
    if rate is not None and (given := round(rate)) > top:
        return given, ()
    steps, seconds = np.diff(known[:, 2]), np.diff(60.0 * known[:, 0] + known[:, 1])
    inside, across = steps[(seconds == 0) & (steps > 0)], steps[seconds == 1]
    if len(inside) and len(across):
        step = float(np.median(inside))
        away = [abs(float(np.median(across)) + counted - step) for counted in possible]
        if min(away) <= MAX_MISMATCH_STEPS * step:
            return possible[int(np.argmin(away))], ()
    counted = DEFAULT_TIMECODE_RATE if DEFAULT_TIMECODE_RATE in possible else possible[0]
    if counted == possible[0]:
        return counted, ()
    return counted, (
        f"its timecodes do not show how many frames they count to a second; {counted} are taken, as of Live Link Face; "
        f"{RATE_OPTIONS}",
    )


def _has_skipped_numbers(fields: FloatArray, counted: int) -> bool:
    """Whether a frame has a number that drop frame skips."""
    minutes, seconds, frames = fields.T
    return bool(((minutes % 10 != 0) & (seconds == 0) & (frames < counted // 15)).any())
