"""Numbers, dates, abbreviations and signs of languages with a table, as words."""

import random
import re
import sys

import pytest

from lexicon.errors import BackendError
from lexicon.g2p import languages
from lexicon.locales import numbers
from lexicon.locales.reading import read_forms
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


PIECES = (
    "5", "3,5", "1.000", "1 234 567", "12\u00a0500", "0,05", "007", "1998", "-5", "−5 °C", "20 %", "20%", "€ 5", "5 €",
    "$20", "3,50 €", "½", "2½", "3/4", "10-15", "10–15 km", "3.5.2024", "3/5/2024", "2024-05-03", "14:30", "8:05",
    "XIV", "XL", "MIX", "II.", "5.", "№ 5", "§ 7", "5 × 3 = 15", "2 + 2", "+49 30 123456", "1.2.3", "COVID-19", "A4",
    "5km", "100 km/h", "m²", "info@a.de",
    "٣٫٥", "५", "word", "(", ")", ",", "?", "Dr.", "z. B.", "т. е.", "1er", "2e", "1.º",
    "5-го", "7!", "~5", "&", "3:1", "#1", "°", "%", "€", "@", "1/2/3", "99999999999999999999",
)  # fmt: skip
NEVER = re.compile(r"[0-9€$£%½−+=×§&@°²]")


@pytest.mark.parametrize("language", ["de", "fr-fr", "es", "it", "pt-br", "nl", "pl", "ru", "tr", "el"])
def test_only_words_are_left_of_any_text(language: str) -> None:
    chance = random.Random(language)
    for _ in range(200):
        text = " ".join(chance.choice(PIECES) for _ in range(chance.randint(1, 8)))
        forms = read_forms(text, language)
        assert "".join(form.source for form in forms) == text
        said = spoken_form(text, language)
        assert not NEVER.search(said), (text, said)
        assert spoken_form(said, language) == said


def test_the_package_of_numbers_is_named_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "unicode_rbnf", None)
    numbers._engine.cache_clear()
    numbers._spelt.cache_clear()
    with pytest.raises(BackendError, match="unicode_rbnf is missing; install it with `pip install tts2face`"):
        spoken_form("Es sind 5 km.", "de")


@pytest.mark.parametrize("language", ["de", "fr-fr", "es", "it", "pt", "nl", "pl", "ru", "tr", "el", "fr-ch", "es-419"])
def test_long_numbers_have_words(language: str) -> None:
    for number in ("0", "1000", "21000", "1000000", "2000001", "123456789012345", "1234567890123456"):
        assert not any(map(str.isdigit, spoken_form(f"{number}, {number}. ", language)))
