"""Glasses in a picture: found by their bridge and rims, taken off the skin, and worn by the head as a part."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.mesh_fit import part_vertices
from corpus_tools.dense.tube import tube
from tts2face.models.face import Face, FacePart
from tts2face.models.hair import WORN_PART
from tts2face.models.landmarks import LID_RINGS
from tts2face.numeric.arrays import FloatArray, Mask

MATERIAL = FacePart(WORN_PART, 0, 0, specular=0.5, shininess=50.0, wrap=0.3)
# The front view in which they are sought: 1 mm a cell, from the middle between the eyes.
LEFT_LOW = (-72, -52)
RIGHT_HIGH = (72, 40)
BLUR_MM = 0.9
LUMA, DARKEST = np.array([0.299, 0.587, 0.114]), 8.0  # added before logarithms
LINE_MM = 3.0  # to both sides of a line, where the skin is lighter
BRIDGE_HALF_MM = 7
BRIDGE_MM = (-18, 16)
BRIDGE_BLUR = (0.5, 1.0)
BRIDGE_STEP, RIM_STEP = 0.01, 0.02  # cost of a millimetre by which a line leaves its course
RADII = np.arange(13.0, 34.0)
LOWER, FLATTENED = np.radians(np.arange(180.0, 361.0, 5.0)), 0.9  # directions from the eye, and height over width
N_RIM = 64
# Mean logarithm by which a bridge is darker, and its fifth faintest column; fourth part of a rim. Without glasses .056,
# .025 and any; thin wire .078, .035 and .021; others from .13, .07 and .09.
BRIDGE = 0.06
FAINT_BRIDGE = 0.03
FAINT_RIM = 0.018
LEAST_RADIUS = 15.2  # mm, mean of a rim: what lies closer is the rim of the lids
FAINT_COLUMN, FAINT_SHARE = 0.2, 0.25
# of the skin about rims and temples, which is painted anew
COVER_MM = 4.5
TEMPLE_COVER_MM = 4.0
TEMPLE_MM = 74.0
HALF_MM = ((19.0, 30.0), (14.0, 27.0))  # least and most half width and height of a rim
# rims stand so far before the centre of the eyeball
WIRE_MM = 1.2
AHEAD_MM, AHEAD = 21.0, np.array([0.0, 0.0, 1.0])
BEHIND_EAR_MM = 9.0
CLEAR_MM, MOST_SUNK_MM, N_SKIN = (
    2.0,
    14.0,
    3,
)  # of wire before the skin; by which it comes forward at most; nearest vertices
WRAP_MM, SQUARE = 4.0, 0.85  # by which rims bend back at their outer side; exponent of their outline
EAR_HIGH, EAR_DEEP = (0.0, 12.0), (-85.0, -55.0)
MOST_LIGHT = 150.0  # of the colour of a frame, sRGB: lighter ones are gloss


@dataclass(frozen=True, slots=True, eq=False)
class Glasses:
    """Rims as closed lines (2, N, 2) from the front, mm, what is seen of the frame (M, 2), and colour, sRGB 0..255."""

    rims: FloatArray
    seen: FloatArray
    colour: FloatArray


def find_glasses(places: FloatArray, colours: FloatArray, marks: FloatArray) -> Glasses | None:
    """Glasses on the skin of a face.

    Parameters
    ----------
    places, colours : (P, 2), (P, 3)
        Places of the skin from the front, mm, and what a picture shows there, sRGB 0..255.
    marks : (468, 3)
        The head's landmarks, mm.
    """
    from scipy.ndimage import gaussian_filter, map_coordinates

    light = _front_view(places, np.log(colours @ LUMA + DARKEST))
    rows = np.arange(*BRIDGE_MM) - LEFT_LOW[1]
    columns = np.arange(-BRIDGE_HALF_MM, BRIDGE_HALF_MM + 1) - LEFT_LOW[0]
    smooth, off = gaussian_filter(light, BRIDGE_BLUR), round(LINE_MM)
    dark = ((smooth[rows - off] + smooth[rows + off]) / 2 - smooth[rows])[:, columns]
    line, depth = _course(dark, BRIDGE_STEP, 1)
    if depth.mean() < BRIDGE or np.quantile(depth, FAINT_COLUMN) < FAINT_BRIDGE:
        return None
    rims, lines = [], [np.column_stack([columns + LEFT_LOW[0], line + BRIDGE_MM[0]])]
    for ring in LID_RINGS:
        middle = marks[list(ring), :2].mean(axis=0)
        radii = RADII + LINE_MM * np.array([[-1], [0], [1]])
        x = middle[0] + radii[..., None] * np.cos(LOWER) - LEFT_LOW[0]
        y = middle[1] + FLATTENED * radii[..., None] * np.sin(LOWER) - LEFT_LOW[1]
        inner, here, outer = map_coordinates(light, [y, x], order=1, mode="nearest")
        course, depth = _course(np.abs((inner + outer) / 2 - here), RIM_STEP, 2)
        if np.quantile(depth, FAINT_SHARE) < FAINT_RIM or RADII[course].mean() < LEAST_RADIUS:
            return None
        rims.append(_outline(middle, RADII[course]))
        way = np.column_stack([np.cos(LOWER), FLATTENED * np.sin(LOWER)])
        lines.append(middle + RADII[course, None] * way)
    near = _distance(places, np.concatenate(lines[1:])) < LINE_MM / 2
    seen = colours[near & (colours.max(axis=1) < MOST_LIGHT)]
    colour = np.quantile(seen if len(seen) else colours[near], FAINT_SHARE, axis=0)
    return Glasses(np.array(rims), np.concatenate(lines), colour)


def _front_view(places: FloatArray, values: FloatArray) -> FloatArray:
    """(H, W) means of values (P,) at places (P, 2) in cells of a millimetre; their mean where there is none."""
    from scipy.ndimage import gaussian_filter

    width, height = np.subtract(RIGHT_HIGH, LEFT_LOW) + 1
    cells = np.rint(places - LEFT_LOW).astype(np.int64)
    inside = ((cells >= 0) & (cells < (width, height))).all(axis=1)
    index = cells[inside, 1] * width + cells[inside, 0]
    count, total = (
        gaussian_filter(np.bincount(index, weights, width * height).reshape(height, width).astype(np.float64), BLUR_MM)
        for weights in (np.ones(len(index)), values[inside])
    )
    usual = total.sum() / max(count.sum(), 1e-9)
    return np.where(count > 1e-3, total / np.maximum(count, 1e-3), usual)


def _course(values: FloatArray, cost: float, most: int) -> tuple[NDArray[np.int64], FloatArray]:
    """Rows (C,) of the line through (R, C) with the largest sum, and its values, by dynamic programming."""
    n = np.arange(len(values))
    apart = np.abs(n[:, None] - n)
    price = np.where(apart > most, np.inf, cost * apart)
    best, back = values[:, 0], []
    for column in values.T[1:]:
        scores = best - price
        back.append(scores.argmax(axis=1))
        best = scores.max(axis=1) + column
    course = [int(best.argmax())]
    for before in back[::-1]:
        course.append(int(before[course[-1]]))
    rows = np.array(course[::-1])
    return rows, values[rows, np.arange(values.shape[1])]


def _outline(middle: FloatArray, lower: FloatArray) -> FloatArray:
    """(N, 2) closed rim, whose upper half mirrors the lower one, of its radii in the directions `LOWER`."""
    third = len(lower) // 3
    wide = np.clip((np.median(lower[:third]) + np.median(lower[-third:])) / 2, *HALF_MM[0])
    high = np.clip(FLATTENED * np.median(lower[third:-third]), *HALF_MM[1])
    turn = np.linspace(0, 2 * np.pi, N_RIM, endpoint=False)
    across, up = np.cos(turn), np.sin(turn)
    outline: FloatArray = middle + np.column_stack([
        wide * np.sign(across) * np.abs(across) ** SQUARE, high * np.sign(up) * np.abs(up) ** SQUARE,
    ])  # fmt: skip
    return outline


def _distance(places: FloatArray, line: FloatArray) -> FloatArray:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(line).query(places)[0], np.float64)


def covered_skin(glasses: Glasses, places: FloatArray) -> Mask:
    """(P,) whether rims, bridge or temples cover places (P, 2) of the skin from the front, mm."""
    near = _distance(places, np.concatenate([*glasses.rims, glasses.seen])) < COVER_MM
    beside = np.abs(places[:, 0])
    temples = (beside > np.abs(glasses.rims[..., 0]).max() - 2.0) & (beside < TEMPLE_MM)
    temples &= np.abs(places[:, 1] - glasses.rims[..., 1].mean() - 3.0) < TEMPLE_COVER_MM
    return np.asarray(near | temples)


def wear_glasses(face: Face, glasses: Glasses) -> Face:
    """The face with glasses of the size and colour that are seen, as its last part, without occlusion."""
    points, triangles = _frame(face, glasses)
    n, n_old = len(points), len(face.vertices)
    part = replace(MATERIAL, first=len(face.triangles), count=len(triangles))
    colour = np.tile(np.rint(np.clip(glasses.colour, 0, 255)).astype(np.uint8), (n, 1))
    return replace(
        face,
        vertices=np.concatenate([face.vertices, points.astype(np.float32)]),
        triangles=np.concatenate([face.triangles, (triangles + n_old).astype(np.int32)]),
        parts=(*face.parts, part),
        shapes=np.pad(face.shapes, ((0, 0), (0, n), (0, 0))),
        colours=np.concatenate([face.colours, colour]),
        uv=None if face.uv is None else np.pad(face.uv, ((0, n), (0, 0))),
        tangents=None if face.tangents is None else np.pad(face.tangents, ((0, n), (0, 0))),
        occlusion=None,
    )


def _frame(face: Face, glasses: Glasses) -> tuple[FloatArray, NDArray[np.int64]]:
    """Points and triangles of rims, bridge and temples before a face's eyes."""
    skin = face.vertices[part_vertices(face, ("skin",))].astype(np.float64)
    half = np.ptp(glasses.rims, axis=1).mean(axis=0) / 2
    tubes, inner, rims = [], [], _rims(face, half)
    rims = {sign: rim + AHEAD * max(_sunk(skin, either) for either in rims.values()) for sign, rim in rims.items()}
    for eye in sorted(face.eyes, key=lambda either: float(either.centre[0])):
        sign = float(np.sign(eye.centre[0]))
        rim = rims[sign]
        tubes.append(tube(rim, WIRE_MM, is_closed=True))
        beside = skin[(skin[:, 0] * sign > 0) & (skin[:, 1] > EAR_HIGH[0]) & (skin[:, 1] < EAR_HIGH[1])]
        deep = beside[(beside[:, 2] > EAR_DEEP[0]) & (beside[:, 2] < EAR_DEEP[1])]
        ear = deep[np.argmax(sign * deep[:, 0])] + [0.5 * sign, 4.0, 0.0]
        outer = rim[np.argmax(sign * rim[:, 0] + 0.4 * rim[:, 1])]
        share = np.linspace(0, 1, N_RIM // 2)[:, None]
        temple = outer + share * (ear - outer) + np.sin(np.pi * share) * [3.0 * sign, 0.0, 0.0]
        end = ear - [2.0 * sign, BEHIND_EAR_MM, BEHIND_EAR_MM] * np.linspace(0.2, 1, 5)[:, None]
        tubes.append(tube(np.concatenate([temple, end]), WIRE_MM))
        inner.append(rim[np.argmax(-sign * rim[:, 0] + 0.3 * rim[:, 1])])
    share = np.linspace(0, 1, N_RIM // 4)[:, None]
    arch = inner[0] + share * (inner[1] - inner[0]) + np.sin(np.pi * share) * [0.0, 3.0, 2.0]
    tubes.append(tube(arch + AHEAD * _sunk(skin, arch), WIRE_MM))
    starts = np.cumsum([0, *(len(points) for points, _ in tubes)])
    triangles = [corners + start for (_, corners), start in zip(tubes, starts, strict=False)]
    return np.concatenate([points for points, _ in tubes]), np.concatenate(triangles)


def _rims(face: Face, half: FloatArray) -> dict[float, FloatArray]:
    """Rims (N, 3) of a half width and height (2,) before a face's eyes, by the sign of their side."""
    turn = np.linspace(0, 2 * np.pi, N_RIM, endpoint=False)
    across, up = (np.sign(way) * np.abs(way) ** SQUARE for way in (np.cos(turn), np.sin(turn)))
    back, found = WRAP_MM * np.clip(across, 0, 1) ** 2, {}
    for eye in face.eyes:
        sign = float(np.sign(eye.centre[0]))
        middle = eye.centre + np.array([0.06 * sign * half[0], -0.12 * half[1], AHEAD_MM])
        found[sign] = middle + np.column_stack([sign * half[0] * across, half[1] * up, -back])
    return found


def _sunk(skin: FloatArray, line: FloatArray) -> float:
    """By how much (mm) a line (N, 3) has to come forward to lie before the skin (V, 3)."""
    from scipy.spatial import cKDTree

    front = skin[skin[:, 2] > line[:, 2].min() - MOST_SUNK_MM]
    behind = front[cKDTree(front[:, :2]).query(line[:, :2], k=N_SKIN)[1], 2].max(axis=1)
    return float(np.clip((behind + CLEAR_MM - line[:, 2]).max(), 0.0, MOST_SUNK_MM))
