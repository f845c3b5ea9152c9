"""Measures of a speaking face find what is put into its motion."""

import numpy as np
import pytest

from corpus_tools.studies.gestures.speech import (
    SpeakingFace,
    SpeechMeasure,
    accented,
    courses,
    spread,
    turns,
    turns_at_words,
)
from tts2face.gestures.speech_plan import Accent, Span, SpokenSentence

FPS = 30.0


def face_with(pitch: np.ndarray, vowels: np.ndarray, sentences: tuple[SpokenSentence, ...]) -> SpeakingFace:
    return SpeakingFace(FPS, pitch, -pitch, -0.1 * pitch, np.zeros(len(pitch)), vowels, sentences)


def test_a_rise_at_each_accent_is_found() -> None:
    times = np.arange(0.0, 30.0, 1 / FPS)
    strong = np.arange(1.0, 29.0, 2.0)
    vowels = np.array([[time, 1.0] for time in strong] + [[time + 1.0, -1.0] for time in strong])
    pitch = -2.0 * np.exp(-0.5 * (np.subtract.outer(times, strong + 0.06) / 0.1) ** 2).sum(axis=1)
    sentence = SpokenSentence(Span(0.5, 29.0), (Span(0.5, 29.0),), tuple(Accent(time, 1.0) for time in strong))
    face = face_with(pitch, vowels, (sentence,))
    assert accented(face, "pitch") < -0.8
    assert accented(face, "eyes_up") > 0.8
    assert len(turns(face)) >= len(strong)
    assert turns_at_words(face).mean() == 0.0


def test_a_course_is_found() -> None:
    times = np.arange(0.0, 60.0, 1 / FPS)
    spans = [Span(start, start + 4.0) for start in np.arange(1.0, 54.0, 5.0)]
    pitch = sum(
        2.0 * np.exp(-0.5 * ((times - span.start - 3.6) / 0.5) ** 2)
        - 2.0 * np.exp(-0.5 * ((times - span.start - 1.0) / 0.5) ** 2)
        for span in spans
    )
    face = face_with(pitch, np.zeros((0, 2)), tuple(SpokenSentence(span, (span,), ()) for span in spans))
    found = courses(face, "pitch").mean(axis=0)
    assert found[1] < -1.2
    assert found[2] > 1.2


def test_a_measure_is_met_within_the_range_of_people() -> None:
    assert SpeechMeasure("turns", "%", 30.0, 20.0, 40.0, (15.0, 45.0)).is_met
    assert not SpeechMeasure("turns", "%", 50.0, 20.0, 60.0, (15.0, 45.0)).is_met
    assert spread(np.random.default_rng(0).exponential(size=20_000)) == pytest.approx(1.0, abs=0.03)
