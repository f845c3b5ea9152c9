"""Marker capture: synthetic motion is recovered from C3D files and tables; damaged files give clear errors."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.decomposition.capture import FaceRecording
from corpus_tools.decomposition.marker_files import read_c3d, read_markers
from corpus_tools.decomposition.marker_gaps import MAX_MARKER_GAP_S, fill_marker_gaps
from corpus_tools.decomposition.marker_sets import DEFAULT_MARKER_TABLE, MarkerSet, read_marker_set
from corpus_tools.decomposition.markers import read_marker_face, read_marker_recording, read_marker_still
from lexicon.errors import DataError, InputError
from tests.corpus_tools.decomposition.made_markers import FPS, SIZE, Made, write_c3d, write_table
from tts2face.models.face import Face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.numeric.arrays import true_runs

REST = slice(0, 60)  # the made performance's frames at rest


@pytest.fixture(scope="module")
def whole(made: Made, face: Face, marker_set: MarkerSet, tmp_path_factory: pytest.TempPathFactory) -> FaceRecording:
    """The made take without gaps, read from a table."""
    path = write_table(tmp_path_factory.mktemp("whole") / "whole.csv", made.names, made.points)
    return read_marker_recording(path, face, marker_set)


def at_rest(made: Made, path: Path) -> Path:
    return write_table(path, made.names, made.points[REST])


def gap(landmarks: np.ndarray) -> np.ndarray:
    return landmarks[:, UPPER_LIP_INNER_MID, 1] - landmarks[:, LOWER_LIP_INNER_MID, 1]


def test_a_c3d_file_gives_head_face_and_sound_again(
    made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path
) -> None:
    sound = np.sin(np.arange(len(made.points) * 100) * 0.1) * 3.0
    path = write_c3d(tmp_path / "take.c3d", made.names, made.points / 1000, units="m", sound=sound)
    found = read_marker_recording(path, face, marker_set, neutral=at_rest(made, tmp_path / "rest.csv"))
    assert found.fps == FPS
    assert found.missing_features == {"gaze"}
    assert found.notes == ()
    assert found.sound is not None
    assert found.sound.duration == pytest.approx(len(made.points) / FPS, abs=0.001)
    assert np.abs(found.sound.samples).max() == pytest.approx(1.0)
    landmark_numbers = list(marker_set.landmarks.values())
    truth = made.landmarks - made.landmarks[0]
    moved = found.landmarks - found.rest
    away = np.linalg.norm(moved - truth, axis=2)
    # The person's axes are found from the markers: a turn of 0.3 degrees moves 10 mm of motion by 0.05 mm.
    assert away[:, landmark_numbers].max() < 0.1
    # Between markers: a quarter of what moves at all.
    assert np.sqrt(np.square(away[:, :468]).mean()) < 0.25 * np.sqrt(np.square(truth[:, :468]).sum(axis=2).mean())
    turns = found.head[:, :3] - found.head[:, :3].mean(axis=0)
    assert np.degrees(np.abs(turns - (made.head[:, :3] - made.head[:, :3].mean(axis=0)))).max() < 2.0
    shifts = found.head[:, 3:] - np.median(found.head[:, 3:], axis=0)
    assert np.abs(shifts - (made.head[:, 3:] - np.median(made.head[:, 3:], axis=0))).max() < 3.0


def test_rest_is_the_person_s_own_size(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    rest = read_marker_face(at_rest(made, tmp_path / "rest.csv"), face, marker_set)
    eyes = np.linalg.norm(rest.spread.rest[33] - rest.spread.rest[263])
    assert eyes == pytest.approx(np.linalg.norm(made.landmarks[0, 33] - made.landmarks[0, 263]), abs=0.1)
    assert rest.spread.size == pytest.approx(1 / SIZE, rel=0.01)
    still = read_marker_still(write_table(tmp_path / "still.csv", made.names, made.points[200:201].repeat(5, 0)), rest)
    np.testing.assert_allclose(
        still[70] - rest.spread.rest[70], made.landmarks[200, 70] - made.landmarks[0, 70], atol=0.1
    )


def test_lips_open_and_lids_close_although_no_marker_lies_inside_them(
    made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path
) -> None:
    path = write_table(tmp_path / "take.csv", made.names, made.points)
    found = read_marker_recording(path, face, marker_set)
    assert np.corrcoef(gap(found.landmarks), gap(made.landmarks))[0, 1] > 0.95
    lids = [take[:, 159, 1] - take[:, 145, 1] for take in (found.landmarks, made.landmarks)]
    assert np.corrcoef(lids)[0, 1] > 0.95
    np.testing.assert_allclose(found.landmarks[:, 468:], found.landmarks[:1, 468:].repeat(len(found.landmarks), 0))
    assert found.notes == ("the median of the recording is used as the face at rest",)


def test_gaps_are_filled_and_reported(
    made: Made, whole: FaceRecording, face: Face, marker_set: MarkerSet, tmp_path: Path
) -> None:
    points = made.points.copy()
    points[100:115, made.names.index("LBRO2")] = np.nan
    points[:5, made.names.index("JAW1")] = np.nan
    points[200:230, made.names.index("HED3")] = np.nan  # four others show the pose
    found = read_marker_recording(write_table(tmp_path / "take.csv", made.names, points), face, marker_set)
    assert "gaps were filled in LBRO2 (15 frames), JAW1 (5 frames)" in found.notes
    assert np.abs(found.landmarks - whole.landmarks).max() < 0.5
    np.testing.assert_allclose(found.head, whole.head, atol=1e-3)


def test_long_gaps_are_left_out_with_their_times(
    made: Made, whole: FaceRecording, face: Face, marker_set: MarkerSet, tmp_path: Path
) -> None:
    points = made.points.copy()
    points[120:150, made.names.index("LBRO2")] = np.nan
    points[130:160, made.names.index("LIP3")] = np.nan
    points[:30, made.names.index("JAW1")] = np.nan
    found = read_marker_recording(write_table(tmp_path / "take.csv", made.names, points), face, marker_set)
    assert found.left_out is not None
    assert true_runs(found.left_out).tolist() == [[0, 30], [120, 160]]
    advice = ", which is left out: gaps up to 0.2 s are filled"
    assert f"the marker LBRO2 is hidden from 1.00 to 1.25 s{advice}" in found.notes
    assert f"the marker LIP3 is hidden from 1.08 to 1.33 s{advice}" in found.notes
    measured = ~found.left_out
    assert np.abs(found.landmarks - whole.landmarks)[measured].max() < 1.0  # mm: the median at rest is of other frames
    assert whole.left_out is not None
    assert not whole.left_out.any()


@pytest.mark.parametrize("share", [1.0, 0.7])
def test_a_marker_that_is_rarely_seen_counts_as_absent(
    made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path, share: float
) -> None:
    points = made.points.copy()
    points[: round(share * len(points)), made.names.index("LIP3")] = np.nan
    rest = at_rest(made, tmp_path / "rest.csv")
    found = read_marker_recording(write_table(tmp_path / "a.csv", made.names, points), face, marker_set, neutral=rest)
    one = [number for number, name in enumerate(made.names) if name != "LIP3"]
    names = tuple(made.names[k] for k in one)
    wanted = read_marker_recording(
        write_table(tmp_path / "b.csv", names, made.points[:, one]), face, marker_set, neutral=rest
    )
    assert found.notes == ("most frames hide the marker LIP3; its region is interpolated from the others",)
    np.testing.assert_allclose(found.landmarks, wanted.landmarks, atol=1e-4)


def test_a_missing_marker_is_reported_and_a_missing_region_refused(
    made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path
) -> None:
    one = [number for number, name in enumerate(made.names) if name != "LIP3"]
    found = read_marker_recording(
        write_table(tmp_path / "one.csv", tuple(made.names[k] for k in one), made.points[:, one]), face, marker_set
    )
    assert "the file has no marker LIP3; its region is interpolated from the others" in found.notes
    none = [number for number, name in enumerate(made.names) if not name.startswith("LBRO")]
    path = write_table(tmp_path / "none.csv", tuple(made.names[k] for k in none), made.points[:, none])
    with pytest.raises(DataError, match=r"no marker of the region brow_left \(LBRO1, LBRO2"):
        read_marker_recording(path, face, marker_set)


def test_a_set_without_brows_lacks_that_feature(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    table = tmp_path / "set.tsv"
    lines = DEFAULT_MARKER_TABLE.read_text().splitlines()
    table.write_text("# no brows\n" + "\n".join(line for line in lines if "brow" not in line) + "\n")
    fewer = read_marker_set(table)
    path = write_table(tmp_path / "take.csv", made.names, made.points)
    assert read_marker_recording(path, face, fewer).missing_features == {"gaze", "brows", "expression"}


def test_a_file_of_other_markers_is_refused(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    path = write_table(tmp_path / "take.csv", tuple(f"m{k}" for k in range(len(made.names))), made.points)
    with pytest.raises(DataError, match="none of the set's markers but m0, m1"):
        read_marker_recording(path, face, marker_set)


def test_a_wrong_unit_is_refused(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    path = write_table(tmp_path / "take.csv", made.names, made.points / 10)
    with pytest.raises(DataError, match=r"are 0\.09\d+ times those on a face"):
        read_marker_recording(path, face, marker_set)


def test_a_head_that_is_not_rigid_is_refused(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    points = made.points.copy()
    points[:, made.names.index("HED2")] += 80 * np.sin(np.arange(len(points)) / 20)[:, None]
    with pytest.raises(DataError, match="do not move rigidly"):
        read_marker_recording(write_table(tmp_path / "take.csv", made.names, points), face, marker_set)


def test_a_pose_that_no_three_markers_show_is_interpolated_and_reported(
    made: Made, whole: FaceRecording, face: Face, marker_set: MarkerSet, tmp_path: Path
) -> None:
    points = made.points.copy()
    head = [made.names.index(name) for name in marker_set.head]
    points[200:210, head[:5]] = np.nan
    points[300:, head[6]] = np.nan
    found = read_marker_recording(write_table(tmp_path / "take.csv", made.names, points), face, marker_set)
    assert "the head's pose was interpolated in 10 frames" in found.notes
    assert np.degrees(np.abs(found.head - whole.head)[:, :3]).max() < 0.2  # over 0.08 s
    points[200:240, head[:5]] = np.nan
    found = read_marker_recording(write_table(tmp_path / "take.csv", made.names, points), face, marker_set)
    assert found.left_out is not None
    assert true_runs(found.left_out).tolist() == [[200, 240]]
    assert any(note.startswith("the head's pose is hidden from 1.67 to 2.00 s, which is left") for note in found.notes)


def test_two_markers_show_no_head(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    kept = [k for k, name in enumerate(made.names) if name not in marker_set.head[2:]]
    path = write_table(tmp_path / "take.csv", tuple(made.names[k] for k in kept), made.points[:, kept])
    with pytest.raises(DataError, match="the file has 2 markers of the head"):
        read_marker_recording(path, face, marker_set)


def test_three_markers_show_no_face(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    table = tmp_path / "set.tsv"
    brows = [line for line in DEFAULT_MARKER_TABLE.read_text().splitlines() if "BRO" in line or "\thead\t" in line]
    table.write_text("\n".join(["marker\tregion\tlandmark", *brows]) + "\n")
    names = ("RBRO1", "RBRO2", "LBRO1", *marker_set.head)
    kept = [made.names.index(name) for name in names]
    path = write_table(tmp_path / "take.csv", names, made.points[:, kept])
    with pytest.raises(DataError, match="3 of the set's markers of the face; it needs at least 4"):
        read_marker_recording(path, face, read_marker_set(table))


def test_two_persons_in_a_file_are_refused(made: Made, tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", (*made.names, "FHD1"), made.points[:5, [*range(len(made.names)), 0]])
    with pytest.raises(DataError, match="the marker FHD1 twice"):
        read_markers(path)


def test_a_table_of_one_frame_is_a_still(made: Made, tmp_path: Path) -> None:
    for first in ("time", "frame"):
        take = read_markers(write_table(tmp_path / "still.csv", made.names, made.points[:1], first))
        np.testing.assert_allclose(take.points, made.points[:1], atol=1e-5)


def test_head_markers_on_a_line_are_refused(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    points = made.points.copy()
    head = [made.names.index(name) for name in marker_set.head]
    points[:, head] = points[:, head[:1]] + np.arange(len(head))[:, None] * [10.0, 0.0, 0.0]
    with pytest.raises(DataError, match="are collinear"):
        read_marker_recording(write_table(tmp_path / "take.csv", made.names, points), face, marker_set)


@pytest.mark.parametrize(("units", "factor"), [("mm", 1.0), ("cm", 0.1), ("m", 0.001)])
def test_units_of_a_c3d_file(made: Made, tmp_path: Path, units: str, factor: float) -> None:
    take = read_c3d(write_c3d(tmp_path / "take.c3d", made.names, made.points[:5] * factor, units=units))
    np.testing.assert_allclose(take.points, made.points[:5], rtol=1e-5)
    assert take.names == made.names


def test_gaps_of_a_c3d_file_are_nan_and_nothing_is_sound(made: Made, tmp_path: Path) -> None:
    points = made.points[:5].copy()
    points[2, 7] = np.nan
    points[3, 8] = 0.0
    take = read_c3d(write_c3d(tmp_path / "take.c3d", made.names, points))
    gone = np.isnan(take.points).any(axis=2)
    assert np.argwhere(gone).tolist() == [[2, 7], [3, 8]]
    assert take.sound is None


def test_an_unknown_unit_is_refused(made: Made, tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", made.names, made.points[:5], units="px")
    with pytest.raises(DataError, match="'px'; POINT:UNITS must be mm"):
        read_markers(path)


@pytest.mark.parametrize("share", [0.0, 0.002])
def test_a_c3d_file_that_breaks_off_before_its_frames_is_refused(made: Made, tmp_path: Path, share: float) -> None:
    path = write_c3d(tmp_path / "take.c3d", made.names, made.points)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(DataError, match="damaged, or no C3D file"):
        read_markers(path)


@pytest.mark.parametrize("cut", [1, 100_000])
def test_a_c3d_file_that_breaks_off_is_read_as_far_as_it_goes(made: Made, tmp_path: Path, cut: int) -> None:
    path = write_c3d(tmp_path / "take.c3d", made.names, made.points)
    width = 16 * len(made.names)  # bytes of a frame
    content = path.read_bytes()
    start = 512 * (int.from_bytes(content[16:18], "little") - 1)
    path.write_bytes(content[: start + width * len(made.points) - cut])
    take = read_markers(path)
    n_held = len(made.points) - 1 - (cut - 1) // width
    np.testing.assert_allclose(take.points, made.points[:n_held], rtol=1e-5)
    assert take.notes == (f"the file breaks off: of {len(made.points)} frames it has {n_held}",)


def test_a_table_that_counts_frames_needs_a_rate(made: Made, tmp_path: Path) -> None:
    path = write_table(tmp_path / "take.csv", made.names, made.points[:9], first="frame")
    with pytest.raises(InputError, match="give its frame rate"):
        read_markers(path)
    take = read_markers(path, 120.0)
    np.testing.assert_allclose(take.points, made.points[:9], atol=1e-5)
    assert take.fps == 120.0


def test_frames_that_a_table_leaves_out_are_gaps_and_rounded_times_do_no_harm(made: Made, tmp_path: Path) -> None:
    path = write_table(tmp_path / "take.csv", made.names, made.points)
    header, *rows = path.read_text().splitlines()
    rounded = [f"{float(row.split(',')[0]):.3f},{row.partition(',')[2]}" for row in rows]
    path.write_text("\n".join([header, *rounded[:50], *rounded[55:]]) + "\n")
    take = read_markers(path)
    assert take.fps == pytest.approx(FPS, abs=0.05)
    assert len(take.points) == len(made.points)
    assert np.flatnonzero(np.isnan(take.points[:, 0, 0])).tolist() == [50, 51, 52, 53, 54]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda lines: ["clock" + lines[0][4:], *lines[1:]], "needs the columns time or frame"),
        (lambda lines: [lines[0].replace("RBRO2_y", "RBRO2_w"), *lines[1:]], "check RBRO2"),
        (lambda lines: lines[:1], "needs the columns time or frame"),
    ],
)
def test_a_table_without_markers_is_refused(made: Made, tmp_path: Path, change: object, reason: str) -> None:
    path = write_table(tmp_path / "take.csv", made.names, made.points[:20])
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
    with pytest.raises(DataError, match=reason):
        read_markers(path)


@pytest.mark.parametrize(
    ("change", "lost", "notes"),
    [
        (lambda lines: [lines[0] + ",", *lines[1:]], [], []),
        (lambda lines: ["Anna; take 3; good; time", "a\tb", *lines], [], []),
        (lambda lines: [lines[0], lines[1] + ",1", *lines[2:]], [], ["beyond the columns"]),
        (lambda lines: [*lines[:2], "x" + lines[2][1:], *lines[3:]], [1], ["no later ones: 1", "cells that are no"]),
        (lambda lines: [lines[0], lines[2], lines[1], *lines[3:]], [1], ["no later ones: 1"]),
        (lambda lines: [*lines[:6], "9.0" + lines[6][6:], *lines[7:]], [5], ["no later ones: 1"]),
        (lambda lines: [*lines[:9], lines[9].rsplit(",", 3)[0], *lines[10:]], [8], []),
    ],
)
def test_a_damaged_row_of_a_table_costs_that_row(
    made: Made, tmp_path: Path, change: Callable[[list[str]], list[str]], lost: list[int], notes: list[str]
) -> None:
    path = write_table(tmp_path / "take.csv", made.names, made.points[:20])
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
    take = read_markers(path)
    whole = np.isfinite(take.points).all(axis=(1, 2))
    assert np.flatnonzero(~whole).tolist() == lost
    assert take.fps == FPS
    np.testing.assert_allclose(take.points[whole], made.points[:20][whole], atol=1e-4)
    assert len(take.notes) == len(notes)
    assert all(part in note for part, note in zip(notes, take.notes, strict=True))


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not a marker file"):
        read_markers(tmp_path / "take.bvh")
    with pytest.raises(InputError, match="there is no capture"):
        read_markers(tmp_path / "take.csv")


def test_the_shipped_set_is_the_paper_s_number_of_markers(marker_set: MarkerSet) -> None:
    assert len(marker_set.face) == 68
    assert len(marker_set.head) == 7
    assert marker_set.missing_features == {"gaze"}


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("marker\t", "name\t", "not a marker set"),
        ("RBRO1\tbrow_right\t70", "RBRO1\tbrow_right", "it needs marker, region, landmark"),
        ("RBRO1\t", "RBRO2\t", "RBRO2 twice"),
        ("RBRO1\tbrow_right", "RBRO1\teyebrow", "region 'eyebrow'"),
        ("RBRO1\tbrow_right\t70", "RBRO1\tbrow_right\t478", "landmark '478'"),
        ("RBRO1\tbrow_right\t70", "RBRO1\tbrow_right\t63", "two markers at the landmark 63"),
    ],
)
def test_a_damaged_set_is_refused(tmp_path: Path, old: str, new: str, reason: str) -> None:
    path = tmp_path / "set.tsv"
    path.write_text(DEFAULT_MARKER_TABLE.read_text().replace(old, new, 1))
    with pytest.raises(DataError, match=reason):
        read_marker_set(path)


def test_a_set_without_a_head_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "set.tsv"
    lines = DEFAULT_MARKER_TABLE.read_text().splitlines()
    path.write_text("\n".join(line for line in lines if "\thead\t" not in line) + "\n")
    with pytest.raises(DataError, match="0 markers of the region head; head pose needs at least 3"):
        read_marker_set(path)


def test_a_gap_is_bridged_without_overshoot() -> None:
    track = np.zeros((40, 1, 3))
    track[20:] = 1.0
    track[15:25] = np.nan
    found = fill_marker_gaps(track, ("A",), 100.0)
    assert found.points.min() >= 0.0
    assert found.points.max() <= 1.0
    assert found.notes == ("gaps were filled in A (10 frames)",)
    assert not found.left_out.any()
    assert true_runs(np.isnan(track[:, 0, 0])).tolist() == [[15, 25]]
    assert MAX_MARKER_GAP_S * 100.0 > 10
