"""The basis expressions B_i of a face, from a table that an animator can correct (expressions.tsv).

Ju and Lee 2008, sections 5 and 7: expressions are designed on each synthetic face, over the whole of it and with closed
lips; weights are what faces share.
"""

import csv
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.eyelids import BLINK_SHAPES, WIDE_SHAPES, build_eyelid_model
from tts2face.face.landmark_fit import N_SKIN, landmark_motion, scatter_landmarks
from tts2face.face.lip_constraints import LipConstraints, build_lip_constraints
from tts2face.face.shape_transfer import add_missing_shapes
from tts2face.models.face import Face
from tts2face.models.palette import EXPRESSIONS

EXPRESSION_TABLE = "expressions.tsv"
BOTH_SIDES = "*"  # at the end of a name: this shape of the left and of the right
GAZE_SHAPES = tuple(f"eyeLook{way}{side}" for way in ("Up", "Down", "In", "Out") for side in ("Left", "Right"))

FloatArray = NDArray[np.float64]


@cache
def expression_table() -> Mapping[str, tuple[float, ...]]:
    """Weight of each ARKit shape in each of `EXPRESSIONS`.

    Raises
    ------
    DataError
        The table is not as it should be.
    """
    rows = list(
        csv.reader(files("tts2face.face").joinpath(EXPRESSION_TABLE).read_text("utf-8").splitlines(), delimiter="\t")
    )
    if tuple(rows[0][1:]) != EXPRESSIONS:
        raise DataError(
            f"{EXPRESSION_TABLE} must have the columns {', '.join(EXPRESSIONS)}, not {', '.join(rows[0][1:])}"
        )
    table: dict[str, tuple[float, ...]] = {}
    for name, *cells in rows[1:]:
        try:
            weights = tuple(float(cell or 0.0) for cell in cells)
        except ValueError as broken:
            raise DataError(
                f"{EXPRESSION_TABLE} holds something that is no weight in the row {name}: {broken}"
            ) from broken
        sides = ("Left", "Right") if name.endswith(BOTH_SIDES) else ("",)
        table |= {name.removesuffix(BOTH_SIDES) + side: weights for side in sides}
    return table


def add_expression_shapes(face: Face) -> Face:
    """A face with every shape of expressions, lids and gaze: those that it lacks are carried from the default head."""
    return add_missing_shapes(face, (*expression_table(), *BLINK_SHAPES, *WIDE_SHAPES, *GAZE_SHAPES))


def expression_weights(face: Face, mouth: LipConstraints) -> FloatArray:
    """(5, K) weights of `EXPRESSIONS` on a face of `add_expression_shapes`; closed lips stay closed."""
    table = expression_table()
    none = (0.0,) * len(EXPRESSIONS)
    drawn = np.array([table.get(name, none) for name in face.shape_names]).T
    held = mouth.held(np.zeros_like(drawn), drawn)
    return build_eyelid_model(face).close(held, np.zeros((len(held), 2)))


def expression_landmarks(face: Face) -> FloatArray:
    """(5, 478, 3) motion of the landmarks in each of `EXPRESSIONS`, mm; 0 for the irises and landmarks that it lacks.

    Raises
    ------
    DataError
        The face lacks the landmarks of lips or lids.
    """
    whole = add_expression_shapes(face)
    weights = expression_weights(whole, build_lip_constraints(whole))
    motion = scatter_landmarks(whole, landmark_motion(whole, np.arange(len(whole.shape_names))))
    moved: FloatArray = np.nan_to_num(np.einsum("lck,ek->elc", motion, weights))
    moved[:, N_SKIN:] = 0.0
    return moved
