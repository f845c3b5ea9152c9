"""Lips that do not cross: the nearest parameters of a shape model whose facing inner lip points are apart."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.talker import ShapeModel

FloatArray = NDArray[np.float64]

UPPER, LOWER = list(INNER_LIP_UPPER[1:-1]), list(INNER_LIP_LOWER[1:-1])  # at the corners both lips are one point
LEAST_GAP_MM = 0.01  # so that lips stay apart when parameters are rounded for a talker file


def facing_gaps(model: ShapeModel) -> FloatArray:
    """(P, M + 1) what facing inner lip points are apart over what they must be, as a linear function of parameters.

    They must be `LEAST_GAP_MM` apart, or as near as they are at rest: tracked lips at rest may overlap a little, and a
    talker at rest is right by definition.
    """
    per_mode = (model.basis[:, UPPER, 1] - model.basis[:, LOWER, 1]).astype(np.float64).T
    mean = (model.mean[UPPER, 1] - model.mean[LOWER, 1]).astype(np.float64)
    at_rest = mean + np.einsum("pm,m->p", per_mode, model.rest.astype(np.float64))
    return np.column_stack([per_mode, mean - np.minimum(LEAST_GAP_MM, at_rest)])


def apart(wanted: FloatArray, limits: FloatArray, gaps: FloatArray) -> FloatArray:
    """(T, M) parameters nearest to `wanted` within limits and with no gap below 0.

    Parameters
    ----------
    wanted : (T, M)
    limits : (M,)
        Largest size of each parameter.
    gaps : (P, M + 1)
        As `facing_gaps` gives them.

    Raises
    ------
    DataError
        No parameters within the limits keep the lips apart.

    Notes
    -----
    The basis is orthonormal: the nearest parameters move the landmarks least. The allowed set is convex, so that two
    frames never come further apart than they were. Least distance programming by non-negative least squares, exact up
    to rounding. Source: Lawson and Hanson 1974, "Solving least squares problems", chapter 23.
    """
    from scipy.optimize import nnls

    n_modes = len(limits)
    sides = np.concatenate([gaps[:, :-1], np.eye(n_modes), -np.eye(n_modes)])
    only = np.zeros(n_modes + 1)
    only[-1] = 1.0
    found = np.zeros_like(wanted)
    for frame, start in enumerate(wanted):
        short = -np.concatenate([gaps[:, :-1] @ start + gaps[:, -1], start + limits, limits - start])
        system = np.vstack([sides.T, short])
        forces, left_over = nnls(system, only)
        if left_over < 1e-9:
            raise DataError("the target's lips cross wherever its limits let it go; build the talker again")
        residual = system @ forces - only
        found[frame] = start - residual[:-1] / residual[-1]
    return found
