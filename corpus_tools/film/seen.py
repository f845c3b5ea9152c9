"""Which triangles of a face are ever seen, over its poses and all around it, by the product's own kernels."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from corpus_tools.film.pose_light import PoseLight
from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import OPENING_LANDMARKS
from tts2face.models.face import Face
from tts2face.render.camera import camera_matrices
from tts2face.render.camera_views import CameraView
from tts2face.render.film.visibility import BLOCK, N_COLUMNS, TRIANGLE_MASK, find_nearest, project

SIDE_PX = 900
YAWS_DEG, PITCHES_DEG = range(-180, 180, 20), (-25.0, -12.0, -4.0, 4.0, 12.0, 25.0)
MOST_YAW_DEG = 60  # of the cameras that see more than the pose at rest
EVERY = 3  # pose of speech
TILE_MM = 20.0  # triangles that are drawn one after the other lie in one tile, outer ones first
INSIDE_MM = 14.0  # behind the lips, from where on the back of skin lies in the dark


def seen_triangles(face: Face, poses: PoseLight) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Triangles in the order of drawing, ``~t`` for the back of one, and whether it is the inside of the head."""
    rig, n = build_rig(face), len(face.triangles)
    both = np.concatenate([face.triangles, face.triangles[:, ::-1]]).astype(np.int32)
    table = np.zeros((len(face.vertices), N_COLUMNS), np.float32)
    nearest = np.zeros((SIDE_PX, SIDE_PX + BLOCK), np.int64)
    every, seen = np.arange(len(face.vertices), dtype=np.int32), np.zeros(2 * n, bool)
    for number in _looked_at(poses):
        points = rig.pose(poses.weights[number], poses.heads[number])
        for view in _cameras(is_at_rest=number == 0):
            optics = camera_matrices(view, face, (SIDE_PX, SIDE_PX))
            project(points, every, optics.view.astype(np.float32), optics.lens.astype(np.float32), table)
            find_nearest(table, both, nearest)
            seen[np.unique(nearest & TRIANGLE_MASK)[1:] - 1] = True
    found = np.flatnonzero(seen | _beside(face, seen[:n]))
    centres = face.vertices[both[found]].mean(axis=1)
    middle = np.array([0.0, 20.0, -60.0])
    out = -(np.linalg.norm(centres - middle, axis=1) // TILE_MM)
    order = np.lexsort((centres[:, 0] // TILE_MM, centres[:, 1] // TILE_MM, out))
    found, centres = found[order], centres[order]
    is_inside = (found >= n) & (centres[:, 2] < mouth_middle(face)[2] - INSIDE_MM)
    return np.where(found < n, found, ~(found - n)).astype(np.int32), is_inside


def mouth_middle(face: Face) -> NDArray[np.float32]:
    """(3,) place between the lips at rest."""
    lips = np.isin(face.landmarks, OPENING_LANDMARKS[:2])
    middle: NDArray[np.float32] = face.vertices[face.landmark_vertices[lips]].mean(axis=(0, 1))
    return middle


def _beside(face: Face, seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(2 F,) triangles that share an edge with seen ones (F,): some are seen between the poses and cameras."""
    reached = np.zeros(len(face.vertices), bool)
    reached[face.triangles[seen]] = True
    beside = reached[face.triangles].sum(axis=1) >= 2
    return np.concatenate([beside, np.zeros_like(beside)])


def _looked_at(poses: PoseLight) -> Iterable[int]:
    """Numbers of the poses that are looked at: all but some of speech."""
    spoken = 0
    for number, name in enumerate(poses.names):
        is_speech = str(name).startswith("speech")
        spoken += is_speech
        if not is_speech or spoken % EVERY == 0:
            yield number


def _cameras(*, is_at_rest: bool) -> Iterable[CameraView]:
    """Cameras that look at a pose."""
    for yaw in YAWS_DEG:
        if is_at_rest or abs(yaw) <= MOST_YAW_DEG:
            yield from (CameraView(float(yaw), pitch) for pitch in PITCHES_DEG)
