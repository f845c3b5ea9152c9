"""Deformation of a face: rest plus weighted shapes, eyeball rotations, and head motion about the pivot."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tts2face.face.eyeballs import EyeballClearance, build_clearance
from tts2face.models.face import Face
from tts2face.models.landmarks import CHIN
from tts2face.numeric.arrays import smoothstep
from tts2face.numeric.kernels import flat_view, kernel
from tts2face.types import HEAD_CHANNELS

REST_HEAD = np.zeros(len(HEAD_CHANNELS), np.float32)  # head pose at rest
CHIN_MARGIN_MM = 8.0  # height below the chin that still moves rigidly with the head
MIN_NECK_MM = 20.0  # meshes with a shorter neck move rigidly as a whole
IDENTITY = np.eye(3)
GAP = 16  # vertices between two that a shape moves, up to which all are added: a jump costs as much
N_KEPT = 64  # poses whose transforms are kept: a frame takes the same ones several times


@dataclass(frozen=True, slots=True, eq=False)
class FaceRig:
    """Rig of a face: its arrays in the form that posing takes.

    Parameters
    ----------
    rest : (V, 3)
        The face at rest, mm.
    starts, runs, deltas : (K + 1,), (R, 3), (3 N,)
        Shape k moves vertices in the runs [starts[k], starts[k + 1]). A run is the place of its first coordinate among
        those of all vertices (3 V,), the end of these, and the place of its first delta, mm per weight; vertices that
        the shape does not move lie between some that it does.
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
    runs: NDArray[np.int64]
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
        _apply_shapes(self.rest, (self.starts, self.runs, self.deltas), weights, vertices)
        if not len(self.eye_spans):
            return vertices
        eyes = eye_rotations(self.eye_turns, weights)
        _turn_eyes(self.eye_spans, self.eye_centres, eyes, vertices)
        centres = self.clearance.centres(self.eye_centres, weights)
        self.clearance.enforce(centres, eyes, vertices)
        return vertices

    def sink_eyes(self, weights: NDArray[np.floating], vertices: NDArray[np.float32]) -> None:
        """Move the eyeballs of vertices (V, 3) of `deform` back behind their lids in place, for who draws them."""
        if len(self.eye_spans):
            self.clearance.openings.sink(self.clearance.centres(self.eye_centres, weights), vertices)

    def move_head(self, head: NDArray[np.floating], vertices: NDArray[np.float32]) -> None:
        """Move vertices (V, 3) of `deform` in place by a head pose (6,)."""
        if np.asarray(head).any():
            _move_head(head_transform(head, self.pivot), self.follow, vertices)


def build_rig(face: Face) -> FaceRig:
    """Rig of a face; shapes keep only the vertices that they move, and short gaps between these."""
    spans = [_runs(shape) for shape in face.shapes]
    lengths = np.concatenate([np.zeros(0, np.int64), *(ends - firsts for firsts, ends in spans)])
    runs = np.zeros((len(lengths), 3), np.int64)
    runs[:, :2] = 3 * np.concatenate([np.zeros((0, 2), np.int64), *(np.column_stack(span) for span in spans)])
    runs[1:, 2] = 3 * np.cumsum(lengths)[:-1]
    deltas = [
        shape[first:end].ravel()
        for shape, span in zip(face.shapes, spans, strict=True)
        for first, end in zip(*span, strict=True)
    ]
    turns = np.zeros((len(face.eyes), len(face.shape_names), 3), np.float32)
    for number, eye in enumerate(face.eyes):
        for name, turn in eye.turns.items():
            turns[number, face.shape_names.index(name)] = turn
    return FaceRig(
        rest=np.array(face.vertices, np.float32),
        starts=np.cumsum([0, *(len(firsts) for firsts, _ in spans)]),
        runs=runs,
        deltas=np.concatenate([np.zeros(0, np.float32), *deltas]).astype(np.float32),
        eye_spans=np.array([(eye.first, eye.first + eye.count) for eye in face.eyes], np.int64).reshape(-1, 2),
        eye_centres=np.array([eye.centre for eye in face.eyes], np.float32).reshape(-1, 3),
        eye_turns=turns,
        pivot=np.array(face.pivot, np.float32),
        follow=head_share(face),
        clearance=build_clearance(face),
    )


