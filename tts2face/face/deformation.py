"""Deformation of a face: rest plus weighted shapes, eyeball rotations, and head motion about the pivot.

Landmarks of a face moved by weights of its shapes.

Landmark positions and motion of a face, and alignment of two sets of landmarks.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.eyeballs import EyeballClearance, build_clearance
from tts2face.models.face import Face
from tts2face.models.landmarks import CHIN, N_LANDMARKS
from tts2face.models.light import Photographed
from tts2face.numeric.arrays import nearest_rotation, smoothstep
from tts2face.numeric.kernels import kernel
from tts2face.processes.shared import shared
from tts2face.types import HEAD_CHANNELS, Trajectory

REST_HEAD = np.zeros(len(HEAD_CHANNELS), np.float32)  # head pose at rest
CHIN_MARGIN_MM = 8.0  # height below the chin that still moves rigidly with the head
MIN_NECK_MM = 20.0  # meshes with a shorter neck move rigidly as a whole
FloatArray = NDArray[np.float64]
DIGITS = 9  # decimals kept: the last bits of LAPACK's results depend on its threads
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FaceRig:
    """Rig of a face: its arrays in the form that posing takes.

    Parameters
    ----------
    rest : (V, 3)
        The face at rest, mm.
    starts, indices, deltas : (K + 1,), (N,), (N, 3)
        Shape k moves vertex ``indices[i]`` by ``deltas[i]`` mm per weight, i in [starts[k], starts[k + 1]).
    eye_spans, eye_centres, eye_turns : (E, 2), (E, 3), (E, K, 3)
        First vertex and one past the last, centre in mm, rotation vector per weight in radians of each eyeball.
    pivot : (3,)
        The point about which the head turns.
    follow : (V,)
        Share of the head motion that each vertex follows: 1 down to the chin, falling to 0 at the end of the neck.
    clearance
        Skin that stays outside the eyeballs.
    """

    rest: NDArray[np.float32]
    starts: NDArray[np.int64]
    indices: NDArray[np.int32]
    deltas: NDArray[np.float32]
    eye_spans: NDArray[np.int64]
    eye_centres: NDArray[np.float32]
    eye_turns: NDArray[np.float32]
    pivot: NDArray[np.float32]
    follow: NDArray[np.float32]
    clearance: EyeballClearance

    def pose(self, weights: NDArray[np.floating], head: NDArray[np.floating] = REST_HEAD) -> NDArray[np.float32]:
        """Vertices (V, 3), mm, for shape weights (K,) and a head pose (6,) of `HEAD_CHANNELS`."""
        vertices = self.deform(weights)
        self.move_head(head, vertices)
        return vertices

    def deform(self, weights: NDArray[np.floating]) -> NDArray[np.float32]:
        """Vertices (V, 3), mm, for shape weights (K,), of a head that has not moved."""
        vertices = np.zeros_like(self.rest)
        weights = np.array(weights, np.float32)  # a copy that can be written: kernels are compiled for one kind
        eyes = eye_rotations(self.eye_turns, weights)
        _apply_shapes(self.rest, self.starts, self.indices, self.deltas, weights, vertices)
        _turn_eyes(self.eye_spans, self.eye_centres, eyes, vertices)
        centres = self.clearance.centres(self.eye_centres, weights)
        self.clearance.enforce(centres, eyes, vertices)
        return vertices

    def move_head(self, head: NDArray[np.floating], vertices: NDArray[np.float32]) -> None:
        """Move vertices (V, 3) of `deform` in place by a head pose (6,)."""
        if np.asarray(head).any():
            _move_head(head_transform(head, self.pivot), self.follow, vertices)


def build_rig(face: Face) -> FaceRig:
    """Rig of a face; shapes keep only the vertices that they move."""
    moves = [(shape[:, 0] != 0) | (shape[:, 1] != 0) | (shape[:, 2] != 0) for shape in face.shapes]
    moved_vertices = [np.flatnonzero(moved).astype(np.int32) for moved in moves]
    starts = np.concatenate([[0], np.cumsum([len(indices) for indices in moved_vertices])]).astype(np.int64)
    deltas = [shape[indices] for shape, indices in zip(face.shapes, moved_vertices, strict=True)]
    turns = np.zeros((len(face.eyes), len(face.shape_names), 3), np.float32)
    for number, eye in enumerate(face.eyes):
        for name, turn in eye.turns.items():
            turns[number, face.shape_names.index(name)] = turn
    return FaceRig(
        rest=np.array(face.vertices, np.float32),
        starts=starts,
        indices=np.concatenate([np.zeros(0, np.int32), *moved_vertices]),
        deltas=np.concatenate([np.zeros((0, 3), np.float32), *deltas]).astype(np.float32),
        eye_spans=np.array([(eye.first, eye.first + eye.count) for eye in face.eyes], np.int64).reshape(-1, 2),
        eye_centres=np.array([eye.centre for eye in face.eyes], np.float32).reshape(-1, 3),
        eye_turns=turns,
        pivot=np.array(face.pivot, np.float32),
        follow=head_share(face),
        clearance=build_clearance(face),
    )


def head_share(face: Face) -> NDArray[np.float32]:
    """Share (V,) of the head motion that each vertex follows: 1 on the head, falling to 0 at the end of the neck."""
    if isinstance(face.light, Photographed):
        return face.light.view.follow
    height = face.vertices[:, 1]
    chin = np.flatnonzero(face.landmarks == CHIN)
    if not len(chin):
        return np.ones(len(height), np.float32)
    corners = face.vertices[face.landmark_vertices[chin[0]], 1]
    top = float(corners @ face.landmark_weights[chin[0]]) - CHIN_MARGIN_MM
    bottom = float(height.min())
    if top - bottom < MIN_NECK_MM:
        return np.ones(len(height), np.float32)
    smooth: NDArray[np.float32] = smoothstep(height, bottom, top).astype(np.float32)
    return smooth


def rotation_matrix(turn: NDArray[np.floating]) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) of a rotation vector (3,) in radians (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = np.asarray(turn, np.float64) / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: NDArray[np.float64] = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return rotation


def head_rotation(pitch: float, yaw: float, roll: float) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) of the head: roll about z first, then pitch about x, then yaw about y; radians."""
    about_x, about_y, about_z = np.eye(3) * [[pitch], [yaw], [roll]]
    return rotation_matrix(about_y) @ rotation_matrix(about_x) @ rotation_matrix(about_z)


