"""Languages of texts by their script, and by common words; short English texts are not taken for others."""

import time

import pytest

from lexicon.g2p import languages
from lexicon.text_language import LANGUAGE_OF_SCRIPT, OWN_LETTERS, guess_language
from lexicon.written_forms import read_table

TEXTS = {
    "ru": "Привет, мир", "uk": "Привіт, як справи?", "cmn": "你好，世界。", "ja": "iPhone を買いました。",
    "ko": "안녕하세요",    "ar": "مرحبا بالعالم",
    "fa": "سلام، چطوری؟", "ur": "آپ کیسے ہیں؟", "el": "Γειά σου", "he": "שלום", "hi": "नमस्ते",
    "th": "สวัสดี", "de": "Guten Morgen.", "fr-fr": "Je suis là.", "es": "¿Cómo estás?", "it": "Come stai?",
    "pt-br": "Olá, como você está?", "nl": "Hoe gaat het met je?", "sv": "Hur mår du, det är inte bra.",
    "fi": "Hyvää huomenta.", "pl": "Dzień dobry.", "cs": "Dobrý den, kde je to?", "hu": "Jó napot!", "tr": "Merhaba.",
    "ro": "Bună ziua.", "id": "Terima kasih.", "vi": "Xin chào.",
}  # fmt: skip
ENGLISH = (
    "Hello.", "OK.", "Yes.", "Bob may move.", "Die hard.", "Los Angeles.", "La La Land.", "O Canada!", "Des Moines.",
    "Mon Cheri", "Van Gogh.", "Leonardo da Vinci was born in Vinci.", "Mi casa es su casa, she said.", "Och aye.",
    "Sen. Warren.",
    "C'est la vie, he said to me.", "The word und is German.", "The value of π.", "Hi Hans, how are you?",
    "Pizza.", "Plan B.", "Is it a bird?", "", "123", "...", "[nod] Hello.",
    "<speak>Hello <emphasis>there</emphasis></speak>",
)  # fmt: skip


@pytest.mark.parametrize("language", TEXTS)
def test_languages_are_recognised(language: str) -> None:
    assert guess_language(TEXTS[language]) == language


@pytest.mark.parametrize("text", ENGLISH)
def test_short_english_texts_are_not_taken_for_others(text: str) -> None:
    assert guess_language(text) == "en-us"
    assert guess_language(text, "en-gb") == "en-gb"


def test_words_overrule_no_other_default_but_scripts_do() -> None:
    assert guess_language("Guten Morgen.", "es") == "es"
    assert guess_language("Привет, мир", "es") == "ru"


def test_markup_has_no_language() -> None:
    assert guess_language("<speak>Guten <emphasis level='strong'>Morgen</emphasis></speak>") == "de"


def test_all_languages_can_be_spoken() -> None:
    own = {language for pairs in OWN_LETTERS.values() for language, _ in pairs}
    assert {*LANGUAGE_OF_SCRIPT.values(), *own, *read_table("stop_words.tsv")} - {"en"} <= set(languages())


def test_texts_of_any_length_take_the_same_time() -> None:
    began = time.process_time()
    for text in ("<" * 1_000_000, "[" * 1_000_000, "a" * 1_000_000):
        guess_language(text)
    assert time.process_time() - began < 1.0
