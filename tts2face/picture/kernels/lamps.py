"""Studio lighting: warm key light, soft fill, two cool rim lights, low ambient light, and a filmic tone curve."""

import math

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.camera import CameraMatrices
from tts2face.picture.camera_view import CameraView

# Sky and floor: colour. Lamps: yaw and pitch in degrees, measured like the camera's, then colour. Linear light.
SKY_COLOUR, FLOOR_COLOUR = (0.30, 0.307, 0.335), (0.115, 0.112, 0.115)
# degrees beside and above the camera's axis, and colour; warm
KEY_LIGHT = (-36.0, 32.0, (1.36, 1.25, 1.13))
FILL_LIGHT = (46.0, 8.0, (0.37, 0.375, 0.41))
RIM_LIGHTS = ((150.0, 34.0, (0.85, 0.92, 1.05)), (-156.0, 26.0, (0.50, 0.52, 0.58)))
LAMPS = (KEY_LIGHT, FILL_LIGHT, *RIM_LIGHTS)
LAMP_RADIUS_RAD = math.radians(16.0)  # angular radius: large lamps cast soft shadows
# Rows of the light table; a lamp has direction and colour.
SKY_ROW, FLOOR_ROW, UP_ROW, FIRST_LIGHT_ROW = range(4)
BRIGHTNESS = 0.8  # of the picture, before the tone curve


def lamp_direction(yaw_deg: float, pitch_deg: float) -> NDArray[np.float64]:
    """Unit vector (3,) from the head to a lamp in the axes of a level camera: x right, y up, z to the camera."""
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    return np.array([math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)])


def lamp_directions(camera: CameraView) -> NDArray[np.float64]:
    """World directions (4, 3) of the lamps, which rotate about the head with the camera's yaw."""
    return np.array([lamp_direction(yaw + camera.yaw_deg, pitch) for yaw, pitch, _ in LAMPS])


def light_table(directions: NDArray[np.float64], optics: CameraMatrices) -> NDArray[np.float32]:
    """Light table (7, 6) of `tts2face.picture.kernels.shade` in camera space: sky, floor, up, four lamps."""
    rotation = optics.view[:, :3]
    rows = np.zeros((FIRST_LIGHT_ROW + len(LAMPS), 6))
    rows[SKY_ROW, :3], rows[FLOOR_ROW, :3], rows[UP_ROW, :3] = SKY_COLOUR, FLOOR_COLOUR, rotation @ [0.0, 1.0, 0.0]
    for row, towards, (_, _, colour) in zip(rows[FIRST_LIGHT_ROW:], directions, LAMPS, strict=True):
        row[:3], row[3:] = rotation @ towards, colour
    return rows.astype(np.float32)
