"""Translations, glosses and other tiers about the words never take the place of the speech, in any language."""

import pytest

from lexicon.errors import DataError
from tests.interchange.transcripts.elan_files import annotated
from tests.interchange.transcripts.grids import textgrid
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.interchange.transcripts.tier_names import NameKind, kind_of_name

SAID = ("o menino foi pescar", "depois voltou para casa")
MEANT = ("the boy went fishing", "then he came back home")
TEXT = " ".join(SAID)


def labels(texts):
    return [(at, at + 1, text) for at, text in enumerate(texts)]


def words(texts):
    found = " ".join(texts).split()
    return [(0.3 * at, 0.3 * at + 0.3, word) for at, word in enumerate(found)]


@pytest.mark.parametrize(
    "rows",
    [
        [("Anna", "", SAID), ("English", "Anna", MEANT)],
        [("English", "Anna", MEANT), ("Anna", "", SAID)],
        [("English text", "Anna", MEANT), ("Anna", "", SAID)],
        [("fr_translation", "", MEANT), ("Anna", "", SAID)],
        [("ft@Anna", "tx@Anna", MEANT), ("ref@Anna", "", ("Anna.001", "Anna.002")), ("tx@Anna", "ref@Anna", SAID)],
        [("Anna", "", ("A001", "A002")), ("Anna-said", "Anna", SAID), ("Anna-eng", "Anna-said", MEANT)],
        [("x", "y", MEANT), ("y", "z", SAID), ("z", "", ("", ""))],
    ],
    ids=str,
)
def test_of_elan_what_is_said_comes_before_what_belongs_to_it(rows, tmp_path):
    (tmp_path / "v.eaf").write_text(annotated(*rows), encoding="utf-8")
    found = read_transcript(tmp_path / "v.eaf")
    assert found.text == TEXT
    named = {name for name, _, texts in rows if any(texts)}
    assert all(repr(name) in found.notes[0] for name in named)
    assert found.notes[0].endswith("; --tier names another")


@pytest.mark.parametrize(
    "tiers",
    [
        {"Anna": labels(SAID), "English": labels(MEANT)},
        {"Anna_en": labels(MEANT), "Anna": labels(SAID)},
        {"Traduction": labels(MEANT), "x": labels(SAID)},
        {"Anna": words(SAID), "eng": labels(MEANT)},
        {"word_gloss": words(MEANT), "Anna": words(SAID)},
        {"free translation": labels(MEANT), "transcrição": labels(SAID)},
    ],
    ids=str,
)
def test_of_textgrids_a_translation_is_not_taken(tiers, tmp_path):
    (tmp_path / "v.TextGrid").write_text(textgrid(**tiers), encoding="utf-8")
    found = read_transcript(tmp_path / "v.TextGrid")
    assert found.text == TEXT
    assert all(repr(name.replace("_", " ")) in found.notes[0] for name in tiers)


def test_a_part_is_read_where_its_whole_is_empty(tmp_path):
    (tmp_path / "v.eaf").write_text(annotated(("Anna", "", ("", "")), ("English", "Anna", MEANT)), encoding="utf-8")
    assert read_transcript(tmp_path / "v.eaf").text == " ".join(MEANT)


def test_two_speakers_whose_names_begin_alike_are_no_parts(tmp_path):
    (tmp_path / "v.TextGrid").write_text(textgrid(Speaker_2=labels(MEANT), Speaker=labels(SAID)))
    found = read_transcript(tmp_path / "v.TextGrid")
    assert found.text == " ".join(MEANT)
    assert "'Speaker' also has words" in found.notes[0]


def test_notes_alone_are_no_speech(tmp_path):
    (tmp_path / "v.TextGrid").write_text(textgrid(word_tags=words(["n", "v"])))
    with pytest.raises(DataError, match="has no tier with words; 'word tags' seems to hold phones or notes"):
        read_transcript(tmp_path / "v.TextGrid")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("word tags", NameKind.OTHERS),
        ("Wörter", NameKind.WORDS),
        ("Wo\u0308rter", NameKind.WORDS),
        ("WÖRTER", NameKind.WORDS),
        ("słowa", NameKind.WORDS),
        ("AnnaSłowa2", NameKind.WORDS),
        ("Übersetzung", NameKind.OTHERS),
        ("ÜBERSETZUNG_en", NameKind.OTHERS),
        ("tłumaczenie", NameKind.OTHERS),
        ("Äußerung", NameKind.TEXTS),
        ("głoski", NameKind.PHONES),
        ("A_word-gls-en", NameKind.OTHERS),
        ("A_phrase-segnum-en", NameKind.OTHERS),
        ("A_Transcription-txt", NameKind.TEXTS),
        ("ORTMau", NameKind.WORDS),
        ("DialogueActs", NameKind.OTHERS),
        ("speech_act A", NameKind.OTHERS),
        ("Act 1", NameKind.NOTHING),
        ("Anna", NameKind.NOTHING),
    ],
)
def test_what_names_say(name, kind):
    assert kind_of_name(name) is kind
