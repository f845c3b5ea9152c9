"""Lips that neither cross nor miss each other: the nearest parameters of a shape model with the wanted lip gaps."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.models.talker import ShapeModel

FloatArray = NDArray[np.float64]

INNER_UPPER_LIP, INNER_LOWER_LIP = (
    list(INNER_LIP_UPPER[1:-1]),
    list(INNER_LIP_LOWER[1:-1]),
)  # at the corners both lips are one point
MIN_LIP_GAP_MM = 0.01  # so that lips stay apart when parameters are rounded for a talker file
CONTACT_SHARE = 0.01  # of the distance of the outer eye corners: tracked lips that touch are up to so far apart
UNBOUNDED_MM = 1e3  # no lips are so far apart
MAX_GAP_SLOPE = 10.0  # how much faster than the source's the gap may open beyond contact: 1 mm on, nothing is held back


def facing_gaps(model: ShapeModel) -> FloatArray:
    """(P, M + 1) heights of facing inner lip points over each other: ``gaps[:, :M] @ parameters + gaps[:, M]``, mm."""
    per_mode = (model.basis[:, INNER_UPPER_LIP, 1] - model.basis[:, INNER_LOWER_LIP, 1]).astype(np.float64).T
    return np.column_stack(
        [per_mode, (model.mean[INNER_UPPER_LIP, 1] - model.mean[INNER_LOWER_LIP, 1]).astype(np.float64)]
    )


def rest_with_open_lips(model: ShapeModel, limits: NDArray[np.floating]) -> FloatArray:
    """(M,) parameters at rest; where tracked lips overlap there, as they may by some 0.1 mm, the nearest that do not.

    Raises
    ------
    DataError
        The lips overlap wherever the limits let them go.
    """
    gaps, rest = facing_gaps(model), model.rest.astype(np.float64)
    if (np.einsum("pm,m->p", gaps[:, :-1], rest) + gaps[:, -1] >= MIN_LIP_GAP_MM).all():
        return rest
    any_gap = np.full((1, len(gaps)), UNBOUNDED_MM)
    parted: FloatArray = nearest_valid_parameters(rest[None], limits.astype(np.float64), gaps, any_gap)[0]
    return parted


def contact_mm(model: ShapeModel) -> float:
    """Gap up to which the model's tracked lips touch, mm."""
    return CONTACT_SHARE * float(np.linalg.norm(model.mean[EYE_OUTER_LEFT] - model.mean[EYE_OUTER_RIGHT]))


def gap_limits(seen: FloatArray, contact: float, at_rest: FloatArray) -> FloatArray:
    """(T, P) gaps that may not be exceeded, for the gaps (T, P) of a source brought to the same size.

    Lips that touch on the source, which is up to `contact` apart, are no further apart, or as at rest.
    """
    return np.maximum(seen + MAX_GAP_SLOPE * np.maximum(seen - contact, 0.0), at_rest)


def nearest_valid_parameters(wanted: FloatArray, limits: FloatArray, gaps: FloatArray, most: FloatArray) -> FloatArray:
    """(T, M) parameters nearest to `wanted` within limits, with lips that do not cross and are not too far apart.

    Parameters
    ----------
    wanted : (T, M)
    limits : (M,)
        Largest size of each parameter.
    gaps : (P, M + 1)
        As `facing_gaps` gives them.
    most : (T, P)
        Each frame's largest gaps; the least is `MIN_LIP_GAP_MM`.

    Raises
    ------
    DataError
        No parameters within the limits have such gaps.

    Notes
    -----
    The basis is orthonormal: the nearest parameters move the landmarks least. Least distance programming by
    non-negative least squares, exact up to rounding. Source: Lawson and Hanson 1974, "Solving least squares problems",
    chapter 23.
    """
    from scipy.optimize import nnls

    n_modes = len(limits)
    pairs, unit = gaps[:, :-1], np.eye(n_modes)
    sides = np.concatenate([pairs, -pairs, unit, -unit])
    only = np.zeros(n_modes + 1)
    only[-1] = 1.0
    found = np.zeros_like(wanted)
    for frame, start in enumerate(wanted):
        here = pairs @ start + gaps[:, -1]
        short = -np.concatenate([here - MIN_LIP_GAP_MM, most[frame] - here, start + limits, limits - start])
        system = np.vstack([sides.T, short])
        forces, left_over = nnls(system, only)
        if left_over < 1e-9:
            raise DataError("the target's lips cannot be as they must within its limits; build the talker again")
        residual = system @ forces - only
        found[frame] = start - residual[:-1] / residual[-1]
    return found
