"""Reading and writing of ``.hair`` files (docs/file-formats.md).

Haircuts of faces with baked light: hair of one face, with the light on both, in any colour.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.checks import Check, anything, free, list_of, text, whole
from tts2face.models.baked_light import BakedLight, HairLight, HairTint, grey_curves
from tts2face.models.face import Face, Hairdo, Late, Texture
from tts2face.models.face_names import BALD, HAIR_KIND, OF_FACE, haircut_names
from tts2face.models.face_schema import (
    MAX_OCCLUSION_BYTES,
    decode_occlusion,
    decode_tangents,
    decode_uv,
    encode_occlusion,
    encode_tangents,
    encode_uv,
    round_places,
)
from tts2face.models.hair import HAIR_PART, Hair, parse_hair_colour
from tts2face.models.light import Lamps
from tts2face.models.light_coding import (
    HAIR_QUALITY,
    SHAPE_TENSORS,
    check_shapes,
    decode_hair_light,
    encode_hair_light,
    pack_shapes,
    unpack_shapes,
)
from tts2face.numeric.arrays import decode_srgb
from tts2face.storage.model_pictures import decode_colours, decode_coverage, encode_colours, encode_coverage
from tts2face.storage.schema import Contents, ModelPlace, Tensor, millimetres
from tts2face.storage.shipped import SHIPPED_FOLDER, find_file
from tts2face.storage.tensors import read_tensors, write_tensors

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


def tint_hair(face: Face, colour: str) -> Face:
    """A face with light of its own whose hair has a colour.

    Raises
    ------
    InputError
        There is no such hair colour.
    DataError
        The hair of the face has one colour only.
    """
    srgb, light = parse_hair_colour(colour), face.light
    tint = None if isinstance(light, Lamps) else light.baked.tint
    if isinstance(light, Lamps) or tint is None:
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
        light=light.changed(lambda baked: _tinted(baked, tint, srgb)),
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


LEAST_STEP_MM = 0.01  # of shapes
FORMAT_VERSION = 1

LIGHT = "light"
METADATA: Mapping[str, Check] = {"n_face_vertices": whole(1, 2**31 - 1), "metadata": free}
OCCLUSION_BYTES = whole(0, MAX_OCCLUSION_BYTES)
TENSORS: Mapping[str, Tensor] = {
    "vertices": millimetres("vertices", 3),
    "triangles": Tensor("int32", ("triangles", 3)),
    "uv": Tensor("uint16", ("vertices", 2)),
    "tangents": Tensor("int8", ("vertices", 3)),
    "relief": Tensor("uint8", ("bytes of relief",)),
    "alpha": Tensor("uint8", ("bytes of alpha",)),
    "anchors": Tensor("int32", ("anchors",)),
    "anchor_places": millimetres("anchors", 3),
    "scalp": Tensor("uint8", ("bytes of scalp",), is_optional=True),
    "occlusion": Tensor("uint8", ("bytes of occlusion",), is_optional=True),
    "skin_occlusion": Tensor("uint8", ("bytes of skin occlusion",), is_optional=True),
}
LIT_METADATA: Mapping[str, Check] = {
    "face": text,
    "n_face_vertices": whole(1, 2**31 - 1),
    "n_face_triangles": whole(1, 2**31 - 1),
    "shape_names": list_of(text),
    LIGHT: anything,  # checked when it is inflated
    "metadata": free,
}
LIT_TENSORS: Mapping[str, Tensor] = {
    **{name: TENSORS[name] for name in ("vertices", "triangles", "uv", "tangents")},
    **SHAPE_TENSORS,
    "colours": Tensor("uint8", ("vertices", 3)),
    "loose": Tensor("uint8", ("vertices",)),
    "middle": millimetres(3),
    "skin": Tensor("uint8", ("bytes of skin",)),
    LIGHT: Tensor("uint8", ("bytes of light",)),
}
PICTURES = ("relief", "alpha", "scalp")
MIN_ANCHORS = 4  # that are not in one plane: fewer do not determine the fit


def write_hair(path: Path, hair: Hair) -> None:
    """Write a ``.hair`` file."""
    arrays: dict[str, NDArray[Any]] = {
        "vertices": hair.vertices.astype(np.float32),
        "triangles": hair.triangles.astype(np.int32),
        "uv": encode_uv(hair.uv),
        "tangents": encode_tangents(hair.tangents),
        "relief": encode_colours(hair.relief),
        "alpha": encode_coverage(hair.alpha),
        "anchors": hair.anchors.astype(np.int32),
        "anchor_places": hair.anchor_places.astype(np.float32),
    }
    if hair.scalp is not None:
        arrays["scalp"] = encode_coverage(hair.scalp)
    n_bytes = 0
    for name in ("occlusion", "skin_occlusion"):
        bits = getattr(hair, name)
        if bits is not None:
            arrays[name], n_bytes = encode_occlusion(bits[None]), bits.shape[1]
    header = {"n_face_vertices": hair.n_face_vertices, "occlusion_bytes": n_bytes, "metadata": dict(hair.metadata)}
    write_tensors(path, HAIR_KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def write_lit_hair(path: Path, hair: LitHair) -> None:
    """Write a ``.hair`` file for a face with baked light."""
    content, stored = encode_hair_light(hair.lights[0])
    arrays: dict[str, NDArray[Any]] = {
        "vertices": round_places(hair.vertices),
        "triangles": hair.triangles.astype(np.int32),
        "uv": encode_uv(hair.uv),
        "tangents": encode_tangents(hair.tangents),
        "colours": hair.colours,
        "loose": hair.loose,
        "middle": hair.middle.astype(np.float32),
        "skin": encode_colours(hair.skins[0], HAIR_QUALITY),
        LIGHT: content,
        **pack_shapes(hair.shapes.values(), LEAST_STEP_MM),
    }
    header = {
        "face": hair.face,
        "n_face_vertices": hair.n_face_vertices,
        "n_face_triangles": hair.n_face_triangles,
        "shape_names": list(hair.shapes),
        LIGHT: stored,
        "metadata": dict(hair.metadata),
    }
    write_tensors(path, HAIR_KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def read_hair(path: Path, *, checks_pictures: bool = True) -> Hair | LitHair:
    """Read a ``.hair`` file: hair cards for heads, or a haircut of a face with baked light.

    Pictures are decoded at once where the file may be damaged (`checks_pictures`), otherwise when hair is first drawn.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid.
    """
    arrays, header = read_tensors(path, HAIR_KIND, FORMAT_VERSION)
    if LIGHT in arrays:
        lit = _lit_hair_from_arrays(arrays, header, path)
        if checks_pictures:
            tuple(lit.skins)
            tuple(lit.lights)
        return lit
    _check_hair(path, arrays, header)
    hair = _hair_from_arrays(arrays, header, path)
    if checks_pictures:
        tuple(hair.pictures)
    return hair


def _hair_from_arrays(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> Hair:
    return Hair(
        vertices=arrays["vertices"],
        triangles=arrays["triangles"],
        uv=decode_uv(arrays["uv"]),
        tangents=decode_tangents(arrays["tangents"]),
        pictures=_read_pictures(arrays, path),
        anchors=arrays["anchors"],
        anchor_places=arrays["anchor_places"],
        n_face_vertices=header["n_face_vertices"],
        metadata=header["metadata"],
        occlusion=_read_occlusion("occlusion", len(arrays["vertices"]), (arrays, header, path)),
        skin_occlusion=_read_occlusion("skin_occlusion", header["n_face_vertices"], (arrays, header, path)),
    )


def _lit_hair_from_arrays(arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any], path: Path) -> LitHair:
    contents = Contents(path, "haircut", arrays, header)
    contents.metadata(LIT_METADATA)
    contents.tensors(LIT_TENSORS)
    contents.only_known()
    contents.indices("triangles", contents.sizes["vertices"], "vertices")
    check_shapes(contents, header["shape_names"])
    n = contents.sizes["vertices"]
    sizes = {
        "vertices": header["n_face_vertices"] + n,
        "triangles": header["n_face_triangles"] + contents.sizes["triangles"],
    }
    return LitHair(
        face=header["face"],
        n_face_vertices=header["n_face_vertices"],
        n_face_triangles=header["n_face_triangles"],
        vertices=arrays["vertices"],
        triangles=arrays["triangles"],
        uv=decode_uv(arrays["uv"]),
        tangents=decode_tangents(arrays["tangents"]),
        colours=arrays["colours"],
        loose=arrays["loose"],
        middle=arrays["middle"],
        shapes=dict(zip(header["shape_names"], unpack_shapes(arrays, n), strict=True)),
        skins=Late(1, lambda: [decode_colours(arrays["skin"], path)]),
        lights=Late(1, lambda: [decode_hair_light(arrays[LIGHT], header[LIGHT], sizes, path)]),
        metadata=header["metadata"],
    )


def _read_pictures(arrays: Mapping[str, NDArray[Any]], path: Path) -> Late[NDArray[np.uint8]]:
    contents = {name: arrays[name] for name in PICTURES if name in arrays}

    def decode() -> list[NDArray[np.uint8]]:
        relief = decode_colours(contents["relief"], path, "L")
        alpha, *scalp = (decode_coverage(content, path) for name, content in contents.items() if name != "relief")
        if relief.shape != alpha.shape:
            raise DataError(f"{path}: relief and alpha differ in size; build or copy the file again")
        return [relief, alpha, *scalp]

    return Late(len(contents), decode)


def _read_occlusion(name: str, n_vertices: int, file: tuple[Any, Any, Path]) -> NDArray[np.uint8] | None:
    arrays, header, path = file
    if name not in arrays:
        return None
    bits: NDArray[np.uint8] = decode_occlusion(arrays[name], (1, n_vertices, header.get("occlusion_bytes", 0)), path)[0]
    return bits


def load_hair(name: str, face: str = "", own: str = BALD) -> Hair | LitHair:
    """Load a shipped haircut by name, or one from a file.

    Parameters
    ----------
    name
        Haircut.
    face
        Shipped face with baked light whose haircut it is; empty for one of cards, for heads.
    own
        Haircut that such a face has without a file.

    Raises
    ------
    InputError
        There is no such haircut.
    DataError
        As `read_hair`.
    """
    known = haircut_names(face)
    if not (name in known or Path(name).suffix):
        lacks = f"the face {face} has no haircut {name!r}" if face else f"there is no haircut {name!r}"
        raise InputError(f"{lacks}; give {', '.join((own, *known))}, or a .hair file")
    path = find_file(f"{face}{OF_FACE}{name}" if face and name in known else name, HAIR_KIND)
    return read_hair(path, checks_pictures=path.parent != SHIPPED_FOLDER)


def _check_hair(path: Path, arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> None:
    contents = Contents(path, "haircut", arrays, header)
    contents.metadata(METADATA)
    OCCLUSION_BYTES(header.get("occlusion_bytes", 0), ModelPlace(f"{path}: metadata: occlusion_bytes"))
    contents.tensors(TENSORS)
    contents.only_known()
    contents.indices("triangles", contents.sizes["vertices"], "vertices")
    contents.indices("anchors", header["n_face_vertices"], "vertices of the head")
    contents.distinct("anchors")
    places = arrays["anchor_places"].astype(np.float64)
    spread = np.linalg.matrix_rank(places - places.mean(axis=0), tol=1.0)
    contents.require(
        len(places) >= MIN_ANCHORS and spread == 3, f"has {len(places)} anchors, which do not surround the head"
    )
