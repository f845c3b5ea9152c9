"""Labels of silence and noise are no words; words are no silence."""

import pytest

from lexicon.dictionary import cmudict_lookup
from tests.interchange.transcripts.grids import WORDS, relabelled, textgrid
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.silence import silence_labels, spoken_part

NO_WORDS = [
    "", " ", "<eps>", "{SL}", "[noise]", "spn", "SPN", "<unk>", "sp", "pau", "#", "<p:>", "<usb>", "SIL", "brth", "xxx",
    "yyy", "&=laughs", "*", "%", "h#", "epi", "nsn", "lau", "(laughs)", "((laughs))", "[bracketed words]",
    "<sil> [noise]", "++UM++",
    "+noise+", "_noise_", "*cough*", "<VOCNOISE>", "dummy", "@", "...", "{laugh}", "-", "sil", "!SIL", "[]", "<s>",
]  # fmt: skip


@pytest.mark.parametrize("label", NO_WORDS)
def test_silence_and_noise_have_no_words(label):
    assert spoken_part(label) == ""


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("bin", "bin"), ("[noise] bin red", "bin red"), ("bin <breath> red {SL}", "bin red"),
        ("3 < x we get y > 0", "3 < x we get y > 0"), ("<LAUGH-yeah>", "yeah"), ("[laughter-yeah]", "yeah"),
        ("don't", "don't"), ("über", "über"), ("he said (quietly) no", "he said (quietly) no"), ("7", "7"),
        ("silence", "silence"), ("noise", "noise"), ("bin sp red", "bin red"),
        ("das ist lau hier", "das ist lau hier"), ("you dummy", "you dummy"), ("SL 500", "SL 500"),
        ("ja ((lacht)) gut", "ja gut"),
    ],
)  # fmt: skip
def test_words_stay(label, words):
    assert spoken_part(label) == words


def test_the_table_holds_no_common_word():
    known = {label for label in silence_labels() if label.isalpha() and len(label) > 3 and cmudict_lookup(label)}
    assert known <= {"dummy"}


@pytest.mark.parametrize("label", ["<eps>", "[noise]", "{SL}", "spn", "h#"])
def test_they_are_left_out_and_said(label, tmp_path):
    (tmp_path / "v.TextGrid").write_text(textgrid(words=relabelled(WORDS, empty=label)))
    found = read_transcript(tmp_path / "v.TextGrid")
    assert found.text == "bin red by k seven now"
    assert found.notes == (f"silence and noise in v.TextGrid, not words: {label} (2)",)
