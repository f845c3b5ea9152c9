"""Lips and jaw that give way to the tongue: without it ``tongueOut`` pushes the tip through lips that are shut."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.mouth_light import part_vertices
from tts2face.models.face import Face
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.models.shape_coding import pack_shapes
from tts2face.numeric.arrays import Float32Array
from tts2face.storage.tensors import read_tensors, write_tensors

TONGUE_OUT = "tongueOut"
GIVES_WAY = "tongue_out_parts_lips"  # in the metadata of a face whose shape has been changed
LOWER_LIP, UPPER_LIP = 0.35, 0.15  # weights of `mouthLowerDown` and `mouthUpperUp` in the shape
JAW_LIMITS = (0.05, 0.4)  # of the weight of `jawOpen` in it
MIDDLE_MM = 7.0  # half the breadth of the tongue and of the lip that are compared
TIP_MM = 8.0  # length of the tip
ROOM_MM = 0.6  # between tongue and teeth, and between tongue and lip


def give_way(face: Face) -> Face:
    """A face whose ``tongueOut`` opens the mouth by the height of the tip, which lies on the lower lip; once."""
    if face.metadata.get(GIVES_WAY) or TONGUE_OUT not in face.shape_names:
        return face
    at = face.shape_names.index(TONGUE_OUT)
    shapes = face.shapes.copy()
    shapes[at] = parted_shape(face)
    return replace(face, shapes=shapes, metadata={**face.metadata, GIVES_WAY: True})


def parted_shape(face: Face) -> Float32Array:
    """(V, 3) displacement of ``tongueOut`` with lips that give way, mm."""
    named = dict(zip(face.shape_names, face.shapes, strict=True))
    tongue, teeth = (part_vertices(face, (name,)) for name in ("tongue", "teeth_upper"))
    own = named[TONGUE_OUT]
    lips = sum(
        weight * named[f"{name}{side}"]
        for name, weight in (("mouthLowerDown", LOWER_LIP), ("mouthUpperUp", UPPER_LIP))
        for side in ("Left", "Right")
    )
    tip = tongue[face.vertices[tongue, 2] > face.vertices[tongue, 2].max() - TIP_MM]
    thick = float(np.ptp(face.vertices[tip, 1]))
    edge = float(face.vertices[_middle(face, teeth), 1].min())
    lower = _landmark(face, face.vertices, LOWER_LIP_INNER_MID) + _landmark(face, lips, LOWER_LIP_INNER_MID)
    jaw = named["jawOpen"]
    drop = -float(_landmark(face, jaw, LOWER_LIP_INNER_MID)[1])
    weight = float(np.clip((lower[1] - edge + thick + 2 * ROOM_MM) / drop, *JAW_LIMITS))
    shape = own + lips + weight * jaw
    share = np.linalg.norm(own[tongue], axis=1) / np.linalg.norm(own[tongue], axis=1).max()
    for _ in range(2):  # the tip that rises lies over another place of the lip
        points = face.vertices + shape
        before = _middle(face, tongue)
        before = before[points[before, 2] > _landmark(face, points, UPPER_LIP_INNER_MID)[2] - TIP_MM]
        lip = float(_landmark(face, points, LOWER_LIP_INNER_MID)[1])
        shape[tongue, 1] += max(lip + ROOM_MM - float(points[before, 1].min()), 0.0) * share
    made: Float32Array = shape.astype(np.float32)
    return made


def _middle(face: Face, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    near: NDArray[np.int64] = rows[np.abs(face.vertices[rows, 0]) < MIDDLE_MM]
    return near


def _landmark(face: Face, values: Float32Array, number: int) -> Float32Array:
    """(3,) of a landmark, of values (V, 3)."""
    row = int(np.flatnonzero(face.landmarks == number)[0])
    there: Float32Array = face.landmark_weights[row] @ values[face.landmark_vertices[row]]
    return there


def refresh_tongue(path: Path) -> None:
    """Change ``tongueOut`` in a face's file once; the rest of it stays."""
    face = read_face(path)
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    if header["metadata"].get(GIVES_WAY):
        return
    at = header["shape_names"].index(TONGUE_OUT)
    counts = arrays["shape_counts"]
    first = int(counts[:at].sum())
    span = slice(first, first + int(counts[at]))
    made = pack_shapes([parted_shape(face)], float(arrays["shape_steps"].min()))
    for name in ("shape_deltas", "shape_vertices"):
        arrays[name] = np.concatenate([arrays[name][: span.start], made[name], arrays[name][span.stop :]])
    for name in ("shape_counts", "shape_steps"):
        arrays[name] = np.concatenate([arrays[name][:at], made[name], arrays[name][at + 1 :]])
    header["metadata"] = header["metadata"] | {GIVES_WAY: True}
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)
