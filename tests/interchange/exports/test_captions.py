"""Captions are read back by pysubs2, with the times of words."""

import re

import numpy as np
import pytest

import tts2face
from lexicon.sequence import PhoneSequence, WordSpan
from tests.interchange.exports.made import RATE, made_clip, made_stream, silent_clip
from tests.packages import package
from tts2face.interchange.exports.captions import MAX_CUE_CHARACTERS, MAX_CUE_S, MAX_LINE_CHARACTERS, sentence_cues
from tts2face.interchange.exports.labels import Label
from tts2face.types import Clip, Speech, Trajectory, Waveform, resting_head

pytestmark = pytest.mark.formats

pysubs2 = package("pysubs2")


def piece(text, clip):
    return tts2face.Piece(clip, 0.0, 1, text=text)


def evenly(words, seconds=0.4, start=0.0, pause=0.0):
    step = seconds + pause
    return [Label(word, start + at * step, start + at * step + seconds) for at, word in enumerate(words)]


def read(path):
    kind = path.suffix[1:]
    return pysubs2.SSAFile.from_string(path.read_text(encoding="utf-8"), format_=kind)


@pytest.mark.parametrize("suffix", [".vtt", ".srt"])
def test_sentences_with_their_written_text(suffix, tmp_path):
    texts = ["Größe „a & b“ 1 > 0!", "Zweiter Satz."]
    tts2face.export([piece(*both) for both in zip(texts, made_stream(2), strict=True)], tmp_path / f"a{suffix}")
    captions = read(tmp_path / f"a{suffix}")
    shown = [line.text.replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">") for line in captions]
    assert shown == texts
    assert [(line.start, line.end) for line in captions] == [(100, 800), (1100, 1800)]


@pytest.mark.parametrize("suffix", [".words.vtt", ".words.srt"])
def test_words(suffix, tmp_path):
    tts2face.export(made_stream(2), tmp_path / f"a{suffix}")
    captions = read(tmp_path / f"a{suffix}")
    assert [(line.start, line.end) for line in captions] == [(100, 500), (500, 800), (1100, 1500), (1500, 1800)]
    assert captions[0].text == "Größe"


def test_karaoke_has_a_time_before_each_word_but_the_first(tmp_path):
    tts2face.export(made_clip(), tmp_path / "a.karaoke.vtt")
    content = (tmp_path / "a.karaoke.vtt").read_text(encoding="utf-8")
    assert content == ('WEBVTT\n\n00:00:00.100 --> 00:00:00.800\nGröße <00:00:00.500>&lt;a&gt; &amp; "b"\n\n')


@pytest.mark.parametrize("suffix", [".vtt", ".srt", ".words.vtt", ".words.srt", ".karaoke.vtt"])
def test_a_clip_without_words_has_no_cue(suffix, tmp_path):
    tts2face.export(silent_clip(), tmp_path / f"a{suffix}")
    content = (tmp_path / f"a{suffix}").read_text()
    assert content == ("WEBVTT\n\n" if suffix.endswith("vtt") else "")


def test_numbers_have_the_time_of_the_words_that_say_them():
    words = evenly(["it", "costs", "three", "dollars", "fifty", "now"])
    (cue,) = sentence_cues(words, 'It costs "$3.50" now!')
    assert [token.text for token in cue] == ["It ", "costs ", '"$3.50" ', "now!"]
    assert [(token.start, token.end) for token in cue] == [(0, 0.4), (0.4, 0.8), (0.8, 2.0), (2.0, 2.4)]


def test_words_are_captions_as_they_are_written(tmp_path):
    said, text = ["it", "costs", "five", "dollars", "only", "now"], 'It costs "$5" only now!'
    phones = PhoneSequence(["sil", *"abcdef", "sil"], [*(0.1 * at for at in range(8)), 1.0])
    words = tuple(WordSpan(word, at, at + 1) for at, word in enumerate(said, start=1))
    waveform = Waveform(np.zeros(RATE, np.float32), RATE)
    clip = Clip(made_clip().motion, made_clip().head, Speech(waveform, phones, words))
    tts2face.export([piece(text, clip)], tmp_path / "a.words.srt")
    tts2face.export(clip, tmp_path / "b.words.srt")
    shown = [(line.text, line.start, line.end) for line in read(tmp_path / "a.words.srt")]
    assert shown == [("It", 100, 200), ("costs", 200, 300), ("$5", 300, 500), ("only", 500, 600), ("now", 600, 700)]
    assert [line.text for line in read(tmp_path / "b.words.srt")] == said  # the text is not known


