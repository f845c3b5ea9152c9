"""Fit of speech to cues, with a voice whose durations are known."""

import re

import pytest

from tts2face.serving.batch.windows import Limits, fit_speech
from tts2face.session.speech_stream import SpeechSpan

TEN = "abcdefghij"  # 1 s at rate 1 with 0.1 s a letter


def measure(text: str, rate: float) -> SpeechSpan:
    """0.1 s a letter, and 0.5 s a comma unless a pause mark follows it."""
    words = re.sub(r"\[[^\]]*\]", "", text)
    end = 0.1 * sum(letter.isalpha() for letter in words) / rate + 0.5 * len(re.findall(r",(?! \[)", text)) / rate
    return SpeechSpan(0.0, end, end + 0.2)


def limits(window: float, slot: float | None = None, policy: str = "extend", max_rate: float = 1.4) -> Limits:
    return Limits(window, slot, 1.0, max_rate, policy)


def test_speech_that_fits_keeps_its_rate() -> None:
    fit = fit_speech(TEN, limits(1.0), measure)
    assert (fit.rate, fit.overflow_s, fit.n_steps, fit.text) == (1.0, 0.0, 1, TEN)


@pytest.mark.parametrize("window", [0.95, 0.9, 0.8, 0.73])
def test_the_rate_is_raised_as_little_as_needed(window: float) -> None:
    fit = fit_speech(TEN, limits(window), measure)
    assert fit.speech_s <= window
    assert fit.speech_s > 0.95 * window
    assert fit.rate <= 1.4
    assert fit.overflow_s == 0.0


def test_a_voice_that_ignores_part_of_the_rate_is_measured_again() -> None:
    fit = fit_speech(TEN, limits(0.9), lambda text, rate: measure(text, 1.0 + 0.5 * (rate - 1.0)))
    assert fit.speech_s <= 0.9
    assert fit.n_steps > 2


def test_what_remains_too_long_is_reported_at_the_largest_rate() -> None:
    fit = fit_speech(TEN, limits(0.5, slot=2.0), measure)
    assert fit.rate == 1.4
    assert fit.overflow_s == pytest.approx(1.0 / 1.4 - 0.5)


def test_the_next_cue_raises_the_rate_beyond_the_limit() -> None:
    fit = fit_speech(TEN, limits(0.5, slot=0.6), measure)
    assert 1.4 < fit.rate <= 2.0
    assert fit.speech_s <= 0.6
    assert fit_speech(TEN, limits(0.5, slot=0.6, policy="report"), measure).rate == 1.4


def test_pauses_are_cut_only_if_the_rate_is_not_enough() -> None:
    text = "abc, defg, hij"
    fitting = fit_speech(text, limits(1.5, policy="cut-pauses"), measure)
    assert fitting.text == text
    short = fit_speech(text, limits(1.1, policy="cut-pauses"), measure)
    assert short.text == "abc, [pause 0] defg, [pause 0] hij"
    assert (short.rate, short.overflow_s) == (1.0, 0.0)
