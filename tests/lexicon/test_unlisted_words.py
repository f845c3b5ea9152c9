"""English words that CMUdict lacks: names, misaki's dictionary, parts of words, spellings of other languages."""

import gzip
import importlib.util
import json
from pathlib import Path

import pytest

from lexicon import misaki
from lexicon.dictionary import arpabet_segments, cmudict_lookup, named_pronunciation
from lexicon.foreign_spellings import read_foreign_spelling, spelling_language
from lexicon.ipa import parse_ipa
from lexicon.misaki import GRADES, misaki_lookup
from lexicon.phones import PHONES
from lexicon.pronounce import Dictionary, pronounce
from tests.bench.bench_words import RIGHT, UNLISTED_WORDS, read_words, said, word_distance

MIN_RIGHT = 165  # of 181 words; 176 were when the tables were made
NAMES = Path(misaki.__file__).with_name("names.tsv").read_text(encoding="utf-8").splitlines()


def test_words_of_names_food_science_and_fashion() -> None:
    found = [
        min(word_distance(said(word), answer) for answer in right) for _, word, right in read_words(UNLISTED_WORDS)
    ]
    assert sum(distance <= RIGHT for distance in found) >= MIN_RIGHT


def test_the_table_of_names_has_one_pronunciation_of_words_that_cmudict_lacks() -> None:
    rows = [line.split("\t") for line in NAMES[1:]]
    assert len({word for word, _, _ in rows}) == len(rows)
    for word, names, kind in rows:
        assert cmudict_lookup(word) is None, word
        assert sum(segment.stress == 1 for segment in arpabet_segments(names)) >= 1, word
        assert kind, word


@pytest.mark.parametrize("accent", ["us", "gb"])
@pytest.mark.parametrize("grade", GRADES)
def test_misaki_is_searched_as_it_is_written(accent: str, grade: str) -> None:
    found = importlib.util.find_spec("hibari")
    assert found is not None
    assert found.submodule_search_locations
    path = Path(found.submodule_search_locations[0], "assets", f"lexicon_{accent}_{grade}.json.gz")
    table = json.loads(gzip.decompress(path.read_bytes()))
    several = [word for word, letters in table.items() if isinstance(letters, dict)]
    for word in [*list(table)[::400], *several[::20], next(iter(table)), next(reversed(table))]:
        letters = table[word]
        wanted = letters["DEFAULT"] if isinstance(letters, dict) else letters
        assert misaki.misaki_readings(word, accent, (grade,), is_exact=True)["DEFAULT"] == wanted
    for word in ("qqqq", "", "~", "'", "NOUN-", "zzzzz"):
        assert not misaki.misaki_readings(word, accent, (grade,), is_exact=True)


def test_misaki_s_letters_become_phones() -> None:
    assert misaki_lookup("burrata") == tuple(arpabet_segments("B ER0 AA1 T AH0"))
    assert misaki_lookup("Burrata") == misaki_lookup("burrata")
    assert misaki_lookup("qqqq") is None


def _arpabet(word: str) -> str:
    return " ".join(name for part in pronounce(word).words for name in part.arpabet)


@pytest.mark.parametrize(
    ("word", "arpabet"),
    [
        ("dockerized", "D AA1 K ER0 AY2 Z D"),
        ("regreened", "R IY2 G R IY1 N D"),
        ("microplastics", "M AY2 K R OW0 P L AE1 S T IH0 K S"),
        ("biopunkish", "B AY2 OW0 P AH1 NG K IH0 SH"),
        ("doomscrolling", "D UW1 M S K R OW2 L IH0 NG"),
        ("lampshadey", "L AE1 M P SH EY2 D IY0"),
        ("hyperparameters", "HH AY2 P ER0 P ER0 AE1 M AH0 T ER0 Z"),
        ("DeepSnow", "D IY1 P S N OW2"),
        ("QuickAI", "K W IH1 K EY0 AY2"),
        ("unputdownable", "AH2 N P UH2 T D AW1 N AH0 B AH0 L"),
        ("Redis's", "R EH1 D IH0 S IH0 Z"),
        ("gulabs", "G UH0 L AA1 B Z"),
    ],
)
def test_parts_of_words(word: str, arpabet: str) -> None:
    assert _arpabet(word) == arpabet


