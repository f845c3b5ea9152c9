"""Retouching of baked light at rest by hand: highlights that a path tracer makes of a plane, and painted brows.

It works on the pages of a ``.face`` file and on the texture of its skin; all else in the file stays as it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import gaussian_filter, map_coordinates

from lexicon.errors import InputError
from tts2face.models.face import Face
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face
from tts2face.models.hair import HAIR_PART
from tts2face.models.light import Lamps
from tts2face.models.light_coding import encode_light
from tts2face.numeric.arrays import FloatArray, Mask, Pixels, decode_srgb, encode_srgb, smoothstep
from tts2face.storage.tensors import read_tensors, write_tensors

RETOUCHED, LIGHT = "retouched", "light"  # key of the metadata of a face that has been, and that of its light
FRONT_Z = 5.0  # of skin that is retouched, mm before the middle of the head
SURROUNDINGS_PX, HAIR_PX = 22.0, 9.0  # of a page of 1024 texels, over which light is compared with that around it
BROW_MARGIN_MM = 1.0
LINEAR = decode_srgb(np.arange(256) / 255)


@dataclass(frozen=True, slots=True)
class Retouching:
    """Changes: shares of highlights that stay, on the nose and on hair, and heights of the brows.

    ``nose`` are the least and greatest height, mm, and half the width of the ridge; ``brow`` is its middle height, how
    far up and down of it skin moves, and displacements by the way from the middle of the face.
    """

    nose: tuple[float, float, float]
    nose_share: float
    hair_share: float
    brow: tuple[float, float]
    brow_rise: tuple[tuple[float, float], ...]


RETOUCHINGS: Mapping[str, Retouching] = {
    "mara": Retouching(
        nose=(-52.0, 12.0, 11.0),
        nose_share=0.12,
        hair_share=0.5,
        brow=(25.0, 8.5),
        brow_rise=((0.0, -2.6), (14.0, -2.6), (28.0, -0.6), (42.0, 2.0), (54.0, 4.0), (70.0, 0.0)),
    ),
}


def retouch_face(path: Path) -> None:
    """Retouch the face of a file once, in place."""
    face = read_face(path)
    name = str(face.metadata["name"])
    if isinstance(face.light, Lamps) or face.metadata.get(RETOUCHED):
        return
    if name not in RETOUCHINGS:
        raise InputError(f"there is no retouching of {name}; choose {', '.join(RETOUCHINGS)}")
    wanted, light = RETOUCHINGS[name], face.light.baked
    places = _places(face, light.pages.shape[1])
    pages = light.pages.copy()
    pages[0] = _raise_brows(pages[0], face, places, wanted)
    x, y = places[..., 0], places[..., 1]
    low, high, wide = wanted.nose
    on_nose = (
        (1 - smoothstep(np.abs(x), 0.5 * wide, wide))
        * smoothstep(y, low, low + 8)
        * (1 - smoothstep(y, high - 8, high))
    )
    pages[0] = soften_highlights(
        pages[0], np.nan_to_num(on_nose), wanted.nose_share, SURROUNDINGS_PX, places[..., 2] > FRONT_Z
    )
    is_hair = np.zeros(pages.shape[1:3], bool)
    is_hair[: _hair_rows(face, pages.shape[1])] = True
    is_hair &= pages[1].max(axis=2) > 3
    pages[1] = soften_highlights(pages[1], is_hair.astype(float), wanted.hair_share, HAIR_PX, is_hair)
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    arrays[LIGHT], header[LIGHT] = encode_light(replace(light, pages=pages))
    header["metadata"] = header["metadata"] | {RETOUCHED: True}
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def _hair_rows(face: Face, side: int) -> int:
    """First rows of the second page, which hold the hair."""
    hair = next(part for part in face.parts if part.name == HAIR_PART)
    used = np.unique(face.triangles[hair.first : hair.first + hair.count])
    return int(np.ceil(float(np.asarray(face.uv)[used, 1].max()) * side))


def _skin_rows(face: Face) -> FloatArray:
    """Vertices of the front of the skin, by number."""
    skin = next(part for part in face.parts if part.name == "skin")
    used = np.unique(face.triangles[skin.first : skin.first + skin.count])
    return np.asarray(used[face.vertices[used, 2] > FRONT_Z])


def _places(face: Face, side: int) -> FloatArray:
    """(S, S, 3) place on the front of the skin, mm, of each texel; NaN elsewhere."""
    rows = _skin_rows(face)
    texel = (np.arange(side) + 0.5) / side
    found = LinearNDInterpolator(np.asarray(face.uv, np.float64)[rows], face.vertices[rows].astype(np.float64))
    places: FloatArray = found(*np.meshgrid(texel, texel))
    return places


def soften_highlights(page: Pixels, where: FloatArray, share: float, reach_px: float, known: Mask) -> Pixels:
    """A page (S, S, 3) where (S, S) light above that of its surroundings keeps a share of the difference."""
    light = LINEAR[page]
    brightness, weight = light.mean(axis=2), known.astype(float)
    reach = reach_px * len(page) / 1024
    around = gaussian_filter(brightness * weight, reach) / np.maximum(gaussian_filter(weight, reach), 1e-6)
    lower = np.where(brightness > around, around + share * (brightness - around), brightness)
    factor = 1 + np.clip(where, 0, 1) * (lower / np.maximum(brightness, 1e-6) - 1)
    softened: Pixels = np.where((where > 0)[..., None], encode_srgb(light * factor[..., None]), page)
    return softened


def _raise_brows(page: Pixels, face: Face, places: FloatArray, wanted: Retouching) -> Pixels:
    """A page (S, S, 3) whose brows lie higher by the way from the middle of the face."""
    middle, reach = wanted.brow
    x, y = places[..., 0], places[..., 1]
    ways, rises = zip(*wanted.brow_rise, strict=True)
    rise = np.interp(np.abs(x), ways, rises) * (1 - smoothstep(np.abs(y - middle), 0.4 * reach, reach))
    moved = np.isfinite(x) & (np.abs(np.nan_to_num(rise)) > 0.01)
    rows = _skin_rows(face)
    rows = rows[face.vertices[rows, 1] > middle - reach - BROW_MARGIN_MM]  # without the folds of the lids
    back = LinearNDInterpolator(face.vertices[rows, :2].astype(np.float64), np.asarray(face.uv, np.float64)[rows])
    source = back(np.column_stack([x[moved], (y - rise)[moved]])) * len(page) - 0.5
    ok = np.isfinite(source).all(axis=1)
    changed, at = page.copy(), np.argwhere(moved)[ok]
    for channel in range(3):
        seen = map_coordinates(page[..., channel].astype(float), source[ok][:, ::-1].T, order=1, mode="nearest")
        changed[at[:, 0], at[:, 1], channel] = np.rint(seen)
    return changed
