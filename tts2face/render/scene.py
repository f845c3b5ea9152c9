"""Everything that stays the same while a mesh face is drawn into pictures."""

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.render.background import background
from tts2face.render.camera import Optics, optics
from tts2face.render.picture import Picture
from tts2face.render.soft_shadows import Exposure, exposed
from tts2face.render.studio_light import lamps, light_table
from tts2face.render.surface import Surface, surfaced


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A face with its camera, lights, soft shadows and background; `build_scene` makes it."""

    face: Face
    picture: Picture
    surface: Surface
    optics: Optics
    lights: NDArray[np.float32]
    exposure: Exposure
    behind: NDArray[np.uint8]


def build_scene(face: Face, picture: Picture) -> Scene:
    """The scene of a face and a picture; its soft shadows take most of a second."""
    side = picture.supersampling
    surface, towards = surfaced(face), lamps(picture.view)
    camera = optics(picture.view, face, (picture.width * side, picture.height * side))
    exposure = exposed(face, surface, towards, available_cores())
    return Scene(face, picture, surface, camera, light_table(towards, camera), exposure, background(picture))


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
