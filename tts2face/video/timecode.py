"""Times of frames that are labelled by timecodes, frame numbers, seconds or parts of them.

Timecodes are ``HH:MM:SS:FF`` with fractions of frames. ``;`` or a point before two digits of frames says drop frame
(SMPTE ST 12-1): 30 or 60 frames are counted to a second that has 29.97 or 59.94, and in each minute but the tenth the
first 2 or 4 numbers are skipped. What most labels show decides; one that contradicts it has no time.
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from tts2face.numeric.arrays import FloatArray, Mask

TIMECODE_RATES = (24, 25, 30, 50, 60, 120)  # frames in a second of timecode
DEFAULT_TIMECODE_RATE = 60  # of Live Link Face
DROP_RATES = (30, 60, 120)  # that have numbers to skip: two of thirty
DAY_S = 86_400.0
RATE_OPTIONS = "--take-fps (mimic) or --marker-rate (corpus gestures) sets another rate"
TIME_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e3, "milliseconds": 1e3, "us": 1e6, "ns": 1e9}  # in a second
# How programs name the column, in lower case without marks, the best first, with the unit where the name states it.
TIME_COLUMNS: Mapping[str, float | None] = MappingProxyType(
    {"timecode": None, "time": None, "timestamp": None}
    | {f"{name}{unit}": per_second for name in ("time", "timestamp") for unit, per_second in TIME_UNITS.items()}
    | {"frame": None, "framenumber": None}
)
COUNTED = "frame"  # how names of columns with frame numbers begin
MAX_STEP_S = 0.2  # between numbers that are seconds; whole numbers of frames are further apart
MIN_FRAME_S, MAX_FRAME_S = 0.004, 0.11  # between frames at 240 and 10 a second, if their times are in parts of a second
PARTS = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
MOST = 0.9  # share of labels that are whole numbers, if they are frame numbers
MAX_MISMATCH_STEPS = 2.5  # frames lost at every end of a second: above it the rate is not found there
TOP_QUANTILE = 0.75  # of the highest numbers of all seconds: the first and the last second are not whole
HUNDREDTHS_SHARE = 0.05  # of numbers of two digits above 59, if they are no frames; of hundredths two fifths are
_TIMECODE = re.compile(r"\s*(\d{1,9}):(\d{1,9}):(\d{1,9})(?:([:;.,])(\d{1,15})(?:[.,](\d{1,15}))?)?\s*")


@dataclass(frozen=True, slots=True, eq=False)
class FrameClock:
    """Times (T,) in seconds, NaN where a label is none; the length of a day of such labels; and what was guessed."""

    times: FloatArray
    day_s: float = DAY_S
    notes: tuple[str, ...] = ()


def parse_times(labels: list[str], rate: float | None = None, column: str = "") -> FrameClock:
    """Times of the labels of frames.

    Parameters
    ----------
    rate
        Frames that are counted to a second, where the labels do not show it.
    column
        Name of their column as in `TIME_COLUMNS`.
    """
    codes = [_TIMECODE.fullmatch(label) for label in labels]
    numbers = np.array([_number(label) for label in labels])
    if sum(code is not None for code in codes) <= np.isfinite(numbers).sum():
        return _parse_numbers(numbers, rate, column)
    if _have_fractions_of_seconds(codes):
        seconds = [np.nan if code is None or code[4] in (":", ";") else _seconds(code) for code in codes]
        return FrameClock(np.array(seconds), notes=_unused(rate))
    fields = np.array([(np.nan,) * 3 if code is None else _fields(code) for code in codes])
    sign = Counter(code[4] for code in codes if code).most_common(1)[0][0]
    fitting = fields[_fit_neighbours(fields)]
    counted, notes = _counted_rate(fitting, rate)
    minutes, seconds, frames = np.where((fields[:, 1] < 60) & (fields[:, 2] < counted), fields.T, np.nan)
    number = (60.0 * minutes + seconds) * counted + frames
    is_drop = sign in (";", ".", ",") and counted in DROP_RATES and not _has_skipped_numbers(fitting, counted)
    if not is_drop:
        return FrameClock(number / counted, notes=notes)
    skipped = counted // 15
    number -= skipped * (minutes - minutes // 10)
    day = (DAY_S * counted - skipped * 9 * 144) * 1.001 / counted
    return FrameClock(number * 1.001 / counted, day, notes)


def _fields(code: re.Match[str]) -> tuple[float, float, float]:
    hours, minutes, seconds, _, frames, fraction = code.groups()
    return 60.0 * int(hours) + int(minutes), float(seconds), float(f"{frames or 0}.{fraction or 0}")


def _seconds(code: re.Match[str]) -> float:
    return 60.0 * (60.0 * int(code[1]) + int(code[2])) + float(f"{int(code[3])}.{code[5] or 0}")


def _have_fractions_of_seconds(codes: list[re.Match[str] | None]) -> bool:
    """Whether a point divides seconds: in most labels, which have other than two digits, or more than any frame's."""
    points = [code for code in codes if code is not None and code[4] in (".", ",")]
    if 2 * len(points) <= sum(code is not None for code in codes):
        return False
    n_long = sum(len(code[5]) != 2 for code in points)
    n_high = sum(len(code[5]) == 2 and int(code[5]) >= DEFAULT_TIMECODE_RATE for code in points)
    return 2 * n_long > len(points) or n_high > HUNDREDTHS_SHARE * len(points)


