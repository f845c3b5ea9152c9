"""Transfer of landmark motion to the skin of a face, and of missing shapes from the default head."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmarks import axis_scales, landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Eye, Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import Float32Array, FloatArray, append_rows
from tts2face.numeric.local_splines import fit_local_interpolant
from tts2face.storage.array_cache import computed_once

DEFAULT_FACE = "head"
SOFT_PARTS = ("lash", "brow")  # substrings of the names of parts that move with the skin
SUPPORT = 0.3  # relative to the distance of the outer eye corners, about 27 mm: from a brow to its lid
MERGE_DISTANCE = 0.02  # relative to the same distance: landmarks closer than 2 mm, as on closed lips, are merged
MIN_CACHED_POINTS = 5000  # fewer are interpolated as fast as a file is read
CACHE_KIND, CACHE_VERSION = "displacements", 1  # raised when the interpolant of the same motion changes
DIGITS = 5  # decimals of a displacement in mm; the last bits of a solver depend on its threads
MAX_CARRIED_WEIGHT = 1.5  # upper limit of transferred shapes, whose effect may be smaller than on the default head
EYEBALL_RETRACTION_FACTOR = 1.5  # relative to the default head: transferred lids follow the eyeball less closely
SCALE_LIMITS = (0.4, 2.5)  # of facial features between two faces, per axis; beyond them the landmarks are wrong


def eye_distance(face: Face) -> float:
    """Distance of the outer eye corners, mm; the measure of the size of a face.

    Raises
    ------
    DataError
        The face lacks landmarks 33 or 263.
    """
    places = scatter_landmarks(face, landmark_positions(face))
    distance = float(np.linalg.norm(places[EYE_OUTER_LEFT] - places[EYE_OUTER_RIGHT]))
    if not distance > 0:
        raise DataError("the face lacks landmarks 33 and 263 of the eye corners; build it with its landmark table")
    return distance


def soft_vertices(face: Face) -> NDArray[np.int64]:
    """Indices of the vertices that gestures move: parts with landmarks, lashes and brows; not the eyeballs."""
    on_skin = np.zeros(len(face.vertices), bool)
    on_skin[face.landmark_vertices[face.landmarks < N_MESH_LANDMARKS]] = True
    soft = np.zeros(len(face.vertices), bool)
    for part in face.parts:
        used = face.triangles[part.first : part.first + part.count]
        if on_skin[used].any() or any(name in part.name for name in SOFT_PARTS):
            soft[used] = True
    for eye in face.eyes:
        soft[eye.first : eye.first + eye.count] = False
    return np.flatnonzero(soft)


def spread_landmark_motion(
    face: Face, landmarks: NDArray[np.integer], motion: FloatArray, still: Sequence[int] = ()
) -> Float32Array:
    """Vertex displacements (k, V, 3) for k motions (k, L, 3) of the landmarks, mm.

    Landmarks that the face lacks are skipped; those in `still` have displacement 0.
    """
    places = scatter_landmarks(face, landmark_positions(face))
    displacements = np.zeros((N_LANDMARKS, *motion.transpose(1, 0, 2).shape[1:]))
    displacements[landmarks] = motion.transpose(1, 0, 2)
    numbers = [int(number) for number in (*landmarks, *still) if np.isfinite(places[number]).all()]
    shapes = np.zeros((len(motion), *face.vertices.shape), np.float32)
    if not numbers:
        return shapes
    size = eye_distance(face)
    centres, merged = _merge_places(
        places[numbers], displacements[numbers].reshape(len(numbers), -1), MERGE_DISTANCE * size
    )
    soft = soft_vertices(face)
    interpolated = _interpolate((centres, merged, SUPPORT * size), face.vertices[soft])
    shapes[:, soft] = interpolated.reshape(len(soft), -1, 3).transpose(1, 0, 2)
    return shapes


def _interpolate(known: tuple[FloatArray, FloatArray, float], points: Float32Array) -> Float32Array:
    """Displacements (P, E) at points (P, 3), from centres (N, 3), their displacements (N, E) and the support, in mm."""

    def compute() -> dict[str, Float32Array]:
        return {"moved": np.round(fit_local_interpolant(*known)(points), DIGITS).astype(np.float32)}

    if len(points) < MIN_CACHED_POINTS:
        return compute()["moved"]
    centres, displacements, support = known
    shape = (len(points), displacements.shape[1])
    return computed_once(
        CACHE_KIND,
        CACHE_VERSION,
        [centres, displacements, repr(float(support)), points],
        compute,
        lambda kept: "moved" in kept and kept["moved"].dtype == np.float32 and kept["moved"].shape == shape,
    )["moved"]


def append_shapes(face: Face, names: Sequence[str], shapes: Float32Array, limits: NDArray[np.floating]) -> Face:
    """Face with further shapes (k, V, 3), mm per weight, and their limits (k, 2)."""
    return replace(
        face,
        shape_names=(*face.shape_names, *names),
        shapes=append_rows(face.shapes, shapes),
        limits=np.concatenate([face.limits, limits.astype(np.float32)]),
    )


def add_missing_shapes(face: Face, names: Sequence[str]) -> Face:
    """Face with all the named ARKit shapes; missing ones move its landmarks as on the default head.

    Sizes are fitted per axis. Eyeballs without rotations take those of the transferred gaze shapes.
    """
    missing = [name for name in dict.fromkeys(names) if name not in face.shape_names]
    if not missing:
        return face
    head = default_head()
    common = np.intersect1d(face.landmarks[face.landmarks < N_MESH_LANDMARKS], head.landmarks)
    places, head_places = (scatter_landmarks(model, landmark_positions(model)) for model in (face, head))
    sizes = axis_scales(head_places[common], places[common], SCALE_LIMITS)
    motion = scatter_landmarks(
        head, landmark_motion(head, np.array([head.shape_names.index(name) for name in missing]))
    )
    shapes = spread_landmark_motion(face, common, motion[common].transpose(2, 0, 1) * sizes)
    for eye in face.eyes:
        shapes[:, eye.first : eye.first + eye.count] = _eyeball_retraction(eye, missing)[:, None] * sizes
    limits = np.tile([0.0, MAX_CARRIED_WEIGHT], (len(missing), 1))
    return replace(
        append_shapes(face, missing, shapes, limits), eyes=tuple(_add_eye_turns(eye, missing) for eye in face.eyes)
    )


def _merge_places(places: FloatArray, values: FloatArray, apart: float) -> tuple[FloatArray, FloatArray]:
    """Points (M, 3) at least `apart` from each other, and the mean values (M, E) of those merged into each."""
    kept: list[int] = []
    member = np.zeros(len(places), np.int64)
    for number, place in enumerate(places):
        distances = np.linalg.norm(places[kept] - place, axis=1)
        near = int(distances.argmin()) if kept else 0
        # two centres at one place make the equations singular
        if kept and distances[near] < apart:
            member[number] = near
        else:
            member[number] = len(kept)
            kept.append(number)
    sums = np.zeros((len(kept), values.shape[1]))
    np.add.at(sums, member, values)
    return places[kept], sums / np.bincount(member)[:, None]


def _eyeball_retraction(eye: Eye, names: Sequence[str]) -> FloatArray:
    """Displacement (k, 3) of this side's eyeball for the default head's shapes, mm; makes room for the lids."""
    head, model = default_head(), _default_head_eye(eye)
    shifts = [head.shapes[head.shape_names.index(name), model.first : model.first + model.count] for name in names]
    return EYEBALL_RETRACTION_FACTOR * np.stack([shift.mean(axis=0, dtype=np.float64) for shift in shifts])


def _add_eye_turns(eye: Eye, missing: Sequence[str]) -> Eye:
    added = {
        name: turn for name, turn in _default_head_eye(eye).turns.items() if name in missing and name not in eye.turns
    }
    return replace(eye, turns={**eye.turns, **added})


def _default_head_eye(eye: Eye) -> Eye:
    return min(default_head().eyes, key=lambda other: abs(float(other.centre[0] - eye.centre[0])))


@cache
def default_head() -> Face:
    """Default head, the source of transferred shapes; loaded once."""
    return load_face(DEFAULT_FACE)
