"""A face in a picture between the steps of `speaking_photo`: each adds parts to those of the one before it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Face
from tts2face.numeric.arrays import Float32Array, FloatArray, Pixels
from tts2face.photo.camera import PhotoCamera
from tts2face.photo.eyes import EyePatch
from tts2face.photo.fit import PhotoPlaces
from tts2face.photo.found_face import PhotographedFace
from tts2face.photo.lids import LidFrame, ShutEye
from tts2face.photo.light import Changing, MouthRows
from tts2face.photo.lines import LidLines
from tts2face.photo.mesh import PhotoMesh
from tts2face.photo.shapes import PhotoPerson
from tts2face.photo.surface import PhotoPages, PhotoSurface, Vertices
from tts2face.photo.teeth import OwnTeeth

BREATH = "breath"


@dataclass(frozen=True, slots=True, eq=False)
class HeadModel:
    """The shipped head without hair, its landmarks (478, 3), mm, and the names of the shapes of photographed faces."""

    head: Face
    landmarks: FloatArray
    names: tuple[str, ...]

    @classmethod
    def of(cls, head: Face) -> "HeadModel":
        """That of a head without hair."""
        return cls(head, scatter_landmarks(head, landmark_positions(head)), (*head.shape_names, BREATH))

    def motion(self) -> dict[str, FloatArray]:
        """(478, 3) motion of the landmarks in each shape, mm; 0 for those that the head lacks."""
        moved = landmark_motion(self.head, np.arange(len(self.head.shapes)))
        spread = np.nan_to_num(scatter_landmarks(self.head, moved))
        return dict(zip(self.head.shape_names, np.moveaxis(spread, -1, 0), strict=True))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Traced:
    """A face in a picture after the first step: its camera, landmarks, lips and lids, corrected where a person did so.

    ``landmarks`` (478, 3) and ``pivot`` (3,) are pixels and depths.
    """

    model: HeadModel
    seen: PhotographedFace
    camera: PhotoCamera
    landmarks: FloatArray
    given: PhotoPlaces
    person: PhotoPerson
    lids: LidLines
    pivot: FloatArray

    @property
    def pixels(self) -> Pixels:
        """(H, W, 3) of the picture."""
        return self.seen.picture.pixels


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Skinned(Traced):
    """The face with its skin: a mesh over the picture, pixels and depths (V, 3) of it, its motion and its creases."""

    mesh: PhotoMesh
    photo: FloatArray
    skin: Vertices
    creases: FloatArray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Pictured(Skinned):
    """The face with pictures of what lies behind its skin: patches and lids of its eyes, and the person's own teeth."""

    patches: Sequence[Sequence[EyePatch]]
    teeth: OwnTeeth | None
    frames: Sequence[LidFrame]
    shut: Sequence[ShutEye]
    pages: PhotoPages


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Laid(Pictured):
    """The face with a surface of skin, lids and eyes, which the mouth is added to; landmarks lie on its corners."""

    surface: PhotoSurface
    corners: NDArray[np.int32]
    weights: Float32Array
    lashes: Changing


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Filled(Laid):
    """The face with a mouth, and the place (3,) of the edge of its upper teeth."""

    mouth: MouthRows
    teeth_edge: FloatArray


Step = TypeVar("Step", bound=Traced)


def after(step: type[Step], before: Traced, **parts: Any) -> Step:
    """The face after a step, with what the step adds."""
    return step(**{field.name: getattr(before, field.name) for field in fields(before)}, **parts)
