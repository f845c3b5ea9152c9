"""Motion of landmarks carried to the skin of a face, and shapes that a face lacks carried from the default head."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.compact_spline import fit_local_interpolant
from tts2face.face.landmark_fit import N_SKIN, axis_scales, landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Eye, Face
from tts2face.models.face_file import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, N_LANDMARKS

DEFAULT_FACE = "head"
SOFT_PARTS = ("lash", "brow")  # parts that go with the skin, by what their names hold
SUPPORT = 0.3  # of the distance of the outer eye corners, some 27 mm: from a brow to its lid and no further
MERGE_DISTANCE = 0.02  # of that distance: landmarks nearer than 2 mm, as those of closed lips, are one centre
DIGITS = 5  # of a displacement in mm; the last bits of a solver depend on its threads
MAX_CARRIED_WEIGHT = 1.5  # a carried shape reaches further than on the default head where a face is made so
EYEBALL_RETRACTION_FACTOR = (
    1.5  # times as far as on the default head do eyeballs go in: carried lids follow the eyeball less closely
)
SCALE_LIMITS = (0.4, 2.5)  # a face's features against another's, axis by axis; beyond that landmarks are wrong

Float32Array = NDArray[np.float32]
FloatArray = NDArray[np.float64]


def eye_distance(face: Face) -> float:
    """Distance of the outer eye corners, mm: the size of a face.

    Raises
    ------
    DataError
        The face lacks their landmarks.
    """
    places = scatter_landmarks(face, landmark_positions(face))
    distance = float(np.linalg.norm(places[EYE_OUTER_LEFT] - places[EYE_OUTER_RIGHT]))
    if not distance > 0:
        raise DataError("the face lacks landmarks 33 and 263 of the eye corners; build it with its landmark table")
    return distance


def soft_vertices(face: Face) -> NDArray[np.int64]:
    """Numbers of the vertices that gestures move: the parts that bear landmarks, lashes and brows; not the eyeballs."""
    on_skin = np.zeros(len(face.vertices), bool)
    on_skin[face.landmark_vertices[face.landmarks < N_SKIN]] = True
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
    """(k, V, 3) displacement of the vertices for k motions (k, L, 3) of landmarks, mm.

    Landmarks that the face lacks are left out; those of `still` stay where they are.
    """
    places = scatter_landmarks(face, landmark_positions(face))
    wanted = np.zeros((N_LANDMARKS, *motion.transpose(1, 0, 2).shape[1:]))
    wanted[landmarks] = motion.transpose(1, 0, 2)
    numbers = [int(number) for number in (*landmarks, *still) if np.isfinite(places[number]).all()]
    shapes = np.zeros((len(motion), *face.vertices.shape), np.float32)
    if not numbers:
        return shapes
    size = eye_distance(face)
    centres, moved = _merge_places(places[numbers], wanted[numbers].reshape(len(numbers), -1), MERGE_DISTANCE * size)
    soft = soft_vertices(face)
    carried = fit_local_interpolant(centres, moved, SUPPORT * size)(face.vertices[soft])
    shapes[:, soft] = np.round(carried, DIGITS).reshape(len(soft), -1, 3).transpose(1, 0, 2)
    return shapes


def append_shapes(face: Face, names: Sequence[str], shapes: Float32Array, limits: NDArray[np.floating]) -> Face:
    """A face with more shapes (k, V, 3), and their limits (k, 2)."""
    return replace(
        face,
        shape_names=(*face.shape_names, *names),
        shapes=np.concatenate([face.shapes, shapes]),
        limits=np.concatenate([face.limits, limits.astype(np.float32)]),
    )


def add_missing_shapes(face: Face, names: Sequence[str]) -> Face:
    """A face with all the named ARKit shapes: those that it lacks move its landmarks as on the default head.

    Sizes are fitted axis by axis. Eyeballs that nothing turns turn with the carried gaze shapes.
    """
    missing = [name for name in dict.fromkeys(names) if name not in face.shape_names]
    if not missing:
        return face
    head = default_head()
    common = np.intersect1d(face.landmarks[face.landmarks < N_SKIN], head.landmarks)
    here, there = (scatter_landmarks(one, landmark_positions(one)) for one in (face, head))
    sizes = axis_scales(there[common], here[common], SCALE_LIMITS)
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
    """Places no two of which are nearer than `apart`, and the mean values of those that each stands for."""
    kept: list[int] = []
    member = np.zeros(len(places), np.int64)
    for number, place in enumerate(places):
        distances = np.linalg.norm(places[kept] - place, axis=1)
        near = int(distances.argmin()) if kept else 0
        if kept and distances[near] < apart:
            member[number] = near
        else:
            member[number] = len(kept)
            kept.append(number)
    sums = np.zeros((len(kept), values.shape[1]))
    np.add.at(sums, member, values)
    return places[kept], sums / np.bincount(member)[:, None]


def _eyeball_retraction(eye: Eye, names: Sequence[str]) -> FloatArray:
    """(k, 3) how far the default head's shapes shift the eyeball of this side, mm: lids that shut slide over it."""
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
    """The head from which motion is carried."""
    return load_face(DEFAULT_FACE)
