"""Arabic and Hebrew are read with vowels where a model of them is installed; letters and labels stay as written."""

import unicodedata

import pytest

from lexicon import vowels
from lexicon.canonical import signs_before_vowels
from lexicon.foreign_words import make_readable
from lexicon.marked_text import MarkedText
from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce
from lexicon.vowels import add_vowels, vowel_note, without_vowels
from tests.packages import needs

TEXTS = {
    "ar": ("السلام عليكم، كيف حالك اليوم؟", "ʕalaikum"),
    "he": ("שלום לכולם, מה שלומך היום?", "lχulam"),
}


@pytest.fixture
def _without_models(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vowels, "_model", lambda _: None)


@pytest.mark.parametrize("language", TEXTS)
def test_words_get_their_vowels(language: str) -> None:
    needs("piper")
    text, phones = TEXTS[language]
    words = pronounce(text, language).words
    assert "".join(words[1].phones) == phones
    assert [word.text for word in words] == [word.strip("،؟,?") for word in text.split()]
    assert vowel_note(text, language) == ""


@pytest.mark.parametrize("language", TEXTS)
@pytest.mark.usefixtures("_without_models")
def test_without_a_model_the_text_stays_and_the_note_says_so(language: str) -> None:
    text, phones = TEXTS[language]
    assert spoken_form(text, language) == text
    assert "".join(pronounce(text, language).words[1].phones) != phones
    assert any("tts2face[piper]" in note for note in make_readable(MarkedText(text), language)[1])


@pytest.mark.parametrize(
    ("text", "language"),
    [("Hello there.", "he"), ("שָׁלוֹם", "he"), ("السَّلَامُ عَلَيْكُمْ", "ar"), ("Größe", "de"), ("25 %", "ar")],
)
def test_other_texts_stay_as_they_are(text: str, language: str) -> None:
    assert add_vowels(text, language) == text


@pytest.mark.parametrize(
    ("text", "language"),
    [
        ("ذهب 25 ولد to school", "ar"),
        ("ـــمرحبا 😀 بك", "ar"),
        ("הלכתי ל-Google ב-2024 עם דני", "he"),
        ("a\tשלום\nב", "he"),
    ],
)
def test_letters_and_signs_do_not_change(text: str, language: str) -> None:
    needs("piper")
    assert without_vowels(add_vowels(text, language), language) == text


def test_marks_of_a_text_stay_and_its_other_words_get_theirs(monkeypatch: pytest.MonkeyPatch) -> None:
    marked = {"شكرا جديدة": "شَكَرَا جَدِيدَة"}
    monkeypatch.setattr(vowels, "_model", lambda _: lambda text: marked.get(text, "?"))
    assert add_vowels("شكراً جديدة", "ar") == "شَكَرَاً جَدِيدَة"  # tanwin alone, as most texts have it
    assert add_vowels("شُكْراً جديدة", "ar") == "شُكْراً جَدِيدَة"


@pytest.mark.parametrize(
    ("language", "text", "phones"),
    [
        ("ar", "مُدَرِّسَة", "mudarrisat"),
        ("ar", "مُحَمَّد", "muħammad"),
        ("ar", "جِدًّا", "dʒidan"),
        ("fa", "مُحَمَّد", "mohamad"),
        ("ur", "مُحَمَّد", "mʊhammad"),
        ("he", "שָׁלוֹם", "ʃalom"),
        ("he", "כֹּל", "kol"),
        ("he", "יִשְׂרָאֵל", "israʔel"),
    ],
)
def test_the_order_of_marks_does_not_count(language: str, text: str, phones: str) -> None:
    orders = {unicodedata.normalize(form, text) for form in ("NFC", "NFD")} | {signs_before_vowels(text)}
    assert len(orders) > 1
    for order in orders:
        assert "".join(pronounce(order, language).phones) == phones


@pytest.mark.parametrize("text", ["شُكْرًا", "شُكْراً", "شُكْرَاً"])
def test_tanwin_may_stand_on_its_alif(text: str) -> None:
    assert "".join(pronounce(text, "ar").phones) == "ʃukran"


def test_a_model_that_changes_letters_is_asked_word_by_word(monkeypatch: pytest.MonkeyPatch) -> None:
    marked = {"אב": "אָב", "אב גד": "אב"}
    monkeypatch.setattr(vowels, "_model", lambda _: lambda text: marked.get(text, "?"))
    assert add_vowels("אב גד", "he") == "אָב גד"


def test_long_texts_are_not_given_to_a_model() -> None:
    text = "שלום " * vowels.MAX_CHARACTERS
    assert add_vowels(text, "he") == text
