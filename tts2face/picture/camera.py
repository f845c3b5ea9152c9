"""Camera matrices that frame head and neck in a picture of any size and aspect ratio."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.landmarks import landmark_positions
from tts2face.models.face import Face
from tts2face.models.landmarks import CHIN
from tts2face.models.light import Photographed
from tts2face.models.photo_view import PhotoView
from tts2face.picture.camera_view import CameraView

FIELD_OF_VIEW_RAD = math.radians(
    22.0
)  # opening angle across the frame: a portrait lens, with little perspective distortion
FRAME_MARGIN = 0.06  # margin on each side as a share of the head's size
MAX_PHOTO_TURN_DEG = 5.0  # of a camera from that of a photograph, whose named views look down a little
PHOTO_DISTANCE_MM = 1000.0  # of a camera that shows as much of a photograph as it can
# least distance of the near plane from the camera of a photograph
NEAR_PHOTO_MM = 20.0
NECK_SHARE = 0.28  # length of neck below the chin, as a share of the head's height


@dataclass(frozen=True, slots=True, eq=False)
class CameraMatrices:
    """Camera matrices in the form that the kernels take.

    `view` (3, 4) transforms world to camera space (x right, y down, z ahead, mm); `lens` (4,) holds the focal length
    in samples, centre x and centre y in samples, and the near plane in mm.
    """

    view: NDArray[np.float64]
    lens: NDArray[np.float64]

    @property
    def yaw_deg(self) -> float:
        """Where the camera stands round the head, positive towards the face's own left."""
        ahead = self.view[2]
        return math.degrees(math.atan2(-ahead[0], -ahead[2]))

    def pixels(self, places: NDArray[np.floating]) -> NDArray[np.float64]:
        """Where places (N, 3) of the world lie in the picture: (N, 2) in samples."""
        there = places @ self.view[:, :3].T + self.view[:, 3]
        flat: NDArray[np.float64] = there[:, :2] / np.maximum(there[:, 2:], 1e-6) * self.lens[0] + self.lens[1:3]
        return flat

    def scaled(self, share: float) -> "CameraMatrices":
        """The same camera for a picture of `share` times as many samples on each side."""
        return CameraMatrices(self.view, self.lens * [share, share, share, 1.0])


def camera_matrices(camera: CameraView, face: Face, size: tuple[int, int]) -> CameraMatrices:
    """Camera matrices that frame a face in a picture of `size` (width, height) in samples.

    Raises
    ------
    InputError
        The face is that of a photograph, and the camera does not see it from where it was taken.
    """
    if isinstance(face.light, Photographed):
        crop = photo_crop(camera, face, face.light.view, size)
        return photo_matrices(face.light.view, crop, size)
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
    # a triangle beyond would wrap to the other side of the picture
    near = max(distance / 50, extent * focal * 256 / 2**29)  # keeps grid coordinates below the int32 limit
    return CameraMatrices(view, np.array([focal, size[0] / 2, size[1] / 2, near]))


def photo_crop(
    camera: CameraView, face: Face, view: PhotoView, size: tuple[int, int]
) -> tuple[float, float, float, float]:
    """Left, top, right and bottom, in pixels of its photograph, of what a camera shows in a picture of `size`.

    The picture is filled, with the face as near its middle as it can be.
    """
    if max(abs(camera.yaw_deg), abs(camera.pitch_deg)) > MAX_PHOTO_TURN_DEG:
        raise InputError(
            "a photograph is seen from where it was taken; choose the camera front or close, or a distance such as "
            "0,0,800"
        )
    wide, high = view.size
    part = _own_pixels(view.size, size) or min(wide / size[0], high / size[1])
    low, top = _in_photo(face, view)
    # a close view shows a part of the head's height
    if camera.share < 1:
        part = min(part, float((top - low).max()) / camera.share / min(size))
    elif camera.distance:
        part *= min(1.0, camera.distance / PHOTO_DISTANCE_MM)
    half = np.array(size) * part / 2
    middle = np.clip((low + top) / 2, half, np.maximum(np.array([wide, high]) - half, half))
    left, above, right, below = (float(edge) for edge in (*(middle - half), *(middle + half)))
    return left, above, right, below


def _own_pixels(photo: tuple[int, int], size: tuple[int, int]) -> float | None:
    """Pixels of a photograph a sample, for a picture in its own size but for an odd row or column; None for others."""
    samples = max(round(size[0] / photo[0]), 1)
    is_own = all(0 <= own * samples - side < 2 * samples for own, side in zip(photo, size, strict=True))
    return 1 / samples if is_own else None


def _in_photo(face: Face, view: PhotoView) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and greatest (2,) pixel of the landmarks of a photographed face."""
    seen = landmark_positions(face) @ view.view[:, :3].T + view.view[:, 3]
    places = seen[:, :2] * (view.lens[0] / seen[:, 2:]) + view.lens[1:] + 0.5
    return places.min(axis=0), places.max(axis=0)


def photo_matrices(view: PhotoView, crop: tuple[float, float, float, float], size: tuple[int, int]) -> CameraMatrices:
    """Camera matrices that show a part of a photograph, of `photo_crop`, in a picture of `size` in samples."""
    scale = size[0] / (crop[2] - crop[0])
    focal, across, down = view.lens * scale
    middle = (across + scale * (0.5 - crop[0]), down + scale * (0.5 - crop[1]))
    return CameraMatrices(view.view, np.array([focal, *middle, NEAR_PHOTO_MM]))


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
