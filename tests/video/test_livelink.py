"""Takes of Live Link Face and tables like them are read with what they hold; what is missing or guessed is said."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.video.livelink import FaceCapture, read_livelink

HEAD = ("HeadYaw", "HeadPitch", "HeadRoll")
NAMES = (*(name[0].upper() + name[1:] for name in ARKIT_SHAPES), *HEAD)
TEN = 10 * 3600.0  # o'clock
FOUR_S = np.arange(240) / 60
AT = {name.lower(): column for column, name in enumerate(("Timecode", "BlendShapeCount", *NAMES))}
ONE_LEFT_OUT = "rows left out, as their time is missing, damaged or no later one: 1"


def jaw(times: np.ndarray) -> np.ndarray:
    return 0.25 - 0.25 * np.cos(2 * np.pi * np.asarray(times))


def timecode(second: float, counted: int = 60, sign: str = ":") -> str:
    frames = round((second % 86400) * counted * 1000) / 1000
    whole = int(frames // counted)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}{sign}{frames - whole * counted:06.3f}"


def rows_of(times: Sequence[float], labels: Sequence[str], names: Sequence[str] = NAMES) -> list[list[str]]:
    rows = [["Timecode", "BlendShapeCount", *names]]
    for value, label in zip(jaw(np.asarray(times)), labels, strict=True):
        rows.append([label, "61", *(f"{value:.6f}" if name.lower() == "jawopen" else "0.000000" for name in names)])
    return rows


def read(folder: Path, rows: list[list[str]], delimiter: str = ",", **options: float) -> FaceCapture:
    path = folder / "take.csv"
    path.write_text("\n".join(delimiter.join(row) for row in rows) + "\n", encoding="utf-8")
    return read_livelink(path, **options)


def jaw_error(capture: FaceCapture) -> float:
    """Largest difference of the jaw from the truth, at the times of the capture's frames."""
    values = capture.weights.values[:, capture.weights.channels.index("jawOpen")]
    return float(np.abs(values - jaw(np.arange(len(values)) / capture.weights.fps)).max())


@pytest.mark.parametrize(
    ("counted", "fps"), [(24, 24), (25, 25), (30, 30), (50, 50), (60, 60), (60, 30), (60, 30000 / 1001), (120, 60)]
)
def test_the_frame_rate_is_found(counted: int, fps: float, tmp_path: Path) -> None:
    times = np.arange(round(4 * fps)) / fps
    found = read(tmp_path, rows_of(times, [timecode(TEN + 5.5 + time, counted) for time in times]))
    assert found.weights.fps == pytest.approx(fps, abs=1e-9)
    assert jaw_error(found) < 1e-3
    assert found.notes == ()


@pytest.mark.parametrize("counted", [24, 25, 30, 50, 60])
def test_the_first_frame_of_a_second_shows_the_rate(counted: int, tmp_path: Path) -> None:
    times = np.arange(counted + 1) / counted
    found = read(tmp_path, rows_of(times, [timecode(TEN + time, counted) for time in times]))
    assert (len(found.weights), found.weights.fps, found.notes) == (counted + 1, counted, ())


@pytest.mark.parametrize("day", [86_398.0, 86_399.99])
def test_a_take_goes_on_after_midnight(day: float, tmp_path: Path) -> None:
    found = read(tmp_path, rows_of(FOUR_S, [timecode(day + time) for time in FOUR_S]))
    assert (len(found.weights), found.weights.fps, found.notes) == (240, 60.0, ())
    assert jaw_error(found) < 1e-3


def test_a_second_without_a_face_keeps_its_time(tmp_path: Path) -> None:
    times = np.concatenate([FOUR_S[:121], FOUR_S[121:] + 1.0])
    found = read(tmp_path, rows_of(times, [timecode(TEN + time) for time in times]))
    assert len(found.weights) == 300
    np.testing.assert_allclose(found.gaps, [(2.0, 3.0 + 1 / 60)])
    assert found.notes == ("there is no face from 2.00 to 3.02 s; the pose relaxes there to the take's usual one",)
    values = found.weights.values[:, found.weights.channels.index("jawOpen")]
    assert np.abs(values[:121] - jaw(np.arange(121) / 60)).max() < 1e-6
    assert values[150] == pytest.approx(np.median(jaw(times)), abs=1e-6)
    assert np.abs(np.diff(values)).max() < 0.05  # no leap: a motion through the whole range takes a quarter second


