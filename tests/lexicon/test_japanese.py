"""Japanese with Chinese characters, read by pyopenjtalk-plus."""

import re
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon import japanese
from lexicon.errors import BackendError
from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce
from lexicon.scripts import check_script
from lexicon.written_words import written_words
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
@pytest.mark.parametrize(
    ("text", "kana"),
    [
        ("5分待つ。", "ゴフンマツ"),
        ("10分です。", "ジュップンデス"),
        ("9:12", "クジジューニフン"),
        ("800です。", "ハッピャクデス"),
        ("十分で食べた。", "ジュップンデタベタ"),
        ("それで十分だ。", "ソレデジューブンダ"),
        ("八百屋", "ヤオヤ"),
        ("3行", "サンギョー"),
    ],
)
def test_a_number_whose_characters_are_another_word_is_read_as_a_number(text: str, kana: str) -> None:
    assert reading(spoken_form(text, "ja")) == kana


@JAPANESE
def test_phrases_are_separated_and_punctuation_is_kept() -> None:
    assert japanese.to_kana("今日は、東京へ行きます。") == "キョーワ、 トーキョーエ イキマス。"


@JAPANESE
def test_long_texts_are_read_piece_by_piece() -> None:
    assert reading("今日" * 5000).count("キョー") > 4000


@JAPANESE
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("お母さんは料理が 上手です！", "お母さんは|料理が|上手です!"),
        ("価格は3.5ドルと1,500円。", "価格は|3.5ドルと|1,500円."),
        ("１４時３０分に2人、来た。", "１４時|３０分に|2人,|来た."),
        ("「東京」へ（明日）行く…", "東京|へ,|明日,|行く…"),
        ("10枚と十枚\n次の日", "10枚と|十枚|次の日"),
        ("五 月 三 日に 二 人で来た。", "五 月|三 日に|二 人で|来た."),
        ("ｶﾀｶﾅと😀絵文字", "ｶﾀｶﾅと|絵文字"),
    ],
)
def test_words_are_accent_phrases_as_they_are_written(text: str, words: str) -> None:
    assert "|".join(word.text + word.mark for word in written_words(text, "ja")) == words


@JAPANESE
@given(st.text("東京は3.5本へりょABｱ 、。😀\n-％", max_size=40))
def test_phrases_are_ranges_of_the_text_in_order(text: str) -> None:
    at = 0
    for phrase in japanese.japanese_phrases(text):
        assert at <= phrase.start < phrase.end <= len(text)
        at = phrase.end


@JAPANESE
def test_kana_are_read_as_sentences_too() -> None:
    assert reading("わたしは がっこうへ いきます。") == "ワタシワガッコーエイキマス"
    assert reading("100000えん") == "ジューマンエン"


def test_kana_without_the_reader_have_their_particles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(japanese, "has_reader", lambda: False)
    assert japanese.to_kana("わたしは がっこうへ いきます。では、はは は はを みがく。") == (
        "わたしわ がっこうえ いきます。 でわ、 はは は はを みがく。"
    )


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("100000えんです。", "じゅうまんえんです。"),
        ("3600えん", "さんぜんろっぴゃくえん"),
        ("-5どです。", "マイナスごどです。"),
        ("14:30に あう。", "じゅうよじさんじゅっぷんに あう。"),
        ("2024/5/1", "にせんにじゅうよねんごがつついたち"),
    ],
)
def test_numbers_are_kana_without_the_reader(text: str, spoken: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(japanese, "has_reader", lambda: False)
    assert spoken_form(text, "ja") == spoken
    assert pronounce(text, "ja").phones


@pytest.mark.parametrize(("written", "phones"), [("りょうり", "ɽijoɯɽi"), ("リャマ", "ɽijama"), ("りゅう", "ɽijɯɯ")])
def test_espeak_says_no_vowel_before_a_small_y(written: str, phones: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(japanese, "has_reader", lambda: False)
    assert "".join(pronounce(written, "ja").phones) == phones


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
