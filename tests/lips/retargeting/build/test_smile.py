"""The smile of the person in the video of a recording, which lips follow by their sound."""

from pathlib import Path

import pytest

import tts2face
from lexicon.errors import DataError, InputError
from tts2face.request import Request
from tts2face.session.request_timeline import build_request_timeline

TEXT = "We were away."


@pytest.mark.parametrize("expression", ["happy=0.7", None])
def test_expression_video_is_the_smile_of_the_recording(
    expression: str | None, face_model: Path, tmp_path: Path
) -> None:
    assert face_model.is_file()  # where the tracker looks for it
    session = tts2face.Session(face="head")
    small = tts2face.Picture(size="320x320", supersampling=1)
    film = tmp_path / "film.mp4"
    session.write(TEXT, film, picture=small, gain="all=0", expression=expression)
    found = build_request_timeline(Request(text=TEXT, audio=film, expression="video")).expressions
    if expression is None:
        assert found == ()
    else:
        assert [one.expression for one in found] == ["happy"]
        assert found[0].weight == pytest.approx(0.7, abs=0.25)


def test_a_recording_without_pictures_has_no_smile(tmp_path: Path) -> None:
    tts2face.export(tts2face.Session().clip("Hi."), tmp_path / "a.wav")
    with pytest.raises(DataError, match=r"a.wav holds no video; give a recording with pictures"):
        build_request_timeline(Request(text="Hi.", audio=tmp_path / "a.wav", expression="video"))
    with pytest.raises(InputError, match="--expression video needs a recording with pictures"):
        build_request_timeline(Request(text="Hi.", expression="video"))
