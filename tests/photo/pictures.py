"""Pictures of shipped faces, and where their landmarks lie in them."""

from dataclasses import astuple
from functools import cache

import numpy as np
import pytest

from tts2face.face.deformation import REST_HEAD
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.photo.eyes import SIDES
from tts2face.photo.found_face import FoundFace, PhotographedFace
from tts2face.photo.photograph import Photograph
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.picture.camera import camera_matrices
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, draw
from tts2face.types import Trajectory

ONE_PROCESS = pytest.mark.xdist_group("photo")  # modules with the same picture of 400 pixels, drawn once
SMILE = {
    **{f"{shape}{side}": weight for shape, weight in (("mouthSmile", 0.9), ("mouthUpperUp", 0.35)) for side in SIDES},
    **{f"mouthLowerDown{side}": 0.5 for side in SIDES},
    "jawOpen": 0.12,
}  # whose upper teeth are seen
_SPEAKING: dict[tuple[object, ...], Face] = {}


def still(name: str, side: int, *, head: tuple[float, ...] = (0, 0, 0), **weights: float) -> np.ndarray:
    """Picture (S, S, 3) of a shipped face, with a head turned by pitch, yaw and roll in degrees."""
    return _drawn(name, side, head, tuple(weights.items())).copy()


@cache
def _drawn(name: str, side: int, head: tuple[float, ...], weights: tuple[tuple[str, float], ...]) -> np.ndarray:
    face = load_face(name)
    pose = np.array([*np.radians(head), 0, 0, 0], np.float32)
    return draw(face, weights_of(face, **dict(weights)), pose, picture=Picture(size=f"{side}x{side}"))


def projected(name: str, side: int, **weights: float) -> np.ndarray:
    """Places (478, 3) of the landmarks of a shipped face in its picture: pixels, and depths away from the camera."""
    return _projected(name, side, tuple(weights.items())).copy()


@cache
def _projected(name: str, side: int, shapes: tuple[tuple[str, float], ...]) -> np.ndarray:
    weights = dict(shapes)
    face = load_face(name)
    camera = camera_matrices(Picture().view, face, (side, side))
    motion = Trajectory(face.shape_names, weights_of(face, **weights)[None], 30.0)
    points = moved_landmarks(face, motion)[0] @ camera.view[:, :3].T + camera.view[:, 3]
    places = camera.lens[1:3] + camera.lens[0] * points[:, :2] / points[:, 2:] - 0.5
    depths = (points[:, 2] - points[:, 2].mean()) * camera.lens[0] / points[:, 2].mean()
    return np.column_stack([places, depths])


def found_in(name: str, side: int, **weights: float) -> FoundFace:
    """A shipped face in its picture, as if a tracker had found it without error."""
    places = projected(name, side, **weights)
    eyes = float(np.linalg.norm(places[EYE_OUTER_LEFT, :2] - places[EYE_OUTER_RIGHT, :2]))
    return FoundFace(places, 0.0, (0.0, 0.0, 0.0), eyes, 1)


def speaking(picture: Photograph, found: FoundFace) -> Face:
    """The bald shipped head as Ada in a picture; pictures of the same content give one face, made once."""
    parts = (*astuple(picture), found.landmarks)
    key = tuple(part.tobytes() + str(part.shape).encode() if isinstance(part, np.ndarray) else part for part in parts)
    if key not in _SPEAKING:
        metadata = {"name": "Ada", "consent": {"statement": "drawn"}}
        _SPEAKING[key] = speaking_photo(photographed(picture, found), load_face("head", hair="bald"), metadata)
    return _SPEAKING[key]


def photographed(picture: Photograph, found: FoundFace, smile: float = 0.0) -> PhotographedFace:
    """A picture and the face in it, with a score of its smile."""
    return PhotographedFace(picture, found, {"mouthSmileLeft": smile, "mouthSmileRight": smile})


def drawn(renderer: MeshRenderer, head: np.ndarray = REST_HEAD, **weights: float) -> np.ndarray:
    """Picture of a face whose shapes have weights, with its head in a pose (6,)."""
    return renderer.draw(weights_of(renderer.scene.face, **weights), head)


def weights_of(face: Face, **weights: float) -> np.ndarray:
    """Weights of all shapes of a face, 0 where none is given."""
    return np.array([weights.get(name, 0.0) for name in face.shape_names], np.float32)
