"""The line between the lips of a photograph: the tracker's landmarks, moved onto the edges that the picture shows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.photo.colours import grey_at, lab_at
from tts2face.photo.found_face import FoundFace

Floats = NDArray[np.float64]

N_POINTS = 41  # along a lip, from the person's right corner to the left one
CLOSED_GAP = 0.02  # of the eye distance, as all lengths below; closed lips have up to .017, narrow smiles from .024
SEARCHED = 0.03  # to either side of the landmarks
N_PLACES = 25  # that are compared across the line at each point
SEAM_BLUR, LIP_BLUR = 0.005, 0.004
LEAST_BLUR_PX, LEAST_LIP_BLUR_PX, LEAST_CONTRAST, TINY_PX = 0.6, 0.5, 1e-3, 1e-6
STIFF_STEP = 0.01  # between neighbours, whose cost is the stiffness of a path
LIP_MIDDLE = slice(6, -6)  # points whose colours are those of the lip
SEAM_STIFFNESS, LIP_STIFFNESS = 2.0, 1.0  # cost of steps between neighbours
SEAM_REST, LIP_REST = 0.15 / 0.02**2, 0.25 / 0.03**2  # cost of a distance from the landmarks
EDGE_GAIN = 2.0
LIP_SPREAD = np.array([22.0, 7.0, 9.0])  # of a lip's colour in Lab
N_SIDE = 3  # places on each side of an edge whose colours are compared
EDGE_SHADE, EDGE_DARKNESS = 0.006, 0.55  # reach of the shadow between lips that meet, and its share of the light
EDGE_REACH, EDGE_FINE = 3, 4  # reaches beyond which there is no shade, and points of a finer edge
SMOOTHING, WAY_SMOOTHING, CORNER_POINTS = 5, 7, 4  # points of means, and points over which corners take less


@dataclass(frozen=True, slots=True, eq=False)
class LipLine:
    """Inner edges of the lips.

    Parameters
    ----------
    upper, lower : (41, 3)
        Pixels and depth as landmarks have them; equal in the corners, and everywhere if the mouth is closed.
    gap
        Largest opening by the landmarks, of the eye distance.
    """

    upper: Floats
    lower: Floats
    gap: float

    @property
    def is_closed(self) -> bool:
        """Whether the lips touch."""
        return self.gap < CLOSED_GAP


def find_lip_line(pixels: NDArray[np.uint8], face: FoundFace) -> LipLine:
    """Inner edges of the lips of a face in a picture (H, W, 3).

    Notes
    -----
    Closed lips meet in the darkest seam near the landmarks, open ones end where the colour of the lip does; both are
    cheapest paths (dynamic programming) over places across the line.
    """
    weights = spline_weights(len(INNER_LIP_UPPER), N_POINTS)
    inner = [weights @ face.landmarks[list(numbers)] for numbers in (INNER_LIP_UPPER, INNER_LIP_LOWER)]
    gap = float(np.linalg.norm((inner[0] - inner[1])[:, :2], axis=1).max() / face.eye_distance_px)
    scale = face.eye_distance_px
    if gap < CLOSED_GAP:
        seam = _seam(pixels, (inner[0] + inner[1]) / 2, scale)
        return LipLine(seam, seam.copy(), gap)
    outer = [weights @ face.landmarks[list(numbers)] for numbers in (OUTER_LIP_UPPER, OUTER_LIP_LOWER)]
    upper, lower = (_edge(pixels, line, around, scale) for line, around in zip(inner, outer, strict=True))
    crossed = lower[:, 1] < upper[:, 1]
    crossed[[0, -1]] = True
    upper[crossed] = lower[crossed] = ((upper + lower) / 2)[crossed]
    return LipLine(upper, lower, gap)


def spline_weights(n: int, m: int) -> Floats:
    """(m, n) values at m places of the natural cubic spline through n equidistant ones."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(np.linspace(0, 1, n), np.eye(n), bc_type="natural")(np.linspace(0, 1, m)))


def darken_lip_edges(pixels: NDArray[np.uint8], lips: LipLine, scale: float) -> NDArray[np.uint8]:
    """Picture (H, W, 3) whose parted lips darken towards their inner edges, as lips that meet do."""
    if lips.is_closed:
        return pixels
    margin = int(np.ceil(EDGE_REACH * EDGE_SHADE * scale)) + 2
    every = np.concatenate([lips.upper, lips.lower])[:, :2]
    low = np.maximum(np.floor(every.min(axis=0)).astype(int) - margin, 0)
    high = np.minimum(np.ceil(every.max(axis=0)).astype(int) + margin, pixels.shape[1::-1])
    down, across = np.mgrid[low[1] : high[1], low[0] : high[0]]
    places = np.column_stack([across.ravel(), down.ravel()]).astype(np.float64)
    fine = spline_weights(N_POINTS, EDGE_FINE * N_POINTS)
    edges = np.concatenate([fine @ lips.upper, fine @ lips.lower])[:, :2]
    away = np.asarray(cKDTree(edges).query(places)[0]).reshape(down.shape)
    bright = 1 - EDGE_DARKNESS * np.exp(-((away / (EDGE_SHADE * scale)) ** 2))
    darker = pixels.copy()
    part = pixels[low[1] : high[1], low[0] : high[0]] * bright[..., None]
    darker[low[1] : high[1], low[0] : high[0]] = np.rint(part).astype(np.uint8)
    return darker


