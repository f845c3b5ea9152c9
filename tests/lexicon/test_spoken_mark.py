"""Words before a text that say that its voice is synthetic."""

import pytest

from lexicon.errors import InputError
from lexicon.languages import language_code
from lexicon.marked_text import GestureMark
from lexicon.spoken_mark import mark_words, sentences, with_spoken_mark
from lexicon.text_marks import parse_marks
from tts2face.request import Request
from tts2face.session.prepared import prepare


def test_marks_and_runs_move_with_their_words() -> None:
    plain = parse_marks("Hello [nod] [style:happy]there[/style].", "en-us")
    marked = with_spoken_mark(plain, "This is made.", "en-us")
    assert marked.text == f"This is made.\n\n{plain.text}"
    shift = len(marked.text) - len(plain.text)
    (before,), (after,) = ([mark for mark in text.marks if isinstance(mark, GestureMark)] for text in (plain, marked))
    assert after.at == before.at + shift
    assert [run.start for run in marked.runs[1:]] == [run.start + shift for run in plain.runs]
    assert marked.runs[0].styles == ()


@pytest.mark.parametrize(
    "code",
    [pytest.param(code, marks=[pytest.mark.needs("pyopenjtalk")] if code == "ja" else []) for code in sentences()],
)
def test_each_language_speaks_its_sentence(code: str) -> None:
    assert language_code(code).partition("-")[0] == code
    assert prepare(Request(text="1", language=code, spoken_mark="auto")).text.text.startswith(mark_words("auto", code))


def test_what_cannot_be_said_is_refused() -> None:
    with pytest.raises(InputError, match="--spoken-mark auto has no sentence in sw; give your own words"):
        mark_words("auto", "sw")
    with pytest.raises(InputError, match="--spoken-mark is empty; give its words, or auto, or remove it"):
        mark_words("  ", "en-us")
    with pytest.raises(InputError, match="--spoken-mark have no effect with --idle; remove them"):
        Request(idle=1.0, spoken_mark="auto")