def test_frames_that_were_dropped_keep_their_time(tmp_path: Path) -> None:
    kept = FOUR_S[np.random.default_rng(3).uniform(size=240) > 0.3]
    kept = np.concatenate([[0.0], kept[(kept > 0) & (kept < FOUR_S[-1])], FOUR_S[-1:]])
    found = read(tmp_path, rows_of(kept, [timecode(TEN + time) for time in kept]))
    assert (len(found.weights), found.weights.fps) == (240, 60.0)
    assert jaw_error(found) < 0.02
    assert any(note.startswith("frames missing") for note in found.notes)


@pytest.mark.parametrize("again", [0.0, -0.004])
def test_a_row_that_is_not_later_is_left_out(again: float, tmp_path: Path) -> None:
    labels = [timecode(TEN + time) for time in FOUR_S]
    labels[120] = timecode(TEN + FOUR_S[119] + again)
    found = read(tmp_path, rows_of(FOUR_S, labels))
    assert len(found.weights) == 240
    assert jaw_error(found) < 0.01
    assert found.notes[0] == "rows left out, as their time is missing, damaged or no later one: 1"


def test_a_clock_that_was_set_goes_on(tmp_path: Path) -> None:
    labels = [timecode(TEN + time + (4000.0 if time > 1 else 0.0) - (6000.0 if time > 3 else 0.0)) for time in FOUR_S]
    labels[200] = timecode(3.0)  # a single one astray
    found = read(tmp_path, rows_of(FOUR_S, labels))
    assert len(found.weights) == 240
    assert jaw_error(found) < 0.01
    assert "its clock leaps at 1.00 s, 3.00 s; the rows after it follow without a pause" in found.notes


def test_a_clock_that_stands_still_counts_rows(tmp_path: Path) -> None:
    found = read(tmp_path, rows_of(FOUR_S, ["00:00:00:00.000"] * 240), fps=30.0)
    assert (len(found.weights), found.weights.fps) == (240, 30.0)
    assert any("stands still" in note for note in found.notes)


@pytest.mark.parametrize(("sign", "counted"), [(";", 30), (";", 60), (".", 30)])
def test_drop_frame_counts_real_time(sign: str, counted: int, tmp_path: Path) -> None:
    fps, skipped = counted * 1000 / 1001, counted // 15
    number, labels = (10 * 60 + 8) * 60 * counted + 58 * counted, list[str]()  # from 10:08:58 on, over a minute's end
    while len(labels) < 4 * counted:
        whole, frame = divmod(number, counted)
        number += 1
        if whole % 60 == 0 and whole // 60 % 10 and frame < skipped:
            continue
        labels.append(f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}{sign}{frame:02d}")
    times = np.arange(len(labels)) / fps
    found = read(tmp_path, rows_of(times, labels))
    assert found.weights.fps == pytest.approx(fps, abs=1e-6)
    assert len(found.weights) == len(labels)
    assert jaw_error(found) < 1e-3


def test_seconds_with_a_fraction_are_read(tmp_path: Path) -> None:
    found = read(tmp_path, rows_of(FOUR_S, [f"10:00:{time + 5:06.3f}" for time in FOUR_S]))
    assert found.weights.fps == 60.0
    assert jaw_error(found) < 0.01
    rows = rows_of(FOUR_S, [f"{time:.4f}" for time in FOUR_S])
    numbers = read(tmp_path, rows)
    assert numbers.weights.fps == 60.0
    assert numbers.notes == ()
    assert read(tmp_path, rows, fps=25.0).notes == (
        "it has times; the 25 frames a second that were given are not used",
    )


def test_frame_numbers_count_to_60_without_an_option(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [str(frame) for frame in range(240)])
    found = read(tmp_path, rows)
    assert (len(found.weights), found.weights.fps) == (240, 60.0)
    assert any("frame numbers, which are taken for 60 a second" in note for note in found.notes)
    assert read(tmp_path, rows, fps=30.0).weights.fps == 30.0


