"""Transferred lips: no crossing, contact where the source has contact, and the least correction."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from scipy.optimize import minimize

from lexicon.errors import DataError
from tests.lips.test_clone import gaps_of, opening_model, seeds, some
from tts2face.lips.cloning import build_parameter_transfer
from tts2face.lips.lip_gaps import MIN_LIP_GAP_MM, nearest_valid_parameters
from tts2face.models.landmarks import INNER_LIP_LOWER
from tts2face.numeric.least_squares import bounded_least_squares

N_GAPS = len(INNER_LIP_LOWER) - 2  # facing inner lip points without the corners


def test_crossing_lips_are_separated_by_the_least_gap() -> None:
    """In closed form: a lower lip that would rise 2 mm stops where the lips are 0.01 mm apart."""
    model = opening_model()
    values = np.array([[-2 * np.sqrt(N_GAPS), 5.0], [6.0, 1.0]], np.float32)
    mapped = build_parameter_transfer(model, model).parameters(values)
    assert gaps_of(model, mapped)[0] == pytest.approx(0.01, abs=1e-4)
    assert mapped[0, 1] == 5.0
    assert mapped[1] == pytest.approx(values[1], abs=1e-6)


def test_lips_that_overlap_at_rest_are_separated_at_rest() -> None:
    """By 0.31 mm in closed form; other frames keep their displacement from there."""
    model = opening_model(gap=-0.3)
    parted = 0.31 * np.sqrt(N_GAPS)
    mapped = build_parameter_transfer(model, model).parameters(np.array([[0, 0], [-9, 3], [4, 4]], np.float32))
    assert mapped == pytest.approx(np.array([[parted, 0], [parted, 3], [4, 4]]), abs=1e-4)
    assert gaps_of(model, mapped).min() == pytest.approx(0.01, abs=1e-4)


@some
@given(seeds)
def test_lip_gaps_are_corrected_by_the_least_motion(seed: int) -> None:
    """Against the same problem by sequential quadratic programming, and by pivoting where only crossing matters."""
    rng = np.random.default_rng(seed)
    gaps = np.column_stack([rng.normal(size=(3, 5)), rng.uniform(0.1, 0.5, 3)])
    wanted, limits = rng.normal(size=(2, 5)) * 2, rng.uniform(0.5, 1.5, 5)
    most = rng.uniform(0.6, 1.5, (2, 3))
    sides, heights = gaps[:, :-1], gaps[:, -1]
    found = nearest_valid_parameters(wanted, limits, gaps, most)
    reached = found @ sides.T + heights
    assert (reached > MIN_LIP_GAP_MM - 1e-8).all()
    assert (reached < most + 1e-8).all()
    assert (np.abs(found) < limits + 1e-8).all()
    for frame, start, highest in zip(found, wanted, most, strict=True):
        rules = (
            lambda p: sides @ p + heights - MIN_LIP_GAP_MM,
            lambda p, highest=highest: highest - sides @ p - heights,
        )
        known = minimize(
            lambda p, start=start: ((p - start) ** 2).sum(),
            np.zeros(5),
            jac=lambda p, start=start: 2 * (p - start),
            method="SLSQP",
            bounds=np.stack([-limits, limits], axis=1),
            constraints=[{"type": "ineq", "fun": rule} for rule in rules],
            options={"ftol": 1e-14, "maxiter": 500},
        )
        assert frame == pytest.approx(known.x, abs=1e-4)
    free = nearest_valid_parameters(wanted, np.full(5, 1e3), gaps, np.full((2, 3), 1e3))
    forces = bounded_least_squares(
        sides @ sides.T, MIN_LIP_GAP_MM - (wanted @ sides.T + heights), np.tile([0.0, 1e6], (3, 1))
    )
    assert free == pytest.approx(wanted + forces @ sides, abs=1e-4)


def test_contact_of_the_source_is_kept_under_gain() -> None:
    """0.4 mm apart at rest; 0.8 mm, which is contact, stays 0.8 mm; 10 mm becomes 20 mm less the rest's 0.4."""
    model, per_mm = opening_model(), np.sqrt(N_GAPS)
    values = np.array([[0.4 * per_mm, 2.0], [9.6 * per_mm, 2.0]], np.float32)
    mapped = build_parameter_transfer(model, replace(model, spread=np.full(2, 100, np.float32)), gain=2).parameters(
        values
    )
    assert gaps_of(model, mapped)[:, 0] == pytest.approx([0.8, 19.6], abs=1e-3)
    assert mapped[:, 1] == pytest.approx([4.0, 4.0], abs=1e-5)


@some
@given(seeds)
def test_differences_of_frames_do_not_grow(seed: int) -> None:
    """The nearest point of a convex set: limits and lip constraints do not add jerk."""
    rng = np.random.default_rng(seed)
    model = opening_model()
    before = rng.normal(size=(30, 2)).astype(np.float32) * 25
    mapped = build_parameter_transfer(model, model).parameters(before)
    assert (
        np.linalg.norm(np.diff(mapped, axis=0), axis=1) <= np.linalg.norm(np.diff(before, axis=0), axis=1) + 1e-4
    ).all()
    assert gaps_of(model, mapped).min() >= 0


def test_unsatisfiable_lip_gaps_are_refused() -> None:
    with pytest.raises(DataError, match="no parameters within the target"):
        nearest_valid_parameters(np.zeros((1, 1)), np.ones(1), np.array([[1.0, -2.0]]), np.full((1, 1), 9.0))
