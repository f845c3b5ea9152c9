"""Everything that stays the same while a mesh face is drawn into pictures."""

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.render.background import draw_background
from tts2face.render.camera import CameraMatrices, camera_matrices
from tts2face.render.picture import Picture
from tts2face.render.soft_shadows import Exposure, compute_exposure
from tts2face.render.studio_light import lamp_directions, light_table
from tts2face.render.surface import Surface, build_surface


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A face with its camera, lights, soft shadows and background; `build_scene` makes it."""

    face: Face
    picture: Picture
    surface: Surface
    optics: CameraMatrices
    lights: NDArray[np.float32]
    exposure: Exposure
    background: NDArray[np.uint8]


def build_scene(face: Face, picture: Picture) -> Scene:
    """The scene of a face and a picture; its soft shadows take most of a second."""
    side = picture.supersampling
    surface, towards = build_surface(face), lamp_directions(picture.view)
    camera = camera_matrices(picture.view, face, (picture.width * side, picture.height * side))
    exposure = compute_exposure(face, surface, towards, available_cores())
    return Scene(face, picture, surface, camera, light_table(towards, camera), exposure, draw_background(picture))


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
