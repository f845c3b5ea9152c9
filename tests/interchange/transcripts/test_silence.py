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
    "S1:", "SPEAKER_00", "spk-2", "Speaker 12:", "s3",
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
        ("ja ((lacht)) gut", "ja gut"), ("GOING_TO", "GOING TO"), ("THE(2)", "THE"), ("A(3)", "A"), ("f(2)", "f(2)"),
        ("speaker", "speaker"), ("H_2 two", "H_2 two"), ("s 2", "s 2"),
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


def test_pieces_within_an_utterance_are_left_out_and_said(tmp_path):
    said = [(0, 1, "bin [laughs] red"), (1, 2, "by sp k <breath>"), (2, 2.9, "[laughs]")]
    (tmp_path / "v.TextGrid").write_text(textgrid(text=said))
    found = read_transcript(tmp_path / "v.TextGrid")
    assert found.text == "bin red by k"
    assert found.notes[0] == "silence and noise in v.TextGrid, not words: [laughs] (2), <breath> (1), sp (1)"


@pytest.mark.parametrize(
    ("labels", "words", "names"),
    [
        (("S1: bin red", "S2: by k"), "bin red by k", "S1 (1), S2 (1)"),
        (("SPEAKER_00: bin red", "SPEAKER_00: by k", "SPEAKER_01:"), "bin red by k", "SPEAKER_00 (2)"),
        (("Anna: bin red", "Anna: by k"), "bin red by k", "Anna (2)"),
        (("JOHN: bin red", "so: by k"), "bin red so: by k", "JOHN (1)"),
        (("bin red", "note: by k"), "bin red note: by k", ""),
    ],
)
def test_names_of_speakers_before_words_are_not_said(labels, words, names, tmp_path):
    table = "".join(f"{at}.5\t{at + 1}.5\t{label}\n" for at, label in enumerate(labels))
    (tmp_path / "v.txt").write_text(table)
    found = read_transcript(tmp_path / "v.txt")
    assert found.text == words
    note = f"v.txt: speakers by names before a colon, which are not spoken: {names}"
    assert (note in found.notes) == bool(names)
