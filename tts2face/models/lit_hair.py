"""Haircuts of faces with baked light: hair of one face, with the light on both, in any colour."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.colour import decode_srgb
from tts2face.models.baked_light import BakedLight, HairLight, HairTint
from tts2face.models.face import Face, Hairdo, Texture
from tts2face.models.hair import HAIR_PART
from tts2face.models.late import Late
from tts2face.models.named_colours import parse_hair_colour
from tts2face.models.view_transform import grey_curves

DARKEST, LEAST_GLOSS = 1e-3, 0.15  # linear light, and share of the change of gloss on light hair
OTHER_COLOUR, GLOSS_TINT = 0.15, 0.3  # distance from the hair's own colour at which that change has so little of it
SWING_SHAPES = ("hairPitch", "hairYaw", "hairRoll")  # shapes of hair that lags, in the order of the head's angles


@dataclass(frozen=True, slots=True, eq=False)
class LitHair:
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

    face: str
    n_face_vertices: int
    n_face_triangles: int
    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    uv: NDArray[np.float32]
    tangents: NDArray[np.float32]
    colours: NDArray[np.uint8]
    loose: NDArray[np.uint8]
    middle: NDArray[np.float32]
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
    """A face with another haircut in its own colour.

    Raises
    ------
    DataError
        It is a haircut of another face.
    """
    n, name = hair.n_face_vertices, str(hair.metadata.get("name", ""))
    own = face.parts[-1]
    fits = own.name == HAIR_PART and own.first == hair.n_face_triangles and face.triangles[: own.first].max() < n
    if not (fits and len(face.light) and face.triangles[own.first :].min() == n and face.uv is not None):
        raise DataError(f"the haircut {name} is one of the face {hair.face}; choose that face, or another haircut")
    moves = {**hair.shapes, **swing_shapes(hair.vertices, hair.loose / np.float32(255), hair.middle)}
    shapes = np.zeros((len(face.shapes), len(hair.vertices), 3), np.float32)
    for number, shape in enumerate(face.shape_names):
        if shape in moves:
            shapes[number] = moves[shape]
    tangents = np.zeros((n, 3), np.float32) if face.tangents is None else face.tangents[:n]
    lights, textures = face.light, face.textures
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
        light=Late(1, lambda: [_lit(lights[0], hair)]),
    )


def _lit(light: BakedLight, hair: LitHair) -> BakedLight:
    worn = hair.lights[0]
    if worn.base.shape != light.base.shape:
        raise DataError(f"the light of the haircut {hair.metadata.get('name', '')} is of another build of {hair.face}")
    return light.with_hair(worn)


def tint_hair(face: Face, colour: str) -> Face:
    """A face with baked light whose hair has a colour.

    Raises
    ------
    InputError
        There is no such hair colour.
    DataError
        The hair of the face has one colour only.
    """
    srgb, lights = parse_hair_colour(colour), face.light
    tint = lights[0].tint
    if tint is None:
        raise DataError("the hair of this face has one colour only; remove the colour of the hair")
    n = len(face.vertices) - tint.vertices.shape[1]
    known = np.concatenate([face.colours[None, n:], tint.vertices]).astype(np.float64)
    colours = face.colours.copy()
    for channel, (pair, share) in enumerate(_brackets(tint.colours.astype(np.float64), srgb)):
        mixed = known[pair[0], :, channel] + share * (known[pair[1], :, channel] - known[pair[0], :, channel])
        colours[n:, channel] = np.rint(np.clip(mixed, 0, 255))
    return replace(
        face,
        colours=colours,
        hairdo=Hairdo("" if face.hairdo is None else face.hairdo.haircut, colour),
        light=Late(1, lambda: [_tinted(lights[0], tint, srgb)]),
    )


def _brackets(known: NDArray[np.float64], wanted: NDArray[np.float64]) -> Iterator[tuple[tuple[int, int], float]]:
    """For each channel the two of known colours (C, 3) between which a colour (3,) lies, or nearest, and its share."""
    for levels, level in zip(known.T, wanted, strict=True):
        order = np.argsort(levels)
        above = int(np.clip(np.searchsorted(levels[order], level), 1, len(order) - 1))
        low, high = int(order[above - 1]), int(order[above])
        yield (low, high), float((level - levels[low]) / (levels[high] - levels[low]))


def _tinted(light: BakedLight, tint: HairTint, srgb: NDArray[np.float64]) -> BakedLight:
    """Light with hair in a colour: linear light is interpolated between those of the hair's known colours.

    The view transform is undone and done along its greys, by one curve a channel; what it mixes of the channels cancels
    at the known colours. What changes with the camera is gloss, which adds to the hair and shows the less the lighter
    it is.
    """
    from PIL import Image

    def resized(pixels: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
        return np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BILINEAR))

    side, (high, wide) = light.pages.shape[1], tint.pages.shape[1:3]
    pages = light.pages.copy()
    own = pages[1, : high * side // wide]
    known = [own.copy(), *(resized(one, own.shape[1::-1]) for one in tint.pages)]
    small = (light.turn_side, high * light.turn_side // wide)
    before = resized(own, small)
    curves = [*zip(*grey_curves(light.view), strict=True)]
    brackets = _brackets(decode_srgb(tint.colours.astype(np.float64)), decode_srgb(srgb))
    for channel, ((to_light, bounds), (pair, share)) in enumerate(zip(curves, brackets, strict=True)):
        first, second = (to_light[known[at][..., channel]] for at in pair)
        own[..., channel] = np.searchsorted(bounds, first + np.float32(share) * (second - first))
    grey = curves[1][0]
    ratio = grey[before.max(axis=2)] / np.maximum(grey[resized(own, small).max(axis=2)], DARKEST)
    gloss = np.clip(ratio, LEAST_GLOSS, 1.0).ravel()
    apart = float(np.abs(srgb - tint.colours[0]).mean()) / OTHER_COLOUR
    end = light.camera_modes.shape[2] - light.turn_side**2
    span = slice(end, end + gloss.size)
    cameras = light.camera_modes.copy()
    changes = cameras[:, :, span].astype(np.float32)
    mean = changes.mean(axis=1, keepdims=True)
    cameras[:, :, span] = np.rint(gloss * (mean + max(1 - apart, GLOSS_TINT) * (changes - mean)))
    return replace(light, pages=pages, camera_modes=cameras)
