"""Adaptation of the default head to a talker: vertices, eyes, teeth and all shapes."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.mesh_fit import HeadWarp, eyes_from_right, fit_head_warp, part_vertices
from tts2face.models.face import Eye, Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray
from tts2face.processes.threads import available_cores
from tts2face.video.pose import similarity_transforms

RIGID_MOUTH_PARTS = ("teeth", "gums", "tongue")  # moved and scaled as a unit, never deformed
EYE_PARTS = ("sclera", "iris")
MIN_SHAPE_MOTION_MM = 1e-4  # smaller displacements of a shape are ignored


def adapt_head(face: Face, talker: NDArray[np.floating]) -> Face:
    """The default head with the shape of a talker.

    Parameters
    ----------
    face
        A head with jawOpen, all landmarks, and two eyes.
    talker : (478, 3)
        Mean landmarks of the talker at rest, lips closed, axes as in `tts2face.models.landmarks`; of any size.
    """
    warp = fit_head_warp(face, talker)
    rest = face.vertices.astype(np.float64)
    bone, balls = part_vertices(face, RIGID_MOUTH_PARTS), part_vertices(face, EYE_PARTS)
    soft = np.setdiff1d(np.arange(len(rest)), np.concatenate([bone, balls]))
    moved = rest.copy()
    moved[soft] = warp.apply(rest[soft], soft)
    linear, shift = _fit_similarity(rest[bone], rest[bone] + warp.field(rest[bone]))
    shift[2] += _lip_protrusion(warp) - (rest[bone] @ linear.T + shift - rest[bone])[:, 2].max()
    moved[bone] = rest[bone] @ linear.T + shift
    eyes = _place_eyes(face, warp, rest, moved)
    shapes = _warp_shapes(face, warp, soft, moved)
    shapes[:, bone] = face.shapes[:, bone] @ linear.T
    for eye, socket in zip(eyes_from_right(face), warp.sockets, strict=True):
        span = slice(eye.first, eye.first + eye.count)
        shapes[:, span] = socket.scale * face.shapes[:, span]  # an eyeball recedes under a closing lid
    origin = np.mean([eye.centre for eye in eyes], axis=0)
    turning = _warp_pivot(face, warp)
    return replace(
        face,
        vertices=(moved - origin).astype(np.float32),
        shapes=shapes.astype(np.float32),
        eyes=tuple(replace(eye, centre=(eye.centre - origin).astype(np.float32)) for eye in eyes),
        pivot=(turning - origin).astype(np.float32),
    )


def _fit_similarity(before: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scaled rotation (3, 3) and shift (3,) nearest to a motion of points (P, 3)."""
    turns, scales = similarity_transforms(before[None], after, np.full(len(before), 1.0 / len(before)))
    linear = scales[0] * turns[0]
    return linear, after.mean(axis=0) - linear @ before.mean(axis=0)


def _lip_protrusion(warp: HeadWarp) -> float:
    """Forward shift of the lips in mm, which teeth and tongue follow."""
    lips = np.isin(warp.landmarks, (*INNER_LIP_UPPER, *INNER_LIP_LOWER))
    centres = warp.field.centres[lips]
    return float(warp.field(centres)[:, 2].mean())


def _place_eyes(face: Face, warp: HeadWarp, rest: FloatArray, moved: FloatArray) -> list[Eye]:
    """The eyes in their new sockets; writes their vertices into `moved`."""
    places = {}
    for eye, socket in zip(eyes_from_right(face), warp.sockets, strict=True):
        span = slice(eye.first, eye.first + eye.count)
        moved[span] = socket.after + socket.scale * (rest[span] - socket.before)
        places[eye.first] = socket.after
    return [replace(eye, centre=places[eye.first].astype(np.float32)) for eye in face.eyes]


def _warp_shapes(face: Face, warp: HeadWarp, soft: NDArray[np.int64], moved: FloatArray) -> FloatArray:
    """(K, V, 3) shapes: the warped position of a displaced vertex minus its warped position at rest.

    mouthClose is warped relative to the open jaw, which it closes.
    """
    shapes = np.zeros(face.shapes.shape)
    rest = face.vertices.astype(np.float64)
    jaw = face.shapes[face.shape_names.index("jawOpen")].astype(np.float64)

    def write(number: int) -> None:
        shape = face.shapes[number].astype(np.float64)
        rows = soft[np.abs(shape[soft]).max(axis=1) > MIN_SHAPE_MOTION_MM]
        # ARKit defines it on the open jaw: lips that meet while it is open
        if face.shape_names[number] == "mouthClose":
            before = rest[rows] + jaw[rows]
            shapes[number, rows] = warp.apply(before + shape[rows], rows) - warp.apply(before, rows)
        else:
            shapes[number, rows] = warp.apply(rest[rows] + shape[rows], rows) - moved[rows]

    with ThreadPoolExecutor(available_cores()) as pool:
        list(pool.map(write, range(len(shapes))))
    return shapes


def _warp_pivot(face: Face, warp: HeadWarp) -> FloatArray:
    place = face.pivot.astype(np.float64)[None]
    turned: FloatArray = (place + warp.field(place))[0]
    return turned
