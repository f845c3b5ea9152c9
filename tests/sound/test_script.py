"""Words of a transcript, their pronunciations, and their places in a recording."""

from pathlib import Path

import numpy as np
import pytest

from lexicon.dictionary import parse_dictionary
from lexicon.errors import DataError, InputError
from tts2face.sound import transcript as scripts
from tts2face.sound.transcript import align_recording, pronounce_transcript
from tts2face.types import Waveform
from tts2face.video.media import read_sound


def test_words_have_all_the_pronunciations_of_the_dictionary() -> None:
    (read,) = pronounce_transcript("read", "en-us")
    assert read[0] == "read"
    assert set(read[1]) == {("ɹ", "ɛ", "d"), ("ɹ", "i", "d")}


def test_numbers_are_words() -> None:
    assert [text for text, _ in pronounce_transcript("Chapter 2.", "en-us")] == ["Chapter", "two"]


def test_own_pronunciations_stand_alone() -> None:
    own = parse_dictionary("read  B AA1 B\n")
    assert pronounce_transcript("read", "en-us", own) == (("read", (("b", "ɑ", "b"),)),)


def test_a_text_without_words_is_refused() -> None:
    with pytest.raises(InputError):
        pronounce_transcript("?!", "en-us")


@pytest.mark.build
def test_long_recordings_are_aligned_part_by_part(takes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three sentences in a row: cut at pauses, the edges are those of one alignment of the whole."""
    clips = takes / "clips"
    texts = {"bbaf2n": "bin blue at F two now", "bbaf3s": "bin blue at F three soon"}
    names = ("bbaf2n", "bbaf3s", "bbaf2n")
    sounds = [read_sound(clips / f"{name}.mkv", 16000).samples for name in names]
    sound = Waveform(np.concatenate(sounds), 16000)
    words = pronounce_transcript(". ".join(texts[name] for name in names), "en-us")
    whole, spans, _ = align_recording(sound, words)
    monkeypatch.setattr(scripts, "MAX_ALIGNED_S", 5.0)
    monkeypatch.setattr(scripts, "MAX_STRETCH_S", 5.0)
    cut, cut_spans, mismatches = align_recording(sound, words)
    assert mismatches == ()
    assert [word.text for word in cut_spans] == [word.text for word in spans]
    assert cut.end == pytest.approx(sound.duration, abs=1e-3)
    starts = [
        np.array([found.edges[word.first] for word in said]) for found, said in ((whole, spans), (cut, cut_spans))
    ]
    assert np.median(np.abs(starts[0] - starts[1])) < 0.02
    assert np.abs(starts[0] - starts[1]).max() < 0.2


def test_a_sound_without_the_words_is_refused() -> None:
    noise = Waveform(np.random.default_rng(0).normal(0, 0.01, 1600), 16000)
    with pytest.raises(DataError, match="too short for 13 words; check the words"):
        align_recording(
            noise, pronounce_transcript("a long sentence that nobody could say in a tenth of a second", "en-us")
        )


def test_a_transcript_has_the_phones_of_words_of_other_writing_systems() -> None:
    words = dict(pronounce_transcript("The word 你好 means ខម.", "en-us"))
    assert list(words) == ["The", "word", "你好", "means", "kha", "mo"]
    assert words["你好"] == (("n", "i", "χ", "ɑu"),)
    assert ("m", "i", "n", "z") in words["means"]
