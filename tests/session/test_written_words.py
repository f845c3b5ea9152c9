"""Words of speech in other languages are those of the text, and sound as `phones` prints them."""

import pytest

from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce
from lexicon.sentences import split_sentences
from lexicon.sequence import SILENCE
from lexicon.text_marks import parse_marks
from tts2face.request import Request
from tts2face.session.speech import script_of, speak_sentence
from tts2face.sound.espeak import EspeakVoice

TEXTS = {
    "de": "½ Liter für 3,50 €, Größe XL, z. B. am 3.5.2024 um 14:30 Uhr.",
    "fr-fr": "½ litre à 14h30 pour Louis XIV : 1 234 567 €.",
    "it": "½ litro, il 1° maggio, 2,50 €.",
    "nl": "½ liter, -2 °C, ca. 5%.",
    "pt-br": "½ litro, R$ 3,50, 14h30.",
    "pl": "½ litra w XX w. za 3,50 zł.",
    "ru": "В XXI веке 3,5 тыс. руб. и iPhone.",
}


@pytest.mark.parametrize("language", sorted(TEXTS))
def test_a_voice_speaks_the_phones_of_the_front_end(language: str) -> None:
    speech = EspeakVoice(language, {}).speak(spoken_form(TEXTS[language], language))
    spoken = tuple(phone for phone in speech.phones.phones if phone != SILENCE)
    assert spoken == pronounce(TEXTS[language], language).phones


def test_words_of_a_sentence_are_written_ones() -> None:
    text = "Le prix : 1 234 567 € pour Louis XIV, à 14h30."
    (sentence,) = split_sentences(parse_marks(text, "fr-fr"), "fr-fr")
    request = Request(text=text, language="fr-fr")
    spoken = speak_sentence(EspeakVoice("fr-fr", {}), sentence, request)
    written = ["Le", "prix", "1 234 567 €", "pour", "Louis", "XIV", "à", "14h30"]
    assert [word.text for word in spoken.speech.words] == written
    script = script_of(sentence, "fr-fr")
    assert [word.text.strip(":.,") for word in script if word.text != ":"] == written
    assert [word.after for word in script][-3:] == [",", "", "."]
    ends = [word.last for word in spoken.speech.words]
    assert ends == sorted(set(ends))
