"""Basis expressions B_i of a face, from an editable table (expressions.tsv).

Ju and Lee 2008, sections 5 and 7: expressions are designed on each synthetic face, over the whole face
and with closed lips; faces share the weights.
"""

import csv
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from lexicon.errors import DataError
from tts2face.face.eyelids import BLINK_SHAPES, WIDE_SHAPES, build_eyelid_model
from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.face.lip_constraints import LipConstraints, build_lip_constraints
from tts2face.face.shape_transfer import add_missing_shapes
from tts2face.models.face import Face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.models.palette import EXPRESSIONS
from tts2face.numeric.arrays import FloatArray

EXPRESSION_TABLE = "expressions.tsv"
# Shapes with which a character shows one of `EXPRESSIONS` itself, as those of VRM do.
OWN_EXPRESSIONS = {name: f"expression{name.capitalize()}" for name in EXPRESSIONS}
BOTH_SIDES = "*"  # suffix of a name: both the left and the right shape
GAZE_SHAPES = tuple(
    f"eyeLook{direction}{side}" for direction in ("Up", "Down", "In", "Out") for side in ("Left", "Right")
)


@cache
def expression_table() -> Mapping[str, tuple[float, ...]]:
    """Weight of each ARKit shape in each of `EXPRESSIONS`.

    Raises
    ------
    DataError
        The columns of the table are not `EXPRESSIONS`, or a cell is not a number.
    """
    rows = list(
        csv.reader(files("tts2face.face").joinpath(EXPRESSION_TABLE).read_text("utf-8").splitlines(), delimiter="\t")
    )
    if tuple(rows[0][1:]) != EXPRESSIONS:
        raise DataError(
            f"{EXPRESSION_TABLE} must have the columns {', '.join(EXPRESSIONS)}, not {', '.join(rows[0][1:])}; "
            "correct its first row"
        )
    table: dict[str, tuple[float, ...]] = {}
    for name, *cells in rows[1:]:
        try:
            weights = tuple(float(cell or 0.0) for cell in cells)
        except ValueError as error:
            raise DataError(
                f"the row {name} of {EXPRESSION_TABLE} has a cell that is not a number: {error}; correct the table"
            ) from error
        sides = ("Left", "Right") if name.endswith(BOTH_SIDES) else ("",)
        table |= {name.removesuffix(BOTH_SIDES) + side: weights for side in sides}
    return table


def add_expression_shapes(face: Face) -> Face:
    """Face with all shapes of expressions, lids and gaze; missing ones are transferred from the default head."""
    return add_missing_shapes(face, (*expression_table(), *BLINK_SHAPES, *WIDE_SHAPES, *GAZE_SHAPES))


def expression_weights(face: Face, mouth: LipConstraints) -> FloatArray:
    """Shape weights (5, K) of `EXPRESSIONS` on a face of `add_expression_shapes`; closed lips stay closed.

    A character's own shape of an expression (`OWN_EXPRESSIONS`) takes the place of those of the table.
    """
    table = expression_table()
    none = (0.0,) * len(EXPRESSIONS)
    designed = np.array([table.get(name, none) for name in face.shape_names]).T
    for row, own in enumerate(OWN_EXPRESSIONS.values()):
        if own in face.shape_names:
            designed[row] = np.array(face.shape_names) == own
    weights = mouth.combine(np.zeros_like(designed), designed)
    return build_eyelid_model(face).close(weights, np.zeros((len(weights), 2)))


def expression_landmarks(face: Face) -> FloatArray:
    """Landmark motion (5, 478, 3) of each of `EXPRESSIONS`, mm; 0 for irises and missing landmarks.

    Raises
    ------
    DataError
        The face lacks the landmarks of lips or lids.
    """
    complete_face = add_expression_shapes(face)
    weights = expression_weights(complete_face, build_lip_constraints(complete_face))
    motion = scatter_landmarks(complete_face, landmark_motion(complete_face, np.arange(len(complete_face.shape_names))))
    moved: FloatArray = np.nan_to_num(np.einsum("lck,ek->elc", motion, weights))
    moved[:, N_MESH_LANDMARKS:] = 0.0
    return moved