def test_a_take_within_one_second_counts_to_60_without_an_option(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S[:20], [timecode(TEN + time) for time in FOUR_S[:20]])
    found = read(tmp_path, rows)
    assert (len(found.weights), found.weights.fps) == (20, 60.0)
    assert any("60 are taken" in note for note in found.notes)
    assert read(tmp_path, rows, fps=24.0).weights.fps == 24.0
    crossing = read(tmp_path, rows_of(FOUR_S[:20], [timecode(TEN + 5.9 + time) for time in FOUR_S[:20]]))
    assert (crossing.weights.fps, crossing.notes) == (60.0, ())


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_tables_of_a_spreadsheet_with_decimal_commas(delimiter: str, tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S])
    rows = [rows[0], *([cell.replace(".", ",") for cell in row] for row in rows[1:])]
    found = read(tmp_path, [*rows, *[[""] * len(rows[0])] * 3], delimiter)
    assert (len(found.weights), found.notes) == (240, ())
    assert jaw_error(found) < 1e-3
    path = tmp_path / "take.csv"
    path.write_bytes(b"\xef\xbb\xbfsep=" + delimiter.encode() + b"\r\n" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert jaw_error(read_livelink(path)) < 1e-3


@pytest.mark.parametrize("short", [False, True])
def test_names_are_compared_without_case_and_in_any_order(short: bool, tmp_path: Path) -> None:
    names = [name.replace("Left", "_L").replace("Right", "_R") if short else name for name in ARKIT_SHAPES[::-1]]
    rows = rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S], names)
    rows = [[*row, "note" if row is rows[0] else "good"] for row in rows]  # a column of the user's own
    found = read(tmp_path, [[*row[1:], row[0]] for row in rows])
    assert set(found.weights.channels) == set(ARKIT_SHAPES)
    assert not found.head.values.any()
    assert jaw_error(found) < 1e-3


def lost_face(rows: list[list[str]]) -> list[list[str]]:
    rows[100:106] = [[row[0], "0", *("" for _ in NAMES)] for row in rows[100:106]]
    rows[180] = [rows[180][0], "0"]
    return rows


def spoilt_cells(rows: list[list[str]]) -> list[list[str]]:
    rows[40][AT["jawopen"]] = "NaN"
    rows[41][AT["jawopen"]] = rows[42][0] = ""
    return [*rows[:60], [], rows[0], *rows[60:], rows[0], rows[-1][:30]]


def with_slates(rows: list[list[str]]) -> list[list[str]]:
    """Two columns of the user's own, whose empty cells are not written."""
    rows[0] += ["Slate", "Take"]
    for row in rows[200:]:
        row += ["4A", ""]
    return rows


def without_last_times(rows: list[list[str]]) -> list[list[str]]:
    """The column of times stands last, and some rows end before it."""
    return [[*row[1:], *([] if 100 <= number < 105 else row[:1])] for number, row in enumerate(rows)]


def with_cell(row: int, name: str, value: str) -> Callable[[list[list[str]]], list[list[str]]]:
    return lambda rows: [
        [value if (number, column) == (row, AT[name]) else cell for column, cell in enumerate(cells)]
        for number, cells in enumerate(rows)
    ]


def with_times(labels: dict[int, str]) -> Callable[[list[list[str]]], list[list[str]]]:
    return lambda rows: [[labels.get(number, row[0]), *row[1:]] for number, row in enumerate(rows)]


