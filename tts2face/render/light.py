"""The studio: a warm key light, a soft fill, a cool rim, a bright sky and a dim floor."""

import numpy as np
from numpy.typing import NDArray

from tts2face.render.camera import Optics

# Sky, floor: colour. Lights: yaw and pitch in degrees as the camera's, then colour; linear light.
SKY, FLOOR = (0.34, 0.36, 0.40), (0.17, 0.14, 0.125)
KEY = (-38.0, 32.0, (1.04, 0.97, 0.88))
FILL = (48.0, 8.0, (0.30, 0.33, 0.38))
RIM = (150.0, 38.0, (0.62, 0.70, 0.85))


def direction(yaw_deg: float, pitch_deg: float) -> NDArray[np.float64]:
    """(3,) unit vector towards a light in front of a camera that looks level: x right, y down, z ahead."""
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    return np.array([np.sin(yaw) * np.cos(pitch), -np.sin(pitch), -np.cos(yaw) * np.cos(pitch)])


def studio(camera: Optics) -> NDArray[np.float32]:
    """(6, 6) lights for the kernels: they stand around the camera, the sky is above the world."""
    rows = np.zeros((6, 6))
    rows[0, :3], rows[1, :3] = SKY, FLOOR
    rows[2, :3] = camera.view[:, :3] @ [0.0, 1.0, 0.0]
    for row, (yaw, pitch, colour) in zip(rows[3:], (KEY, FILL, RIM), strict=True):
        row[:3], row[3:] = direction(yaw, pitch), colour
    return rows.astype(np.float32)
