"""Weights of basis expressions: exact on made faces, within limits, and both estimators against brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from corpus_tools.decomposition.blend_weights import (
    N_AVERAGED,
    build_least_squares_estimator,
    build_nearest_samples_estimator,
    moving_average,
)
from lexicon.errors import DataError, InputError
from tests.corpus_tools.decomposition.weight_errors import approximation_error

N_LANDMARKS = 30


def made(n_frames: int = 40, *, noise: float = 0.0, low: float = 0.0, high: float = 1.0) -> tuple[np.ndarray, ...]:
    generator = np.random.default_rng(3)
    basis = generator.normal(0, 3, (5, N_LANDMARKS, 3))
    weights = generator.uniform(low, high, (n_frames, 5))
    seen = np.tensordot(weights, basis, axes=1) + noise * generator.normal(size=(n_frames, N_LANDMARKS, 3))
    return basis, weights, seen


def test_least_squares_finds_the_weights_that_made_a_face() -> None:
    basis, weights, seen = made()
    np.testing.assert_allclose(build_least_squares_estimator(basis).weights(seen), weights, atol=1e-9)


@pytest.mark.parametrize("slack", [0.0, 0.3, 1.0])
def test_least_squares_agrees_with_scipy_s_where_limits_bind(slack: float) -> None:
    basis, _, seen = made(noise=3.0, low=-1.5, high=2.5)
    found = build_least_squares_estimator(basis, slack).weights(seen)
    design = basis.reshape(5, -1).T
    expected = [lsq_linear(design, row.ravel(), (-slack, 1 + slack), tol=1e-14).x for row in seen]
    np.testing.assert_allclose(found, expected, atol=1e-6)  # 10 x the other's stop criterion, on weights
    assert found.min() >= -slack - 1e-9
    assert found.max() <= 1 + slack + 1e-9


def brute_force(basis: np.ndarray, samples: np.ndarray, seen: np.ndarray, n_nearest: int) -> np.ndarray:
    """The paper's estimator in all coordinates, without a tree."""
    faces = np.tensordot(samples, basis, axes=1).reshape(len(samples), -1)
    found = []
    for row in seen.reshape(len(seen), -1):
        away = np.linalg.norm(faces - row, axis=1)
        nearest = np.argsort(away)[:n_nearest]
        shares = 1.0 / away[nearest]
        found.append(shares @ samples[nearest] / shares.sum())
    return np.array(found)


@pytest.mark.parametrize("n_nearest", [1, 2, 60])
def test_the_tree_in_the_basis_span_equals_a_search_in_all_coordinates(n_nearest: int) -> None:
    basis, _, seen = made(noise=2.0)
    ready = build_nearest_samples_estimator(
        basis, np.random.default_rng(5), slack=0.2, n_samples=500, n_nearest=n_nearest
    )
    expected = brute_force(basis, ready.samples, seen, n_nearest)
    np.testing.assert_allclose(ready.weights(seen), expected, rtol=1e-9, atol=1e-12)


def test_samples_stay_within_the_limits_and_reach_them() -> None:
    basis, _, seen = made(noise=5.0, low=-3, high=4)
    ready = build_nearest_samples_estimator(basis, np.random.default_rng(5), slack=0.5)
    assert ready.samples.min() == pytest.approx(-0.5, abs=0.01)
    assert ready.samples.max() == pytest.approx(1.5, abs=0.01)
    found = ready.weights(seen)
    assert found.min() >= -0.5
    assert found.max() <= 1.5


def test_a_face_that_is_a_sample_has_its_weights() -> None:
    basis, _, _ = made()
    ready = build_nearest_samples_estimator(basis, np.random.default_rng(5))
    seen = np.tensordot(ready.samples[:3], basis, axes=1)
    np.testing.assert_allclose(ready.weights(seen), ready.samples[:3], atol=1e-4)  # distance 0 up to rounding


def test_the_error_falls_with_the_number_of_samples_and_never_below_least_squares() -> None:
    basis, _, seen = made(200, noise=0.5)
    errors = []
    for n_samples in (20, 200, 2000, 20_000):
        ready = build_nearest_samples_estimator(basis, np.random.default_rng(5), n_samples=n_samples, n_nearest=10)
        errors.append(approximation_error(seen, basis, ready.weights(seen)).mean())
    assert (np.diff(errors) < 0).all()
    assert approximation_error(seen, basis, build_least_squares_estimator(basis).weights(seen)).mean() <= errors[-1]


def test_the_same_seed_gives_the_same_weights() -> None:
    basis, _, seen = made()
    first, second = (build_nearest_samples_estimator(basis, np.random.default_rng(9)).weights(seen) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def plain_average(motion: np.ndarray) -> np.ndarray:
    """Mirrored by hand: frame -1 is frame 0, frame T is frame T - 1."""
    n, half = len(motion), N_AVERAGED // 2
    rows = []
    for t in range(n):
        at = np.arange(t - half, t + half + 1) % (2 * n)
        rows.append(motion[np.where(at < n, at, 2 * n - 1 - at)].mean(axis=0))
    return np.array(rows)


@settings(deadline=None)
@given(st.integers(1, 120))
def test_the_average_is_the_mean_of_its_frames(n: int) -> None:
    motion = np.random.default_rng(n).normal(size=(n, 2, 3))
    np.testing.assert_allclose(moving_average(motion), plain_average(motion), atol=1e-12)


def test_the_average_keeps_constants_and_removes_its_own_period() -> None:
    wave = np.sin(2 * np.pi * np.arange(200) / N_AVERAGED)[:, None]
    np.testing.assert_allclose(moving_average(wave + 7.0)[40:-40], 7.0, atol=1e-12)


def test_more_neighbours_than_samples_are_refused() -> None:
    with pytest.raises(InputError, match="60 nearest of 50"):
        build_nearest_samples_estimator(made()[0], np.random.default_rng(1), n_samples=50)


def test_a_slack_above_one_is_refused() -> None:
    with pytest.raises(InputError, match=r"0 to 1, not by 1\.5"):
        build_least_squares_estimator(made()[0], 1.5)


def test_expressions_that_depend_on_each_other_are_refused() -> None:
    basis = made()[0].copy()
    basis[4] = basis[0] + basis[1]
    with pytest.raises(DataError, match="are linearly dependent"):
        build_least_squares_estimator(basis)


def test_an_expression_with_a_gap_is_refused() -> None:
    basis = made()[0].copy()
    basis[2, 0] = np.nan
    with pytest.raises(DataError, match="not finite"):
        build_least_squares_estimator(basis)


def test_displacements_of_other_landmarks_are_refused() -> None:
    basis, _, seen = made()
    with pytest.raises(InputError, match="87 coordinates"):
        build_least_squares_estimator(basis).weights(seen[:, 1:])
