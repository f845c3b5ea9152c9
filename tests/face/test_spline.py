"""Local interpolation against scipy's B-splines, closed forms and the law of locality."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from lexicon.errors import DataError, InputError
from tts2face.face.landmarks import landmark_motion, landmark_positions
from tts2face.models.face_loading import load_face
from tts2face.numeric.local_splines import cubic_bspline, fit_local_interpolant
from tts2face.numeric.splines import CHUNK_SIZE

SUPPORT = 30.0  # mm


def brows(n: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Points about 5 mm apart, like the landmarks of brows, and their displacements."""
    generator = np.random.default_rng(4)
    grid = np.stack(np.meshgrid(np.arange(5) * 5.0, np.arange(-(-n // 5)) * 5.0), axis=-1).reshape(-1, 2)[:n]
    places = np.column_stack([grid, 0.05 * grid[:, 0] ** 2]) + generator.normal(0, 0.5, (n, 3))
    return places, generator.normal(0, 3, (n, 3))


def test_the_basis_function_is_the_cubic_b_spline() -> None:
    share = np.linspace(0, 0.999, 101)
    known = 1.5 * BSpline.basis_element([-2, -1, 0, 1, 2])(2 * share)  # its value at 0 is 2/3
    np.testing.assert_allclose(cubic_bspline(share), known, atol=1e-12)
    assert cubic_bspline(np.array([0.5, 1.0, 7.0])).tolist() == [0.25, 0.0, 0.0]


def test_takes_the_given_displacements_of_near_centres_exactly() -> None:
    centres, moved = brows()
    np.testing.assert_allclose(fit_local_interpolant(centres, moved, SUPPORT)(centres), moved, atol=1e-9)


def test_a_cubic_spline_on_a_line_is_recovered() -> None:
    """Centres at half the support are the knots of a spline, whose coefficients are recovered."""
    knots = np.arange(12.0)
    wanted = np.random.default_rng(2).normal(size=(len(knots), 2))
    found = fit_local_interpolant(knots[:, None], spline_sum(knots, knots, wanted), 2.0)
    np.testing.assert_allclose(found.coefficients, wanted, atol=1e-12)


def spline_sum(x: np.ndarray, knots: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    bells = [1.5 * BSpline.basis_element(knot + np.arange(-2, 3), extrapolate=False)(x) for knot in knots]
    return np.nan_to_num(np.transpose(bells)) @ coefficients


def test_nothing_moves_beyond_the_support() -> None:
    centres, moved = brows()
    places = np.random.default_rng(5).uniform(-80, 80, (2000, 3))
    far = np.abs(places[:, None] - centres).max(axis=2).min(axis=1) >= SUPPORT
    field = fit_local_interpolant(centres, moved, SUPPORT)(places)
    assert far.any()
    assert not field[far].any()
    assert field[~far].any(axis=1).mean() > 0.95


def test_one_centre_is_the_product_of_splines_along_the_axes() -> None:
    field = fit_local_interpolant(np.zeros((1, 3)), np.array([[2.0, 0.0, -1.0]]), 10.0)
    place = np.array([[5.0, 0.0, -5.0]])
    np.testing.assert_allclose(field(place), np.array([[2.0, 0.0, -1.0]]) / 16, rtol=1e-12)


def test_does_not_oscillate_between_the_landmarks_of_a_dense_mesh() -> None:
    """Splines of the distance, which are not positive definite in space, turn a blink of 13 mm into 114 mm here."""
    head = load_face("head")
    places = landmark_positions(head)[:468:2]
    blink = landmark_motion(head, np.array([head.shape_names.index("eyeBlinkLeft")]))[:468:2, :, 0]
    field = fit_local_interpolant(places, blink, SUPPORT)(head.vertices[::7])
    assert np.abs(field).max() < 1.5 * np.abs(blink).max()


def test_does_not_depend_on_the_unit_of_length_or_the_number_of_points() -> None:
    centres, moved = brows()
    places = np.random.default_rng(6).uniform(-20, 40, (CHUNK_SIZE + 3, 3))
    field = fit_local_interpolant(centres, moved, SUPPORT)
    in_metres = fit_local_interpolant(centres / 1000, moved / 1000, SUPPORT / 1000)(places / 1000)
    np.testing.assert_allclose(1000 * in_metres, field(places), atol=1e-9)
    np.testing.assert_allclose(field(places)[[0, -1]], np.concatenate([field(places[:1]), field(places[-1:])]), 1e-12)


def test_invalid_centres_are_refused() -> None:
    centres, moved = brows(3)
    with pytest.raises(InputError, match="must have the same rows"):
        fit_local_interpolant(centres, moved[:2], SUPPORT)
    with pytest.raises(InputError, match="must be finite"):
        fit_local_interpolant(centres, moved * np.nan, SUPPORT)
    with pytest.raises(InputError, match="support must be above 0, not 0"):
        fit_local_interpolant(centres, moved, 0)
    with pytest.raises(DataError, match="too close together"):
        fit_local_interpolant(centres[[0, 1, 0]], moved, SUPPORT)
