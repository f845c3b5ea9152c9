"""Scattered-data interpolation against closed forms, laws and scipy's."""

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tts2face.numeric.splines import CHUNK_SIZE, fit_interpolant

WIDTH = 150.0
REACH = 64.0 / 200.0 * WIDTH  # mm; eq. 4's 64 on a face 200 wide


def scattered(n: int = 40) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(4)
    return generator.uniform(-75, 75, (n, 3)), generator.normal(0, 4, (n, 3))


def test_takes_the_given_displacements_at_the_centres() -> None:
    centres, moved = scattered()
    np.testing.assert_allclose(fit_interpolant(centres, moved, WIDTH)(centres), moved, atol=1e-9)


def test_one_centre_decreases_as_in_the_paper() -> None:
    field = fit_interpolant(np.zeros((1, 3)), np.array([[2.0, 0.0, -1.0]]), 200.0)
    far = field(np.array([[64.0, 0.0, 0.0], [0.0, 0.0, 128.0]]))
    np.testing.assert_allclose(far, np.exp([[-1.0], [-2.0]]) * [2.0, 0.0, -1.0], rtol=1e-12)


def test_between_two_centres_on_a_line_it_is_a_hyperbolic_sine() -> None:
    a, u0, u1 = 64.0, 3.0, -1.0
    field = fit_interpolant(np.array([[0.0], [90.0]]), np.array([[u0], [u1]]), 200.0)
    x = np.linspace(0, 90, 31)
    wanted = (u0 * np.sinh((90 - x) / a) + u1 * np.sinh(x / a)) / np.sinh(90 / a)
    np.testing.assert_allclose(field(x[:, None])[:, 0], wanted, rtol=1e-10, atol=1e-12)


def test_equals_scipys_interpolation_with_the_same_kernel() -> None:
    from scipy.interpolate import Rbf

    centres, moved = scattered()
    places = np.random.default_rng(5).uniform(-100, 100, (60, 3))
    wanted = [Rbf(*centres.T, u, function=lambda _, r: np.exp(-r / REACH))(*places.T) for u in moved.T]
    np.testing.assert_allclose(fit_interpolant(centres, moved, WIDTH)(places), np.transpose(wanted), atol=1e-9)


def test_does_not_depend_on_the_unit_of_length() -> None:
    centres, moved = scattered()
    places = centres + 3.0
    in_metres = fit_interpolant(centres / 1000, moved / 1000, WIDTH / 1000)(places / 1000)
    np.testing.assert_allclose(1000 * in_metres, fit_interpolant(centres, moved, WIDTH)(places), atol=1e-9)


def test_displacements_vanish_far_from_the_centres() -> None:
    centres, _ = scattered()
    field = fit_interpolant(centres, np.ones((len(centres), 3)), WIDTH)
    assert np.abs(field(np.array([[3000.0, 0.0, 0.0]]))).max() < 1e-12


def test_chunks_equal_single_evaluations() -> None:
    centres, moved = scattered(5)
    field = fit_interpolant(centres, moved, WIDTH)
    places = np.random.default_rng(6).uniform(-75, 75, (CHUNK_SIZE + 3, 3))
    np.testing.assert_allclose(field(places)[[0, -1]], np.concatenate([field(places[:1]), field(places[-1:])]), 1e-12)


def test_invalid_centres_are_refused() -> None:
    centres, moved = scattered(3)
    with pytest.raises(InputError, match="must have the same rows"):
        fit_interpolant(centres, moved[:2], WIDTH)
    with pytest.raises(InputError, match="must be finite"):
        fit_interpolant(centres, np.where(moved == moved[0, 0], np.nan, moved), WIDTH)
    with pytest.raises(InputError, match="width must be above 0, not 0"):
        fit_interpolant(centres, moved, 0.0)
    with pytest.raises(DataError, match="two centres lie in one place"):
        fit_interpolant(centres[[0, 1, 0]], moved, WIDTH)
