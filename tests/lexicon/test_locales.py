"""Numbers, dates, abbreviations and signs of languages with a table, as words."""

import random
import re
import sys

import pytest

from lexicon.errors import BackendError
from lexicon.g2p import languages
from lexicon.locales import numbers
from lexicon.locales.reading import read, read_forms
from lexicon.locales.tables import find_locale
from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks
from lexicon.vowels import without_vowels
from lexicon.written_forms import read_table

TABLES = ["ar", "cmn", "de", "el", "es", "fr-fr", "hi", "it", "ja", "ko", "nl", "pl", "pt-br", "ru", "tr", "vi"]


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


@pytest.mark.parametrize(
    "language", [pytest.param(one, marks=[pytest.mark.needs("pyopenjtalk")] if one == "ja" else []) for one in TABLES]
)
def test_every_table_has_the_signs_and_powers_of_texts(language: str) -> None:
    locale = find_locale(language)
    assert locale is not None
    missing = [sign for sign in "&+=*×÷<>≤≥≈≠√²³%§°@#∞π№" if sign not in locale.rows("sign")]
    assert not missing
    assert "{}" in locale.setting("power")
    for text in ("7-7-1886", "12/25/2024", "2024-05-03", "3/5/24", "5㎏", "№5", "①", "CO₂", "x⁻³", "10^6", "≥5", "∞"):
        assert not re.search(r"[\d㎏№①₂³⁻≥∞^]", read(text, language))
        assert pronounce(text, language).words


@pytest.mark.parametrize(
    ("language", "text", "spoken"),
    [
        ("cmn", "31.2.2024", "二零二四年二月三十一日"),
        ("ja", "29/2/1998", "千九百九十八年二月二十九日"),
        ("ko", "7-6-1886", "천팔백팔십육년 유월 칠일"),
        ("de", "12/25/2024", "fünfundzwanzigster Dezember zweitausendvierundzwanzig"),
        ("vi", "2024-05-03", "ba tháng năm năm hai nghìn không trăm hai mươi tư"),
        ("de", "10㎡", "zehn Quadratmeter"),
        ("fr-fr", "20℃", "vingt degrés Celsius"),
        ("es", "5㎏/㎡", "cinco kilogramos por metro cuadrado"),
        ("de", "Heinrich Ⅷ regierte", "Heinrich der achte regierte"),
        ("fr-fr", "CO₂", "CO deux"),
        ("cmn", "10⁻³", "十的负三次方"),
        ("it", "10^6", "dieci elevato a sei"),
        ("ru", "2^3", "два в кубе"),
        ("de", "5*3", "fünf mal drei"),
        ("de", "im Maßstab 1:25000", "im Maßstab eins zu fünfundzwanzigtausend"),
        ("hi", "3≠4", "तीन बराबर नहीं चार"),
        ("ar", "5 kg/m²", "خمسة كيلوغرامات في متر مربع"),
    ],
)
def test_signs_dates_and_joined_letters(language: str, text: str, spoken: str) -> None:
    assert without_vowels(read(text, language), language) == spoken


def test_written_forms_of_joined_letters_are_known() -> None:
    text = "Es sind 5㎏ auf 10㎡, Ⅳ. Teil."
    forms = read_forms(text, "de")
    assert "".join(form.source for form in forms) == text
    assert [word.source for word in pronounce(text, "de").words][2:6] == ["5㎏", "5㎏", "auf", "10㎡"]
