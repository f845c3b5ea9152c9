"""Landmark displacements caused by head rotation: corrected if present, no change otherwise."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.recordings.observation import Observation
from corpus_tools.training.pose_correction import MIN_CHUNKS, angle_terms, correct_pose, fit_pose_correction
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, N_LANDMARKS

N = 40


@pytest.fixture
def recorded(make_observation: Callable[..., Observation]) -> list[Observation]:
    """One person in 40 recordings, with another head pose in each, without pose-dependent errors."""
    generator = np.random.default_rng(0)
    seen = []
    for number in range(N):
        one = make_observation(f"u{number}", number, 75)
        head = one.head.copy()
        head[:, :3] = generator.normal(0, 0.05, 3) + generator.normal(0, 0.002, (75, 3))
        seen.append(replace(one, head=head))
    return seen


def leaking(seen: list[Observation], offsets: np.ndarray) -> list[Observation]:
    leaks = [np.tensordot(angle_terms(one.head[:, :3] / 0.05), offsets, axes=1) for one in seen]
    return [replace(one, landmarks=one.landmarks + leak) for one, leak in zip(seen, leaks, strict=True)]


def test_a_known_leak_is_taken_out(recorded: list[Observation]) -> None:
    """0.25: the mean of speech over a chunk is not zero, and the regression removes a part of it."""
    offsets = np.random.default_rng(1).normal(0, 1.0, (9, N_LANDMARKS, 3))
    offsets[:, list(INNER_LIP_LOWER)] = offsets[:, list(INNER_LIP_UPPER)]
    leaky = leaking(recorded, offsets)
    clean = correct_pose(leaky)

    def off(seen: list[Observation] | tuple[Observation, ...]) -> float:
        away = np.array([one.landmarks - true.landmarks for one, true in zip(seen, recorded, strict=True)])
        return float((away - away.mean(axis=(0, 1))).std())

    assert off(clean) < 0.25 * off(leaky)


def test_lips_that_touch_keep_touching(recorded: list[Observation]) -> None:
    offsets = np.random.default_rng(2).normal(0, 1.0, (9, N_LANDMARKS, 3))
    leaky = leaking(recorded, offsets)
    for before, after in zip(leaky, correct_pose(leaky), strict=True):
        gaps = [one.landmarks[:, INNER_LIP_UPPER] - one.landmarks[:, INNER_LIP_LOWER] for one in (before, after)]
        np.testing.assert_allclose(gaps[0], gaps[1], atol=1e-3)


def test_too_few_recordings_are_not_corrected(recorded: list[Observation]) -> None:
    few = leaking(recorded, np.ones((9, N_LANDMARKS, 3)))[: MIN_CHUNKS - 1]
    assert not fit_pose_correction(few).offsets.any()
    for before, after in zip(few, correct_pose(few), strict=True):
        np.testing.assert_array_equal(before.landmarks, after.landmarks)


def test_pose_correction_of_no_recordings_is_empty() -> None:
    assert correct_pose([]) == ()


def test_terms_are_angles_squares_and_products() -> None:
    assert angle_terms(np.array([[2.0, 3.0, 5.0]])).tolist() == [[2, 3, 5, 4, 9, 25, 6, 10, 15]]
