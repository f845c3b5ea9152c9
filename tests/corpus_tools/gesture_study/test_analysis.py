"""The study of a palette whose gestures are known."""

import numpy as np
import pytest

from corpus_tools.studies.gestures.analysis import StudyOptions, StyleStudy, TraitComparison, study_gestures
from corpus_tools.studies.gestures.clips import (
    field_clip,
    hold_out,
    noise_clip,
    published_clip,
    replace_style,
    select_recordings,
    sound_of,
)
from corpus_tools.studies.gestures.measures import split_recordings, wasserstein
from corpus_tools.studies.gestures.traits import style_traits
from lexicon.errors import InputError
from tests.corpus_tools.gesture_study.made_palette import BLINK, N_FRAMES, made_palette, made_style
from tts2face.gestures.stream import GestureFields, GestureStream, style_median
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import GESTURE_FPS
from tts2face.types import Waveform


def compared(style: StyleStudy, name: str) -> TraitComparison:
    return next(one for one in style.trait_comparisons if one.trait.name == name)


def test_every_recording_is_assigned_whole_and_once():
    style = made_style()
    learnt, held = hold_out(style, 4, 0)
    assert (len(learnt.lengths), len(held.lengths)) == (45, 15)
    takes = {part.tobytes() for part in split_recordings(style.intensity, style.lengths)}
    kept, away = ({part.tobytes() for part in split_recordings(one.intensity, one.lengths)} for one in (learnt, held))
    assert kept | away == takes
    assert not kept & away
    assert not np.array_equal(hold_out(style, 4, 1)[1].intensity, held.intensity)


def test_some_recordings_keep_their_parts_together():
    style = made_style()
    chosen = select_recordings(style, np.array([5, 2]))
    rows = np.r_[5 * N_FRAMES : 6 * N_FRAMES, 2 * N_FRAMES : 3 * N_FRAMES]
    np.testing.assert_array_equal(chosen.motion["head"], style.motion["head"][rows])
    np.testing.assert_array_equal(chosen.intensity, style.intensity[rows])


def test_too_few_to_hold_out():
    with pytest.raises(InputError, match="of 4 recordings one in 4 cannot be held out"):
        hold_out(made_style(n=4), 4, 0)


def test_a_field_in_silence_does_what_a_stream_does():
    fields = GestureFields(made_palette())
    quiet = np.tile(np.array([-35.0, 0.0, 0.0, 0.0, 0.0], np.float32), (200, 1))
    stream = GestureStream(fields, style="calm", seed=3, fps=GESTURE_FPS)  # a recorded style is not presented
    streamed = stream.next(Waveform(np.zeros(2, np.float32), 16000), 200, Timeline())
    for feature in fields.features:
        made = field_clip(fields, "calm", feature, quiet, 3).values
        np.testing.assert_allclose(made, streamed[feature], atol=1e-4)


def test_a_derived_style_is_the_changed_clip_of_its_source():
    palette = made_palette()
    fields = GestureFields(palette)
    sound = sound_of(palette.styles["calm"])[:300]
    plain, larger = (field_clip(fields, style, "head", sound, 1).values for style in ("calm", "quick"))
    middle = style_median(palette.styles["calm"], "head")
    np.testing.assert_allclose(larger - middle, 2 * (plain - middle), atol=1e-5)


