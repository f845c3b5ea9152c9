"""Pauses of the table within sentences of voices that pause as they like."""

import numpy as np
import pytest

from lexicon.pauses import PAUSES_S
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.sound.delivery import sound_with, speak_with
from tts2face.sound.prosody import Prosody
from tts2face.sound.spacing import WINDOW_S, has_pauses, with_pauses
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Speech, Waveform

RATE_HZ = 16_000


def quiet_s(speech: Speech, word: int) -> float:
    """Seconds of quiet sound around the end of a word."""
    sound, end = speech.waveform, float(speech.phones.edges[speech.words[word].last])
    window = round(WINDOW_S * sound.rate)
    levels = np.abs(sound.samples[: len(sound.samples) // window * window]).reshape(-1, window).max(axis=1)
    quiet = np.flatnonzero(levels < 0.01 * levels.max())
    runs = np.split(quiet, np.flatnonzero(np.diff(quiet) > 1) + 1)
    near = [run for run in runs if run[0] * WINDOW_S - 0.1 <= end <= (run[-1] + 1) * WINDOW_S + 0.1]
    return max(map(len, near), default=0) * WINDOW_S


def two_words(silence: float, trace: float = 0.0) -> Speech:
    """Two words of a tone with a silence between, in which a trace of sound remains."""
    seconds = np.arange(round((0.8 + silence) * RATE_HZ)) / RATE_HZ
    is_loud = (seconds < 0.4) | (seconds >= 0.4 + silence)
    samples = np.where(is_loud, 0.5, trace) * np.sin(2 * np.pi * 150.0 * seconds)
    edges = [0.0, 0.4, 0.4 + silence, len(seconds) / RATE_HZ]
    words = (WordSpan("one", 0, 1), WordSpan("two", 2, 3))
    return Speech(Waveform(samples.astype(np.float32), RATE_HZ), PhoneSequence(["a", SILENCE, "i"], edges), words)


@pytest.mark.parametrize("silence", [0.06, 0.2, 0.6])
@pytest.mark.parametrize("mark", [",", "—", ";", "..."])
def test_a_pause_is_that_of_the_table(silence: float, mark: str) -> None:
    spaced = with_pauses(two_words(silence), f"one{mark} two", "en-us")
    wanted = PAUSES_S["…" if mark == "..." else mark]
    assert np.diff(spaced.phones.edges) == pytest.approx([0.4, wanted, 0.4], abs=2 * WINDOW_S)
    assert quiet_s(spaced, 0) == pytest.approx(wanted, abs=2 * WINDOW_S)
    assert spaced.phones.end == pytest.approx(spaced.waveform.duration)


@pytest.mark.parametrize("silence", [0.1, 0.6])
def test_a_cut_makes_no_click(silence: float) -> None:
    """The largest step between samples is that of the tone, though the trace ends within a pause."""
    spaced = with_pauses(two_words(silence, trace=0.004), "one, two", "en-us").waveform.samples
    middle = spaced[round(0.42 * RATE_HZ) : round(0.6 * RATE_HZ)]
    assert np.abs(np.diff(middle)).max() < 0.004 * 2 * np.pi * 150.0 / RATE_HZ * 2


def test_words_without_a_mark_keep_their_silence() -> None:
    speech = two_words(0.1)
    assert with_pauses(speech, "one two", "en-us") is speech
    assert not has_pauses("one two.")
    assert has_pauses("one, two")


def test_marks_are_found_where_a_voice_divides_words_otherwise() -> None:
    spaced = with_pauses(two_words(0.1), "zero one, two", "de")
    assert float(np.diff(spaced.phones.edges)[1]) == pytest.approx(0.25, abs=2 * WINDOW_S)


@pytest.mark.parametrize(
    ("language", "text", "word", "mark"),
    [
        ("en-us", "He came home; she had left.", 2, ";"),
        ("de", "Er kam um 7.30 Uhr – sie war weg.", 5, "—"),
        ("fr-fr", "Il est venu, elle est partie.", 2, ","),
        ("ru", "Он пришёл… и ушёл.", 1, "…"),
    ],
)
def test_espeak_pauses_by_the_table(language: str, text: str, word: int, mark: str) -> None:
    voice = load_voice("espeak", language)
    speech = speak_with(voice, text, Prosody(), language=language)
    assert quiet_s(speech, word) == pytest.approx(PAUSES_S[mark], abs=0.03)
    assert np.array_equal(sound_with(voice, text, Prosody(), language=language).samples, speech.waveform.samples)
