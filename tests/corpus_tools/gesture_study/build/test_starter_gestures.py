"""What fields make of the shipped palette's recordings that they have not seen: near the real, far from noise."""

from dataclasses import replace

import pytest

from corpus_tools.studies.gestures.analysis import (
    FeatureComparison,
    StudyOptions,
    StyleStudy,
    TraitComparison,
    study_gestures,
)
from tests.kept import kept
from tts2face.models.palette_file import load_palette

NO_JITTER = 1.3  # times the recorded power above 6 Hz


@pytest.fixture(scope="module")
def style() -> StyleStudy:
    return kept(starter_style)


def starter_style() -> StyleStudy:
    return study_gestures("starter", replace(load_palette("starter"), derivations={}), StudyOptions()).styles[0]


def compared(style: StyleStudy, name: str) -> TraitComparison:
    return next(one for one in style.trait_comparisons if one.trait.name == name)


def moving(style: StyleStudy, feature: str) -> FeatureComparison:
    return next(one for one in style.motion_comparisons if one.feature == feature)


def test_hundreds_of_recordings_are_studied(style: StyleStudy) -> None:
    assert style.is_held_out
    assert style.n_held_out > 100
    assert len(compared(style, "blink interval").real) > 100


@pytest.mark.parametrize("name", ["head speed", "brow height", "blink interval"])
def test_fields_differ_no_more_than_other_recordings_of_the_same_person(name: str, style: StyleStudy) -> None:
    found = compared(style, name)
    assert found.to_field <= 1.5 * found.halves
    assert found.to_field < 0.5 * found.to_noise


def test_heads_move_with_the_sound_as_real_ones_do(style: StyleStudy) -> None:
    real, field, noise, _ = moving(style, "head").with_intensity
    assert real > 0.3
    assert abs(field - real) <= 0.1
    assert abs(noise) < 0.1


@pytest.mark.parametrize("feature", ["head", "brows"])
def test_no_feature_has_excess_high_frequency_motion(feature: str, style: StyleStudy) -> None:
    assert 0.7 < moving(style, feature).fast_power[0] < NO_JITTER


@pytest.mark.parametrize("name", ["head speed", "brow height", "brow speed"])
def test_fields_are_nearer_than_the_published_ones(name: str, style: StyleStudy) -> None:
    found = compared(style, name)
    assert found.to_field < found.to_published


def test_clips_of_ten_minutes_do_not_repeat_themselves(style: StyleStudy) -> None:
    for found in style.long_run.repetition.values():
        _, speech, silence = found.highest
        assert max(speech, silence) < 0.5


def test_another_seed_is_another_clip(style: StyleStudy) -> None:
    for found in style.motion_comparisons:
        assert found.diversity[0] > 0.4
