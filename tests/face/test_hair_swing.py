"""Hair that lags behind the head."""

from dataclasses import replace

import numpy as np
import pytest

from tts2face.face.breathing import BREATH_SHAPE
from tts2face.face.hair_swing import LIMIT_RAD, HairSwing
from tts2face.models.face_loading import load_face
from tts2face.models.lit_hair import SWING_SHAPES
from tts2face.session.session import Session
from tts2face.types import HEAD_CHANNELS, Trajectory

CHANNELS = ("jawOpen", *SWING_SHAPES)
FPS = 30.0
SWING = HairSwing.of_channels(CHANNELS)


def swung(yaw: np.ndarray, pieces: int = 1, fps: float = FPS) -> np.ndarray:
    head = np.zeros((len(yaw), len(HEAD_CHANNELS)), np.float32)
    head[:, 1] = yaw
    state, found = None, []
    for part in np.array_split(head, pieces):
        face = Trajectory(CHANNELS, np.full((len(part), len(CHANNELS)), 0.01, np.float32), fps)
        moved, state = SWING.apply(face, Trajectory(HEAD_CHANNELS, part, fps), state)
        found.append(moved.values)
    return np.concatenate(found)


def test_hair_lags_behind_a_turn_and_comes_to_rest() -> None:
    yaw = np.radians(20) * np.clip((np.arange(90) - 10) / 12, 0, 1)
    moved = swung(yaw)
    lag = moved[:, 2] - 0.01
    assert lag[:10] == pytest.approx(0, abs=1e-6)
    assert lag[11:15].min() < -0.03  # it stays where it was
    assert lag[22:30].max() > 0.03  # and swings past the head that has stopped
    assert np.abs(lag[60:]).max() < 0.1 * np.abs(lag).max()
    assert np.abs(lag).max() < LIMIT_RAD
    assert moved[:, [0, 1, 3]] == pytest.approx(0.01)


def test_pieces_swing_like_a_whole_and_frame_rates_alike() -> None:
    rng = np.random.default_rng(1)
    yaw = np.cumsum(rng.normal(0, 0.01, 120))
    assert swung(yaw, pieces=7) == pytest.approx(swung(yaw), abs=1e-6)
    times = np.arange(60) / FPS
    slow = swung(0.3 * np.sin(4 * times))
    fine = swung(0.3 * np.sin(4 * np.arange(240) / (4 * FPS)), fps=4 * FPS)
    assert slow[20:, 2] == pytest.approx(fine[::4][20:, 2], abs=0.02)


def test_a_face_without_these_shapes_has_no_swing() -> None:
    assert HairSwing.of_channels(("jawOpen", *SWING_SHAPES[:2])) is None


def test_hair_swings_and_shoulders_breathe_in_clips_of_a_face_that_has_them() -> None:
    face = load_face("head", hair="bald")
    names = (*SWING_SHAPES, BREATH_SHAPE)
    still = np.zeros((len(names), *face.vertices.shape), np.float32)
    limits = np.tile(np.array([-LIMIT_RAD, 1.0], np.float32), (len(names), 1))
    swinging = replace(
        face,
        shape_names=(*face.shape_names, *names),
        shapes=np.concatenate([face.shapes, still]),
        limits=np.concatenate([face.limits, limits]),
    )
    clip = Session(face=swinging).clip("Who are you? Come in.", style="delighted")
    columns = [clip.motion.channels.index(name) for name in SWING_SHAPES]
    lags = clip.motion.values[:, columns]
    assert np.abs(lags).max() > 0.002
    assert np.abs(lags).max() < LIMIT_RAD
    alone = Trajectory(clip.motion.channels, np.zeros_like(clip.motion.values), clip.motion.fps)
    expected, _ = HairSwing.of_channels(alone.channels).apply(alone, clip.head, None)
    assert lags == pytest.approx(expected.values[:, columns], abs=1e-5)
    breath = clip.motion.values[:, clip.motion.channels.index(BREATH_SHAPE)]
    assert breath.max() > 0.9
    assert breath.min() < 0.8
