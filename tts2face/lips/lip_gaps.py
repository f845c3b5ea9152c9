"""Lip gaps of a shape model, and the nearest parameters whose gaps lie within limits: no crossing, kept contact."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, inner_lip_gaps
from tts2face.models.talker import ShapeModel
from tts2face.numeric.arrays import FloatArray

MIN_LIP_GAP_MM = 0.01  # margin for the rounding of parameters in a talker file
WITHOUT_CORNERS = slice(1, -1)  # of the inner lip points; at the corners both lips share one point
CONTACT_SHARE = 0.01  # tracked gap of touching lips, relative to the distance of the outer eye corners
UNBOUNDED_MM = 1e3  # a gap limit without effect
MAX_GAP_SLOPE = 10.0  # largest ratio of target to source gap growth beyond contact; 1 mm beyond, it has no effect


def facing_gaps(model: ShapeModel) -> FloatArray:
    """Gaps (P, M + 1) of facing inner lip points, mm: ``gaps[:, :M] @ parameters + gaps[:, M]``."""
    per_mode, mean = (inner_lip_gaps(part)[..., WITHOUT_CORNERS] for part in (model.basis, model.mean))
    return np.column_stack([per_mode.T, mean])


def rest_with_open_lips(model: ShapeModel, limits: NDArray[np.floating]) -> FloatArray:
    """Parameters (M,) at rest; if tracked lips overlap there, by up to .1 mm, the nearest ones without overlap."""
    gaps, rest = facing_gaps(model), model.rest.astype(np.float64)
    if (np.einsum("pm,m->p", gaps[:, :-1], rest) + gaps[:, -1] >= MIN_LIP_GAP_MM).all():
        return rest
    any_gap = np.full((1, len(gaps)), UNBOUNDED_MM)
    parted: FloatArray = nearest_valid_parameters(rest[None], limits.astype(np.float64), gaps, any_gap)[0]
    return parted


def contact_mm(model: ShapeModel) -> float:
    """Gap up to which the model's tracked lips touch, mm."""
    return CONTACT_SHARE * float(np.linalg.norm(model.mean[EYE_OUTER_LEFT] - model.mean[EYE_OUTER_RIGHT]))


def gap_limits(source_gaps: FloatArray, contact: float, at_rest: FloatArray) -> FloatArray:
    """Upper limits (T, P) of the gaps for source gaps (T, P) at the same scale, mm.

    Where the source's lips touch (gap up to `contact`), the limit is the source's gap, or the gap `at_rest` if larger.
    """
    return np.maximum(source_gaps + MAX_GAP_SLOPE * np.maximum(source_gaps - contact, 0.0), at_rest)


def nearest_valid_parameters(target: FloatArray, limits: FloatArray, gaps: FloatArray, most: FloatArray) -> FloatArray:
    """Parameters (T, M) nearest to `target` within limits on parameters and lip gaps.

    Parameters
    ----------
    target : (T, M)
        Target parameters.
    limits : (M,)
        Largest magnitude of each parameter.
    gaps : (P, M + 1)
        As `facing_gaps` returns them.
    most : (T, P)
        Upper limits of the gaps of each frame, mm; the lower limit is `MIN_LIP_GAP_MM`.

    Raises
    ------
    DataError
        No parameters within the limits satisfy the gap limits.

    Notes
    -----
    The basis is orthonormal, so the nearest parameters are the nearest shape. Least distance programming by
    non-negative least squares, exact up to rounding. Source: Lawson and Hanson 1974, "Solving least squares problems",
    chapter 23.
    """
    # imported here: clips of text need no SciPy (decision 200)
    from scipy.optimize import nnls

    n_modes = len(limits)
    pairs, unit = gaps[:, :-1], np.eye(n_modes)
    sides = np.concatenate([pairs, -pairs, unit, -unit])
    unit_target = np.zeros(n_modes + 1)
    unit_target[-1] = 1.0
    parameters = np.zeros_like(target)
    for frame, start in enumerate(target):
        start_gaps = pairs @ start + gaps[:, -1]
        short = -np.concatenate([start_gaps - MIN_LIP_GAP_MM, most[frame] - start_gaps, start + limits, limits - start])
        system = np.vstack([sides.T, short])
        multipliers, residual_norm = nnls(system, unit_target)
        if residual_norm < 1e-9:
            raise DataError(
                "no parameters within the target's limits keep its lips from overlapping; "
                "build the target talker from more recordings"
            )
        residual = system @ multipliers - unit_target
        parameters[frame] = start - residual[:-1] / residual[-1]
    return parameters
