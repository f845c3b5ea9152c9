"""A text that differs from the recording: the core reports the words, the command line writes one sentence."""

import wave
from dataclasses import replace
from pathlib import Path

import pytest

from cli.main import run
from tests.world import World
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.session import Session
from tts2face.sound.voice_pool import VoicePool

pytestmark = pytest.mark.usefixtures("heard_once")
SAID = "The young chef usually pushes five big maps before noon."
WRONG = "The young chef usually pushes five big maps before noon, yesterday elephants remembered."
OTHER = "Please wait for the beep, then say your name."


@pytest.fixture(scope="module")
def recording(voices: VoicePool, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project's own voice as the recording."""
    sound = voices.voice("heart", "en-us", {}).speak(SAID).waveform
    path = tmp_path_factory.mktemp("recording") / "speech.wav"
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, sound.rate, 0, "NONE", "not compressed"))
        file.writeframes((sound.samples * 32767).astype("<i2").tobytes())
    return path


def test_the_core_reports_the_words(recording: Path, session: Session, tmp_path: Path) -> None:
    ready = session
    request = Request(audio=recording, text=WRONG, fps=10.0, gestures="none")
    pieces = list(ready.stream(request))
    (mismatch,) = (one for piece in pieces for one in piece.mismatches)
    assert set(mismatch.words) <= set(WRONG.replace(",", "").replace(".", "").split())
    assert 0.0 <= mismatch.begin < mismatch.end <= sum(piece.clip.speech.waveform.duration for piece in pieces)
    written = ready.write(request, tmp_path / "wrong.mp4", picture=Picture(size="64x64"))
    assert [one.words for one in written.mismatches] == [mismatch.words]
    assert [piece.mismatches for piece in ready.stream(replace(request, text=SAID))] == [()]


def test_another_text_is_refused_with_its_words(
    recording: Path, world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "clip.mp4"
    assert run(["--audio", str(recording), "--text", OTHER, "--out", str(out), *world.models]) == 3
    refusal = capsys.readouterr().err
    assert "the recording does not contain this text" in refusal
    assert "wait" in refusal
    assert not out.exists()


@pytest.mark.parametrize(("text", "n_lines"), [(SAID, 0), (WRONG, 1)])
def test_the_command_line_reports_mismatches(
    text: str, n_lines: int, recording: Path, world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "clip.mp4"
    options = ["--size", "64x64", "--fps", "10", "--no-gestures", "--quiet"]
    assert run(["--audio", str(recording), "--text", text, "--out", str(out), *world.models, *options]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "does not fit the recording from" in line]
    assert len(lines) == n_lines
    assert out.is_file()
    for line in lines:
        assert line.startswith("tts2face: warning: the text does not fit the recording from ")
        assert "elephants" in line