def test_noise_is_independent_of_the_sound_and_depends_on_the_seed():
    fields = GestureFields(made_palette())
    one, same, other = (noise_clip(fields, "calm", 100, seed)["head"] for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_traits_have_the_units_that_they_say():
    palette = made_palette()
    traits = {trait.name: trait for trait in style_traits(palette, palette.styles["calm"])}
    turning = np.zeros((3, 6))
    turning[:, 1] = np.radians([0, 1, 3])
    np.testing.assert_allclose(traits["head speed"].of(turning), [30, 60])
    np.testing.assert_allclose(palette.brow_lift, [np.sqrt(0.5), 0], rtol=1e-6)
    lifted = np.array([[0.0, 5.0], [np.sqrt(2), 5.0]])  # both landmarks by 1 mm
    np.testing.assert_allclose(traits["brow height"].of(lifted), [0, 1], atol=1e-6)
    np.testing.assert_allclose(traits["brow speed"].of(lifted), [30], rtol=1e-6)
    aimed = {name for name, trait in traits.items() if trait.has_target}
    assert aimed == {"head speed", "brow height", "blink interval"}


def test_what_is_known_of_the_made_palette_is_found(found):
    calm, quick = found.styles
    assert (calm.n_training, calm.n_held_out, calm.is_held_out) == (45, 15, True)
    intervals = compared(calm, "blink interval")
    np.testing.assert_allclose(intervals.real, 1.0, atol=1e-6)
    assert len(intervals.real) == 2 * 15
    assert calm.blinks_per_minute[0] == pytest.approx(60)
    closing = compared(calm, "closing speed")
    np.testing.assert_allclose(closing.real, 30 * (BLINK[1] - BLINK[0]), rtol=1e-5)
    assert quick.source == "calm"
    assert compared(quick, "head amplitude").field.mean() == pytest.approx(
        2 * compared(calm, "head amplitude").field.mean(), rel=0.01
    )


def test_a_field_is_nearer_than_noise(found):
    calm = found.styles[0]
    for name in ("head speed", "brow speed", "closing speed"):
        assert compared(calm, name).to_field < 0.5 * compared(calm, name).to_noise
    by_feature = {one.feature: one for one in calm.motion_comparisons}
    real, field, noise, _ = by_feature["head"].with_intensity
    assert min(real, field) > noise + 0.1
    assert 0.3 < by_feature["head"].diversity[0] < 1.5


def test_published_fields_stand_beside_those_of_measured_styles(found):
    calm, quick = found.styles
    one = compared(calm, "head speed")
    assert len(one.published) == len(one.noise) / 2
    assert one.to_published == pytest.approx(wasserstein(one.real, one.published))
    assert one.to_published > 3 * one.to_field  # without a spring a leap is a jump
    assert len(calm.blinks_per_minute) == 4
    assert all(len(one.spectra) == len(one.with_intensity) == 4 for one in calm.motion_comparisons)
    assert calm.motion_comparisons[0].fast_power[2] > calm.motion_comparisons[0].fast_power[0]
    assert not len(compared(quick, "head speed").published)
    assert np.isnan(compared(quick, "head speed").to_published)
    assert len(quick.blinks_per_minute) == len(quick.motion_comparisons[0].spectra) == 3


def test_a_published_clip_consists_of_recorded_frames():
    palette = made_palette()
    sound = sound_of(palette.styles["calm"])[:200]
    made = published_clip(palette, "calm", sound, 3)
    again = published_clip(palette, "calm", sound, 3)
    for feature, values in made.items():
        np.testing.assert_array_equal(values, again[feature])
        recorded = palette.styles["calm"].motion[feature]
        nearest = np.abs(recorded[:, None] - values[None, ::20]).max(axis=2).min(axis=0)
        np.testing.assert_allclose(nearest, 0.0, atol=1e-5)


def test_long_clips_visit_more_and_more_and_do_not_repeat(found):
    calm, quick = found.styles
    assert len(calm.long_run.coverage) == 3
    for shares in calm.long_run.coverage.values():
        assert 0 < shares[0] <= shares[1] <= shares[2] <= 1
    assert all(len(one.speech) == 300 for one in calm.long_run.repetition.values())
    assert not quick.long_run.coverage


def test_targets_are_those_of_measured_styles(found):
    assert found.targets[1] == 4
    one = compared(found.styles[0], "head speed")
    assert one.is_met == (one.to_field <= 1.5 * one.halves and one.to_field < 0.5 * one.to_noise)


def test_few_recordings_are_compared_with_themselves():
    palette = made_palette(n=5)
    (calm,) = study_gestures(
        "few", replace_style(palette, "calm", palette.styles["calm"]), StudyOptions(clips=2)
    ).styles[:1]
    assert (calm.n_training, calm.n_held_out, calm.is_held_out) == (5, 5, False)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"one_in": 1}, "one in 1 recordings cannot be held out"),
        ({"halves": 0}, "at least 1 halving, not 0"),
        ({"clips": 1}, "at least 2 clips, not 1"),
        ({"seed": -1}, "a whole number from 0, not -1"),
    ],
)
def test_options_out_of_range(wrong, reason):
    with pytest.raises(InputError, match=reason):
        StudyOptions(**wrong)
