"""Readings of words with several pronunciations, on lists of the project's own making."""

import csv
import gzip
import json
import re
from collections.abc import Iterator
from importlib import util
from pathlib import Path

import pytest

from lexicon import part_of_speech
from lexicon.dictionary import parse_dictionary
from lexicon.errors import BackendError, DataError
from lexicon.homographs import homograph_segments, is_homograph
from lexicon.part_of_speech import tag_words
from lexicon.pronounce import pronounce

REDUCED = ("AH0", "IH0", "ER0", "UH0", "EH0", "AE0", "AA0", "AO0", "OW0", "UW0", "IY0", "AY0")
# Sentences of homographs_fresh.tsv were written after the table and measured once: 27 of 30 were right.
MOST_WRONG_FRESH = 3


def rows(name: str) -> list[dict[str, str]]:
    with (Path(__file__).parent / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))


def reading(names: str) -> list[str]:
    """Names without the quality of weak vowels, which no reading depends on."""
    return ["V" if name in REDUCED or name[-1] == "2" else name for name in names.split()]


def is_right(row: dict[str, str]) -> bool:
    words = [word for word in pronounce(row["text"]).words if word.text.lower() == row["word"].lower()]
    return reading(" ".join(words[0].arpabet)) == reading(row["arpabet"])


@pytest.mark.parametrize("row", rows("homographs.tsv"), ids=lambda row: row["text"])
def test_both_readings_of_the_list(row: dict[str, str]) -> None:
    assert is_right(row)


def test_sentences_that_the_table_was_not_made_for() -> None:
    wrong = [row["text"] for row in rows("homographs_fresh.tsv") if not is_right(row)]
    assert len(wrong) <= MOST_WRONG_FRESH, wrong


@pytest.mark.parametrize(
    ("text", "word", "arpabet"),
    [
        ("He records songs.", "records", "R AH0 K AO1 R D Z"),
        ("Two records were broken.", "records", "R EH1 K ER0 D Z"),
        ("The bows of two ships.", "bows", "B AW1 Z"),
        ("It tears easily.", "tears", "T EH1 R Z"),
    ],
)
def test_inflected_homographs(text: str, word: str, arpabet: str) -> None:
    assert is_right({"text": text, "word": word, "arpabet": arpabet})


def test_read_follows_the_tense_of_its_sentence() -> None:
    """By auxiliaries, also before the subject of a question, the subject, times, and verbs beside it."""
    sentences = {
        "R IY1 D Z": "It reads well. My brother always reads the news. She reads and writes Arabic.",
        "R EH1 D": "I read that last night. Yesterday I read three chapters. Have they ever read it? Has your mother "
        "read it? It was read aloud. The teacher read a story. She sat down and read the letter. Everyone in the room "
        "read the note. He got up, read the sign, and turned back. The students read Hamlet last term. When I was "
        "young, I read every day. The committee has not yet read it. Who read this?",
        "R IY1 D": "They read every day. Read it aloud! Never read in the dark. Open your book and read page nine. "
        "Does he read much? Did your brother read it? What did you read yesterday? Why don't we read it now? People "
        "who read live longer. When you read this, I will be gone. I watched her read the letter. On Sundays they read "
        "the Bible. Please read the label. To read is to travel.",
    }
    wrong = [
        (names, sentence)
        for names, text in sentences.items()
        for sentence in re.split(r"(?<=[.?!]) ", text)
        for word in pronounce(sentence).words
        if word.text.lower() in {"read", "reads"} and word.arpabet != tuple(names.split())
    ]
    assert not wrong


def test_the_user_dictionary_takes_precedence() -> None:
    own = parse_dictionary("lead L AH1 D")
    assert pronounce("They lead the lead pipe.", dictionary=own).words[1].arpabet == ("L", "AH1", "D")


def test_a_spelling_without_readings_is_none() -> None:
    assert not is_homograph("table")
    assert homograph_segments(["the", "table"], [1]) == {}


def test_tags_are_those_of_the_tagger_of_hibari() -> None:
    tagger = pytest.importorskip("hibari.g2p.tagger")
    package = util.find_spec("hibari")
    assert package is not None
    folder = Path((package.submodule_search_locations or [])[0])
    content = json.loads(gzip.decompress((folder / "assets" / "tagger.json.gz").read_bytes()))
    own = tagger.Tagger(content)
    names = [*list(content["weights"])[::50], "w=°", 's3="']
    assert all(part_of_speech._model().weights(name) == content["weights"].get(name, {}) for name in names)
    for text in (
        "The old lead pipe burst , and Metals contract when they cool .",
        'In 1984 a well-known élan \\ of " quoted frobnicators - 7 é .',
    ):
        assert list(tag_words(tuple(text.split()))) == own(text.split())


def test_a_contraction_has_the_tag_of_its_first_part() -> None:
    assert tag_words(("I", "don't", "know"))[1] == "VBP"
    assert tag_words(("She's", "here"))[0] == "PRP"


def forget() -> None:
    part_of_speech._model.cache_clear()
    tag_words.cache_clear()


@pytest.fixture
def _no_tagger() -> Iterator[None]:
    """None is loaded before the test and after it."""
    forget()
    yield
    forget()


@pytest.mark.usefixtures("_no_tagger")
def test_a_missing_tagger_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(util, "find_spec", lambda name: None)
    with pytest.raises(BackendError, match="pip install hibari-tts"):
        tag_words(("a", "bow"))


@pytest.mark.usefixtures("_no_tagger")
def test_a_damaged_tagger_is_reported(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    broken = tmp_path / "tagger.json.gz"
    broken.write_bytes(gzip.compress(b'{"tags":["NN"]}'))
    monkeypatch.setattr(part_of_speech, "_model_path", lambda: broken)
    with pytest.raises(DataError, match=r"is damaged .*reinstall hibari-tts"):
        tag_words(("a", "bow"))