def _seam(pixels: NDArray[np.uint8], line: Floats, scale: float) -> Floats:
    """A line (N, 3) moved to the darkest seam."""
    along = line[-1, :2] - line[0, :2]
    across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    offsets = np.linspace(-SEARCHED, SEARCHED, N_PLACES)
    places = line[:, None, :2] + (offsets * scale)[None, :, None] * across
    grey = grey_at(pixels, places, max(LEAST_BLUR_PX, SEAM_BLUR * scale))
    darkness = (grey - grey.mean(axis=1, keepdims=True)) / (grey.std() + LEAST_CONTRAST)
    moved = line.copy()
    moved[:, :2] += cheapest_path(darkness + SEAM_REST * offsets**2, offsets, SEAM_STIFFNESS)[:, None] * scale * across
    return moved


def _edge(pixels: NDArray[np.uint8], line: Floats, outer: Floats, scale: float) -> Floats:
    """The inner edge (N, 3) of one lip, from its landmarks and those of its outer edge."""
    inwards = (line - outer)[:, :2]
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True) + TINY_PX
    inwards[:CORNER_POINTS], inwards[-CORNER_POINTS:] = inwards[CORNER_POINTS], inwards[-CORNER_POINTS - 1]
    inwards = _smooth(inwards, WAY_SMOOTHING)
    offsets = np.linspace(-SEARCHED, SEARCHED, N_PLACES)
    places = line[:, None, :2] + (offsets * scale)[None, :, None] * inwards[:, None]
    middle = ((line + outer) / 2)[LIP_MIDDLE, None, :2]
    blur = max(LEAST_LIP_BLUR_PX, LIP_BLUR * scale)
    colours = lab_at(pixels, np.concatenate([places.reshape(-1, 1, 2), middle]), blur)[:, 0]
    lip = np.median(colours[places[..., 0].size :], axis=0)
    unlike = (((colours[: places[..., 0].size] - lip) / LIP_SPREAD) ** 2).sum(axis=1).reshape(places.shape[:2])
    likeness = np.minimum.accumulate(np.exp(-unlike / 2), axis=1)  # beyond the first edge there is no lip
    cost = np.full(likeness.shape, EDGE_GAIN)
    sums = np.concatenate([np.zeros((len(likeness), 1)), np.cumsum(likeness, axis=1)], axis=1)
    at = np.arange(N_SIDE, N_PLACES - N_SIDE)
    before = (sums[:, at] - sums[:, at - N_SIDE]) / N_SIDE
    behind = (sums[:, at + 1 + N_SIDE] - sums[:, at + 1]) / N_SIDE
    cost[:, at] = -EDGE_GAIN * (before - behind)
    steps = cheapest_path(cost + LIP_REST * offsets**2, offsets, LIP_STIFFNESS)
    from_corner = np.minimum(np.arange(N_POINTS), np.arange(N_POINTS)[::-1])
    moved = line.copy()
    moved[:, :2] += (steps * np.minimum(1, from_corner / CORNER_POINTS))[:, None] * scale * inwards
    return moved


def cheapest_path(cost: Floats, offsets: Floats, stiffness: float) -> Floats:
    """Offset (N,) of each row of the cheapest path through costs (N, P), smoothed."""
    step = stiffness * ((offsets[:, None] - offsets) / STIFF_STEP) ** 2
    total, came = cost[0].copy(), np.zeros(cost.shape, np.int64)
    for row in range(1, len(cost)):
        each = total[None] + step
        came[row] = each.argmin(axis=1)
        total = each.min(axis=1) + cost[row]
    chosen = [int(total.argmin())]
    for row in range(len(cost) - 1, 0, -1):
        chosen.append(int(came[row, chosen[-1]]))
    return _smooth(offsets[chosen[::-1]][:, None], SMOOTHING)[:, 0]


def _smooth(values: Floats, n: int) -> Floats:
    """Means of n neighbours along the first axis, (N, K); the ends are held."""
    padded = np.pad(values, ((n // 2, n // 2), (0, 0)), mode="edge")
    kernel = np.ones(n) / n
    return np.stack([np.convolve(column, kernel, "valid") for column in padded.T], axis=1)
