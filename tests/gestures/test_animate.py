"""Gestures of a clip: in pieces as at once, each layer for itself, and what a timeline paints."""

import numpy as np
import pytest

from lexicon.errors import InputError
from tts2face.gestures import prosody, stream
from tts2face.gestures.elements import ExpressionSpan, Gains, Gesture, StyleSpan
from tts2face.gestures.field import FieldOptions
from tts2face.gestures.noise import NoiseStream, blink_closure, blinks_per_second, perlin_noise
from tts2face.gestures.stream import GestureFields, GestureStream, style_median
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import EXPRESSIONS, FEATURES
from tts2face.sound.praat import intensity_track
from tts2face.types import Waveform

FPS = 30.0
RATE = 16_000
PLAIN = Timeline()


def _sound(seconds: float, seed: int = 0) -> Waveform:
    """Noise in syllables."""
    times = np.arange(round(seconds * RATE)) / RATE
    loud = 0.5 + 0.5 * np.sin(2 * np.pi * 3 * times)
    noise = np.random.default_rng(seed).uniform(-1, 1, len(times))
    return Waveform(0.3 * loud * noise, RATE)


@pytest.fixture(scope="module")
def fields(palette) -> GestureFields:
    return GestureFields(palette, dict.fromkeys(FEATURES, FieldOptions(sigma=1.0, candidates=3)))


def _made(fields, timeline=PLAIN, *, style="calm", seed=0, seconds=6.0, fps=FPS, kind=GestureStream):  # noqa: PLR0913 - a clip's choices
    return kind(fields, style=style, seed=seed, fps=fps).next(_sound(seconds), round(seconds * fps), timeline)


@pytest.mark.parametrize("kind", [GestureStream, NoiseStream])
def test_every_feature_has_its_channels(fields, kind):
    made = _made(fields, kind=kind)
    assert set(made) == set(FEATURES)
    for name, values in made.items():
        assert values.shape == (180, len(fields.palette.channels(name)))
        assert values.dtype == np.float32
        assert np.isfinite(values).all()


@pytest.mark.parametrize("kind", [GestureStream, NoiseStream])
def test_the_same_seed_gives_the_same_and_another_one_another(fields, kind):
    first, again, other = (_made(fields, seed=seed, kind=kind) for seed in (1, 1, 2))
    for name in FEATURES:
        np.testing.assert_array_equal(first[name], again[name])
        assert not np.array_equal(first[name], other[name])


def test_pieces_join_without_a_pop(fields):
    stream = GestureStream(fields, style="calm", seed=3, fps=FPS)
    parts = [stream.next(_sound(2.0, seed), 60, PLAIN) for seed in range(4)]
    for name in FEATURES:
        whole = np.concatenate([part[name] for part in parts])
        steps = np.abs(np.diff(whole, axis=0)).max(axis=1)
        assert steps[[59, 119, 179]].max() <= 1.5 * np.delete(steps, [59, 119, 179]).max()


