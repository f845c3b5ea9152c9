"""Fit of baked light: modes of what changes, and what a pose hides."""

import numpy as np
import pytest

from corpus_tools.film.fit_light import fit_modes, predicted, principal_modes

N_POSES, N_FEATURES, N_VERTICES = 30, 8, 50


@pytest.fixture(scope="module")
def truth() -> tuple[np.ndarray, np.ndarray]:
    """Features, the first of which is 0 in the first pose, and changes that follow from them."""
    rng = np.random.default_rng(4)
    features = rng.uniform(0, 1, (N_POSES, N_FEATURES))
    features[0] = 0
    return features, np.einsum("pf,fnc->pnc", features, rng.normal(0, 20, (N_FEATURES, N_VERTICES, 3)))


def test_modes_predict_changes_from_features(truth: tuple[np.ndarray, np.ndarray]) -> None:
    features, changes = truth
    hidden = np.zeros(changes.shape[:2], bool)
    modes, weights = fit_modes(features, changes, hidden, N_FEATURES)
    assert modes.dtype == np.int8
    found = predicted(features, modes, weights)
    assert np.abs(found - changes).mean() < 0.02 * np.abs(changes).mean()
    assert np.abs(found[0]).max() == 0
    few, of_few = principal_modes(features, changes, 2, 0.01)
    assert len(few) == 2
    assert few.reshape(2, -1) @ few.reshape(2, -1).T == pytest.approx(np.eye(2), abs=1e-9)
    assert np.abs(predicted(features, few, of_few) - changes).mean() < np.abs(changes).mean()


def test_what_a_pose_hides_is_guessed_by_the_others(truth: tuple[np.ndarray, np.ndarray]) -> None:
    features, changes = truth
    hidden = np.random.default_rng(5).uniform(size=changes.shape[:2]) < 0.15
    seen = np.where(hidden[..., None], -200.0, changes)
    blind = predicted(features, *fit_modes(features, seen, np.zeros_like(hidden), N_FEATURES))
    found = predicted(features, *fit_modes(features, seen, hidden, N_FEATURES))
    errors = [np.abs(one - changes)[hidden].mean() for one in (blind, found)]
    assert errors[1] < 0.3 * errors[0]
