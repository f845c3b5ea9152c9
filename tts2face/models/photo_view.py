"""View of a face that is moved in a picture of a person, by the camera that took the picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import make_read_only

HEAD_GAIN = 0.75  # of the turns of a head, in a photograph
# of a turn, towards which larger ones bend: the picture has no other side of the face
HEAD_LIMIT_RAD = np.radians(9.0)
# of shifts of the head: the picture does not show what they uncover
SHIFT_GAIN = 0.45
NO_TURN_DEG = 75.0  # yaw of a photographed head that does not move


@dataclass(frozen=True, slots=True, eq=False)
class PhotoView:
    """How a photographed face is seen and moved: by the camera that took the picture, its light's backdrop.

    ``view`` (3, 4) goes from the face to that camera (x right, y down, z ahead, mm), and ``lens`` (3,) is its focal
    length and centre in pixels of the picture, which has a ``size`` (width, height) and the coverage ``alpha`` (H, W)
    unless it is opaque; ``behind`` (H, W, 3) is the background that was divided from the person in an opaque one.
    Vertices follow the head's motion by the shares ``follow`` (V,). The first page of the light begins at the pixel
    ``corner`` (2,).
    """

    size: tuple[int, int]
    view: NDArray[np.float64]
    lens: NDArray[np.float64]
    follow: NDArray[np.float32]
    corner: tuple[int, int]
    alpha: NDArray[np.uint8] | None = None
    behind: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        make_read_only(self)

    @property
    def turn(self) -> NDArray[np.float64]:
        """(3, 3) from the axes of the face to x right, y up, z towards the camera."""
        turned: NDArray[np.float64] = self.view[:, :3] * np.array([[1.0], [-1.0], [-1.0]])
        return turned

    @property
    def head_gain(self) -> float:
        """Share of the turns of a head that the picture bears, where they are small: less where it is turned in it."""
        turned_deg = float(np.degrees(np.arctan2(abs(self.view[0, 2]), abs(self.view[2, 2]))))
        return HEAD_GAIN * max(0.0, 1 - turned_deg / NO_TURN_DEG)

    def bearable(self, head: NDArray[np.floating]) -> NDArray[np.float32]:
        """The part of a head pose (6,), rad and mm, that the picture bears."""
        turns = HEAD_LIMIT_RAD * np.tanh(self.head_gain * np.asarray(head[:3], np.float64) / HEAD_LIMIT_RAD)
        return np.array([*turns, *(SHIFT_GAIN * np.asarray(head[3:5], np.float64)), 0.0], np.float32)
