"""Brows and wide eyes from landmarks, where the scores of a tracker do not follow the picture.

Measures are the displacements from rest of small groups of landmarks, x and y, over the distance of the outer corners
of the eyes; weights are linear in them. `tests/bench/bench_upper_face.py` learns the table from drawn faces.
"""

import csv
from functools import cache
from importlib.resources import files
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray

TABLE = "upper_face.tsv"
# Groups of landmarks by place; Left and Right are the person's.
GROUPS = MappingProxyType({
    "browInnerLeft": (285, 336), "browInnerRight": (55, 107), "browMiddleLeft": (296, 295, 334, 282),
    "browMiddleRight": (66, 65, 105, 52), "browOuterLeft": (276, 300, 283, 293), "browOuterRight": (46, 70, 53, 63),
    "eyeOuterLeft": (263,), "eyeOuterRight": (33,), "eyeInnerLeft": (362,), "eyeInnerRight": (133,),
    "lidUpperLeft": (386, 385, 387), "lidUpperRight": (159, 158, 160), "lidLowerLeft": (374, 373, 380),
    "lidLowerRight": (145, 144, 153), "templeLeft": (356, 454), "templeRight": (127, 234),
    "wingLeft": (278, 294), "wingRight": (48, 64), "cheekLeft": (425, 280), "cheekRight": (205, 50),
    "bridge": (168, 6, 197), "nose": (4, 1, 5),
})  # fmt: skip
MEASURES = tuple(f"{name}.{axis}" for axis in "xy" for name in GROUPS)
READ_SHAPES = (
    "browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight", "eyeWideLeft",
    "eyeWideRight",
)  # fmt: skip
EYE_CORNERS = (33, 263)  # outer ones


def upper_face_measures(landmarks: NDArray[np.floating], rest: NDArray[np.floating]) -> FloatArray:
    """(T, M) `MEASURES` of landmarks (T, 478, 3) without head pose; `rest` (478, 3) is the same face at rest."""
    size = np.linalg.norm(rest[EYE_CORNERS[0]] - rest[EYE_CORNERS[1]])
    moved = (np.asarray(landmarks, np.float64) - rest) / size
    return np.column_stack([moved[:, list(group), axis].mean(axis=1) for axis in (0, 1) for group in GROUPS.values()])


def read_upper_face(landmarks: NDArray[np.floating], rest: NDArray[np.floating]) -> FloatArray:
    """(T, R) weights of `READ_SHAPES`, at least 0, of landmarks as `upper_face_measures` takes them."""
    return np.maximum(upper_face_measures(landmarks, rest) @ _table(), 0.0)


@cache
def _table() -> FloatArray:
    """(M, R) weights of the measures."""
    text = files("tts2face.lips").joinpath(TABLE).read_text("utf-8")
    heading, *rows = csv.reader(text.splitlines(), delimiter="\t")
    if tuple(heading[1:]) != READ_SHAPES or tuple(row[0] for row in rows) != MEASURES:
        columns = ", ".join(READ_SHAPES)
        raise DataError(f"{TABLE} must have the columns {columns} and a row for each measure; make it again")
    found = np.array([[float(cell) for cell in row[1:]] for row in rows])
    found.setflags(write=False)
    return found
