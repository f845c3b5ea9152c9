"""Work on one take: its check, and what its tool answers."""

import json
from pathlib import Path

import pytest
from PIL import Image

from corpus_tools.decomposition.take_check import GOOD_S, LEAST_S, check_gesture_take
from corpus_tools.run_options import RunOptions
from lexicon.errors import InputError
from tests.photo.pictures import still
from tests.processes.answered import ordered
from tts2face.models.face_file import read_face
from tts2face.models.palette_file import load_palette, read_palette
from tts2face.serving.work.resource_check import CONTENT, STATEMENT
from tts2face.serving.work.tools import TAKES

HEADER = "Timecode,BlendshapeCount,JawOpen,EyeBlinkLeft,EyeBlinkRight,BrowInnerUp,HeadYaw,HeadPitch,HeadRoll"


def write_table(path: Path, seconds: float, *, broken: bool = False) -> Path:
    """A Live Link table at 30 frames/s in which everything moves."""
    rows = [HEADER]
    for frame in range(round(30 * seconds)):
        share = (frame % 20) / 20
        values = f"{share:.3f},{float(frame % 40 < 4)},{float(frame % 40 < 4)},{1 - share:.3f},{share / 9:.4f},0,0"
        rows.append(f"00:00:{frame // 30:02d}:{frame % 30:02d}.000,61,{'x' if broken and frame == 5 else ''}{values}")
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(("seconds", "found"), [(LEAST_S - 1, "refusal"), (LEAST_S + 1, "warning"), (GOOD_S + 1, "")])
def test_a_take_must_be_long_enough(tmp_path: Path, seconds: float, found: str) -> None:
    shares: list[float] = []
    report = check_gesture_take(write_table(tmp_path / "take.csv", seconds), RunOptions(tmp_path, 1), shares.append)
    assert report.seconds == pytest.approx(seconds, abs=0.1)
    assert "".join(one.severity for one in report.findings) == found


def test_a_take_with_a_damaged_cell_is_read_and_says_so(tmp_path: Path) -> None:
    report = check_gesture_take(write_table(tmp_path / "take.csv", 3, broken=True), RunOptions(tmp_path, 1), print)
    assert report.seconds == pytest.approx(3.0)
    assert {finding.severity for finding in report.findings} == {"warning"}
    assert "cells without a number, which are interpolated: 1" in {finding.message for finding in report.findings}


def test_a_take_of_damaged_rows_says_what_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text("\n".join([HEADER, *["00:00:00:xx.000,61,a,b,c,d,e,f,g"] * 90]))
    report = check_gesture_take(tmp_path / "take.csv", RunOptions(tmp_path, 1), print)
    assert (report.seconds, report.findings[0].severity) == (0.0, "refusal")
    assert "fewer than two frames with a time and a face (0)" in report.findings[0].message


def test_another_kind_of_file(tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="neither a video nor a Live Link Face table"):
        check_gesture_take(tmp_path / "take.csv", RunOptions(tmp_path, 1), print)


def test_a_table_becomes_a_style_beside_the_others(tmp_path: Path) -> None:
    take = write_table(tmp_path / "take.csv", 4)
    order = {
        "take": str(take), "cache": str(tmp_path), "base": "starter", "name": "my own",
        "out": str(tmp_path / "out.palette"),
    }  # fmt: skip
    progress, result = ordered(TAKES, "style", order)
    assert progress[0]["stage"] == "reading recordings"
    assert result["seconds"] == pytest.approx(4.0, abs=0.1)
    made = read_palette(tmp_path / "out.palette")
    assert set(made.names) - set(load_palette("starter").names) == {"my own"}
    assert made.styles["my own"].metadata["sources"] == "a take recorded in the studio"


def test_an_error_names_no_path(tmp_path: Path) -> None:
    take = write_table(tmp_path / "take.csv", 4)
    order = {"take": str(take), "cache": str(tmp_path), "base": "starter", "name": "delighted",
             "out": str(tmp_path / "out.palette")}  # fmt: skip
    with pytest.raises(InputError, match="the palette has a style delighted already") as refused:
        ordered(TAKES, "style", order)
    assert str(tmp_path) not in str(refused.value)


@pytest.mark.build
@pytest.mark.usefixtures("face_model")
def test_a_photo_becomes_the_head_of_its_person(tmp_path: Path) -> None:
    photo, out = tmp_path / "face.upload", tmp_path / "checked"
    out.mkdir()
    Image.fromarray(still("tomas", 360)).save(photo, "PNG")
    order = {"take": str(photo), "out": str(out), "max_bytes": 2e7}
    stated = {
        "name": "tom",
        "consent": None,
        "eye_color": "green",
        "age_keep": False,
        "no_glasses": False,
        "max_pixels": 1_000_000,
    }
    (tmp_path / STATEMENT).write_text(json.dumps(stated))
    with pytest.raises(InputError, match="state the consent"):
        ordered(TAKES, "avatar", order)
    (tmp_path / STATEMENT).write_text(json.dumps(stated | {"consent": "nobody"}))
    _, made = ordered(TAKES, "avatar", order)
    assert str(made["look"]).startswith("hair: ")
    face = read_face(out / CONTENT)
    assert not face.light.is_flat
    assert face.metadata["consent"]["statement"] == "nobody"
    assert face.hairdo is not None
    assert "green" in str(made["look"])