@pytest.mark.parametrize("kind", [GestureStream, NoiseStream])
def test_one_sound_in_pieces_as_at_once(fields, kind):
    silent = Waveform(np.zeros(4 * RATE), RATE)
    whole = kind(fields, style="calm", seed=4, fps=FPS).next(silent, 120, PLAIN)
    stream = kind(fields, style="calm", seed=4, fps=FPS)
    parts = [stream.next(Waveform(np.zeros(n * RATE // 30), RATE), n, PLAIN) for n in (1, 50, 9, 60)]
    for name in FEATURES:
        np.testing.assert_allclose(np.concatenate([part[name] for part in parts]), whole[name], atol=1e-5)


def test_frame_rates_agree(fields):
    slow, fast = _made(fields, fps=30.0), _made(fields, fps=60.0)
    for name in FEATURES:
        np.testing.assert_allclose(fast[name][::2], slow[name], atol=1e-4 * np.abs(slow[name]).max())


def test_a_layer_changes_no_other(fields):
    plain = _made(fields)
    painted = _made(fields, Timeline(style={"brows": "wild"}, spans=(StyleSpan("gaze", "double", 1.0, 2.0),)))
    assert not np.array_equal(painted["brows"], plain["brows"])
    for name in set(FEATURES) - {"brows", "gaze"}:
        np.testing.assert_array_equal(painted[name], plain[name])


def test_a_derived_style_is_its_source_changed_as_stated(fields, palette):
    fields = GestureFields(palette, fields.options, has_presentation=False)
    plain, double = _made(fields), _made(fields, style="double")
    middle = style_median(palette.styles["calm"], "head")
    np.testing.assert_allclose(double["head"] - middle, 2 * (plain["head"] - middle), atol=1e-5)
    happy = EXPRESSIONS.index("happy")
    np.testing.assert_allclose(double["expression"][:, happy], plain["expression"][:, happy] + 0.5, atol=1e-6)
    np.testing.assert_array_equal(double["cheeks"], plain["cheeks"])


def test_a_piece_measures_its_sound_once_and_no_median_again(fields, monkeypatch):
    _made(fields, style="double")
    heard = []
    monkeypatch.setattr(prosody, "intensity_track", lambda sound: heard.append(sound) or intensity_track(sound))
    monkeypatch.setattr(stream, "style_median", lambda style, feature: pytest.fail(f"median of {feature}"))
    _made(fields, style="double")  # some features have another tempo, so other times
    assert len(heard) == 1


def test_tempo_is_speed(fields):
    plain, double = (_made(fields, style=style, seconds=40.0)["brows"] for style in ("calm", "double"))
    speed = [np.abs(np.diff(values, axis=0)).mean() for values in (plain, double)]
    assert 1.6 < speed[1] / speed[0] < 2.4


def test_a_span_begins_and_ends_without_a_pop(fields):
    timeline = Timeline(spans=(StyleSpan("head", "wild", 2.0, 4.0), StyleSpan("expression", "double", 2.0, 4.0)))
    made, wild = _made(fields, timeline), _made(fields, style="wild")
    for name in ("head", "expression"):
        most = np.abs(np.diff(wild[name], axis=0)).max(axis=0)
        assert (np.abs(np.diff(made[name], axis=0)).max(axis=0) <= 1.5 * most).all()


def test_expressions_nods_and_gains(fields):
    plain = _made(fields)
    timeline = Timeline(
        expressions=(ExpressionSpan("sad", 0.6, 2.0, 4.0),),
        gestures=(Gesture(1.0, size=1.0),),
        gains=Gains({"gaze": 0.5}),
    )
    made = _made(fields, timeline)
    added = made["expression"] - plain["expression"]
    np.testing.assert_allclose(added[90], [0.6, 0, 0, 0, 0], atol=1e-6)
    np.testing.assert_allclose(added[0], 0, atol=1e-6)
    nod = made["head"] - plain["head"]
    assert np.degrees(nod[:, 0].max()) == pytest.approx(6.0, abs=0.3)
    np.testing.assert_array_equal(nod[:, 1:], 0)
    np.testing.assert_allclose(made["gaze"], 0.5 * plain["gaze"], rtol=1e-6)


def test_loud_speech_and_silence_differ(fields):
    silent = GestureStream(fields, style="calm", seed=0, fps=FPS).next(Waveform(np.zeros(6 * RATE), RATE), 180, PLAIN)
    assert not np.array_equal(silent["head"], _made(fields)["head"])


def test_pitch_has_an_effect_where_it_is_enabled(palette):
    tone = np.sin(2 * np.pi * (150 + 50 * np.sin(np.arange(4 * RATE) / RATE * 5)) * np.arange(4 * RATE) / RATE)
    made = {
        with_pitch: GestureStream(GestureFields(palette, {}, with_pitch), style="calm", seed=0, fps=FPS).next(
            Waveform(0.3 * tone, RATE), 120, PLAIN
        )["head"]
        for with_pitch in (False, True)
    }
    assert not np.array_equal(made[False], made[True])


def test_an_unknown_style(fields):
    with pytest.raises(InputError, match="no style 'cross'"):
        GestureStream(fields, style="cross", seed=0, fps=FPS)


def test_a_feature_that_a_style_lacks_comes_from_another(palette):
    from dataclasses import replace

    lacking = replace(palette.styles["wild"], motion={"head": palette.styles["wild"].motion["head"]})
    fields = GestureFields(replace(palette, styles={"calm": palette.styles["calm"], "wild": lacking}), {})
    made = _made(fields, style="wild")
    assert set(made) == set(FEATURES)
    assert fields.source("wild", "gaze") == "calm"
    assert fields.source("wild", "head") == "wild"


def test_noise_is_as_strong_as_stated():
    times = np.arange(0, 3600, 1 / 30)
    noise = perlin_noise(times, 7)
    assert noise.std() == pytest.approx(1.0, abs=0.05)
    assert abs(noise.mean()) < 0.1
    assert np.corrcoef(noise, perlin_noise(times, 8))[0, 1] == pytest.approx(0.0, abs=0.05)
    np.testing.assert_array_equal(perlin_noise(times[1000:2000], 7), noise[1000:2000])
    assert np.abs(np.diff(noise)).max() < 0.5


def test_blinks_at_random_are_as_many_as_stated():
    times = np.arange(0, 3600, 1 / 30)
    shut = blink_closure(times, 0.3, 1)
    assert shut.min() == 0
    assert shut.max() <= 1
    assert blinks_per_second(np.stack([shut, shut], axis=1)) == pytest.approx(0.3, rel=0.1)
