"""Gaze in conversation: the shipped distribution over people, its process, and the head that follows."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.gestures.gaze import HEAD_ONSET_DEG, HEAD_SHARE, GazeProcess, HeadFollower
from tts2face.gestures.presentation import FrameContext
from tts2face.gestures.speech_plan import NO_PLAN
from tts2face.models.gaze import (
    FACE_DEG,
    LISTENING,
    PARAMETERS,
    SPEAKING,
    STATES,
    GazeHabit,
    GazeModel,
    LogNormal,
    load_gaze,
    write_gaze,
)

FPS = 30.0
HABIT = GazeHabit(
    face=LogNormal(2.0, 0.3),
    away=LogNormal(1.0, 0.3),
    beyond=LogNormal(10.0, 0.2),
    face_fixation=LogNormal(0.5, 0.2),
    away_fixation=LogNormal(0.4, 0.2),
    roam=LogNormal(4.0, 0.2),
    directions=(0.5, 0.4, 0.1),
    left=0.8,
    spot_deg=1.5,
)
HABITS = {SPEAKING: HABIT, LISTENING: replace(HABIT, face=LogNormal(8.0, 0.3), away=LogNormal(0.5, 0.3))}


def made(
    process: GazeProcess, seconds: float, *, listens: bool = False, begin: float = 0.0, decibels: float = 0.0
) -> np.ndarray:
    """Gaze (T, 2) in degrees."""
    times = begin + np.arange(round(seconds * FPS)) / FPS
    process.extend(frames(times, listens=listens, decibels=decibels))
    return np.degrees(process.at(times))


def frames(times: np.ndarray, *, listens: bool = False, decibels: float = 0.0) -> FrameContext:
    """Frames of a derived style."""
    level, listening = np.full(len(times), decibels, np.float32), np.full(len(times), listens)
    return FrameContext(times, level, NO_PLAN, np.ones(len(times), bool), listening)


def test_a_look_is_as_long_as_far_and_where_the_habit_says() -> None:
    process = GazeProcess(HABITS, [0])
    gaze = made(process, 1200)
    away = np.linalg.norm(gaze, axis=1) >= FACE_DEG
    begins = np.flatnonzero(~away[:-1] & away[1:])
    ends = np.flatnonzero(away[:-1] & ~away[1:])
    assert np.median(ends - begins[: len(ends)]) / FPS == pytest.approx(1.0, abs=0.1)
    assert np.median(begins[1:] - ends[: len(begins) - 1]) / FPS == pytest.approx(2.0, abs=0.2)
    landed = gaze[begins + 4]
    assert np.median(np.linalg.norm(landed, axis=1)) == pytest.approx(15.0, abs=1.5)
    down, left = landed.T
    is_side = np.abs(left) > np.abs(down)
    assert is_side.mean() == pytest.approx(0.5, abs=0.1)
    assert (left[is_side] > 0).mean() == pytest.approx(0.8, abs=0.1)
    assert (down[~is_side] < 0).mean() == pytest.approx(0.8, abs=0.1)


def test_listeners_look_at_the_face() -> None:
    shares = [
        (np.linalg.norm(made(GazeProcess(HABITS, [1]), 600, listens=listens), axis=1) < FACE_DEG).mean()
        for listens in (False, True)
    ]
    assert shares[0] == pytest.approx(0.66, abs=0.05)
    assert shares[1] > 0.9


def test_who_is_silent_for_long_listens() -> None:
    process, times = GazeProcess(HABITS, [1]), np.arange(18000) / FPS
    process.extend(frames(times, decibels=-35.0))
    assert (np.linalg.norm(np.degrees(process.at(times)), axis=1) < FACE_DEG).mean() > 0.9


def test_a_clip_begins_with_a_look_at_the_viewer() -> None:
    for seed in range(20):
        assert not made(GazeProcess(HABITS, [seed]), 0.1).any()


def test_most_turns_begin_with_a_look_away_and_up_and_end_on_the_listener() -> None:
    away, up = [], []
    for seed in range(150):
        process = GazeProcess(HABITS, [seed])
        made(process, 1.0, listens=True)
        turn = made(process, 0.2, begin=1.0, decibels=-35.0)  # before the first word
        away.append(np.linalg.norm(turn[-1]) >= FACE_DEG)
        up.append(turn[-1, 0] < -abs(turn[-1, 1]))
        back = made(process, 0.6, listens=True, begin=1.2)
        assert np.linalg.norm(back[-1]) < FACE_DEG
    assert np.mean(away) == pytest.approx(0.7, abs=0.12)
    assert np.sum(up) / np.sum(away) == pytest.approx(0.6, abs=0.15)


def test_no_look_away_begins_between_sentences() -> None:
    for seed in range(20):
        process = GazeProcess(HABITS, [seed])
        for begin in np.arange(0.0, 30.0, 3.0).tolist():
            made(process, 2.0, begin=begin)
            silent = np.linalg.norm(made(process, 1.0, begin=begin + 2.0, decibels=-35.0), axis=1) >= FACE_DEG
            assert not (~silent[1:-1] & silent[2:]).any()  # the first two frames may end a jump of before


def test_frames_in_pieces_are_those_of_the_whole_and_a_copy_goes_on_alone() -> None:
    whole = made(GazeProcess(HABITS, [4]), 30)
    process = GazeProcess(HABITS, [4])
    parts = [made(process, 10, begin=10.0 * at) for at in range(2)]
    copied = process.copy()
    parts.append(made(process, 10, begin=20.0))
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-4)
    np.testing.assert_array_equal(made(copied, 10, begin=20.0), parts[2])
    assert len(process.fixations) < 5


def test_eyes_jump_within_a_tenth_of_a_second_without_overshoot() -> None:
    times = np.arange(0, 20, 1 / 200)
    process = GazeProcess(HABITS, [5])
    process.extend(frames(np.arange(600) / FPS))
    away = np.linalg.norm(np.degrees(process.at(times)), axis=1)
    moving = np.abs(np.diff(away)) > 1e-3
    ends = np.flatnonzero(np.diff(np.concatenate([[0], moving.astype(int), [0]])))
    assert (ends[1::2] - ends[::2]).max() / 200 < 0.11


def test_the_head_follows_what_lies_beyond_ten_degrees_after_the_eyes() -> None:
    gaze = np.zeros((90, 2))
    gaze[10:, 1] = math.radians(8.0)
    assert not HeadFollower().next(gaze, FPS).any()
    gaze[10:] = np.radians([-12.0, 16.0])
    turned = np.degrees(HeadFollower().next(gaze, FPS))
    assert not turned[:11].any()
    half = np.flatnonzero(np.linalg.norm(turned, axis=1) > HEAD_SHARE * (20 - HEAD_ONSET_DEG) / 2)[0]
    assert 0.15 < (half - 10) / FPS < 0.35
    np.testing.assert_allclose(turned[-1], HEAD_SHARE * (20 - HEAD_ONSET_DEG) * np.array([-0.6, 0.8]), atol=0.02)
    follower = HeadFollower()
    parts = [follower.next(part, FPS) for part in np.array_split(gaze, 7)]
    np.testing.assert_allclose(np.degrees(np.concatenate(parts)), turned, atol=1e-9)


def test_people_differ_and_keep_their_side() -> None:
    model = load_gaze()
    people = [model.draw(np.random.default_rng(seed)) for seed in range(200)]
    medians = np.array([[person[state].face.median for state in STATES] for person in people])
    assert np.median(medians[:, 1]) > 2 * np.median(medians[:, 0])
    assert np.quantile(medians[:, 0], 0.9) > 1.6 * np.quantile(medians[:, 0], 0.1)
    lefts = np.array([[person[state].left > 0.5 for state in STATES] for person in people])
    assert (lefts[:, 0] == lefts[:, 1]).all()
    assert lefts[:, 0].mean() == pytest.approx(0.5, abs=0.12)


def test_a_file_keeps_the_distribution(tmp_path: Path) -> None:
    shape = (len(STATES), len(PARAMETERS))
    model = GazeModel(np.full(shape, 0.5), np.full(shape, 0.25), {"source": "made"})
    write_gaze(tmp_path / "made.gaze", model)
    found = load_gaze(str(tmp_path / "made.gaze"))
    np.testing.assert_array_equal(found.mean, model.mean)
    np.testing.assert_array_equal(found.spread, model.spread)
    assert found.metadata == {"source": "made"}
    write_gaze(tmp_path / "narrow.gaze", replace(model, spread=-model.spread))
    with pytest.raises(DataError, match="spread"):
        load_gaze(str(tmp_path / "narrow.gaze"))
