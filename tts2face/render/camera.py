"""Camera matrices that frame head and neck in a picture of any size and aspect ratio."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.models.landmarks import CHIN
from tts2face.render.camera_views import CameraView

FIELD_OF_VIEW_RAD = math.radians(
    22.0
)  # opening angle across the frame: a portrait lens, with little perspective distortion
FRAME_MARGIN = 0.06  # margin on each side as a share of the head's size
NECK_SHARE = 0.28  # length of neck below the chin, as a share of the head's height


@dataclass(frozen=True, slots=True, eq=False)
class CameraMatrices:
    """Camera matrices in the form that the kernels take.

    `view` (3, 4) transforms world to camera space (x right, y down, z ahead, mm); `lens` (4,) holds the focal length
    in samples, centre x and centre y in samples, and the near plane in mm.
    """

    view: NDArray[np.float64]
    lens: NDArray[np.float64]


def camera_matrices(camera: CameraView, face: Face, size: tuple[int, int]) -> CameraMatrices:
    """Camera matrices that frame a face in a picture of `size` (width, height) in samples."""
    low, high = framing_box(face)
    yaw, pitch = math.radians(camera.yaw_deg), math.radians(camera.pitch_deg)
    ahead = -np.array([math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)])
    right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    axes = np.stack([right, np.cross(ahead, right), ahead])
    half = np.abs(axes) @ (high - low) / 2  # half extents of the box along the camera axes
    half_height = max(half[1], half[0] * size[1] / size[0])
    framing_distance = half_height / math.tan(FIELD_OF_VIEW_RAD / 2) + 0.5 * half[2]
    focal = size[1] / 2 / math.tan(FIELD_OF_VIEW_RAD / 2) / camera.share
    distance = camera.distance or float(framing_distance)
    view = np.column_stack([axes, -axes @ ((low + high) / 2 - distance * ahead)])
    extent = float(np.abs(face.vertices).max()) + distance
    near = max(distance / 50, extent * focal * 256 / 2**29)  # keeps grid coordinates below the int32 limit
    return CameraMatrices(view, np.array([focal, size[0] / 2, size[1] / 2, near]))


def framing_box(face: Face) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest corner (3,), mm, of the box to frame: head, part of the neck, and a margin."""
    rest = face.vertices.astype(np.float64)
    low, high = rest.min(axis=0), rest.max(axis=0)
    chin_y = _chin_height(face, float(high[1]))
    if chin_y is not None and chin_y < high[1]:
        head = rest[rest[:, 1] > chin_y]
        bottom = max(chin_y - NECK_SHARE * (high[1] - chin_y), low[1])
        low, high = head.min(axis=0), head.max(axis=0)
        low[1] = bottom
        return low - FRAME_MARGIN * (high - low) * [1, 0, 1], high + FRAME_MARGIN * (high - low)
    return low - FRAME_MARGIN * (high - low), high + FRAME_MARGIN * (high - low)


def _chin_height(face: Face, top: float) -> float | None:
    """Height of the chin landmark, mm; without it, the top of the head mirrored at the eyes; None without eyes."""
    chin = np.flatnonzero(face.landmarks == CHIN)
    if len(chin):
        return float(face.vertices[face.landmark_vertices[chin[0]], 1] @ face.landmark_weights[chin[0]])
    if face.eyes:
        return float(np.mean([eye.centre[1] for eye in face.eyes])) * 2 - top
    return None