def _runs(shape: NDArray[np.floating]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First vertices and ends of the runs of vertices that a shape (V, 3) moves, with gaps of less than `GAP`."""
    moved = np.flatnonzero((shape[:, 0] != 0) | (shape[:, 1] != 0) | (shape[:, 2] != 0))
    breaks = np.flatnonzero(moved[1:] - moved[:-1] > GAP)
    return np.concatenate([moved[:1], moved[breaks + 1]]), np.concatenate([moved[breaks], moved[-1:]]) + 1


def head_share(face: Face) -> NDArray[np.float32]:
    """Share (V,) of the head motion that each vertex follows: 1 on the head, falling to 0 at the end of the neck."""
    return face.light.head_share(_share_by_height(face))


def _share_by_height(face: Face) -> NDArray[np.float32]:
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
    angle = float(np.sqrt(turn.dot(turn)))
    # the axis of no rotation would be 0 / 0
    if angle == 0.0:
        return IDENTITY.copy()
    x, y, z = (np.asarray(turn, np.float64) / angle).tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: NDArray[np.float64] = IDENTITY + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return rotation


def head_rotation(pitch: float, yaw: float, roll: float) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) of the head: roll about z first, then pitch about x, then yaw about y; radians."""
    about_x, about_y, about_z = IDENTITY * [[pitch], [yaw], [roll]]
    return rotation_matrix(about_y) @ rotation_matrix(about_x) @ rotation_matrix(about_z)


def head_transform(head: NDArray[np.floating], pivot: NDArray[np.floating]) -> NDArray[np.float32]:
    """Rigid transform (3, 4) of a head pose (6,) about the pivot (3,): rotation and translation."""
    return _transform(tuple(np.asarray(head).tolist()), pivot.dtype.char, tuple(pivot.tolist())).copy()


@lru_cache(N_KEPT)
def _transform(head: tuple[float, ...], kind: str, about: tuple[float, ...]) -> NDArray[np.float32]:
    pitch, yaw, roll, *shift = head
    pivot, rotation = np.array(about, kind), head_rotation(pitch, yaw, roll)
    transform = np.zeros((3, 4), np.float32)
    transform[:, :3], transform[:, 3] = rotation, pivot - rotation @ pivot + shift
    return transform


def eye_rotations(turns: NDArray[np.float32], weights: NDArray[np.floating]) -> NDArray[np.float32]:
    """Rotation matrices (E, 3, 3) of the eyeballs for rotation vectors per weight (E, K, 3) and weights (K,)."""
    vectors = np.einsum("ekc,k->ec", turns, weights)
    kind = vectors.dtype.char
    return np.array([_rotation(kind, *vector) for vector in vectors.tolist()], np.float32).reshape(-1, 3, 3)


@lru_cache(N_KEPT)
def _rotation(kind: str, *turn: float) -> NDArray[np.float64]:
    return rotation_matrix(np.array(turn, kind))


@kernel
def _apply_shapes(rest, shapes, weights, vertices):  # type: ignore[no-untyped-def]
    starts, runs, deltas = shapes
    line = flat_view(vertices)
    still = flat_view(rest)
    for i in range(len(line)):
        line[i] = still[i]
    for k in range(len(weights)):
        weight = weights[k]
        if weight == 0:
            continue
        for r in range(starts[k], starts[k + 1]):
            first, count, own = np.uint64(runs[r, 0]), np.uint64(runs[r, 1] - runs[r, 0]), np.uint64(runs[r, 2])
            for i in range(count):
                line[first + i] += weight * deltas[own + i]


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
