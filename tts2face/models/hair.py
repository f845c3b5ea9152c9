"""Haircuts: hair cards that are fitted to a head and drawn in any colour."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.checks import free, whole
from tts2face.models.codec import InHeader, StoredModel
from tts2face.models.face import Face, FacePart, Hairdo, Texture
from tts2face.models.late import Late
from tts2face.models.mesh_coding import TANGENTS, UV
from tts2face.models.named_colours import parse_hair_colour
from tts2face.numeric.arrays import decode_srgb, encode_srgb
from tts2face.storage.schema import Tensor, millimetres

HAIR_PART, WORN_PART = "hair", "glasses"
MEAN_RELIEF = 128.0  # relief at which a strand has the colour of the hair
# Levels, of 255, at which hair is seen in the middle from in front, and of its strands: `head` in ten colours.
SEEN_LEVELS = np.array([0, 9, 20, 31, 46, 64, 80, 109, 127, 146, 178, 194, 209, 255.0])
STRAND_LEVELS = np.array([0, 14, 20, 27, 40, 51, 61, 80, 90, 103, 127, 143, 164, 220.0])
# Light in the middle of haircuts that hang away from the lamps or shade themselves, of that of the others.
SHADED_HAIRCUTS = {
    "afro01": 0.53, "curly01": 0.75, "curly02": 0.63, "fringe01": 0.9, "long01": 0.54, "wavy01": 0.47, "wavy02": 0.9,
}  # fmt: skip
MATERIAL = FacePart(HAIR_PART, 0, 0, specular=0.3, shininess=24.0, wrap=0.3, cutout=True, kind="strands")


@dataclass(frozen=True, slots=True, eq=False)
class Hair(StoredModel):
    """A haircut for heads of one layout, those whose vertices correspond to the shipped head's.

    Parameters
    ----------
    vertices, triangles : (V, 3), (F, 3)
        Cards on the head that they were fitted to, mm.
    uv : (V, 2)
        Texture coordinates in [0, 1] from the top left corner.
    tangents : (V, 3)
        Unit vectors along the strands, from root to tip.
    pictures : (H, W), (H, W), (h, w)
        `relief`: linear light of the strands relative to the colour of the hair (128 = 1); `alpha`: their coverage,
        0-255; and where there is one, `scalp`: coverage of the skin's texture by hair, painted in the hair's colour
        under the cards, 0-255.
    anchors, anchor_places : (A,), (A, 3)
        Vertices of the head that carry the hair, and their places on that head, mm: another head moves the hair as it
        moves these.
    n_face_vertices
        Number of vertices of heads of the layout.
    metadata
        Name, summary, licence, attribution, and the command that built it.
    occlusion, skin_occlusion : (V, D / 8), (n_face_vertices, D / 8)
        Directions from which the vertices of the hair, and by the hair those of the head, are hidden
        (`tts2face.picture.occlusion`); None where they are not computed.
    """

    vertices: Annotated[NDArray[np.float32], millimetres("vertices", 3)]
    triangles: Annotated[NDArray[np.int32], Tensor("int32", ("triangles", 3))]
    uv: Annotated[NDArray[np.float32], UV]
    tangents: Annotated[NDArray[np.float32], TANGENTS]
    pictures: Sequence[NDArray[np.uint8]]
    anchors: Annotated[NDArray[np.int32], Tensor("int32", ("anchors",))]
    anchor_places: Annotated[NDArray[np.float32], millimetres("anchors", 3)]
    n_face_vertices: Annotated[int, InHeader(whole(1, 2**31 - 1))]
    metadata: Annotated[Mapping[str, Any], InHeader(free, encode=dict)] = field(default_factory=dict)
    occlusion: NDArray[np.uint8] | None = None
    skin_occlusion: NDArray[np.uint8] | None = None

    @property
    def relief(self) -> NDArray[np.uint8]:
        """First of the pictures."""
        return self.pictures[0]

    @property
    def alpha(self) -> NDArray[np.uint8]:
        """Second of the pictures."""
        return self.pictures[1]

    @property
    def scalp(self) -> NDArray[np.uint8] | None:
        """Third of the pictures; None where nothing is painted."""
        return self.pictures[2] if len(self.pictures) > 2 else None


def attach_hair(face: Face, hair: Hair, colour: str) -> Face:
    """A face with a haircut, which moves with the head.

    Raises
    ------
    InputError
        There is no such hair colour.
    DataError
        The haircut belongs to heads of another layout.
    """
    # what is worn, such as glasses, lies behind the vertices of the layout
    worn = len(face.vertices) - hair.n_face_vertices
    if worn < 0 or (worn and not any(part.name == WORN_PART for part in face.parts)):
        raise DataError(
            f"the haircut {hair.metadata.get('name', '')} fits heads of {hair.n_face_vertices} vertices, but the face "
            f"has {len(face.vertices)}; choose another face or no hair"
        )
    srgb = strand_colour(parse_hair_colour(colour), str(hair.metadata.get("name", "")))
    textures = face.textures  # the rest of the face is not kept for them
    n_old, n_new = len(face.vertices), len(hair.vertices)
    uv = np.zeros((n_old, 2), np.float32) if face.uv is None else face.uv
    tangents = np.zeros((n_old, 3), np.float32) if face.tangents is None else face.tangents
    part = replace(MATERIAL, first=len(face.triangles), count=len(hair.triangles), texture=len(textures))
    return replace(
        face,
        vertices=np.concatenate([face.vertices, fit_hair(face, hair)]),
        triangles=np.concatenate([face.triangles, hair.triangles + np.int32(n_old)]),
        parts=(*face.parts, part),
        shapes=np.pad(face.shapes, ((0, 0), (0, n_new), (0, 0))),
        colours=np.concatenate([face.colours, np.tile(np.rint(255 * srgb).astype(np.uint8), (n_new, 1))]),
        uv=np.concatenate([uv, hair.uv]),
        textures=Late(len(textures) + 1, lambda: _painted(textures, hair, srgb)),
        tangents=np.concatenate([tangents, hair.tangents]),
        hairdo=Hairdo(str(hair.metadata.get("name", "")), colour),
        occlusion=_join_occlusion(face, hair),
    )


def _join_occlusion(face: Face, hair: Hair) -> NDArray[np.uint8] | None:
    """Occlusion (P, V, D / 8) of a face with a haircut; None if either has none, or of other directions."""
    own, cards, shadow = face.occlusion, hair.occlusion, hair.skin_occlusion
    if own is not None and shadow is not None and len(shadow) < own.shape[1]:
        shadow = np.pad(shadow, ((0, own.shape[1] - len(shadow)), (0, 0)))
    if (
        own is None
        or cards is None
        or shadow is None
        or own.shape[2] != cards.shape[1]
        or cards.shape[1] != shadow.shape[1]
    ):
        return None
    return np.concatenate([own | shadow, np.broadcast_to(cards, (len(own), *cards.shape))], axis=1)


def fit_hair(face: Face, hair: Hair) -> NDArray[np.float32]:
    """Vertices (V, 3) of a haircut on a face: it moves as its anchors do (biharmonic interpolation in space)."""
    places = hair.anchor_places.astype(np.float64)
    moved = face.vertices[hair.anchors].astype(np.float64) - places
    # the head that it was made for
    if not np.abs(moved).max(initial=0.0) > 0:
        return hair.vertices.astype(np.float32)
    n, middle, scale = len(places), places.mean(axis=0), float(np.ptp(places, axis=0).max())

    def terms(points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances from the anchors, and an affine map, at points (N, 3)."""
        squared = (points**2).sum(axis=1)[:, None] + (places**2).sum(axis=1) - 2 * points @ places.T
        affine = np.column_stack([np.ones(len(points)), (points - middle) / scale])
        # biharmonic in space: the kernel is the distance
        return np.hstack([-np.sqrt(np.maximum(squared, 0.0)), affine])

    matrix = np.zeros((n + 4, n + 4))
    matrix[:n] = terms(places)
    matrix[n:, :n] = matrix[:n, n:].T
    np.fill_diagonal(matrix[:n, :n], 0.0)
    factors = np.linalg.solve(matrix, np.concatenate([moved, np.zeros((4, 3))]))
    fitted: NDArray[np.float32] = (hair.vertices + terms(hair.vertices.astype(np.float64)) @ factors).astype(np.float32)
    return fitted


