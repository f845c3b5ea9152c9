"""Rows of marker tables stand where most times and frame numbers say; a damaged one costs its row at most."""

import numpy as np
import pytest

from corpus_tools.decomposition.marker_clock import RowClock, place_rows

N = 200
NONE = np.full(N, np.nan)
LATER = "rows left out"


def numbers(**wrong: float) -> np.ndarray:
    counted = np.arange(1.0, N + 1)
    for row, value in wrong.items():
        counted[int(row[1:])] = value
    return counted


def times(fps: float, digits: int = 6, n_rows: int = N) -> np.ndarray:
    return np.round(np.arange(n_rows) / fps, digits)


def place(counted: np.ndarray, seconds: np.ndarray, rate: float = 0.0) -> tuple[RowClock, list[str]]:
    notes = list[str]()
    return place_rows(counted, seconds, rate, notes), notes


@pytest.mark.parametrize(
    "wrong",
    [
        {"_3": 5000.0},
        {"_100": 3.0},
        {"_50": 50.5},
        {"_9": np.inf},
        {"_0": 900.0},
        {"_199": 1e9},
        {"_60": -4.0, "_61": 1e6},
    ],
)
@pytest.mark.parametrize("digits", [2, 3, 6, None])
def test_a_wrong_frame_number_costs_its_row_at_most(wrong: dict[str, float], digits: int | None) -> None:
    clock, _ = place(numbers(**wrong), NONE if digits is None else times(60.0, digits), 60.0)
    lost = {int(row[1:]) for row in wrong}
    if digits is not None and digits > 2:
        lost = set[int]()
    assert set(range(N)) - set(clock.rows.tolist()) <= lost
    np.testing.assert_array_equal(clock.frames - clock.rows, clock.frames[0] - clock.rows[0])
    assert clock.fps == 60.0


@pytest.mark.parametrize(("row", "value"), [(3, 700.0), (100, 0.0), (100, 1.7), (0, 1e6), (199, 1e6), (50, np.nan)])
@pytest.mark.parametrize("is_counted", [True, False])
def test_a_wrong_time_costs_its_row_at_most(row: int, value: float, is_counted: bool) -> None:
    seconds = times(60.0)
    seconds[row] = value
    clock, _ = place(numbers() if is_counted else NONE, seconds, 60.0)
    assert set(range(N)) - set(clock.rows.tolist()) <= {row}
    np.testing.assert_array_equal(clock.frames - clock.rows, clock.frames[0] - clock.rows[0])
    assert clock.fps == 60.0


@pytest.mark.parametrize("digits", [3, 6])
@pytest.mark.parametrize("fps", [120.12, 119.88, 60 * 1000 / 1001, 99.9])
def test_times_overrule_a_rate_that_is_nearly_right(fps: float, digits: int) -> None:
    seconds = times(fps, digits, 72_000)  # ten minutes, in which .1 % are .6 s
    clock, _ = place(np.arange(72_000.0), seconds, round(fps))
    assert abs((len(seconds) - 1) / clock.fps - (len(seconds) - 1) / fps) < 2e-3
    assert abs(clock.fps - fps) < 1e-3


@pytest.mark.parametrize("digits", [2, 3])
@pytest.mark.parametrize("fps", [50.0, 60.0, 120.0, 30000 / 1001])
def test_rounded_times_leave_a_right_rate(fps: float, digits: int) -> None:
    clock, notes = place(numbers(), times(fps, digits), fps)
    assert (clock.fps, len(clock.rows), notes[1:]) == (fps, N, [])


@pytest.mark.parametrize("counted", [NONE, numbers(), numbers() * 0.0, numbers() * 2])
def test_a_hole_in_the_times_is_a_gap(counted: np.ndarray) -> None:
    seconds = times(60.0)
    seconds[120:] += 1.0
    clock, _ = place(counted, seconds, 60.0)
    assert (clock.frames[119], clock.frames[120], clock.frames[-1], clock.fps) == (119, 180, 259, 60.0)


@pytest.mark.parametrize("seconds", [NONE, np.zeros(N), np.full(N, 4.0)])
def test_without_times_the_stated_rate_and_the_numbers_count(seconds: np.ndarray) -> None:
    counted = numbers()
    counted[120:] += 60
    clock, _ = place(counted, seconds, 50.0)
    assert (clock.frames[119], clock.frames[120], clock.fps) == (119, 180, 50.0)
    assert place(NONE, seconds, 50.0)[0].frames.tolist() == list(range(N))


def test_milliseconds_are_said() -> None:
    clock, notes = place(NONE, 1000 * times(60.0))
    assert (clock.fps, clock.frames[-1], notes) == (60.0, N - 1, ["its times are taken for milliseconds"])


def test_uneven_times_are_said() -> None:
    uneven = times(60.0) + np.random.default_rng(2).uniform(0, 0.012, N)
    clock, notes = place(numbers(), uneven)
    assert clock.fps == pytest.approx(60.0, abs=0.2)
    assert len(clock.rows) == N
    assert notes[0].startswith("its times are not even; places are moved by up to")