@pytest.mark.parametrize(
    ("word", "language", "arpabet"),
    [
        ("Zaragüeña", "letters", "Z AA2 R AH0 G W EH1 N Y AH0"),
        ("Brzozowska", "pl", "B ZH AO0 Z AO1 F S K AH0"),
        ("Vukčević", "hr", "V UW0 K CH EH1 V IH0 CH"),
        ("Marenzelli", "letters", "M AA2 R EH0 N Z EH1 L IY0"),
        ("Yamanoto", "letters", "Y AA2 M AH0 N OW1 T OW0"),
        ("Pardinho", "letters", "P AA0 R D IY1 N Y OW0"),
    ],
)
def test_spellings_of_other_languages(word: str, language: str, arpabet: str) -> None:
    assert spelling_language(word) == language
    assert word_distance([name.rstrip("012") for name in _arpabet(word).split()], _plain(arpabet)) <= RIGHT


def _plain(arpabet: str) -> list[str]:
    return [name.rstrip("012") for name in arpabet.split()]


def test_english_spellings_are_not_foreign() -> None:
    for word in ("Smithson", "rewatchable", "Blankenship", "Zorn"):
        assert read_foreign_spelling(word) == ()


@pytest.mark.parametrize(
    ("word", "first"), [("vlarp", "V L"), ("Zlorin", "Z L"), ("Dnorp", "D N"), ("chthorn", "TH"), ("Tchell", "CH")]
)
def test_odd_beginnings_are_not_spelled(word: str, first: str) -> None:
    assert _arpabet(word).startswith(first)


def test_a_name_with_s_is_no_plural() -> None:
    assert _arpabet("Gorvas").endswith("S")
    assert _arpabet("gorvas").endswith("Z")


def test_order_of_the_dictionaries() -> None:
    own = Dictionary({"djokovic": parse_ipa("bˈɑb"), "hello": parse_ipa("hˈeɪ")})
    assert pronounce("Djokovic", "en-us", own).phones == ("b", "ɑ", "b")
    assert pronounce("hello", "en-us", own).phones == ("h", "eɪ")
    assert named_pronunciation("Djoković") is not None
    assert _arpabet("matcha") == "M AA1 CH AH0"


def test_without_misaki_words_are_read_by_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(misaki, "_text", lambda accent, grade: b"{}")
    misaki.misaki_readings.cache_clear()
    assert misaki_lookup("burrata") is None
    assert all(phone in PHONES for phone in pronounce("zymotechnic").phones)
    misaki.misaki_readings.cache_clear()


@pytest.mark.parametrize(
    ("word", "phones"),
    [
        ("Xiaoming", "ʃaʊmɪŋ"),
        ("Anqi", "ɑntʃi"),
        ("Quanzhou", "tʃwɑndʒoʊ"),
        ("Jinxiang", "dʒɪnʃɑŋ"),
        ("Xianzhi", "ʃjɛndʒi"),
        ("Huaraz", "wɑɹɑz"),
        ("Ndlovu", "ndloʊvu"),
        ("Mwangi", "mwɑŋɡi"),
        ("Yıldız", "jɪldɪz"),
        ("quishing", "kwɪʃɪŋ"),
        ("hangrily", "hæŋɡɹili"),
        ("cringiness", "kɹɪndʒinəs"),
        ("ketoacidosis", "kitoʊæsədoʊsəs"),
        # no Chinese syllables
        ("Zhanna", "ʒænə"),
        ("Brezhnevo", "bɹɛʒnivoʊ"),
    ],
)
def test_names_and_words_by_their_letters(word: str, phones: str) -> None:
    assert "".join(pronounce(word).words[0].phones) == phones
