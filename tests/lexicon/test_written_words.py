"""Words as they are written in languages that espeak-ng reads, and their phones within their sentence."""

import pytest

from lexicon.espeak_words import words_by_espeak
from lexicon.normalize import spoken_form
from lexicon.written_words import written_words


@pytest.mark.parametrize(
    ("language", "text", "words"),
    [
        ("de", "Der Weg ist 3,5 km lang, 1.000 € teuer.", "Der|Weg|ist|3,5|km|lang,|1.000|€|teuer."),
        ("de", "Das heißt (d. h.) -5 °C — oder?", "Das|heißt,|d|h.|-5|°C—|oder?"),
        ("fr-fr", "« L'été », dit-il à 14h30 : 12 000 € !", "L'été,|dit-il|à|14h30:|12 000|€!"),
        ("es", "¿Cuesta $1.500,50 o 20 %?", "Cuesta|$1.500,50|o|20|%?"),
        ("it", "L'anno 1881: 82,5 kg.", "L'anno|1881:|82,5|kg."),
        ("sv", "1 234 567 kr och 5 %", "1 234 567|kr|och|5|%"),
        ("nl", "'s Ochtends om 7.30 uur.", "s|Ochtends|om|7.30|uur."),
        ("cmn", "价格是3.5元，iPhone坏了。", "价|格|是|3.5|元,|iPhone|坏|了."),
        ("ar", "السعر ٣٫٥ دولار؟", "السعر|٣٫٥|دولار?"),
        ("hi", "कीमत ₹3.50 है।", "कीमत|₹3.50|है."),
        ("ko", "3.5달러, 100m를!", "3.5달러,|100m를!"),
        ("de", "... — !", ""),
    ],
)
def test_numbers_signs_and_apostrophes_are_words(language: str, text: str, words: str) -> None:
    assert "|".join(word.text + word.mark for word in written_words(text, language)) == words


def _phones(text: str, language: str) -> list[tuple[str, str]]:
    return [
        (word.text, "".join(segment.phone for segment in segments))
        for word, segments in words_by_espeak(spoken_form(text, language), language)
    ]


def test_a_number_has_the_phones_of_its_sentence() -> None:
    assert [text for text, _ in _phones("Det kostar 12\u202f000 kr.", "sv")] == ["Det", "kostar", "12 000", "kr"]


def test_words_that_espeak_joins_are_divided() -> None:
    assert _phones("Tout le monde aime l’été.", "fr-fr") == [
        ("Tout", "tu"), ("le", "l"), ("monde", "mɔ̃d"), ("aime", "ɛm"), ("l'été", "lete"),
    ]  # fmt: skip


def test_a_word_without_phones_of_its_own_is_written_with_the_one_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    said = {"a b c": ("a_m", "s_i"), "a": ("a_m",), "b": ("t",), "c": ("s_i",)}
    monkeypatch.setattr("lexicon.espeak_words.phonemize", lambda lines, _: tuple(said[line] for line in lines))
    assert _phones("a b c", "xx") == [("a b", "am"), ("c", "si")]


def test_aujourd_hui_is_french_with_either_apostrophe() -> None:
    ((_, phones),) = _phones("aujourd’hui", "fr-fr")
    assert phones.startswith("oʒuʁd")
