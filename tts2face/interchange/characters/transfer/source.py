"""Shipped heads whose shapes are carried over, and the choice of the one that is like a target."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from tts2face.face.landmarks import landmark_positions, scatter_landmarks
from tts2face.interchange.characters.shape_names import ARKIT_SHAPES
from tts2face.interchange.characters.surface_points import SurfacePoints
from tts2face.interchange.characters.transfer.lids import lids_in_sight
from tts2face.interchange.characters.transfer.lip_sight import lips_in_sight
from tts2face.interchange.characters.transfer.parts import is_kind
from tts2face.interchange.characters.transfer.skin import Skin, build_skin
from tts2face.interchange.characters.transfer.tracked import locate_bare_landmarks, without_colours
from tts2face.models.face import Face, keep_parts
from tts2face.models.face_file import KIND, read_identities
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, EYELID_LANDMARKS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray
from tts2face.storage.array_cache import computed_once
from tts2face.storage.shipped import find_file

REALISTIC, DRAWN = "head", "ada"
DRAWN_EYES = 0.16  # height of the eyes over the distance of their outer corners from which a head is a drawn one
CACHE_KIND, CACHE_VERSION = "source_landmarks", 3


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A shipped head: its skin, with landmarks found as those of targets are, and displacements of it.

    `identities` (P, V, 3) are those of its presets of age, sex and ancestry, mm: how heads differ.
    """

    name: str
    face: Face
    skin: Skin
    shape_names: tuple[str, ...]
    identities: FloatArray

    def moves(self) -> FloatArray:
        """Displacements (K, S, 3) of the skin by the shapes, mm."""
        return self.shapes(self.skin.rows())

    def modes(self) -> FloatArray:
        """Displacements (P, S, 3) of the skin by the identities, mm."""
        return self.identities[:, self.skin.rows()]

    def shapes(self, rows: Sequence[int] | np.ndarray) -> FloatArray:
        """Displacements (K, N, 3) of vertices of the face by the shapes, mm."""
        numbers = [self.face.shape_names.index(name) for name in self.shape_names]
        return self.face.shapes[numbers][:, rows].astype(np.float64)


def choose_source(landmarks: FloatArray) -> str:
    """Name of the shipped head that is like a target with these landmarks (468, 3): drawn for large eyes."""
    return DRAWN if eye_height(landmarks) > DRAWN_EYES else REALISTIC


def eye_height(landmarks: FloatArray) -> float:
    """Mean height of the eyes over the distance of their outer corners."""
    apart = np.linalg.norm(landmarks[EYE_OUTER_LEFT] - landmarks[EYE_OUTER_RIGHT])
    heights = [
        landmarks[list(upper), 1].max() - landmarks[list(lower), 1].min()
        for upper, lower, _, _ in EYELID_LANDMARKS.values()
    ]
    return float(np.mean(heights) / apart)


@cache
def load_source(name: str, *, is_tracked: bool = True) -> Source:
    """A shipped head as a source, loaded once in a process.

    Its landmarks are those that the tracker sees, which are kept in the user's cache folder, or its own.
    """
    face = keep_parts(load_face(name), lambda part: not is_kind(part.name, "other"))

    landmarks = _tracked_landmarks(name, face) if is_tracked else own_landmarks(face)
    names = tuple(name for name in ARKIT_SHAPES if name in face.shape_names)
    skin = lips_in_sight(build_skin(face, lids_in_sight(face, landmarks)))
    return Source(name, face, skin, names, read_identities(find_file(name, KIND)))


def _tracked_landmarks(name: str, face: Face) -> FloatArray:
    def find() -> dict[str, np.ndarray]:
        points = locate_bare_landmarks(without_colours(face)).points
        return {"vertices": points.vertices[:N_MESH_LANDMARKS], "weights": points.weights[:N_MESH_LANDMARKS]}

    shape = (N_MESH_LANDMARKS, 3)
    found = computed_once(
        CACHE_KIND, CACHE_VERSION, [name, face.vertices, face.triangles], find,
        lambda kept: kept.keys() == {"vertices", "weights"} and kept["vertices"].shape == shape,
    )  # fmt: skip
    return SurfacePoints(found["vertices"].astype(np.int64), found["weights"]).places(face.vertices)


def own_landmarks(face: Face) -> FloatArray:
    """Landmarks (468, 3) of a face's skin."""
    return scatter_landmarks(face, landmark_positions(face))[:N_MESH_LANDMARKS]
