"""Numbers, dates, abbreviations and signs of languages with a table, as words."""

import pytest

from lexicon.g2p import languages
from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks
from lexicon.vowels import without_vowels
from lexicon.written_forms import read_table


@pytest.mark.parametrize(
    ("written", "spoken"),
    [
        ("Am 3. Mai in Berlin.", "Am dritten Mai in Berlin."),
        ("Heute ist der 31. Dezember.", "Heute ist der einunddreißigste Dezember."),
        ("3. Mai", "dritter Mai"),
        ("vom 21. März bis zum 7. April", "vom einundzwanzigsten März bis zum siebten April"),
        ("Es waren 3. Dann kam Mai.", "Es waren drei. Dann kam Mai."),
    ],
)
def test_days_of_german_dates(written: str, spoken: str) -> None:
    assert spoken_form(written, "de") == spoken


def test_a_word_has_the_written_form_of_which_it_is_a_part() -> None:
    words = pronounce_marked(parse_marks("Es kostet 1 234 €, d. h. 10-15 %.", "de"), "de").words
    assert [(word.source, word.text) for word in words] == [
        ("Es", "Es"), ("kostet", "kostet"), ("1 234 €", "tausendzweihundertvierunddreißig"),
        ("1 234 €", "Euro"), ("d. h", "das"), ("d. h", "heißt"), ("10-15 %", "zehn"), ("10-15 %", "bis"),
        ("10-15 %", "fünfzehn"), ("10-15 %", "Prozent"),
    ]  # fmt: skip
    assert [word.source for word in pronounce("Louis XIV", "fr-fr").words] == ["Louis", "XIV"]


def test_words_are_read_as_they_are() -> None:
    for language in ("de", "fr-fr"):
        text = "Zug um acht Uhr, Karl der Große, l'été de Louis quatorze; Wort-Wort (so)"
        assert spoken_form(text, language) == text


@pytest.mark.parametrize(
    ("language", "text", "spoken"),
    [
        ("sv", "Det är -5 grader, 10-15 eller 3 - 4.", "Det är minus 5 grader, 10-15 eller 3 - 4."),
        ("cs", "Je −5 °C.", "Je minus 5 °C."),
        ("he", "עכשיו -5 מעלות", "עכשיו מינוס 5 מעלות"),
        ("nb", "-5", "minus 5"),
        ("gd", "-5", "-5"),
    ],
)
def test_minus_is_a_word_in_languages_without_a_table(language: str, text: str, spoken: str) -> None:
    assert without_vowels(spoken_form(text, language), language) == spoken


def test_every_language_of_the_table_of_minus_is_one_of_espeak() -> None:
    assert read_table("minus_words.tsv").keys() <= languages().keys()