def strand_colour(srgb: NDArray[np.float64], haircut: str = "") -> NDArray[np.float64]:
    """Colour (..., 3) of strands that are seen in a colour before lamps: gloss and light between them brighten hair."""
    strands = decode_srgb(np.interp(srgb, SEEN_LEVELS / 255, STRAND_LEVELS / 255)) / SHADED_HAIRCUTS.get(haircut, 1.0)
    colour: NDArray[np.float64] = encode_srgb(np.minimum(strands, 1.0)) / 255
    return colour


def seen_colour(srgb: NDArray[np.floating], haircut: str = "") -> NDArray[np.float64]:
    """Colour (..., 3) in which strands are seen: the inverse of `strand_colour`."""
    strands = encode_srgb(decode_srgb(np.asarray(srgb, np.float64)) * SHADED_HAIRCUTS.get(haircut, 1.0)) / 255
    seen: NDArray[np.float64] = np.interp(strands, STRAND_LEVELS / 255, SEEN_LEVELS / 255)
    return seen


def colour_relief(relief: NDArray[np.uint8], srgb: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Pixels (H, W, 3), sRGB, of strands with a relief (H, W) in a colour (3,)."""
    pixels: NDArray[np.uint8] = encode_srgb(np.arange(256)[:, None] / MEAN_RELIEF * decode_srgb(srgb))[relief]
    return pixels


def _painted(textures: Sequence[Texture], hair: Hair, srgb: NDArray[np.float64]) -> tuple[Texture, ...]:
    """A face's textures with the scalp in the colour of the hair, and that of the strands."""
    strands = Texture(colour_relief(hair.relief, srgb), hair.alpha)
    if hair.scalp is None or not textures:
        return (*textures, strands)
    return (_paint_scalp(textures[0], hair.scalp, srgb), *textures[1:], strands)


def _paint_scalp(skin: Texture, scalp: NDArray[np.uint8], srgb: NDArray[np.float64]) -> Texture:
    from PIL import Image

    size = skin.pixels.shape[1::-1]
    cover = np.asarray(Image.fromarray(scalp).resize(size, Image.Resampling.BILINEAR))
    light = decode_srgb(np.arange(256) / 255.0)[:, None]
    share = np.arange(256, dtype=np.float32)[:, None, None] / 255
    mixed = encode_srgb(light * (1 - share) + decode_srgb(srgb) * share)  # (256, 256, 3) by cover and skin
    pixels, covered = np.array(skin.pixels), cover > 0
    pixels[covered] = mixed[cover[covered][:, None], skin.pixels[covered], np.arange(3)]
    return Texture(pixels, skin.alpha)
