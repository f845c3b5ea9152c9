"""Triangles of a face that are ever seen, over its poses and all around it, by the product's own kernels."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing

from corpus_tools.shipped.film.pose_light import FRONT, PoseLight
from tts2face.face.deformation import build_rig
from tts2face.models.face import Face
from tts2face.picture.baked.visibility import N_COLUMNS, TRIANGLE_MASK, X, Y, nearest_triangles, project
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import CameraView

SIDE_PX = 900
MIDDLE_LIPS = (13, 14)  # landmarks
YAWS_DEG, PITCHES_DEG = range(-180, 180, 20), (-25.0, -12.0, -4.0, 4.0, 12.0, 25.0)
MOST_YAW_DEG = 60  # of the cameras that see more than the pose at rest
EVERY = 3  # pose of speech
TILE_MM = 20.0  # triangles that are drawn one after the other lie in one tile, outer ones first
INSIDE_MM = 14.0  # behind the lips, from where on the back of skin lies in the dark


def seen_triangles(face: Face, poses: PoseLight) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Triangles in the order of drawing, ``~t`` for the back of one, and whether it is the inside of the head."""
    n = len(face.triangles)
    both = np.concatenate([face.triangles, face.triangles[:, ::-1]]).astype(np.int32)
    rig, seen = build_rig(face), np.zeros(2 * n, bool)
    for number in _looked_at(poses):
        points = rig.pose(poses.weights[number], poses.heads[number])
        for nearest, _ in _looks(face, points, _cameras(is_at_rest=number == 0)):
            shown = np.unique(nearest)
            seen[shown[shown >= 0]] = True
    found = np.flatnonzero(seen | _beside(face, seen[:n]))
    centres = face.vertices[both[found]].mean(axis=1)
    middle = np.array([0.0, 20.0, -60.0])
    out = -(np.linalg.norm(centres - middle, axis=1) // TILE_MM)
    order = np.lexsort((centres[:, 0] // TILE_MM, centres[:, 1] // TILE_MM, out))
    found, centres = found[order], centres[order]
    is_inside = (found >= n) & (centres[:, 2] < mouth_middle(face)[2] - INSIDE_MM)
    return np.where(found < n, found, ~(found - n)).astype(np.int32), is_inside


def shown_skin(
    face: Face, poses: PoseLight, numbers: Iterable[int], corners: NDArray[np.int64], side: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Vertices (P, V) and texels of the skin (P, side, side) that the camera in front sees of these poses.

    `corners` (F, 3) are the skin's triangles.
    """
    skin = np.unique(corners)
    is_skin = np.isin(face.triangles, skin).sum(axis=1) == 3
    uv = np.zeros((len(face.vertices), 2), np.float32) if face.uv is None else face.uv
    texel = np.clip(uv[skin] * side, 0, side - 1).astype(int)
    rig, n = build_rig(face), len(face.triangles)
    vertices, texels = [], []
    for number in numbers:
        points = rig.pose(poses.weights[number], poses.heads[number])
        ((nearest, table),) = _looks(face, points, [FRONT])
        shown = np.zeros(len(face.vertices), bool)
        at = np.clip(np.rint(table[:, [Y, X]]), 1, SIDE_PX - 2).astype(int)
        for down, right in np.ndindex(3, 3):
            found = nearest[at[:, 0] + down - 1, at[:, 1] + right - 1]
            around = np.asarray(face.triangles[np.clip(found, 0, n - 1)] == np.arange(len(at))[:, None])
            shown[around.any(axis=1) & (found >= 0) & (found < n)] = True
        down, across = np.nonzero((nearest >= 0) & (nearest < n) & is_skin[np.clip(nearest, 0, n - 1)])
        used = face.triangles[nearest[down, across]]
        a, b, c = np.moveaxis(table[used][:, :, [X, Y]].astype(np.float64), 1, 0)
        place = np.column_stack([across, down]) - a
        first, second = b - a, c - a
        whole = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        at_b = (place[:, 0] * second[:, 1] - place[:, 1] * second[:, 0]) / whole
        at_c = (first[:, 0] * place[:, 1] - first[:, 1] * place[:, 0]) / whole
        shares = np.column_stack([1 - at_b - at_c, at_b, at_c])
        places = np.clip(np.einsum("nk,nkx->nx", shares, uv[used]) * side, 0, side - 1).astype(int)
        marked = np.zeros((side, side), bool)
        marked[places[:, 1], places[:, 0]] = True
        marked = np.asarray(binary_closing(marked, iterations=2))
        shown[skin] &= marked[texel[:, 1], texel[:, 0]]  # a triangle may be seen where the vertex lies in a fold
        vertices.append(shown)
        texels.append(marked)
    return np.array(vertices), np.array(texels)


def _looks(
    face: Face, points: NDArray[np.float32], views: Iterable[CameraView]
) -> Iterable[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Triangle (S, S) that each camera sees of posed vertices (V, 3), -1 of none, and the projected vertices.

    From the number of triangles on, these are backs.
    """
    both = np.concatenate([face.triangles, face.triangles[:, ::-1]]).astype(np.int32)
    table = np.zeros((len(face.vertices), N_COLUMNS), np.float32)
    every = np.arange(len(face.vertices), dtype=np.int32)
    for view in views:
        optics = camera_matrices(view, face, (SIDE_PX, SIDE_PX))
        project(points, every, optics.view.astype(np.float32), optics.lens.astype(np.float32), table)
        nearest, _, _ = nearest_triangles(table, both, (SIDE_PX, SIDE_PX))
        yield (nearest[:, :SIDE_PX] & TRIANGLE_MASK) - 1, table


def mouth_middle(face: Face) -> NDArray[np.float32]:
    """(3,) place between the lips at rest."""
    lips = np.isin(face.landmarks, MIDDLE_LIPS)
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
