"""A round-necked shirt: the shoulders, cut along a tilted plane and offset from the skin."""

from dataclasses import dataclass

import numpy as np

from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.subdivision import join_triangles, triangulate
from tts2face.numeric.arrays import FloatArray, IntArray

COLLAR_Y, COLLAR_SLOPE = -164.0, -0.30  # height in front of the neck, mm, and rise per mm towards the back
BAND_MM = 13.0  # height of the collar's band
BAND_OFF, BODY_OFF = 3.0, 1.8  # mm off the skin
BOTTOM_Y, WIDEST = -330.0, 300.0  # where the bust ends, mm
MATERIAL = {"specular": 0.04, "shininess": 8.0, "wrap": 0.2}


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Points (N, D) of any attributes, and triangles (F, 3)."""

    points: FloatArray
    triangles: IntArray


def height_above_collar(places: FloatArray) -> FloatArray:
    """(P,) signed height above the collar's edge in mm, for positions on the default skin."""
    return places[:, 1] - COLLAR_Y - COLLAR_SLOPE * np.minimum(places[:, 2], 20.0)


def shirt_piece(default: HeadSkin, own: HeadSkin, colour: FloatArray) -> HeadPart:
    """The shirt over the shoulders `own` of an identity, cut where the shoulders of the `default` identity are."""
    normals = vertex_normals(own.vertices, own.quads, own.base)
    whole = Sheet(np.column_stack([default.vertices, own.vertices, normals]), triangulate(own.quads))
    whole = clip_sheet(clip_sheet(whole, whole.points[:, 1] - BOTTOM_Y), None)
    whole = clip_sheet(whole, WIDEST - np.abs(whole.points[:, 0]))
    below = clip_sheet(whole, -height_above_collar(whole.points))
    band = clip_sheet(below, height_above_collar(below.points) + BAND_MM)
    body = clip_sheet(below, -height_above_collar(below.points) - BAND_MM + 0.6)
    rolled = [_roll_collar(body, BODY_OFF), _roll_collar(band, BAND_OFF)]
    points = [sheet.points for sheet in rolled]
    triangles = join_triangles([sheet.triangles for sheet in rolled], map(len, points))
    shades = np.repeat([1.0, 0.88], [len(own) for own in points])
    return HeadPart(np.concatenate(points), (MaterialSpan("shirt", triangles, MATERIAL),), np.outer(shades, colour))


def clip_sheet(sheet: Sheet, inside: FloatArray | None) -> Sheet:
    """The part of a sheet where `inside` (N,) is not negative, without unused points."""
    points, triangles = sheet.points, sheet.triangles
    if inside is not None:
        points, triangles = _cut_triangles(points, triangles, inside)
    used, packed = np.unique(triangles, return_inverse=True)
    return Sheet(points[used], packed.reshape(-1, 3).astype(np.int64))


def _cut_triangles(points: FloatArray, triangles: IntArray, inside: FloatArray) -> tuple[FloatArray, IntArray]:
    is_in = inside >= 0
    n_in = is_in[triangles].sum(axis=1)
    new_points: list[FloatArray] = []
    known: dict[tuple[int, int], int] = {}

    def crossing(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in known:
            share = inside[key[0]] / (inside[key[0]] - inside[key[1]])
            known[key] = len(points) + len(new_points)
            new_points.append(points[key[0]] + share * (points[key[1]] - points[key[0]]))
        return known[key]

    faces: list[tuple[int, int, int]] = []
    for a, b, c in triangles[(n_in > 0) & (n_in < 3)].tolist():
        turns = ((a, b, c), (b, c, a), (c, a, b))
        odd, following, last = next(turn for turn in turns if is_in[turn[0]] != is_in[turn[1]] == is_in[turn[2]])
        first, second = crossing(odd, following), crossing(odd, last)
        faces += [(odd, first, second)] if is_in[odd] else [(first, following, last), (first, last, second)]
    cut = np.array(faces, np.int64).reshape(-1, 3)
    return np.concatenate([points, np.array(new_points).reshape(-1, points.shape[1])]), np.concatenate(
        [triangles[n_in == 3], cut]
    )


def _roll_collar(sheet: Sheet, off: float) -> Sheet:
    """The sheet offset from the skin by `off` mm, its upper edge joined to the skin."""
    raised = sheet.points[:, 3:6] + off * sheet.points[:, 6:9]
    sides = np.stack([sheet.triangles, np.roll(sheet.triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, first, uses = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    free = sides[first[uses == 1]]
    height = height_above_collar(sheet.points)
    top = free[(height[free] > height.max() - 1.0).all(axis=1)]
    n = len(raised)
    low = sheet.points[:, 3:6] - 0.5 * sheet.points[:, 6:9] + [0.0, 0.8, 0.0]
    strip = np.concatenate([top[:, ::-1], top + n], axis=1)  # b, a, a', b'
    rim = np.concatenate([strip[:, [0, 1, 2]], strip[:, [0, 2, 3]]])
    return clip_sheet(Sheet(np.concatenate([raised, low]), np.concatenate([sheet.triangles, rim])), None)
