"""A shipped face for programs that light it themselves: hair in the colours that its video shows, a bust cut level."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face, FacePart
from tts2face.models.hair import HAIR_PART, seen_colour
from tts2face.models.light import Baked
from tts2face.numeric.arrays import FloatArray, IntArray, decode_srgb, encode_srgb

SKIN_PART, CLOTHES_PART = "skin", "shirt"
LINEAR = decode_srgb(np.arange(256) / 255)
FORWARD = 0.3  # least share of a triangle's normal that points forward where its light counts
SHADE = (0.4, 1.8)  # least and largest light of a strand, of the mean: the lamps of others shade it again
USUAL_HUE = 0.75  # share of the hair's usual hue in each place: highlights have that of the lamp
INWARD = 0.2  # weight of the other two corners of the place at which a corner's light is read, off the texture's seams


def plain_face(face: Face) -> Face:
    """The face with hair as it looks in its baked light, and clothes that end level; others stay as they are."""
    return _level_clothes(_film_hair(face) if isinstance(face.light, Baked) else _lamp_hair(face))


def _lamp_hair(face: Face) -> Face:
    """Strands in the colour in which they are seen before lamps, without white reflections."""
    hair = next((part for part in face.parts if part.name == HAIR_PART), None)
    if hair is None or face.hairdo is None or not hair.is_textured:
        return face
    textures = list(face.textures)
    own = textures[hair.texture]
    levels = np.rint(255 * seen_colour(np.arange(256) / 255, face.hairdo.haircut)).astype(np.uint8)
    textures[hair.texture] = replace(own, pixels=levels[own.pixels])
    parts = tuple(replace(part, specular=0.0) if part is hair else part for part in face.parts)
    return replace(face, textures=tuple(textures), parts=parts)


def _film_hair(face: Face) -> Face:
    """Hair's own colour is that of a fibre, from which a path tracer makes what is seen: up to 7 times as bright.

    Its light at rest is divided by that on the skin, which keeps the colours of its texture.
    """
    assert isinstance(face.light, Baked)
    baked = face.light.baked
    parts = {part.name: part for part in face.parts}
    hair, skin = parts.get(HAIR_PART), parts.get(SKIN_PART)
    lit = hair is not None and skin is not None and {HAIR_PART, SKIN_PART} <= set(baked.page_of)
    if hair is None or skin is None or not lit or not skin.is_textured or face.uv is None:
        return face
    seen = _at_corners(face, skin, baked.pages[baked.page_of[SKIN_PART]])
    own = _at_corners(face, skin, face.textures[skin.texture].pixels)
    lamp = _lamp(seen, own, _forward_areas(face, skin))
    strands = _at_corners(face, hair, baked.pages[baked.page_of[HAIR_PART]])
    mean = np.average(strands.mean(axis=1), axis=0, weights=_forward_areas(face, hair))
    corners = face.triangles[hair.first : hair.first + hair.count].ravel()
    sums = np.column_stack([np.bincount(corners, axis, len(face.vertices)) for axis in strands.reshape(-1, 3).T])
    rows = np.unique(corners)
    light = sums[rows] / np.bincount(corners)[rows][:, None]
    brightness = light.sum(axis=1, keepdims=True)
    hue = light / np.maximum(brightness, 1e-6)
    hue += USUAL_HUE * (np.median(hue, axis=0) - hue)
    shade = np.clip(brightness / mean.sum(), *SHADE) * mean.sum() / lamp
    colours = face.colours.copy()
    colours[rows] = encode_srgb(shade * hue)
    return replace(face, colours=colours)


def _at_corners(face: Face, part: FacePart, texture: NDArray[np.uint8]) -> FloatArray:
    """Linear light (F, 3, 3) of a texture near each corner of the triangles of a part."""
    uv = np.asarray(face.uv)[face.triangles[part.first : part.first + part.count]].astype(np.float64)
    places = (1 - 3 * INWARD) * uv + INWARD * uv.sum(axis=1, keepdims=True)
    side = np.array(texture.shape[1::-1])
    column, row = np.moveaxis(np.clip((places * side).astype(np.int64), 0, side - 1), -1, 0)
    light: FloatArray = LINEAR[texture[row, column]]
    return light


def _forward_areas(face: Face, part: FacePart) -> FloatArray:
    """Areas (F,) of the triangles of a part that look forward; 0 for others."""
    a, b, c = (face.vertices[corner] for corner in face.triangles[part.first : part.first + part.count].T)
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    return np.where(normals[:, 2] > FORWARD * areas, areas, 0.0)


def _lamp(seen: FloatArray, own: FloatArray, areas: FloatArray) -> float:
    """Light on the brighter half of a surface: what is seen (F, 3, 3) over its own colour; the rest lies in shadow."""
    seen, own = seen.mean(axis=(1, 2)), own.mean(axis=(1, 2))
    share = seen / np.maximum(own, 1e-6)
    order = np.argsort(share)
    bright = order[np.cumsum(areas[order]) >= areas.sum() / 2]
    return float((seen * areas)[bright].sum() / max((own * areas)[bright].sum(), 1e-6))


def _level_clothes(face: Face) -> Face:
    """Clothes end with the arms and the bust of a head, unevenly: they are cut where the highest of these ends is."""
    is_cloth = np.repeat([part.name == CLOTHES_PART for part in face.parts], [part.count for part in face.parts])
    _, weld = np.unique(np.rint(face.vertices * 1000).astype(np.int64), axis=0, return_inverse=True)
    corners = weld.ravel()[face.triangles[is_cloth]]
    height = np.zeros(len(face.vertices))
    height[weld.ravel()] = face.vertices[:, 1]
    bottom = _highest_end(corners, height)
    if bottom is None:
        return face
    places = np.zeros((len(height), 3))
    places[weld.ravel()] = face.vertices
    moved, known = _to_height(places, corners, bottom)
    vertices = np.where(known[weld.ravel()][:, None], moved[weld.ravel()], face.vertices).astype(np.float32)
    stays = np.ones(len(face.triangles), bool)
    stays[is_cloth] = (height[corners] >= bottom).any(axis=1)
    counts = [int(stays[part.first : part.first + part.count].sum()) for part in face.parts]
    firsts = np.cumsum([0, *counts]).tolist()
    parts = tuple(replace(part, first=at, count=n) for part, at, n in zip(face.parts, firsts, counts, strict=False))
    return replace(face, vertices=vertices, triangles=face.triangles[stays], parts=parts)


def _highest_end(triangles: IntArray, height: FloatArray) -> float | None:
    """Greatest height of the open edges of a surface in its lower half; None where it has none there."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    pairs, counts = np.unique(edges, axis=0, return_counts=True)
    ends = height[pairs[counts == 1]].max(axis=1) if len(pairs) else np.zeros(0)
    used = height[triangles]
    ends = ends[ends < (used.min() + used.max()) / 2] if len(ends) else ends
    return float(ends.max()) if len(ends) else None


def _to_height(places: FloatArray, triangles: IntArray, bottom: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Vertices (V, 3) below a height that are next to one above it, moved along these edges; and which these are."""
    edges = np.concatenate([triangles[:, [a, b]] for a in range(3) for b in range(3) if a != b])
    low, high = edges[(places[edges[:, 0], 1] < bottom) & (places[edges[:, 1], 1] >= bottom)].T
    share = ((bottom - places[low, 1]) / (places[high, 1] - places[low, 1]))[:, None]
    crossings = places[low] + share * (places[high] - places[low])
    counts = np.bincount(low, minlength=len(places))
    sums = np.column_stack([np.bincount(low, axis, len(places)) for axis in crossings.T])
    moved = sums / np.maximum(counts, 1)[:, None]
    return moved, counts > 0
