"""Basis expressions against a face's own rest: drawn lips may smile at rest, and drawn brows be far from large eyes.

`mood_targets.tsv` states what a viewer sees of an expression, in shares of the face. The weights of some shapes, its
levers, are solved for it on the face's landmarks, nearest to those of `expressions.tsv`.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.expressions import BOTH_SIDES, OWN_EXPRESSIONS, expression_weights
from tts2face.face.eyelids import LID_LANDMARK_PAIRS, SIDES, build_eyelid_model
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import CORNER_SHAPE, LipConstraints
from tts2face.face.mouth import CHIN_LANDMARKS
from tts2face.face.shape_transfer import append_shapes, eye_distance, spread_landmark_motion
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    LIP_LANDMARKS,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.palette import EXPRESSIONS
from tts2face.numeric.arrays import FloatArray, ordered_product
from tts2face.numeric.least_squares import bounded_least_squares

TARGET_TABLE = "mood_targets.tsv"
CORNERS, MIDDLE = (MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT), (UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID)
BROW_ENDS = {"brows_inner": ((285, 336), (55, 107)), "brows_outer": ((276, 300), (46, 70))}  # left, right
MEASURES = ("corners", "corners_risen", "wider", *BROW_ENDS, "eyes")
CHANGE_COST = 1e-4  # of a weight's change by 1 from the table: as much as an error of .01 in a target
CORNER_DROP = 0.15  # drop of the corners at weight 1 of `CORNER_SHAPE`, of the mouth's width
NOSE_BASE = (2, 97, 326)  # above the lips; stays still, as the chin


@dataclass(frozen=True, slots=True)
class MoodTarget:
    """Shapes that reach one of `MEASURES`, and its value at weight 1 of each of `EXPRESSIONS`; None is free."""

    levers: frozenset[str]
    values: tuple[float | None, ...]


@cache
def mood_targets() -> Mapping[str, MoodTarget]:
    """Targets by measure."""
    lines = files("tts2face.face").joinpath(TARGET_TABLE).read_text("utf-8").splitlines()
    heading, *rows = csv.reader((line for line in lines if not line.startswith("#")), delimiter="\t")
    if tuple(heading[2:]) != EXPRESSIONS or tuple(row[0] for row in rows) != MEASURES:
        raise DataError(f"{TARGET_TABLE} must have the columns {', '.join(EXPRESSIONS)} and rows {', '.join(MEASURES)}")
    try:
        return {
            name: MoodTarget(_both_sides(levers), tuple(float(cell) if cell else None for cell in cells))
            for name, levers, *cells in rows
        }
    except ValueError as error:
        raise DataError(f"a cell of {TARGET_TABLE} is not a number: {error}; correct the table") from error


def _both_sides(names: str) -> frozenset[str]:
    sides = {True: SIDES, False: ("",)}
    return frozenset(
        name.removesuffix(BOTH_SIDES) + side for name in names.split() for side in sides[name.endswith(BOTH_SIDES)]
    )


def mood_measures(face: Face) -> Mapping[str, FloatArray]:
    """Each of `MEASURES` that the landmarks allow, left and right: (2, 1 + K), at rest and change per weight."""
    places = scatter_landmarks(face, landmark_positions(face))
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))
    across, high = (np.column_stack([places[:, axis], motion[:, axis]]) for axis in (0, 1))
    width, eyes = across[MOUTH_CORNER_LEFT, 0] - across[MOUTH_CORNER_RIGHT, 0], eye_distance(face)
    corners = (high[list(CORNERS)] - high[list(MIDDLE)].mean(axis=0)) / width
    opening = np.stack([(high[list(up)] - high[list(low)]).mean(axis=0) for up, low in LID_LANDMARK_PAIRS])
    risen = {"corners_risen": corners, "eyes": opening / opening[:, :1]}
    # both halves of a mouth: a head that stands aside is no wider
    risen["wider"] = np.tile((across[MOUTH_CORNER_LEFT] - across[MOUTH_CORNER_RIGHT]) / width, (2, 1))
    risen |= {name: np.stack([high[list(end)].mean(axis=0) for end in ends]) / eyes for name, ends in BROW_ENDS.items()}
    found = {"corners": corners}
    found |= {name: np.column_stack([np.zeros(2), values[:, 1:]]) for name, values in risen.items()}
    return {name: values for name, values in found.items() if np.isfinite(values).all()}


def with_corner_shape(face: Face) -> Face:
    """Face with `CORNER_SHAPE`, which bends both lips alike about their middle, so that shut lips stay shut.

    Shapes of faces frown too little for lips that smile at rest, and part them beside the middle.
    """
    lips = np.unique(LIP_LANDMARKS)
    places = scatter_landmarks(face, landmark_positions(face))
    width = places[MOUTH_CORNER_LEFT, 0] - places[MOUTH_CORNER_RIGHT, 0]
    across = 2.0 * (places[:, 0] - places[list(CORNERS), 0].mean()) / width  # -1 to 1 between the corners
    motion = np.zeros((1, len(lips), 3))
    motion[0, :, 1] = -CORNER_DROP * width * np.square(across[lips])
    moved = spread_landmark_motion(face, lips, motion, (*NOSE_BASE, *CHIN_LANDMARKS))
    return append_shapes(face, (CORNER_SHAPE,), moved, np.array([[-1.0, 1.0]]))


def mood_weights(face: Face, mouth: LipConstraints) -> FloatArray:
    """Shape weights (5, K) of `EXPRESSIONS` against the rest of a face of `with_corner_shape`; closed lips stay closed.

    An expression for which a character has its own shape is as the character has it.
    """
    weights, measures = expression_weights(face, mouth), mood_measures(face)
    rows = [row for row, own in enumerate(OWN_EXPRESSIONS.values()) if own not in face.shape_names]
    bends = np.array([name == CORNER_SHAPE for name in face.shape_names])
    for allowed in (~bends, bends):  # the corners last, since shutting the lips moves them
        for row in rows:
            weights[row] = _towards_targets(face, weights[row], row, measures, allowed)
        weights = mouth.combine(np.zeros_like(weights), weights)
    return build_eyelid_model(face).close(weights, np.zeros((len(weights), 2)))


def _towards_targets(
    face: Face, weights: FloatArray, row: int, measures: Mapping[str, FloatArray], allowed: NDArray[np.bool_]
) -> FloatArray:
    """Weights (K,) of one expression; levers among `allowed` (K,) reach the targets as far as their limits let them."""
    goals = [(goal, measures[name], goal.values[row]) for name, goal in mood_targets().items() if name in measures]
    names = {lever for goal, _, wanted in goals if wanted is not None for lever in goal.levers}
    levers = np.flatnonzero(np.isin(face.shape_names, list(names)) & allowed)
    served = [(values, wanted) for _, values, wanted in goals if wanted is not None and values[:, 1 + levers].any()]
    found = weights.copy()
    if not served:
        return found
    change = np.concatenate([values[:, 1:] for values, _ in served])
    missing = np.concatenate([wanted - values[:, 0] for values, wanted in served]) - ordered_product(change, weights)
    here = change[:, levers]
    curvature = ordered_product(here.T, here) + CHANGE_COST * np.eye(len(levers))
    limits = face.limits[levers].astype(np.float64) - weights[levers, None]
    found[levers] += bounded_least_squares(curvature, ordered_product(here.T, missing)[None], limits)[0]
    return found
