"""Letters of the neural voice: variants of phones, and the place of each phone."""

import pytest

from lexicon.ipa import parse_ipa
from lexicon.misaki import PHONE_OF_LETTER
from tts2face.sound.heart_letters import LETTERS_OF_PHONE, voice_phones, word_letters


def letters(ipa: str) -> str:
    segments = parse_ipa(ipa)
    return word_letters([s.phone for s in segments], [s.stress for s in segments])[0]


@pytest.mark.parametrize(
    ("ipa", "written"),
    [
        ("həlˈoʊ", "həlˈO"),
        ("bˈʌtɚ", "bˈʌTəɹ"),
        ("pˈɑɹti", "pˈɑɹTi"),
        ("ətˈæk", "ətˈæk"),  # before a stressed vowel
        ("bˈʌtən", "bˈʌtən"),  # before a syllabic n
        ("bˈɑtəl", "bˈɑTᵊl"),
        ("sɪɹiəlz", "sɪɹiᵊlz"),
        ("wˈɑntəd", "wˈɑntᵻd"),
        ("ˈædəd", "ˈædᵻd"),
        ("tʃˈɝtʃɪz", "ʧˈɜɹʧᵻz"),
        ("ə", "ɐ"),
        ("ən", "ɐn"),
        ("ˈən", "ˈən"),
        ("ʌv", "ʌv"),
        ("bˈy", "bˈʊ"),  # a vowel that the alphabet lacks
    ],
)
def test_variants_of_phones(ipa: str, written: str) -> None:
    assert letters(ipa) == written


def test_places_are_those_of_the_phones() -> None:
    phones, stress = ("b", "ɝ", "d", "tʃ", "ɚ"), (0, 1, 0, 0, 0)
    written, places = word_letters(phones, stress)
    assert written == "bˈɜɹdʧəɹ"
    assert [written[place] for place in places] == ["b", "ɜ", "d", "ʧ", "ə"]
    assert voice_phones(phones) == list(phones)


def test_every_phone_keeps_its_name() -> None:
    for phone, letter in LETTERS_OF_PHONE.items():
        assert PHONE_OF_LETTER[letter[0]] == {"ɚ": "ə"}.get(phone, phone)
