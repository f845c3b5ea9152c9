"""Fields on made recordings: against brute force, and laws that any field must keep."""

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tts2face.gestures.field import (
    Field,
    FieldOptions,
    FieldState,
    build_field,
    initial_state,
    sample_field,
    sample_field_moments,
    transfer_state,
)
from tts2face.gestures.field_kernels import MIN_MOMENT_GAP, SEARCH_SLACK
from tts2face.numeric.kd_tree import build_tree

OPTIONS = FieldOptions(history=5, candidates=3, future=4, alpha=(1.0,))


def _recordings(seed: int, n: int = 12, length: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smooth motion (T, 2), its sound (T, 1), and the lengths of n recordings."""
    generator = np.random.default_rng(seed)
    steps = generator.normal(size=(n, length, 3))
    smooth = np.stack([np.convolve(row, np.hanning(9), "same") for row in steps.transpose(0, 2, 1).reshape(-1, length)])
    whole = smooth.reshape(n, 3, length).transpose(0, 2, 1).reshape(-1, 3).astype(np.float32)
    return whole[:, :2], whole[:, 2:], np.full(n, length, np.int32)


def resting(made: Field, rest: np.ndarray, silence: np.ndarray) -> FieldState:
    """The state of a face that has been at rest (D,) in silence (E,)."""
    history = made.options.history
    shown = np.repeat((rest / np.float32(made.scale))[None], history, axis=0).astype(np.float32)
    loudness = np.repeat((silence * made.weights)[None], history, axis=0).astype(np.float32)
    n_leaps = min(made.options.memory, len(made.tree.order) // (8 * MIN_MOMENT_GAP))
    recent = np.full(n_leaps, -MIN_MOMENT_GAP, np.int64)
    return FieldState(shown, loudness, -1, np.zeros((2, len(rest)), np.float32), recent, 0)


def _brute_force(made, state, n_best: int) -> list[int]:
    """The nearest moments, by comparing with all of them, none within `MIN_MOMENT_GAP` frames of a nearer one."""
    history, future = made.options.history, made.options.future
    ends = np.append(np.unique(made.starts)[1:], len(made.values))
    found = []
    for moment in range(history, len(made.values)):
        start = made.starts[moment]
        end = ends[np.searchsorted(ends, moment, side="right")]
        if moment - start < history or end - moment <= future:
            continue
        rows = slice(moment - history, moment)
        away = np.square(made.values[rows] - state.motion).sum() + np.square(made.prosody[rows] - state.prosody).sum()
        found.append((float(away) / history, moment))
    best: list[int] = []
    for _, moment in sorted(found):
        if all(made.starts[other] != made.starts[moment] or abs(other - moment) >= MIN_MOMENT_GAP for other in best):
            best.append(moment)
    return best[:n_best]


def test_a_tree_holds_every_place_once_and_on_its_side():
    places = np.random.default_rng(0).normal(size=(777, 3)).astype(np.float32)
    tree = build_tree(places)
    assert sorted(tree.order.tolist()) == list(range(777))
    np.testing.assert_array_equal(tree.places, places[tree.order])
    for node in np.flatnonzero(tree.axes >= 0):
        children = (2 * node + 1, 2 * node + 2)
        left, right = (tree.places[slice(*tree.spans[child]), tree.axes[node]] for child in children)
        assert left.max() <= tree.cuts[node] <= right.min()


@pytest.mark.parametrize("seed", range(8))
def test_the_search_finds_what_brute_force_finds(seed, monkeypatch):
    values, loudness, lengths = _recordings(seed)
    made = build_field(values, loudness, lengths, FieldOptions(history=5, candidates=1, future=4, alpha=(1.0,)))
    generator = np.random.default_rng(100 + seed)
    state = resting(made, generator.normal(size=2).astype(np.float32), np.float32([0.3]))
    (expected,) = _brute_force(made, state, 1)
    _, behind = sample_field(made, state, np.zeros((1, 1), np.float32), np.array([0.5]))
    found = np.square(made.values[behind.moment - 5 : behind.moment] - state.motion).sum()
    found += np.square(made.prosody[behind.moment - 5 : behind.moment] - state.prosody).sum()
    nearest = np.square(made.values[expected - 5 : expected] - state.motion).sum()
    nearest += np.square(made.prosody[expected - 5 : expected] - state.prosody).sum()
    assert found <= SEARCH_SLACK**2 * nearest + 1e-6


def test_candidates_are_drawn_by_their_distance():
    values, loudness, lengths = _recordings(1)
    made = build_field(
        values, loudness, lengths, FieldOptions(history=5, candidates=3, future=4, alpha=(1.0,), sigma=0.5)
    )
    state = resting(made, np.zeros(2, np.float32), np.zeros(1, np.float32))
    best = _brute_force(made, state, 3)
    chances = (np.arange(3000) + 0.5) / 3000
    drawn = [
        sample_field(made, state, np.zeros((1, 1), np.float32), np.array([chance]))[1].moment for chance in chances
    ]
    away = []
    for moment in best:
        rows = slice(moment - 5, moment)
        squares = (
            np.square(made.values[rows] - state.motion).sum() + np.square(made.prosody[rows] - state.prosody).sum()
        )
        away.append(squares / 5)
    shares = np.exp((away[0] - np.array(away)) / (0.5 * made.median_distance))
    expected = shares / shares.sum()
    got = [drawn.count(moment) / len(drawn) for moment in best]
    np.testing.assert_allclose(got, expected, atol=2 / 3000)


def _field_and_sound(seed, n_frames):
    values, loudness, lengths = _recordings(seed)
    made = build_field(values, loudness, lengths, OPTIONS)
    generator = np.random.default_rng(seed + 1)
    sound, chances = generator.normal(size=(n_frames, 1)).astype(np.float32), generator.random(n_frames)
    return made, resting(made, np.zeros(2, np.float32), np.zeros(1, np.float32)), sound, chances, lengths


def test_in_parts_as_at_once():
    made, start, sound, chances, _ = _field_and_sound(2, 200)
    whole, _ = sample_field(made, start, sound, chances)
    parts, state = [], start
    for low, high in ((0, 1), (1, 50), (50, 50), (50, 200)):
        part, state = sample_field(made, state, sound[low:high], chances[low:high])
        parts.append(part)
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_without_leaps_a_recording_is_repeated():
    values, loudness, lengths = _recordings(4, n=1, length=300)
    options = FieldOptions(history=5, future=20, alpha=(1.0,), continuity=0.0, sigma=1e-6)
    made = build_field(values, loudness, lengths, options)
    state = FieldState(
        made.values[20:25], made.prosody[20:25], 24, np.zeros((2, 2), np.float32), np.zeros(0, np.int64), 0
    )
    shown, behind = sample_field(made, state, loudness[25:150], np.full(125, 0.5))
    assert behind.moment == 149
    np.testing.assert_allclose(shown, values[25:150], atol=1e-5)


def test_motion_is_continuous_across_a_jump():
    values, loudness, lengths = _recordings(5)
    made = build_field(values, loudness, lengths, FieldOptions(history=5, future=4, alpha=(5.0,), settle_s=0.2))
    generator = np.random.default_rng(6)
    sound = generator.normal(size=(600, 1)).astype(np.float32)
    start = resting(made, np.zeros(2, np.float32), np.zeros(1, np.float32))
    shown, _ = sample_field(made, start, sound, generator.random(600))
    recorded = np.abs(np.diff(values.reshape(12, 60, 2), axis=1)).max()
    assert np.abs(np.diff(shown, axis=0)).max() < 1.5 * recorded


def test_no_dead_end_and_no_loop_in_silence():
    values, loudness, lengths = _recordings(7)
    made = build_field(values, loudness, lengths, OPTIONS)
    start = resting(made, np.zeros(2, np.float32), np.zeros(1, np.float32))
    moments, state = [], start
    generator = np.random.default_rng(8)
    for _ in range(1500):
        _, state = sample_field(made, state, np.zeros((1, 1), np.float32), generator.random(1))
        moments.append(state.moment)
    assert len(set(moments[:500])) > 100
    assert set(moments[1000:]) - set(moments[500:1000])


def test_motion_is_continuous_across_a_change_of_style():
    values, loudness, lengths = _recordings(9)
    first = build_field(values, loudness, lengths, OPTIONS)
    second = build_field(2.0 * values[::-1].copy(), loudness[::-1].copy(), lengths, OPTIONS)
    state = resting(first, np.float32([1.0, 2.0]), np.float32([0.5]))
    there = transfer_state(state, first, second)
    np.testing.assert_allclose(there.motion * second.scale, state.motion * first.scale, rtol=1e-6)
    np.testing.assert_allclose(there.prosody / second.weights, state.prosody / first.weights, rtol=1e-6)


def test_too_short_recordings():
    values, loudness, _ = _recordings(10, n=1, length=9)
    with pytest.raises(DataError, match="no recording of the style has 10 frames"):
        build_field(values, loudness, np.array([9], np.int32), OPTIONS)


def test_sound_without_weight():
    values, loudness, lengths = _recordings(11)
    with pytest.raises(InputError, match="2 sound features need as many weights, not 1"):
        build_field(values, np.repeat(loudness, 2, axis=1), lengths, OPTIONS)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"history": 1}, "history is 2 to 60 frames"),
        ({"stride": 61}, "its stride 1 to 60"),
        ({"memory": -1}, "memory of a field must be 0 to 1000 jumps, not -1"),
        ({"candidates": 17}, "candidates of a field must be 1 to 16, not 17"),
        ({"alpha": (-1.0,)}, "alpha and settling time must not be negative"),
        ({"sigma": 0.0}, "its sigma must be above 0"),
        ({"settle_s": -0.1}, "alpha and settling time must not be negative"),
        ({"apart": 0}, "candidates lie 1 to 600 frames apart"),
        ({"search_error": 0.9}, "its search error is 1 to 10"),
        ({"continuity": 1.5}, "continuity must lie from 0 to 1, not 1.5"),
    ],
)
def test_options_out_of_range(wrong, reason):
    with pytest.raises(InputError, match=reason):
        FieldOptions(**wrong)


def test_a_walk_tells_which_moments_it_shows():
    made, start, sound, chances, lengths = _field_and_sound(4, 300)
    walk = sample_field_moments(made, start, sound, chances)
    np.testing.assert_array_equal(walk.values, sample_field(made, start, sound, chances)[0])
    assert walk.moments[-1] == walk.state.moment
    leaps = np.flatnonzero(np.diff(walk.moments) != 1) + 1
    ended = (walk.moments[leaps - 1] + 1) % lengths[0] == 0
    assert len(leaps) > 5
    assert not (leaps[~ended] % OPTIONS.stride).any()


def test_the_residual_offset_of_a_jump_decays_as_a_critically_damped_spring():
    values, loudness, lengths = _recordings(4)
    made = build_field(values, loudness, lengths, OPTIONS)
    generator = np.random.default_rng(5)
    sound, chances = generator.normal(size=(300, 1)).astype(np.float32), generator.random(300)
    walk = sample_field_moments(made, resting(made, np.zeros(2, np.float32), np.zeros(1, np.float32)), sound, chances)
    leaps = np.flatnonzero(np.diff(walk.moments) != 1) + 1
    omega = 1 / (OPTIONS.settle_s * 30)
    for leap, following in zip(leaps, [*leaps[1:], 300], strict=True):
        moment, k = walk.moments[leap], np.arange(1, following - leap + 1)[:, None]
        place = walk.values[leap - 1] - values[moment - 1]
        speed = np.diff(walk.values[leap - 2 : leap], axis=0) - np.diff(values[moment - 2 : moment], axis=0)
        left = walk.values[leap:following] - values[walk.moments[leap:following]]
        np.testing.assert_allclose(left, (place + (speed + omega * place) * k) * np.exp(-omega * k), atol=1e-4)


@pytest.mark.parametrize("chance", [0.0, 0.5, 0.999])
def test_a_clip_begins_as_a_recording_did(chance: float):
    values, loudness, lengths = _recordings(12)
    made = build_field(values, loudness, lengths, OPTIONS)
    state = initial_state(made, chance)
    start = 60 * int(chance * 12)
    np.testing.assert_array_equal(state.motion, made.values[start : start + OPTIONS.history])
    assert state.moment == start + OPTIONS.history - 1
