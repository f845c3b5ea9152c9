"""Studio lighting: warm key light, soft fill, cool rim light, bright sky and dim floor."""

import math

import numpy as np
from numpy.typing import NDArray

from tts2face.render.camera import CameraMatrices
from tts2face.render.camera_views import CameraView

# Sky and floor: colour. Lamps: yaw and pitch in degrees, measured like the camera's, then colour. Linear light.
SKY_COLOUR, FLOOR_COLOUR = (0.26, 0.265, 0.285), (0.13, 0.105, 0.095)
KEY_LIGHT = (-44.0, 36.0, (1.22, 1.14, 1.04))
FILL_LIGHT = (52.0, 6.0, (0.25, 0.245, 0.25))
RIM_LIGHT = (148.0, 36.0, (0.75, 0.84, 1.0))
LAMP_RADIUS_RAD = math.radians(13.0)  # angular radius: large lamps cast soft shadows


def lamp_direction(yaw_deg: float, pitch_deg: float) -> NDArray[np.float64]:
    """Unit vector (3,) from the head to a lamp in the axes of a level camera: x right, y up, z to the camera."""
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    return np.array([math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)])


def lamp_directions(camera: CameraView) -> NDArray[np.float64]:
    """World directions (3, 3) of the lamps, which rotate about the head with the camera's yaw."""
    return np.array(
        [lamp_direction(yaw + camera.yaw_deg, pitch) for yaw, pitch, _ in (KEY_LIGHT, FILL_LIGHT, RIM_LIGHT)]
    )


def light_table(directions: NDArray[np.float64], optics: CameraMatrices) -> NDArray[np.float32]:
    """Light table (6, 6) of `tts2face.render.shade.shade_fragments` in camera space: sky, floor, up, three lamps."""
    rotation = optics.view[:, :3]
    rows = np.zeros((6, 6))
    rows[0, :3], rows[1, :3], rows[2, :3] = SKY_COLOUR, FLOOR_COLOUR, rotation @ [0.0, 1.0, 0.0]
    for row, towards, (_, _, colour) in zip(rows[3:], directions, (KEY_LIGHT, FILL_LIGHT, RIM_LIGHT), strict=True):
        row[:3], row[3:] = rotation @ towards, colour
    return rows.astype(np.float32)
