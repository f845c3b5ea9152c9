"""Canonical correlation against closed forms and against the eigenvalue problem that defines it."""

import numpy as np
import pytest

from corpus_tools.training.canonical_correlation import canonical_correlation
from lexicon.errors import InputError
from tests.bench.bench_drive import sampled_correlations
from tests.packages import package

KNOWN = (0.9, 0.5, 0.2)


def tied(n_frames: int = 4000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Mixed sets whose factors have exactly the `KNOWN` correlations, as built from an orthonormal table."""
    generator = np.random.default_rng(seed)
    raw = generator.normal(size=(n_frames, 8))
    columns, _ = np.linalg.qr(raw - raw.mean(axis=0))
    share = np.array(KNOWN)
    a = columns[:, :3]
    b = share * a + np.sqrt(1 - share**2) * columns[:, 3:6]
    b = np.concatenate([b, columns[:, 6:8]], axis=1)
    return a @ generator.normal(size=(3, 3)) + 5.0, b @ generator.normal(size=(5, 5)) - 2.0


def test_known_correlations_are_found() -> None:
    np.testing.assert_allclose(canonical_correlation(*tied()).correlations, KNOWN, rtol=1e-10)


def test_correlations_are_the_roots_of_the_eigenvalue_problem() -> None:
    generator = np.random.default_rng(1)
    a = generator.normal(size=(300, 4))
    b = a @ generator.normal(size=(4, 6)) + 2 * generator.normal(size=(300, 6))
    joint = np.cov(a.T, b.T)
    aa, ab, bb = joint[:4, :4], joint[:4, 4:], joint[4:, 4:]
    squares = np.linalg.eigvals(np.linalg.solve(aa, ab) @ np.linalg.solve(bb, ab.T)).real
    np.testing.assert_allclose(canonical_correlation(a, b).correlations, np.sqrt(np.sort(squares)[::-1]), rtol=1e-9)


def test_factors_have_unit_variance_and_the_stated_correlations() -> None:
    a, b = tied()
    found = canonical_correlation(a, b)
    left, right = (a - found.mean_a) @ found.weights_a, (b - found.mean_b) @ found.weights_b
    np.testing.assert_allclose(left.T @ left / len(a), np.eye(3), atol=1e-9)
    np.testing.assert_allclose(left.T @ right / len(a), np.diag(KNOWN), atol=1e-9)


def test_it_equals_scikit_learn() -> None:
    decomposition = package("sklearn.cross_decomposition")
    a, b = tied(500)
    left, right = decomposition.CCA(3, max_iter=5000, tol=1e-12).fit_transform(a, b)
    theirs = [np.corrcoef(left[:, k], right[:, k])[0, 1] for k in range(3)]
    np.testing.assert_allclose(canonical_correlation(a, b).correlations, theirs, rtol=1e-6)


def test_a_measurement_given_twice_changes_nothing() -> None:
    a, b = tied()
    doubled = canonical_correlation(np.concatenate([a, a[:, :1]], axis=1), b)
    np.testing.assert_allclose(doubled.correlations, KNOWN, rtol=1e-8)


def test_few_frames_feign_a_strong_tie_that_falls_to_the_true_one() -> None:
    a, b = tied()
    rng = np.random.default_rng(0)
    means = sampled_correlations(a, b, (12, 50, 2000), trials=30, rng=rng).mean(axis=1)
    assert means[0] > means[1] > means[2]
    assert means[2] == pytest.approx(0.9, abs=0.005)


@pytest.mark.parametrize(
    ("a", "b", "reason"),
    [
        (np.ones((9, 2)), np.ones((8, 2)), "not 9 and 8"),
        (np.eye(4), np.eye(4), "4 frames are too few"),
        (np.ones((20, 2)), np.random.default_rng(0).normal(size=(20, 2)), "constant measurements have no correlation"),
    ],
)
def test_what_has_no_correlation_is_refused(a: np.ndarray, b: np.ndarray, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        canonical_correlation(a, b)
