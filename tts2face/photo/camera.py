"""The camera of a photograph: between its pixels and the millimetres of a head."""

from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray
from tts2face.photo.found_face import FoundFace
from tts2face.video.pose import CAMERA_DISTANCE_MM, rigid_points, similarity_transforms

TO_CAMERA = np.array([1.0, -1.0, -1.0])  # from x right, y up, z towards the camera to x right, y down, z ahead
PIXEL_AXES = np.array([1.0, -1.0, 1.0])  # from x right, y up, z towards the camera to y down


@dataclass(frozen=True, slots=True, eq=False)
class PhotoCamera:
    """A camera that sees a head where the photograph shows it.

    Pixels are x right and y down from the centre of the top left one; depths are pixels towards the camera, from the
    origin of the head.

    Attributes
    ----------
    turn : (3, 3)
        From the axes of the head to x right, y up, z towards the camera.
    scale
        Pixels a millimetre at the origin of the head.
    origin : (2,)
        Pixel of the origin of the head.
    depth
        Of the origin of the head in the landmarks' depths, pixels towards the camera.
    """

    turn: FloatArray
    scale: float
    origin: FloatArray
    depth: float

    @property
    def focal_px(self) -> float:
        """Focal length for a camera that is `CAMERA_DISTANCE_MM` away from the origin of the head."""
        return CAMERA_DISTANCE_MM * self.scale

    @property
    def view(self) -> FloatArray:
        """(3, 4) from head to camera: x right, y down, z ahead, mm."""
        return np.column_stack([TO_CAMERA[:, None] * self.turn, (0.0, 0.0, CAMERA_DISTANCE_MM)])

    def depths_of(self, landmarks: FloatArray) -> FloatArray:
        """Landmarks (N, 3), whose z goes away from the camera, as pixels and depths."""
        return np.column_stack([landmarks[:, :2], -landmarks[:, 2] - self.depth])

    def to_head(self, places: FloatArray) -> FloatArray:
        """Points (N, 3) of the head, mm, of pixels and depths (N, 3)."""
        ahead = CAMERA_DISTANCE_MM - places[:, 2] / self.scale
        across = (places[:, :2] - self.origin) * ahead[:, None] / self.focal_px
        seen = np.column_stack([across, ahead]) - (0.0, 0.0, CAMERA_DISTANCE_MM)
        points: FloatArray = (seen * TO_CAMERA) @ self.turn
        return points

    def ways_to_head(self, ways: FloatArray) -> FloatArray:
        """Displacements (..., 3) in the head, mm, of those in pixels and depths (..., 3)."""
        turned: FloatArray = (ways * PIXEL_AXES / self.scale) @ self.turn
        return turned

    def to_pixels(self, points: FloatArray) -> FloatArray:
        """Pixels and depths (N, 3) of points (N, 3) of the head, mm."""
        seen = points @ self.view[:, :3].T + self.view[:, 3]
        across = seen[:, :2] * (self.focal_px / seen[:, 2:]) + self.origin
        return np.column_stack([across, (CAMERA_DISTANCE_MM - seen[:, 2]) * self.scale])


def find_camera(face: FoundFace, head_landmarks: FloatArray) -> PhotoCamera:
    """Camera that sees the rigid landmarks (478, 3) of a head, mm, where the photograph shows them (least squares)."""
    indices, _, weights = rigid_points()
    seen = face.landmarks * TO_CAMERA
    turns, scales = similarity_transforms(seen[None, indices], head_landmarks[indices], weights)
    turn, scale = turns[0].T, float(1 / scales[0])
    middle = weights @ seen[indices] / weights.sum()
    origin = middle - scale * turn @ (weights @ head_landmarks[indices] / weights.sum())
    return PhotoCamera(turn, scale, origin[:2] * (1, -1), float(origin[2]))
