"""Japanese with Chinese characters, read by pyopenjtalk-plus."""

import re
import sys

import pytest

from lexicon import japanese
from lexicon.errors import BackendError
from lexicon.pronounce import pronounce
from lexicon.scripts import check_script
from tests.lexicon.japanese_readings import READINGS
from tts2face.sound.voice_pool import load_voice

JAPANESE = pytest.mark.needs("pyopenjtalk")


def reading(text: str) -> str:
    return re.sub(r"[\s、。？！]", "", japanese.to_kana(text))


@JAPANESE
def test_most_sentences_are_read_as_a_person_reads_them() -> None:
    """35 of 40 when the library was chosen (docs/decisions/058-japanese.md)."""
    assert len(READINGS) == 40
    right = [written for written, kana in READINGS if reading(written) == kana]
    assert len(right) >= 35


@JAPANESE
def test_phrases_are_separated_and_punctuation_is_kept() -> None:
    assert japanese.to_kana("今日は、東京へ行きます。") == "キョーワ、 トーキョーエ イキマス。"


@JAPANESE
def test_long_texts_are_read_piece_by_piece() -> None:
    assert reading("今日" * 5000).count("キョー") > 4000


def test_texts_in_kana_are_passed_to_espeak_unchanged() -> None:
    assert not japanese.has_kanji("こんにちは、カタカナ。 abc 3")
    assert pronounce("きょうは", "ja").words[0].text == "きょうは"


@JAPANESE
def test_the_voice_pronounces_the_reading() -> None:
    phones = pronounce("東京へ行きます。", "ja").phones
    assert phones == ("t", "o", "o", "k", "o", "o", "e", "i", "k", "i", "m", "a", "s", "ɯ")
    heard = load_voice(None, "ja").speak("東京へ行きます。").phones.phones
    assert "".join(phone for phone in heard if phone in {"t", "k", "m", "s"}) == "tkkms"


def test_without_the_library_the_message_names_the_installation_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyopenjtalk", None)
    japanese.load_reader.cache_clear()
    check_script("こんにちは", "ja")
    with pytest.raises(BackendError, match=r"pip install 'tts2face\[japanese\]', or write the text in kana"):
        check_script("今日は", "ja")
    japanese.load_reader.cache_clear()