def head_transform(head: NDArray[np.floating], pivot: NDArray[np.floating]) -> NDArray[np.float32]:
    """Rigid transform (3, 4) of a head pose (6,) about the pivot (3,): rotation and translation."""
    pitch, yaw, roll, *shift = (float(value) for value in head)
    rotation = head_rotation(pitch, yaw, roll)
    transform = np.column_stack([rotation, pivot - rotation @ pivot + shift])
    return transform.astype(np.float32)


def eye_rotations(turns: NDArray[np.float32], weights: NDArray[np.floating]) -> NDArray[np.float32]:
    """Rotation matrices (E, 3, 3) of the eyeballs for rotation vectors per weight (E, K, 3) and weights (K,)."""
    vectors = np.einsum("ekc,k->ec", turns, weights)
    return np.array([rotation_matrix(vector) for vector in vectors], np.float32).reshape(-1, 3, 3)


@kernel
def _apply_shapes(rest, starts, indices, deltas, weights, vertices):  # type: ignore[no-untyped-def]
    for v in range(len(rest)):
        vertices[v, 0], vertices[v, 1], vertices[v, 2] = rest[v, 0], rest[v, 1], rest[v, 2]
    for k in range(len(weights)):
        weight = weights[k]
        if weight == 0:
            continue
        for i in range(starts[k], starts[k + 1]):
            v = indices[i]
            vertices[v, 0] += weight * deltas[i, 0]
            vertices[v, 1] += weight * deltas[i, 1]
            vertices[v, 2] += weight * deltas[i, 2]


@kernel
def _turn_eyes(spans, centres, rotations, vertices):  # type: ignore[no-untyped-def]
    for e in range(len(spans)):
        turn, centre = rotations[e], centres[e]
        for v in range(spans[e, 0], spans[e, 1]):
            x, y, z = vertices[v, 0] - centre[0], vertices[v, 1] - centre[1], vertices[v, 2] - centre[2]
            for c in range(3):
                vertices[v, c] = centre[c] + turn[c, 0] * x + turn[c, 1] * y + turn[c, 2] * z


@kernel
def _move_head(transform, follow, vertices):  # type: ignore[no-untyped-def]
    for v in range(len(vertices)):
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        for c in range(3):
            target = transform[c, 0] * x + transform[c, 1] * y + transform[c, 2] * z + transform[c, 3]
            vertices[v, c] += follow[v] * (target - vertices[v, c])