def _parse_numbers(numbers: FloatArray, rate: float | None, column: str) -> FrameClock:
    """Seconds, parts of them, or frame numbers."""
    known = numbers[np.isfinite(numbers)]
    steps = np.abs(np.diff(known))
    step = float(np.median(steps[steps > 0])) if steps.any() else 0.0
    if (unit := TIME_COLUMNS.get(column)) is not None:
        return FrameClock(numbers / unit, np.inf, _unused(rate))
    # seconds at less than 5 frames have fractions; frame numbers have none
    if step <= MAX_STEP_S or (step < 1 and np.mean(known == np.rint(known)) < MOST):
        return FrameClock(numbers, np.inf, _unused(rate if step else None))
    is_counted = column.startswith(COUNTED) or (rate is not None and MIN_FRAME_S <= step / rate <= MAX_FRAME_S)
    part = next((part for part in PARTS if MIN_FRAME_S <= step / part <= MAX_FRAME_S), None)
    if part is not None and not is_counted:
        note = f"its times are {step:g} apart; they are taken for {PARTS[part]}"
        return FrameClock(numbers / part, np.inf, (note, *_unused(rate)))
    if rate is not None:
        return FrameClock(numbers / rate, np.inf)
    note = (
        f"it has frame numbers, which are taken for {DEFAULT_TIMECODE_RATE} a second as in Live Link Face; "
        f"{RATE_OPTIONS}"
    )
    return FrameClock(numbers / DEFAULT_TIMECODE_RATE, np.inf, (note,))


def _unused(rate: float | None) -> tuple[str, ...]:
    """A note on a frame rate that is given for times."""
    return () if rate is None else (f"it has times; the {rate:g} frames a second that were given are not used",)


def _number(label: str) -> float:
    try:
        return float(label.replace(",", "."))
    except ValueError:
        return np.nan


def _fit_neighbours(fields: FloatArray) -> Mask:
    """Rows (T,) whose frame is near that of a row beside them in the same second; all, where few have such a row."""
    known = np.flatnonzero(np.isfinite(fields[:, 0]))
    steps, seconds = np.diff(fields[known, 2]), np.diff(60.0 * fields[known, 0] + fields[known, 1])
    inside = (seconds == 0) & (steps > 0)
    fits: Mask = np.zeros(len(fields), np.bool_)
    if inside.any():
        step = np.median(steps[inside])
        near = inside & (steps <= MAX_MISMATCH_STEPS * step)
        fits[known[1:][near]] = fits[known[:-1][near]] = True
        # a take may end with the first frame of a second
        starts = (seconds == 1) & (fields[known[1:], 2] < step) & fits[known[:-1]]
        fits[known[1:][starts]] = True
    if 2 * fits.sum() < len(known):
        fits[known] = True
    return fits


def _counted_rate(fields: FloatArray, rate: float | None) -> tuple[int, tuple[str, ...]]:
    """Frames counted to a second of timecode, and a note where the whole take does not show it.

    The last number of a second and the first of the next one are one step apart at the right rate.
    """
    steps, at = np.diff(fields[:, 2]), 60.0 * fields[:, 0] + fields[:, 1]
    top = _usual_top(at, fields[:, 2])
    possible = [counted for counted in TIMECODE_RATES if counted > top] or [int(top) + 1]
    notes = list[str]()
    if rate is not None:
        if (given := round(rate)) > top:
            return given, ()
        notes.append(f"its timecodes count up to frame {top:g}, which {rate:g} frames a second do not have")
    seconds = np.diff(at)
    inside, across = steps[(seconds == 0) & (steps > 0)], steps[seconds == 1]
    if len(inside) and len(across):
        step = float(np.median(inside))
        away = [abs(float(np.median(across)) + counted - step) for counted in possible]
        if min(away) <= MAX_MISMATCH_STEPS * step:
            counted = possible[int(np.argmin(away))]
            return counted, tuple(f"{note}; {counted} are taken" for note in notes)
    counted = DEFAULT_TIMECODE_RATE if DEFAULT_TIMECODE_RATE in possible else possible[0]
    if counted == possible[0]:
        return counted, tuple(f"{note}; {counted} are taken" for note in notes)
    return counted, (
        *notes,
        f"its timecodes do not show how many frames they count to a second; {counted} are taken, as of Live Link Face; "
        f"{RATE_OPTIONS}",
    )


def _usual_top(seconds: FloatArray, frames: FloatArray) -> float:
    """The number up to which most seconds count."""
    _, which = np.unique(seconds, return_inverse=True)
    tops = np.zeros(int(which.max()) + 1)
    np.maximum.at(tops, which.ravel(), frames)
    return float(np.quantile(tops, TOP_QUANTILE, method="higher"))


def _has_skipped_numbers(fields: FloatArray, counted: int) -> bool:
    """Whether a frame has a number that drop frame skips."""
    minutes, seconds, frames = fields.T
    return bool(((minutes % 10 != 0) & (seconds == 0) & (frames < counted // 15)).any())
