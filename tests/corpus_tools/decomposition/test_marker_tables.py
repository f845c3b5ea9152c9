"""Tables of markers of other programs, .trc and Motive's CSV, give the places that were written, and NaN in gaps."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.decomposition.capture_files import MarkerOptions, read_capture_file
from corpus_tools.decomposition.marker_files import read_markers
from lexicon.errors import DataError, InputError
from tests.corpus_tools.decomposition.made_markers import FPS, Made
from tts2face.models.face import Face

NAMES = ("RBRO1", "LBRO1", "CHIN")
POINTS = np.random.default_rng(5).uniform(-400, 900, (30, 3, 3)).round(3)


def with_gaps() -> np.ndarray:
    points = POINTS.copy()
    points[4:7, 1] = np.nan
    points[9, 2] = points[20:, 2] = np.nan
    return points


def trc_text(
    names: Sequence[str],
    points: np.ndarray,
    *,
    fps: float = 120.0,
    units: str = "mm",
    gap: str = "",
    trailing: bool = True,
) -> str:
    rate = f"{fps:.2f}"
    lines = [
        "PathFileType\t4\t(X/Y/Z)\ttake.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{len(points)}\t{len(names)}\t{units}\t{rate}\t1\t{len(points)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + ("\t\t" if trailing else ""),
        "\t\t" + "\t".join(f"{axis}{number + 1}" for number in range(len(names)) for axis in "XYZ"),
        "",
    ]
    for frame, row in enumerate(points.reshape(len(points), -1)):
        line = "\t".join([str(frame + 1), f"{frame / fps:.3f}", *(gap if np.isnan(v) else f"{v:.5f}" for v in row)])
        lines.append(line if trailing else line.rstrip("\t"))
    return "\n".join(lines) + "\n"


def motive_text(names: Sequence[str], points: np.ndarray, *, units: str = "Meters", has_body: bool = True) -> str:
    scale = {"Meters": 1e-3, "Millimeters": 1.0, "Centimeters": 0.1}[units]
    body = (
        ("Rigid Body", "Head", "Rotation", "XYZW"), ("Rigid Body", "Head", "Position", "XYZ"),
        ("Rigid Body", "Head", "Mean Marker Error", " "), ("Rigid Body Marker", "Head:Marker 001", "Position", "XYZ"),
        ("Rigid Body Marker", "Head:Marker 001", "Marker Quality", " "),
    )  # fmt: skip
    blocks = [*(body if has_body else ()), *(("Marker", f"Anna:{name}", "Position", "XYZ") for name in names)]
    columns = [(*block[:3], axis.strip()) for block in blocks for axis in block[3]]
    n_body = len(columns) - 3 * len(names)
    lines = [
        f"Format Version,1.23,Take Name,Take 1,Capture Frame Rate,{FPS:.6f},Export Frame Rate,{FPS:.6f},"
        f"Capture Start Time,2024-05-01 10.00.00.000 AM,Rotation Type,Quaternion,Length Units,{units},"
        "Coordinate Space,Global",
        "",
        ",Type," + ",".join(column[0] for column in columns),
        ",Name," + ",".join(column[1] for column in columns),
        ",ID," + ",".join('"8E2F"' for _ in columns),
        ",," + ",".join(column[2] for column in columns),
        "Frame,Time (Seconds)," + ",".join(column[3] for column in columns),
    ]
    for frame, row in enumerate(points.reshape(len(points), -1) * scale):
        cells = ["0.500000"] * n_body + ["" if np.isnan(value) else f"{value:.8f}" for value in row]
        lines.append(f"{frame},{frame / FPS:.6f}," + ",".join(cells))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("units", "factor"), [("mm", 1.0), ("m", 1e-3), ("cm", 0.1)])
@pytest.mark.parametrize("gap", ["", "NaN", "0.00000", "9999999.00000"])
@pytest.mark.parametrize("trailing", [True, False])
def test_a_trc_file_gives_places_and_gaps(units: str, factor: float, gap: str, trailing: bool, tmp_path: Path) -> None:
    path = tmp_path / "take.trc"
    far = "" if gap.startswith("9999") and units != "mm" else gap
    path.write_text(trc_text(NAMES, with_gaps() * factor, units=units, gap=far, trailing=trailing))
    take = read_markers(path)
    assert (take.names, take.fps, take.notes) == (NAMES, 120.0, ())
    np.testing.assert_allclose(take.points, with_gaps(), atol=0.006)


def test_a_trc_file_with_comments_and_lost_frames(tmp_path: Path) -> None:
    lines = trc_text([f"Anna:{name}" for name in NAMES], POINTS).splitlines()
    lines = ["# exported", *lines[:12], "// a break", *lines[14:], lines[-1]]  # frames 7 and 8 are lost, 30 is double
    (tmp_path / "take.trc").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())
    take = read_markers(tmp_path / "take.trc")
    assert take.names == NAMES
    assert np.isnan(take.points[6:8]).all()
    np.testing.assert_allclose(take.points[8:], POINTS[8:], atol=1e-4)
    assert take.notes == ("rows left out, as their frame number and time are missing or no later ones: 1",)


def test_times_overrule_a_stated_rate_that_contradicts_them(tmp_path: Path) -> None:
    (tmp_path / "take.trc").write_text(trc_text(NAMES, POINTS, fps=100.0).replace("100.00\t", "60.00\t", 2))
    take = read_markers(tmp_path / "take.trc")
    assert take.fps == 100.0
    assert take.notes == ("it states 60 frames a second; 100 are taken",)


@pytest.mark.parametrize("suffix", [".trc", ".csv"])
def test_a_rate_is_that_of_the_times_then_the_given_then_the_stated_one(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"take{suffix}"
    text = trc_text(NAMES, POINTS, fps=FPS) if suffix == ".trc" else motive_text(NAMES, POINTS)
    path.write_text(text)
    take = read_markers(path, 100.0)
    assert (take.fps, take.notes) == (
        FPS,
        ("100 frames a second were given, but its times have 120, which are taken",),
    )
    lines = [line for line in text.splitlines() if line]
    separator = "\t" if suffix == ".trc" else ","
    at = next(n for n, line in enumerate(lines) if line.startswith("Frame"))
    rows = [line.split(separator) for line in lines[at + 1 :]]
    timeless = [separator.join([row[0], "", *row[2:]]) for row in rows]
    path.write_text("\n".join([*lines[: at + 1], *timeless]))
    assert (read_markers(path).fps, read_markers(path).notes) == (FPS, ())
    take = read_markers(path, 100.0)
    assert (take.fps, take.notes) == (100.0, ("it states 120 frames a second; 100 are taken",))


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("PathFileType", "Path", "needs a first line PathFileType"),
        ("\tmm\t", "\tpx\t", "its unit is 'px'"),
        ("RBRO1\t\t\tLBRO1\t\t\tCHIN", "", "it names no marker"),
    ],
)
def test_a_trc_file_that_is_none_is_refused(old: str, new: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "take.trc").write_text(trc_text(NAMES, POINTS).replace(old, new, 1))
    with pytest.raises(DataError, match=reason):
        read_markers(tmp_path / "take.trc")


@pytest.mark.parametrize("units", ["Meters", "Millimeters", "Centimeters"])
@pytest.mark.parametrize("has_body", [True, False])
def test_a_table_of_motive_gives_its_markers(units: str, has_body: bool, tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    path.write_text(motive_text(NAMES, with_gaps(), units=units, has_body=has_body))
    take = read_markers(path)
    assert (take.names, take.fps, take.notes) == (NAMES, FPS, ())
    np.testing.assert_allclose(take.points, with_gaps(), atol=1e-3)


def test_a_table_of_motive_that_a_spreadsheet_saved(tmp_path: Path) -> None:
    first, *rest = motive_text(NAMES, with_gaps()).splitlines()
    rows = [first.replace(",", ";"), *(line.replace(",", ";").replace(".", ",") for line in rest)]
    (tmp_path / "take.csv").write_text("\n".join(rows))
    np.testing.assert_allclose(read_markers(tmp_path / "take.csv").points, with_gaps(), atol=1e-3)


def test_a_table_of_motive_without_markers_is_refused_truly(tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    path.write_text(motive_text((), np.zeros((3, 0, 3))).replace("Rigid Body Marker", "Rigid Body"))
    with pytest.raises(DataError, match="has no markers, but rigid bodies or bones"):
        read_markers(path)
    path.write_text(motive_text(NAMES, POINTS).replace("Meters", "Furlongs"))
    with pytest.raises(DataError, match="Length Units are 'furlongs'"):
        read_markers(path)


def test_both_are_captures_of_a_face(made: Made, face: Face, tmp_path: Path) -> None:
    part = replace(made, points=made.points[:60])
    (tmp_path / "a.trc").write_text(trc_text(part.names, part.points, fps=FPS))
    (tmp_path / "b.csv").write_text(motive_text(part.names, part.points))
    trc, motive = (read_capture_file(tmp_path / name, face, options=MarkerOptions()) for name in ("a.trc", "b.csv"))
    np.testing.assert_allclose(trc.landmarks, motive.landmarks, atol=0.01)
    assert trc.missing_features == {"gaze"}
    with pytest.raises(InputError, match=r"supported suffixes are \.c3d, \.trc and \.csv"):
        read_markers(tmp_path / "take.bvh")