def landmark_positions(face: Face) -> FloatArray:
    """Landmarks (L, 3) of a face at rest, mm, in the order of `Face.landmarks`."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    places: FloatArray = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)
    return places


def landmark_motion(face: Face, shapes: NDArray[np.integer]) -> FloatArray:
    """Landmark motion (L, 3, k) per weight of the shapes with indices `shapes` (k,), mm."""
    return np.ascontiguousarray(np.moveaxis(_landmark_moves(face)[np.asarray(shapes)], 0, -1))


@shared
def _landmark_moves(face: Face) -> FloatArray:
    """Landmark motion (K, L, 3) per weight of all shapes, mm; a face that is prepared needs it eight times."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    moves: FloatArray = (face.shapes[:, face.landmark_vertices] * mixed).sum(axis=2)
    moves.setflags(write=False)
    return moves


def scatter_landmarks(face: Face, values: FloatArray) -> FloatArray:
    """Values (L, ...) of a face's landmarks in an array (478, ...) by landmark index; NaN for missing landmarks."""
    spread: FloatArray = np.full((N_LANDMARKS, *values.shape[1:]), np.nan)
    spread[face.landmarks] = values
    return spread


def procrustes_rotation(source: FloatArray, target: FloatArray) -> FloatArray:
    """Rotation (3, 3) of points (N, 3) that fits the target best, up to translation and scale (Procrustes)."""
    inertia = np.einsum("nc,nd->cd", source - source.mean(axis=0), target - target.mean(axis=0))
    turn: FloatArray = np.round(nearest_rotation(inertia).T, DIGITS)
    return turn


def axis_scales(source: FloatArray, target: FloatArray, bounds: tuple[float, float]) -> FloatArray:
    """Factors s (3,) of the least-squares fit ``target = s * source + shift`` per axis, clipped to `bounds`."""
    clipped: FloatArray = np.clip(axis_ratios(source, target), *bounds).round(DIGITS)
    return clipped


def axis_ratios(source: NDArray[np.floating], target: NDArray[np.floating]) -> FloatArray:
    """Factors s (3,) of the least-squares fit ``target = s * source + shift`` per axis."""
    here, there = (np.asarray(points, np.float64) for points in (source, target))
    here, there = here - here.mean(axis=0), there - there.mean(axis=0)
    ratios: FloatArray = (here * there).sum(axis=0) / np.maximum((here**2).sum(axis=0), 1e-12)
    return ratios


def rest_landmarks(face: Face) -> Floats:
    """(478, 3) landmarks of a face at rest, mm.

    Raises
    ------
    DataError
        The face has not all of them.
    """
    if sorted(face.landmarks.tolist()) != list(range(N_LANDMARKS)):
        raise DataError(f"the face has {len(face.landmarks)} of {N_LANDMARKS} landmarks; build it with all of them")
    return scatter_landmarks(face, landmark_positions(face))


def moved_landmarks(face: Face, motion: Trajectory) -> NDArray[np.float32]:
    """(T, 478, 3) landmarks of a face, mm, for weights (T, K) of its first K shapes; its eyes turn.

    Raises
    ------
    DataError
        The face has not all landmarks, or the weights are not of its shapes.
    """
    n = len(motion.channels)
    if motion.channels != face.shape_names[:n]:
        raise DataError("the weights are not for the shapes of this face; retarget them to it first")
    weights = motion.values.astype(np.float64)
    moves = scatter_landmarks(face, landmark_motion(face, np.arange(n)))
    found = rest_landmarks(face) + np.tensordot(weights, moves, axes=(1, 2))
    _turn_eye_landmarks(face, weights, found)
    return found.astype(np.float32)


def _turn_eye_landmarks(face: Face, weights: Floats, landmarks: Floats) -> None:
    """Turn those landmarks (T, 478, 3) that lie on eyeballs."""
    from scipy.spatial.transform import Rotation

    for eye in face.eyes:
        on_it = ((face.landmark_vertices >= eye.first) & (face.landmark_vertices < eye.first + eye.count)).all(axis=1)
        known = [name for name in eye.turns if name in face.shape_names[: weights.shape[1]]]
        if not on_it.any() or not known:
            continue
        columns = [face.shape_names.index(name) for name in known]
        turns = weights[:, columns] @ np.array([eye.turns[name] for name in known], np.float64)
        rows = face.landmarks[on_it]
        about = Rotation.from_rotvec(turns).as_matrix()
        landmarks[:, rows] = np.einsum("tij,tlj->tli", about, landmarks[:, rows] - eye.centre) + eye.centre