def test_signs_that_are_not_spoken_lie_between_their_neighbours():
    (cue,) = sentence_cues(evenly(["a", "b"], pause=0.2), "– a – b –")
    assert [(token.text.strip(), round(token.start, 3), round(token.end, 3)) for token in cue] == [
        ("–", 0, 0), ("a", 0, 0.4), ("–", 0.4, 0.6), ("b", 0.6, 1.0), ("–", 1.0, 1.0),
    ]  # fmt: skip


def test_long_sentences_become_cues_of_two_lines_and_seven_seconds(tmp_path):
    words = [f"word{number}" for number in range(60)]
    for text in ("", " ".join(words)):
        cues = sentence_cues(evenly(words), text)
        assert [token.text.strip() for cue in cues for token in cue] == words
        assert all(len("".join(token.text for token in cue).strip()) <= MAX_CUE_CHARACTERS for cue in cues)
        assert all(cue[-1].end - cue[0].start <= MAX_CUE_S for cue in cues)
    duration = 30.0
    samples = Waveform([0.0] * int(duration * RATE), RATE)
    phones = PhoneSequence(["ɑ"] * 60, [number * 0.5 for number in range(61)])
    spoken = Speech(samples, phones, tuple(WordSpan(word, at, at + 1) for at, word in enumerate(words)))
    rest = silent_clip(900)
    tts2face.export(Clip(rest.motion, rest.head, spoken), tmp_path / "a.vtt")
    rows = [line for line in (tmp_path / "a.vtt").read_text().splitlines() if line.startswith("word")]
    assert max(len(row) for row in rows) <= MAX_LINE_CHARACTERS


def test_text_without_spaces_is_divided_too():
    text = "我们一年前不在这里，可是鲍勃也许会搬动五张大地图。" * 8
    cues = sentence_cues(evenly(["a"] * 100, 0.25), text)
    assert "".join(token.text for cue in cues for token in cue) == text
    assert len(cues) >= 4
    assert all(len("".join(token.text for token in cue)) <= MAX_CUE_CHARACTERS for cue in cues)
    assert all(cue[-1].end - cue[0].start <= MAX_CUE_S for cue in cues)
    times = [token.start for cue in cues for token in cue]
    assert times == sorted(times)


def test_without_written_text_a_pause_ends_a_cue():
    words = [*evenly(["one", "two"]), *evenly(["three"], start=1.3)]
    assert [[token.text.strip() for token in cue] for cue in sentence_cues(words, "")] == [["one", "two"], ["three"]]
    assert len(sentence_cues(words, "one two three")) == 1


def test_times_beyond_an_hour(tmp_path):
    n_frames = 3_700
    samples = np.zeros(n_frames * 100, np.float32)
    phones = PhoneSequence(["sil", "ɑ"], [0.0, 3_661.25, float(n_frames)])
    speech = Speech(Waveform(samples, 100), phones, (WordSpan("ah", 1, 2),))
    still = Trajectory(("a",), np.zeros((n_frames, 1)), 1.0)
    tts2face.export(Clip(still, resting_head(n_frames, 1.0), speech), [tmp_path / "a.vtt", tmp_path / "a.srt"])
    assert "01:01:01.250 --> 01:01:40.000" in (tmp_path / "a.vtt").read_text()
    assert "01:01:01,250 --> 01:01:40,000" in (tmp_path / "a.srt").read_text()


def test_a_session_gives_the_sentences_as_they_are_written(world, tmp_path):
    session = world.session(palette=None)
    text = 'Dr. Smith paid $3.50, "really"! [pause 0.2] And then he left.'
    session.export(text, [tmp_path / "a.srt", tmp_path / "a.karaoke.vtt"], fps=10)
    assert [line.text for line in read(tmp_path / "a.srt")] == ['Dr. Smith paid $3.50, "really"!', "And then he left."]
    times = re.findall(r"<([\d:.]+)>", (tmp_path / "a.karaoke.vtt").read_text())
    assert times == sorted(times)
    assert len(times) == 7
