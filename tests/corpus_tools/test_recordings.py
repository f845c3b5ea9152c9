"""Recordings of a folder, their words, and how these are pronounced."""

import pytest

from corpus_tools.recordings.folder import (
    LETTER_NAMES,
    Recording,
    find_recordings,
    look_up_pronunciations,
    pronounce_recording,
)
from lexicon.dictionary import arpabet_segments
from lexicon.errors import DataError, InputError


def test_a_manifest_names_clips_and_their_words(tmp_path):
    (tmp_path / "clips").mkdir()
    for name in ("b", "a"):
        (tmp_path / "clips" / f"{name}.mkv").touch()
    (tmp_path / "manifest.csv").write_text("clip,transcript\na,bin blue at a two now\n")
    found = find_recordings(tmp_path)
    assert [(one.name, one.transcript) for one in found] == [("a", "bin blue at a two now"), ("b", None)]
    assert found[0].is_spelling


def test_plain_videos_have_their_text_beside_them(tmp_path):
    (tmp_path / "x.MP4").touch()
    (tmp_path / "x.txt").write_text("A word.", encoding="utf-8-sig")
    (tmp_path / "notes.doc").touch()
    (found,) = find_recordings(tmp_path)
    assert (found.name, found.transcript, found.is_spelling) == ("x", tmp_path / "x.txt", False)
    assert [word for word, _ in pronounce_recording(found)] == ["A", "word"]


def test_single_letters_are_letter_names_where_the_corpus_spells(tmp_path):
    pronunciations = dict(pronounce_recording(Recording("r", tmp_path / "r.mkv", "at a b", is_spelling=True)))
    assert pronunciations["a"] == (("eɪ",),)
    assert pronunciations["b"] == (("b", "i"),)


def test_an_article_may_sound_both_ways():
    assert set(look_up_pronunciations("a", is_letter=False)) == {("ə",), ("eɪ",)}


def test_all_variants_of_the_dictionary_are_offered():
    assert set(look_up_pronunciations("either", is_letter=False)) == {("i", "ð", "ɚ"), ("aɪ", "ð", "ɚ")}


def test_white_begins_with_w():
    assert look_up_pronunciations("white", is_letter=False) == (("w", "aɪ", "t"),)


def test_letters_have_names_in_the_phone_table():
    assert sorted(LETTER_NAMES) == [chr(code) for code in range(ord("a"), ord("z") + 1)]
    assert all(arpabet_segments(names) for variants in LETTER_NAMES.values() for names in variants)


def test_no_folder(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        find_recordings(tmp_path / "none")


def test_a_folder_without_video(tmp_path):
    with pytest.raises(InputError, match="contains no video"):
        find_recordings(tmp_path)


def test_a_manifest_with_other_columns(tmp_path):
    (tmp_path / "a.mkv").touch()
    (tmp_path / "manifest.csv").write_text("file,words\na,bin\n")
    with pytest.raises(DataError, match="needs the columns clip and transcript"):
        find_recordings(tmp_path)


def test_a_recording_without_a_transcript_has_no_words(tmp_path):
    assert pronounce_recording(Recording("r", tmp_path / "r.mkv", None)) is None


def test_words_that_are_known_already_are_not_read_again(tmp_path):
    words = (("bob", (("b", "ɑ", "b"),)),)
    assert pronounce_recording(Recording("r", tmp_path / "r.mkv", "other words", words=words)) == words


def test_a_transcript_without_words(tmp_path):
    with pytest.raises(DataError, match="contains no word"):
        pronounce_recording(Recording("r", tmp_path / "r.mkv", "... !"))


def test_a_word_missing_in_the_dictionary_is_pronounced_by_rule(tmp_path):
    words = dict(pronounce_recording(Recording("r", tmp_path / "r.mkv", "the zorblatt")))
    assert words["zorblatt"] == (("z", "ɔ", "ɹ", "b", "l", "æ", "t"),)


def test_numbers_of_a_transcript_are_written_out(tmp_path):
    assert [word for word, _ in pronounce_recording(Recording("r", tmp_path / "r.mkv", "I have 2."))] == [
        "I",
        "have",
        "two",
    ]


def test_a_word_without_pronunciation_is_refused(tmp_path):
    with pytest.raises(DataError, match="no pronunciation is known for '東京'"):
        pronounce_recording(Recording("r", tmp_path / "r.mkv", "bin 東京"))