@pytest.mark.parametrize(
    ("damage", "notes"),
    [
        (lost_face, {"rows without a face: 7", "frames missing from 1.63 s on, which are interpolated: 7"}),
        (spoilt_cells, {"rows left out, as they have more or fewer cells than columns: 1",
                        "cells without a number, which are interpolated: 2"}),
        (with_times({60: "10:00:00:75.000"}), {ONE_LEFT_OUT,
                                               "frames missing from 0.97 s on, which are interpolated: 1"}),
        (with_times({60: "10:00:00:45.000"}), {ONE_LEFT_OUT}),  # a possible number, a quarter second early
        (with_times({60: "10:00:01:10.000"}), {ONE_LEFT_OUT}),  # and late: no row after it is lost
        (with_times({60: "10:00:09:59.000", 61: "10:00:09:60.000"}), {ONE_LEFT_OUT[:-1] + "2"}),
        (with_times({3: "10:00:40:10.000"}), {ONE_LEFT_OUT}),  # soon after the first row
        (with_times({60: "01:00:00:10.000", 61: "10:00:30:00.000"}), {ONE_LEFT_OUT[:-1] + "2"}),
        (with_times({60: "10:00:00:59.000", 61: "10:00:01;00"}), set()),  # one sign of drop frame
        (with_cell(60, "timecode", "600"), {ONE_LEFT_OUT}),
        (with_cell(60, "jawopen", "23"), {"cells that no face can have are left out: JawOpen 23 at 0.98 s"}),
        (with_cell(60, "jawopen", "-1e40"), {"cells that no face can have are left out: JawOpen -1e+40 at 0.98 s"}),
        (with_cell(1, "mouthclose", "99"), {"cells that no face can have are left out: MouthClose 99 at 0.00 s"}),
        (with_cell(60, "jawopen", "-1.8"), {"cells that no face can have are left out: JawOpen -1.8 at 0.98 s"}),
        (with_cell(60, "headyaw", "7.5"), {"cells that no face can have are left out: HeadYaw 7.5 at 0.98 s"}),
        (with_cell(60, "headroll", "inf"), {"cells without a number, which are interpolated: 1"}),
        (lambda rows: [[*rows[0], ""], *rows[1:]], set()),  # a comma at the end of the heading
        (lambda rows: [rows[0], *([*row, "", ""] for row in rows[1:])], set()),  # at the ends of rows
        (lambda rows: [rows[0][:-3], *(row[:-2] for row in rows[1:])], set()),  # of headings, without the last names
        (with_slates, set()),
        (without_last_times, {"rows left out, as their time is missing, damaged or no later one: 5"}),
        (lambda rows: [["Anna; take 3; 60 fps; good"], *rows], set()),
        (lambda rows: [["a\tb\tc; d"], [], *rows], set()),
    ],
)  # fmt: skip
def test_damage_costs_the_damaged_cells_only(
    damage: Callable[[list[list[str]]], list[list[str]]], notes: set[str], tmp_path: Path
) -> None:
    found = read(tmp_path, damage(rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S])))
    assert (len(found.weights), found.weights.fps) == (240, 60.0)
    assert jaw_error(found) < 0.03
    assert np.abs(found.head.values).max() == 0.0
    assert notes <= set(found.notes)
    assert bool(notes) == bool(found.notes)


@pytest.mark.parametrize(("row", "label"), [(0, "09:00:00:00.000"), (239, "10:20:00:00.000"), (239, "10:00:03:75.000")])
def test_a_damaged_time_at_an_end_costs_that_row(row: int, label: str, tmp_path: Path) -> None:
    times = FOUR_S - (row == 0) / 60
    found = read(
        tmp_path, rows_of(times, [label if n == row else timecode(TEN + time) for n, time in enumerate(FOUR_S)])
    )
    assert (len(found.weights), found.weights.fps, found.notes) == (239, 60.0, (ONE_LEFT_OUT,))
    assert jaw_error(found) < 1e-3


@pytest.mark.parametrize("leaps", [(10.0, -10.0), (-10.0, 10.0), (70.0, -70.0)])
def test_a_clock_that_is_set_and_set_back_leaves_no_gap(leaps: tuple[float, float], tmp_path: Path) -> None:
    labels = [timecode(TEN + time + leaps[0] * (time > 1) + leaps[1] * (time > 2)) for time in FOUR_S]
    found = read(tmp_path, rows_of(FOUR_S, labels))
    assert len(found.weights) == 240
    assert jaw_error(found) < 0.01
    assert found.notes == ("its clock leaps at 1.00 s, 2.00 s; the rows after it follow without a pause",)


@pytest.mark.parametrize(
    ("column", "per_second", "said"),
    [
        ("Timecode", 1e3, "milliseconds"),
        ("timestamp", 1e6, "microseconds"),
        ("Time", 1e9, "nanoseconds"),
        ("Time (ms)", 1e3, ""),
        ("timestamp_us", 1e6, ""),
        ("Time [s]", 1.0, ""),
    ],
)
@pytest.mark.parametrize("fps", [30, 60])
def test_times_in_parts_of_seconds(column: str, per_second: float, said: str, fps: int, tmp_path: Path) -> None:
    times = np.arange(4 * fps) / fps
    start = 1.7e9 if per_second > 1 else 0.0  # from 1970 on, as programs write it
    rows = rows_of(times, [f"{(start + time) * per_second:.{0 if per_second > 1 else 4}f}" for time in times])
    found = read(tmp_path, [[column, *rows[0][1:]], *rows[1:]])
    assert (len(found.weights), found.weights.fps) == (4 * fps, fps)
    assert jaw_error(found) < 0.01
    assert [said in note for note in found.notes] == [True] * bool(said)


