"""Labels of the words of other languages, and their phones: what `tts2face phones` prints is what is spoken."""

from itertools import pairwise

import pytest

from lexicon.ipa import parse_ipa
from lexicon.sequence import SILENCE
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks
from tests.packages import needs
from tts2face.sound.voice import SpokenWord
from tts2face.sound.voice_pool import load_voice

SEGMENTS = parse_ipa("kilomˈeːtɐ")
TEXTS = {
    "de": "Am 3. März um 14:30 Uhr kosten 2,5 kg (z. B. Äpfel) 1.000 €.",
    "fr-fr": "L’été dernier, tout le monde a payé 12 500,75 € ; c'est 20 % de plus !",
    "es": "¿Cuesta $1.500 o 20 € el 3/5/1998?",
    "it": "Il sig. Rossi pesa 82,5 kg nell'anno 1881.",
    "pt-br": "Custa R$ 3,50 por kg às 14h30.",
    "nl": "Het is -2 °C, ca. 5% kouder in 's-Gravenhage.",
    "pl": "Dr Nowak ma 12 000 zł i 3,5 km do ul. Długiej 5.",
    "ru": "Это 5 км, т. е. 20 % пути.",
    "tr": "Dr. Yılmaz %20 indirim yaptı: 3,50 TL.",
    "el": "Κοστίζει 3,50 € το 1ο.",
    "sv": "Det kostar 1 000 kr, dvs. 5 % av 20 000.",
    "hi": "कीमत ₹3.50 है और 20% छूट।",
    "ko": "가격은 3.5달러이고 20% 빨라졌다.",
    "vi": "Giảm 20% cho 1.500 người, -5 °C.",
    "cmn": "价格是3.5元，他跑了100米，还钱给熊。",
    "ja": "3.5ドルの料理は、20%安い。",
    "ar": "السعر ٣٫٥ دولار و100 كم.",
}


@pytest.mark.parametrize("language", TEXTS)
def test_words_and_phones_are_those_that_are_printed(language: str) -> None:
    if language == "ja":
        needs("pyopenjtalk")
    printed = pronounce_marked(parse_marks(TEXTS[language], language), language)
    speech = load_voice("espeak", language).speak(TEXTS[language])
    assert [word.text for word in speech.words] == [word.text for word in printed.words]
    assert tuple(phone for phone in speech.phones.phones if phone != SILENCE) == printed.phones


def test_words_of_numbers_in_german() -> None:
    speech = load_voice("espeak", "de").speak("Der Weg ist 3,5 km lang, das kostet 1.000 €.")
    labels = [word.text for word in speech.words]
    assert " ".join(labels) == "Der Weg ist drei Komma fünf Kilometer lang das kostet tausend Euro"
    starts = [float(speech.phones.edges[word.first]) for word in speech.words]
    assert min(after - before for before, after in pairwise(starts)) > 0.05


def test_a_dictionary_changes_the_words_phones_alone() -> None:
    own = {"kilometer": SEGMENTS}
    speech = load_voice("espeak", "de", own).speak("Nur 3,5 km.")
    assert [word.text for word in speech.words] == ["Nur", "drei", "Komma", "fünf", "Kilometer"]
    km = speech.words[-1]
    assert speech.phones.phones[km.first : km.last] == tuple(segment.phone for segment in own["kilometer"])


def test_words_with_given_phones_stand_beside_numbers() -> None:
    words = [SpokenWord("1.000", ()), SpokenWord("Ada", SEGMENTS, ","), SpokenWord("3,5", ())]
    speech = load_voice("espeak", "de").speak(words)
    assert [word.text for word in speech.words] == ["tausend", "Ada", "drei", "Komma", "fünf"]
