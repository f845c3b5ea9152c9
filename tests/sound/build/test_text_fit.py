"""Words of a text that a recording does not contain are found, and no others."""

import csv
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.sound.alignment import TextMismatch
from tts2face.sound.transcript import align_recording, pronounce_transcript
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Waveform
from tts2face.video.media import read_sound

RIGHT = ("Please wait for the beep, then say your name.", "The young chef usually pushes five big maps before noon.")
WRONG = (
    "She sold seven old houses near the river.",
    "A cold wind blew from the mountains all night.",
    "Children like to jump over puddles.",
    "The judge read the letter twice.",
)


@pytest.mark.smoke
def test_a_mismatch_has_its_time_and_words() -> None:
    mismatch = TextMismatch(1.0, 2.5, ("one", "two")).shift(2.0)
    assert mismatch.sentence == ("the text does not fit the recording from 3.0 to 4.5 s (one two); check the words")
    long = TextMismatch(0.0, 9.0, tuple("abcdefghij"))
    assert "(a b c d ... h i j)" in long.sentence


@pytest.mark.smoke
def test_another_text_for_the_project_s_own_voice() -> None:
    speech = load_voice("heart", "en-us").speak(RIGHT[1])
    assert align_recording(speech.waveform, pronounce_transcript(RIGHT[1], "en-us"))[2] == ()
    with pytest.raises(DataError, match=r"the recording does not contain this text: \d+% .*wait.*; check the words"):
        align_recording(speech.waveform, pronounce_transcript(RIGHT[0], "en-us"))


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_the_before_consonants_has_a_schwa(name: str) -> None:
    text = "The dog ran to the river. They put the cups on the table to open the box of the old man."
    sound = load_voice(name, "en-us").speak(text).waveform
    phones, words, _ = align_recording(sound, pronounce_transcript(text, "en-us"))
    spoken = [(word.text.lower(), "".join(phones.phones[word.first : word.last])) for word in words]
    assert [form for word, form in spoken if word == "the"] == ["ðə"] * 5 + ["ði"]
    assert [form for word, form in spoken if word == "to"][1] in {"tu", "tʊ"}
    assert ("of", "ʌv") in spoken


def test_wrong_sentences_among_right_ones() -> None:
    voice = load_voice("heart", "en-us")
    said = [RIGHT[0], RIGHT[1], "It was a sunny day in the park.", "Nobody saw the dog again."]
    sounds = [voice.speak(text).waveform for text in said]
    sound = Waveform(np.concatenate([one.samples for one in sounds]), voice.sample_rate)
    assert align_recording(sound, pronounce_transcript(" ".join(said), "en-us"))[2] == ()
    n_found = 0
    for wrong in WRONG:
        for at in (1, 2):
            begin = sum(one.duration for one in sounds[:at])
            text = " ".join([*said[:at], wrong, *said[at + 1 :]])
            found = align_recording(sound, pronounce_transcript(text, "en-us"))[2]
            assert all(one.begin < begin + sounds[at].duration and one.end > begin for one in found)
            n_found += bool({word for one in found for word in one.words} & set(wrong.rstrip(".").split()))
    assert n_found == 8


@pytest.mark.parametrize("n_sentences", [1, 6])
def test_real_recordings(n_sentences: int, shared_recordings: Path) -> None:
    """GRID s1: no warning with the right text; a sentence of another one is noticed, or refused."""
    folder = shared_recordings / "grid_s1"
    with (folder / "manifest.csv").open() as file:
        rows = list(csv.DictReader(file))[50:800:125][:n_sentences]
    samples = [read_sound(folder / "clips" / f"{row['clip']}.mkv", 16000).samples for row in rows]
    sound = Waveform(np.concatenate(samples), 16000)
    texts = [row["transcript"] for row in rows]
    assert align_recording(sound, pronounce_transcript(". ".join(texts), "en-us"))[2] == ()
    place = n_sentences // 2
    begin = sum(map(len, samples[:place])) / 16000
    end = begin + len(samples[place]) / 16000
    texts[place] = "My brother usually drinks coffee"
    try:
        found = align_recording(sound, pronounce_transcript(". ".join(texts), "en-us"))[2]
    except DataError:
        assert n_sentences == 1
    else:
        assert any("usually" in one.words and begin - 1.5 < one.begin and one.end < end + 1.5 for one in found)
