"""The script that makes the shipped models: its steps make all of them, and a step gives the file that is shipped."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from corpus_tools.shipped import make_models
from corpus_tools.shipped.drawn.build_drawn import CAST
from corpus_tools.shipped.drawn.worn import HAIRCUTS
from tts2face.models.face_names import OF_FACE
from tts2face.models.palette_file import load_palette
from tts2face.models.talker_file import load_talker
from tts2face.storage.shipped import SHIPPED_FOLDER


def test_derived_styles_are_made_as_they_are_shipped(tmp_path: Path) -> None:
    path = Path(shutil.copy(SHIPPED_FOLDER / "starter.palette", tmp_path))
    command = [sys.executable, "-m", "corpus_tools.shipped.make_models", "styles", "--out", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    assert path.read_bytes() == (SHIPPED_FOLDER / "starter.palette").read_bytes()


def test_it_names_the_source_of_the_talker_and_of_the_style_as_they_are_shipped() -> None:
    assert load_talker(make_models.GRID).metadata["pooled"] == make_models.TRACKS
    assert tuple(load_palette("starter").styles) == (make_models.GRID,)


def test_every_shipped_character_and_haircut_of_characters_is_made() -> None:
    heads = {"head"}
    assert {path.stem for path in SHIPPED_FOLDER.glob("*.face")} == heads | CAST.keys()
    worn = {f"{name}{OF_FACE}{style.name}" for name, styles in HAIRCUTS.items() for style in styles}
    assert worn == {path.stem for path in SHIPPED_FOLDER.glob(f"*{OF_FACE}*.hair")}


def test_an_unknown_step_is_refused(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["make_models", "lips"])
    with pytest.raises(SystemExit, match="2"):
        make_models.main()
    steps = "phones, talker, heads, palette, gaze, cast, light, retouching, mouths, styles"
    assert f"there is no step 'lips'; give {steps}" in capsys.readouterr().err
