"""Head, brows and blinks of speaking faces against people: the table of docs/gestures.md."""

import pytest

from corpus_tools.studies.gestures.speech import SpeechMeasure, study_speech
from tts2face.session.session import Session


@pytest.fixture(scope="module", params=["ada", "zuri", "head"])
def measures(request: pytest.FixtureRequest) -> dict[str, SpeechMeasure]:
    """Measures of a face by name."""
    return {measure.name: measure for measure in study_speech(Session(face=request.param), 3)}


def test_the_course_of_a_sentence_is_up_and_then_down(measures: dict[str, SpeechMeasure]) -> None:
    assert measures["pitch at 0.25 of a sentence"].high < 0 < measures["pitch at 0.9 of a sentence"].low
    assert measures["brows at 0.25 of a sentence"].low > 0 > measures["brows at 1 of a sentence"].high


def test_accents_are_up_and_head_turns_at_content_words_are_mostly_up(measures: dict[str, SpeechMeasure]) -> None:
    assert measures["accented minus weak vowels: pitch"].high < 0
    assert measures["accented minus weak vowels: brows"].value > 0
    assert 15 <= measures["turns at content words that go down"].value <= 45
    assert measures["turns of the head"].is_met


def test_brows_move_as_far_as_people_s(measures: dict[str, SpeechMeasure]) -> None:
    assert 0.3 <= measures["brow height, deviation"].value <= 1.28


def test_blinks_are_as_frequent_and_as_irregular_as_people_s(measures: dict[str, SpeechMeasure]) -> None:
    assert 18 <= measures["blinks in speech"].value <= 34
    assert 10 <= measures["blinks in silence"].value <= 24
    assert 0.55 <= measures["variation of intervals of blinks"].value <= 1.0
