"""Haircuts of faces with baked light: hair of one face, with the light on both, and how a face wears it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.checks import text, whole
from tts2face.models.baked_light import BakedLight, HairLight
from tts2face.models.codec import InHeader, Stored, StoredModel
from tts2face.models.face import Face, Hairdo, Texture
from tts2face.models.hair import HAIR_PART
from tts2face.models.late import Late
from tts2face.models.light import Lamps
from tts2face.models.mesh_coding import (
    TANGENTS,
    UV,
    round_places,
)
from tts2face.storage.schema import Tensor, millimetres

SWING_SHAPES = ("hairPitch", "hairYaw", "hairRoll")  # shapes of hair that lags, in the order of the head's angles
# of vertices or triangles: indices have 32 bits
COUNT = whole(1, 2**31 - 1)


@dataclass(frozen=True, slots=True, eq=False)
class LitHair(StoredModel):
    """A haircut of one face with baked light; it takes the place of the hair that the face has in its file.

    Parameters
    ----------
    face
        Name of the face.
    n_face_vertices, n_face_triangles
        Of the face without hair, which are its first ones.
    vertices, triangles : (V, 3), (F, 3)
        mm, and numbers among these vertices.
    uv, tangents : (V, 2), (V, 3)
    colours : (V, 3)
    loose : (V,)
        Share of a lag of the hair that a vertex follows, in 255ths.
    middle : (3,)
        About which it swings, mm.
    shapes
        Displacement (V, 3), mm, by names of other shapes of the face; those not named do not move the hair.
    skins
        The only picture (H, W, 3): the texture of the skin, painted where this hair grows.
    lights
        The only light.
    metadata
        Name, summary, licence, and the command that built it.
    """

    face: Annotated[str, InHeader(text)]
    n_face_vertices: Annotated[int, InHeader(COUNT)]
    n_face_triangles: Annotated[int, InHeader(COUNT)]
    vertices: Annotated[NDArray[np.float32], Stored(millimetres("vertices", 3), encode=round_places)]
    triangles: Annotated[NDArray[np.int32], Tensor("int32", ("triangles", 3))]
    uv: Annotated[NDArray[np.float32], UV]
    tangents: Annotated[NDArray[np.float32], TANGENTS]
    colours: Annotated[NDArray[np.uint8], Tensor("uint8", ("vertices", 3))]
    loose: Annotated[NDArray[np.uint8], Tensor("uint8", ("vertices",))]
    middle: Annotated[NDArray[np.float32], millimetres(3)]
    shapes: Mapping[str, NDArray[np.float32]]
    skins: Sequence[NDArray[np.uint8]]
    lights: Sequence[HairLight]
    metadata: Mapping[str, Any] = field(default_factory=dict)


def swing_shapes(
    points: NDArray[np.floating], share: NDArray[np.floating], middle: NDArray[np.floating]
) -> dict[str, NDArray[Any]]:
    """Motion (V, 3) of hair (V, 3) for a lag of 1 rad about each of the head's axes through a middle (3,), mm.

    A vertex follows a share (V,) of it.
    """
    off = points - middle
    axes = dict(zip(SWING_SHAPES, np.eye(3, dtype=points.dtype), strict=True))
    return {name: share[:, None] * np.cross(axis, off) for name, axis in axes.items()}


def wear_hair(face: Face, hair: LitHair) -> Face:
    """A face with another haircut in its own colour."""
    n, name = hair.n_face_vertices, str(hair.metadata.get("name", ""))
    own = face.parts[-1]
    fits = own.name == HAIR_PART and own.first == hair.n_face_triangles and face.triangles[: own.first].max() < n
    light = face.light
    if isinstance(light, Lamps) or not (fits and face.triangles[own.first :].min() == n and face.uv is not None):
        raise DataError(f"the haircut {name} is one of the face {hair.face}; choose that face, or another haircut")
    moves = {**hair.shapes, **swing_shapes(hair.vertices, hair.loose / np.float32(255), hair.middle)}
    shapes = np.zeros((len(face.shapes), len(hair.vertices), 3), np.float32)
    for number, shape in enumerate(face.shape_names):
        if shape in moves:
            shapes[number] = moves[shape]
    tangents = np.zeros((n, 3), np.float32) if face.tangents is None else face.tangents[:n]
    textures = face.textures
    return replace(
        face,
        vertices=np.concatenate([face.vertices[:n], hair.vertices]),
        triangles=np.concatenate([face.triangles[: own.first], hair.triangles + np.int32(n)]),
        parts=(*face.parts[:-1], replace(own, count=len(hair.triangles))),
        shapes=np.concatenate([face.shapes[:, :n], shapes], axis=1),
        colours=np.concatenate([face.colours[:n], hair.colours]),
        uv=np.concatenate([face.uv[:n], hair.uv]),
        tangents=np.concatenate([tangents, hair.tangents]),
        textures=Late(len(textures), lambda: (Texture(hair.skins[0]), *textures[1:])),
        hairdo=Hairdo(name, "" if face.hairdo is None else face.hairdo.colour),
        occlusion=None,
        light=light.changed(lambda baked: _lit(baked, hair)),
    )


def _lit(light: BakedLight, hair: LitHair) -> BakedLight:
    worn = hair.lights[0]
    if worn.base.shape != light.base.shape:
        raise DataError(f"the light of the haircut {hair.metadata.get('name', '')} is of another build of {hair.face}")
    return light.with_hair(worn)