def test_frame_numbers_in_steps_are_no_milliseconds(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [str(8 * frame) for frame in range(240)])
    assert read(tmp_path, rows, fps=240.0).weights.fps == 30.0
    assert read(tmp_path, [["Frame", *rows[0][1:]], *rows[1:]], fps=480.0).weights.fps == 60.0


def test_seconds_of_few_frames_are_no_frame_numbers(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="has 3 frames per second by its column Timecode"):
        read(tmp_path, rows_of(FOUR_S, [f"{frame / 3:.4f}" for frame in range(240)]))


def test_a_rate_that_the_timecodes_contradict_is_said(tmp_path: Path) -> None:
    found = read(tmp_path, rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S]), fps=30.0)
    assert (found.weights.fps, jaw_error(found) < 1e-3) == (60.0, True)
    assert found.notes == ("its timecodes count up to frame 59, which 30 frames a second do not have; 60 are taken",)


def test_one_number_that_drop_frame_skips_is_damage(tmp_path: Path) -> None:
    labels = [f"10:01:{59 + (n >= 60):02d};{n % 60:02d}" for n in range(60)]
    labels += [f"10:02:{second:02d};{n:02d}" for second in range(3) for n in range(4 * (not second), 60)]
    labels[64] = "10:02:00;01"
    found = read(tmp_path, rows_of(np.arange(len(labels)) * 1.001 / 60, labels))
    assert found.weights.fps == pytest.approx(60 / 1.001, abs=1e-6)


def test_a_still_head_in_degrees_and_a_large_weight_are_read(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S])
    for number, row in enumerate(rows[1:]):
        row[AT["headyaw"]] = f"{90 + 3 * np.sin(number / 20):.4f}"
        row[AT["jawopen"]] = f"{3 * float(row[AT['jawopen']]):.4f}"  # of a program that exaggerates
    found = read(tmp_path, rows)
    assert np.ptp(found.head.values[:, 1]) == pytest.approx(np.radians(6), abs=0.01)
    assert found.weights.values.max() == pytest.approx(1.5, abs=0.01)


def test_a_head_that_turns_over_half_a_circle_does_not_leap(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S])
    for number, row in enumerate(rows[1:]):
        roll = np.pi + 0.1 * np.sin(number / 20)
        row[AT["headroll"]] = f"{roll - 2 * np.pi * (roll > np.pi):.5f}"
    found = read(tmp_path, rows)
    assert np.abs(found.head.values[:, 2]).max() < 0.15
    assert found.notes == ()


def test_a_take_of_no_frame_says_what_became_of_its_rows(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S])
    with pytest.raises(DataError, match=r"\(0\); rows left out, as they have more or fewer cells than columns: 240"):
        read(tmp_path, [rows[0], *([*row, *row[2:]] for row in rows[1:])])


def test_turns_in_degrees_and_weights_per_cent_are_said(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S, [timecode(TEN + time) for time in FOUR_S])
    at, yaw = rows[0].index("JawOpen"), rows[0].index("HeadYaw")
    for number, row in enumerate(rows[1:]):
        row[at], row[yaw] = f"{100 * float(row[at]):.4f}", str(number % 60)
    found = read(tmp_path, rows)
    assert jaw_error(found) < 1e-3
    assert np.ptp(found.head.values[:, 1]) == pytest.approx(np.radians(59), abs=0.02)
    assert [note.rpartition("taken for ")[2] for note in found.notes] == ["per cent", "degrees"]


def test_what_is_no_take_is_refused_truly(tmp_path: Path) -> None:
    rows = rows_of(FOUR_S[:1], [timecode(TEN)])
    with pytest.raises(DataError, match="holds fewer than two frames with a time and a face \\(1\\)"):
        read(tmp_path, rows)
    with pytest.raises(DataError, match="no row with a column of times and ARKit's names"):
        read(tmp_path, [["Timecode", "a"], ["1", "2"]])
    with pytest.raises(DataError, match=r"has 5 frames per second by its column Timecode; supported are 10 to 240"):
        read(tmp_path, rows_of(FOUR_S[:20], [timecode(TEN + number / 5) for number in range(20)]))
