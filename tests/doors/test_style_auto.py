"""``--style auto`` at the doors: a style for each sentence, and why."""

from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from tts2face.request import Request
from tts2face.session.marked_styles import with_styles_of
from tts2face.session.prepared import prepare
from tts2face.session.session import Session

TEXT = "We won the cup! The door is open. I am so sorry, he died."
MARKED = "[style:delighted]We won the cup! [/style]The door is open. [style:depressed]I am so sorry, he died.[/style]"
NOTES = (
    "'We won the cup!' is delighted, by We won (2.5)",
    "'I am so sorry, he died.' is depressed, by so sorry (2), died (3)",
)


def test_the_words_give_the_styles(shipped: Session) -> None:
    by_words, by_marks = shipped.clip(Request(text=TEXT, style="auto")), shipped.clip(Request(text=MARKED))
    np.testing.assert_array_equal(by_words.motion.values, by_marks.motion.values)
    np.testing.assert_array_equal(by_words.speech.waveform.samples, by_marks.speech.waveform.samples)
    assert prepare(Request(text=TEXT, style="auto")).notes == NOTES


def test_a_palette_without_the_style_shows_the_sentence_as_it_is() -> None:
    text = prepare(Request(text=TEXT, style="auto")).text
    found = with_styles_of(text, ("neutral", "annoyed"))
    assert {run.styles for run in found.runs} == {()}
    assert found.notes == text.notes


def test_the_command_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.json"
    assert run([TEXT, "--style", "auto", "--export", str(out), "--voice", "espeak"]) == 0
    assert all(f"tts2face: note: {note}" in capsys.readouterr().err for note in NOTES[:1])
