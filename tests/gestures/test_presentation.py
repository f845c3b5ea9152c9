"""Derived styles blink and move for viewers; recorded styles and ``measured`` as the recorded person does."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from corpus_tools.studies.gestures.blinks import find_blinks
from corpus_tools.studies.gestures.measures import wasserstein
from tts2face.gestures.elements import Gains, GazeTarget, StyleSpan
from tts2face.gestures.head_presentation import slow_scales
from tts2face.gestures.presentation import LowPass, filtered_spread
from tts2face.gestures.speech_plan import SpeechPlan, plan_speech
from tts2face.gestures.stream import GestureFields, GestureStream
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import FEATURES, GESTURE_FPS, Palette
from tts2face.models.palette_file import load_palette
from tts2face.types import Speech, Waveform

RATE = 8_000
FPS = 30.0
PHRASE_S, PAUSE_S = 2.4, 0.5
SECONDS = 10 * (PHRASE_S + PAUSE_S)
SEEDS = range(4)


@pytest.fixture(scope="module")
def starter() -> Palette:
    return load_palette("starter")


@pytest.fixture(scope="module")
def fields(starter: Palette) -> GestureFields:
    return GestureFields(starter)


def phrases(seconds: float = SECONDS, seed: int = 0) -> Waveform:
    """Noise in syllables, every sixth of which is loud, with pauses between phrases."""
    times = np.arange(round(seconds * RATE)) / RATE
    in_phrase = times % (PHRASE_S + PAUSE_S) < PHRASE_S
    syllable = np.floor(times * 4)
    loud = np.abs(np.sin(np.pi * times * 4)) ** 0.5 * np.where(syllable % 6 == 3, 1.0, 0.5)
    noise = np.random.default_rng(seed).uniform(-1, 1, len(times))
    return Waveform(0.4 * np.where(in_phrase, loud, 0.0) * noise, RATE)


def gestures(fields: GestureFields, style: str = "neutral", seed: int = 0, timeline: Timeline | None = None):
    return GestureStream(fields, style=style, seed=seed, fps=FPS).next(
        phrases(), round(SECONDS * FPS), timeline or Timeline(), heard()
    )


@cache
def heard() -> SpeechPlan:
    return plan_speech(Speech.without_phones(phrases()), (), "en-us")


@pytest.fixture(scope="module")
def neutral(fields: GestureFields):
    return [gestures(fields, seed=seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def measured(fields: GestureFields):
    return [gestures(fields, "measured", seed=seed) for seed in SEEDS]


def blinks_of(clips, index=slice(None)):
    lids = np.concatenate([clip["blink"][index] for clip in clips])
    return find_blinks(lids, np.full(len(clips), len(lids) // len(clips), np.int32), FPS)


def test_derived_styles_blink_as_in_conversation_and_measured_as_recorded(neutral, measured) -> None:
    assert 20 <= blinks_of(neutral).per_minute <= 33
    assert blinks_of(measured).per_minute > 35


def test_intervals_of_blinks_vary_as_those_of_people(starter_of: Callable[..., Palette]) -> None:
    lids = GestureFields(starter_of("blink"))
    rates = [blinks_of([gestures(lids, seed=seed)]) for seed in range(40, 60)]
    intervals = np.concatenate([found.intervals for found in rates])
    assert 22 <= np.mean([found.per_minute for found in rates]) <= 31
    assert 0.6 < intervals.std() / intervals.mean() < 0.95
    assert np.quantile(intervals, 0.05) > 0.4


def test_faces_with_different_seeds_blink_at_different_instants(neutral) -> None:
    onsets = [np.flatnonzero(np.diff((clip["blink"].mean(axis=1) > 0.5).astype(int)) > 0) for clip in neutral]
    shared = [np.isin(one, other).mean() for one, other in pairwise(onsets)]
    assert np.mean(shared) < 0.15


def test_the_eyes_are_open_at_the_end_of_a_clip(starter_of: Callable[..., Palette]) -> None:
    lids_alone, ended = GestureFields(starter_of("blink")), replace(heard(), is_last=True)
    for style in ("neutral", "measured", "depressed"):
        for seed in range(8):
            stream = GestureStream(lids_alone, style=style, seed=seed, fps=FPS)
            lids = stream.next(phrases(), round(SECONDS * FPS), Timeline(), ended)["blink"]
            assert lids[-1].max() <= 0.3


@pytest.fixture(scope="module")
def idle(starter_of: Callable[..., Palette]):
    seconds, fields = 480, GestureFields(starter_of("blink"))
    silence = Waveform(np.zeros(seconds * RATE), RATE)
    return GestureStream(fields, style="neutral", seed=0, fps=FPS).next(silence, round(seconds * FPS), Timeline())


def test_an_idle_face_blinks(idle) -> None:
    assert 10 <= blinks_of([idle]).per_minute <= 20


def test_blinks_fall_at_edges_of_phrases_more_often_than_chance(neutral) -> None:
    edges = np.array(heard().edges)
    near = np.abs(np.subtract.outer(np.arange(len(neutral[0]["blink"])) / FPS, edges)).min(axis=1) < 0.3
    onsets = [np.flatnonzero(np.diff((clip["blink"].mean(axis=1) > 0.2).astype(int)) > 0) for clip in neutral]
    within = np.concatenate([near[at] for at in onsets])
    assert near.mean() + 0.1 < within.mean() < 0.95


@pytest.mark.parametrize("phase", ["closing", "opening", "closing_speeds", "opening_speeds"])
def test_presented_blinks_have_the_recorded_form(phase: str, idle, starter: Palette) -> None:
    style = starter.styles["grid_s1"]
    recorded = getattr(find_blinks(style.motion["blink"], style.lengths, GESTURE_FPS), phase)
    presented = getattr(blinks_of([idle]), phase)
    assert len(presented) > 80
    assert np.median(presented) == pytest.approx(np.median(recorded), rel=0.15)
    assert wasserstein(presented, recorded) < 0.6 * recorded.std()


def test_blink_gain_scales(fields: GestureFields, neutral) -> None:
    half = gestures(fields, timeline=Timeline(gains=Gains({"blink": 0.5})))
    np.testing.assert_allclose(half["blink"], 0.5 * neutral[0]["blink"], atol=1e-6)


def test_measured_is_the_recorded_style(fields: GestureFields, measured) -> None:
    recorded = gestures(fields, "grid_s1")
    for name in FEATURES:
        np.testing.assert_array_equal(measured[0][name], recorded[name])


def test_measured_applies_to_one_feature_and_one_span(fields: GestureFields, neutral, measured) -> None:
    mixed = gestures(fields, timeline=Timeline(style={"blink": "measured"}))
    np.testing.assert_allclose(mixed["blink"], measured[0]["blink"], atol=1e-6)
    np.testing.assert_array_equal(mixed["head"], neutral[0]["head"])
    span = Timeline(spans=(StyleSpan("blink", "measured", 10.0, SECONDS),))
    clips = [gestures(fields, seed=seed, timeline=span) for seed in SEEDS]
    assert blinks_of(clips, slice(360, None)).per_minute > 35
    assert blinks_of(clips, slice(0, 300)).per_minute < 40
    assert blinks_of(clips, slice(0, 300)).per_minute < blinks_of(clips, slice(360, None)).per_minute


def yaw_spread(clip) -> float:
    return float(np.degrees(clip["head"][:, 1].std()))


def test_heads_turn_visibly_and_return_to_the_viewer(fields: GestureFields, neutral, measured) -> None:
    held = [gestures(fields, seed=seed, timeline=Timeline(gains=Gains({"gaze": 0.0}))) for seed in SEEDS]
    spreads = [yaw_spread(clip) for clip in neutral]
    assert 2.0 <= np.mean(spreads) <= 4.0
    assert min(spreads) > 1.2
    assert np.mean([yaw_spread(clip) for clip in measured]) < 0.6
    for clip in held:
        assert 1.0 < yaw_spread(clip) < 4.0
        yaw = np.degrees(clip["head"][:, 1])
        assert abs(yaw.mean()) < 2.2
        assert np.abs(yaw).max() < 16


def test_the_head_follows_the_eyes_of_derived_styles_only(fields: GestureFields, neutral, measured) -> None:
    held = Timeline(gains=Gains({"gaze": 0.0}))
    turned = np.degrees(neutral[0]["head"] - gestures(fields, timeline=held)["head"])[:, 1]
    far = np.degrees(neutral[0]["gaze"][:, 1])
    assert np.abs(turned).max() > 4
    assert np.corrcoef(turned, far)[0, 1] > 0.7
    assert np.corrcoef(turned[5:], far[:-5])[0, 1] > np.corrcoef(turned, far)[0, 1]  # after them
    still = gestures(fields, "measured", timeline=Timeline(gaze=(GazeTarget(0.0, 30.0),)))
    np.testing.assert_array_equal(still["head"], measured[0]["head"])
    np.testing.assert_allclose(still["gaze"], np.tile(np.radians([0.0, 30.0]), (len(turned), 1)), atol=1e-6)


def test_a_style_scales_the_gaze_and_recorded_styles_keep_theirs(fields: GestureFields, neutral) -> None:
    annoyed = gestures(fields, "annoyed")
    middle = fields.middle("grid_s1", "gaze")
    np.testing.assert_allclose(annoyed["gaze"] - middle, 0.5 * (neutral[0]["gaze"] - middle), atol=1e-6)
    assert np.degrees(np.linalg.norm(neutral[0]["gaze"], axis=1)).max() > 10
    mixed = gestures(fields, timeline=Timeline(spans=(StyleSpan("gaze", "measured", 10.0, SECONDS),)))
    np.testing.assert_allclose(mixed["gaze"][:290], neutral[0]["gaze"][:290], atol=1e-6)
    recorded = fields.palette.styles["grid_s1"].motion["gaze"]
    assert np.abs(mixed["gaze"][310:]).max() <= np.abs(recorded).max()


def fast_power(head: np.ndarray) -> np.ndarray:
    """(3,) power above 6 Hz of the rotations, square degrees."""
    angles = np.degrees(head[:, :3]) - np.degrees(head[:, :3]).mean(axis=0)
    window = np.hanning(len(angles))[:, None]
    spectrum = np.square(np.abs(np.fft.rfft(angles * window, axis=0))) * 2 / len(angles) / np.square(window).sum()
    return np.asarray(spectrum[np.fft.rfftfreq(len(angles), 1 / FPS) > 6].sum(axis=0))


def test_presented_heads_have_no_more_jitter_than_recordings(neutral, starter: Palette) -> None:
    style = starter.styles["grid_s1"]
    borders = [0, *np.cumsum(style.lengths).tolist()]
    recorded = np.mean([fast_power(style.motion["head"][a:b]) for a, b in pairwise(borders)], axis=0)
    presented = np.mean([fast_power(clip["head"]) for clip in neutral], axis=0)
    assert (presented <= recorded).all()


def test_head_gain_scales_and_pieces_are_continuous(fields: GestureFields, neutral) -> None:
    still = gestures(fields, timeline=Timeline(gains=Gains({"head": 0.5})))
    np.testing.assert_allclose(still["head"], 0.5 * neutral[0]["head"], atol=1e-6)
    stream = GestureStream(fields, style="neutral", seed=3, fps=FPS)
    parts = [stream.next(phrases(2.9, seed), 87, Timeline()) for seed in range(6)]
    steps = np.abs(np.diff(np.concatenate([part["head"][:, :3] for part in parts]), axis=0)).max(axis=1)
    joins = 87 * np.arange(1, 6) - 1
    assert steps[joins].max() <= np.delete(steps, joins).max()


def test_a_lively_recording_is_not_scaled_down(starter: Palette) -> None:
    style = starter.styles["grid_s1"]
    lively = type(style)(
        style.lengths, style.intensity, style.pitch, {"head": 40 * style.motion["head"]}, style.metadata
    )
    np.testing.assert_array_equal(slow_scales(lively), 1.0)
    assert (slow_scales(style)[:3] > 1.5).all()
    np.testing.assert_array_equal(slow_scales(style)[3:], 1.0)


def test_spread_from_the_spectrum_is_that_of_the_filter() -> None:
    noise = np.random.default_rng(0).normal(size=(20_000, 2))
    filtered = LowPass(0.7, np.zeros(2)).filter(noise)
    np.testing.assert_allclose(filtered_spread(noise - noise.mean(axis=0), 0.7), filtered.std(axis=0), rtol=0.02)


def test_a_copied_stream_continues_independently(fields: GestureFields) -> None:
    stream = GestureStream(fields, style="neutral", seed=2, fps=FPS)
    stream.next(phrases(4.0), 120, Timeline())
    copied = stream.copy()
    first = stream.next(phrases(4.0, 1), 120, Timeline())
    again = copied.next(phrases(4.0, 1), 120, Timeline())
    for name in FEATURES:
        np.testing.assert_array_equal(first[name], again[name])
