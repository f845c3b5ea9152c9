"""Lines of lips and lids in a photograph: the tracker's landmarks, moved onto the edges that its colours show."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_opening, distance_transform_edt, label
from scipy.spatial import cKDTree

from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LEFT_LIDS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    RIGHT_LIDS,
)
from tts2face.numeric.arrays import FloatArray, IntArray, Pixels, points_in_polygon
from tts2face.photo.found_face import FoundFace

N_LIP = 41  # along a lip, from the person's right corner to the left one
CLOSED_GAP = 0.02  # of the eye distance, as all lengths below; closed lips have up to .017, narrow smiles from .024
SEARCHED = 0.03  # to either side of the landmarks
N_PLACES = 25  # that are compared across the line at each point
SEAM_BLUR, LIP_BLUR = 0.005, 0.004
LEAST_BLUR_PX = 0.6
LEAST_LIP_BLUR_PX = 0.5
LEAST_CONTRAST = 1e-3
TINY_PX = 1e-6
STIFF_STEP = 0.01  # between neighbours, whose cost is the stiffness of a path
LIP_MIDDLE = slice(6, -6)  # points whose colours are those of the lip
SEAM_STIFFNESS, LIP_STIFFNESS = 2.0, 1.0  # cost of steps between neighbours
SEAM_REST, LIP_REST = 0.15 / 0.02**2, 0.25 / 0.03**2  # cost of a distance from the landmarks
EDGE_GAIN = 2.0
LIP_SPREAD = np.array([22.0, 7.0, 9.0])  # of a lip's colour in Lab
N_SIDE = 3  # places on each side of an edge whose colours are compared
EDGE_SHADE, EDGE_DARKNESS = 0.006, 0.55  # reach of the shadow between lips that meet, and its share of the light
EDGE_REACH, EDGE_FINE = 3, 4  # reaches beyond which there is no shade, and points of a finer edge
# points of means, and points over which corners take less
SMOOTHING = 5
WAY_SMOOTHING = 7
CORNER_POINTS = 4
LID_MARGINS = (RIGHT_LIDS, LEFT_LIDS)  # of the person, which the picture shows on its left and right
N_LID = 25  # points along the margin of a lid, from the outer corner to the inner one
BELOW = ((230, 231, 229, 118, 119, 117), (450, 451, 449, 347, 348, 346))  # landmarks of skin below the eyes
ABOVE = ((225, 224, 223, 222), (445, 444, 443, 442))  # and between folds and brows
LID_BLUR = 0.004  # of the eye distance, as all lengths below
HUE_SPREAD, BRIGHT_SPREAD = 8.0, 30.0  # of the colours of skin in Lab
LOWER_STEPS = np.arange(-0.012, 0.17, 0.006)  # of lower lids that are tried; drawn eyes are larger than the tracker's
INSIDE, OUTSIDE = 0.012, 0.016  # of a lower lid, where the eye and skin are compared
COST = 1.2  # of a step, over its length
GAIN, LEAST_STEP = 0.15, 0.012  # of a step that is taken
LARGE_EYES, LARGE_EYES_TRUST = 0.165, 0.4  # opening of drawn eyes, and the share of cost and gain that they need
LARGE_EYES_MORE = 0.025  # so that no rim of the eye is left when its lids are shut
# way that drawn eyes grow, steps of it, and way beyond
GROWN_REACH = 0.12
GROWN_STEP = 0.006
GROWN_MORE = 0.008
GROWN_UP, GROWN_THICK = 0.02, 2  # way above the upper margin, and half of the least thickness in steps
GROWN_SKIN, DARK_LASHES = 0.4, 0.45  # likeness to skin, and lightness over that of skin, at which they end
CORNER_STEPS, CORNER_SKIN = np.arange(0.006, 0.05, 0.006), 0.25  # of corners, up to where there is skin
MIDDLE = slice(4, -4)
FOLD_STEPS = np.arange(0.025, 0.13, 0.006)  # of the ends of upper lashes: where skin begins
MOST_LASHES = 0.065  # of eyes that are not drawn
FOLD_ROOM = 0.75  # of the way to the skin below the brow, at most
FOLD_COLUMNS = slice(6, -6)
FOLD_SKIN = 0.5


def lab_at(pixels: Pixels, places: FloatArray, blur: float) -> FloatArray:
    """CIE Lab of 8 bits (..., 3) of a blurred picture (H, W, 3) at places (..., 2), x and y."""
    import cv2

    part, low = _around(pixels, places, blur)
    return _sample(
        np.asarray(cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_RGB2LAB), np.float64), places - low, blur
    )


def grey_at(pixels: Pixels, places: FloatArray, blur: float) -> FloatArray:
    """Mean (...) of the channels of a blurred picture (H, W, 3) at places (..., 2), x and y."""
    part, low = _around(pixels, places, blur)
    return _sample(part.mean(axis=2)[..., None], places - low, blur)[..., 0]


def _around(pixels: Pixels, places: FloatArray, blur: float) -> tuple[Pixels, IntArray]:
    """The part of a picture that a blur reads at places, and its left top pixel."""
    margin = int(np.ceil(4 * blur)) + 1
    last = np.array(pixels.shape[1::-1]) - 1
    low = np.clip(np.floor(places.reshape(-1, 2).min(axis=0)).astype(np.int64) - margin, 0, last)
    high = np.clip(np.ceil(places.reshape(-1, 2).max(axis=0)).astype(np.int64) + margin + 1, low + 1, last + 1)
    return pixels[low[1] : high[1], low[0] : high[0]], low


def _sample(values: FloatArray, places: FloatArray, blur: float) -> FloatArray:
    """Values (..., C) of a blurred picture (h, w, C) at places (..., 2)."""
    from scipy.ndimage import gaussian_filter

    return colours_at(gaussian_filter(values, (blur, blur, 0)), places)


def colours_at(values: FloatArray, places: FloatArray) -> FloatArray:
    """Values (..., C) of a picture (H, W, C) at places (..., 2), x and y, between its pixels."""
    from scipy.ndimage import map_coordinates

    at = np.moveaxis(places, -1, 0)[::-1]
    return np.stack(
        [map_coordinates(part, at, order=1, mode="nearest") for part in np.moveaxis(values, -1, 0)], axis=-1
    )


@dataclass(frozen=True, slots=True, eq=False)
class InnerLips:
    """Inner edges of the lips.

    Parameters
    ----------
    upper, lower : (41, 3)
        Pixels and depth as landmarks have them; equal in the corners, and everywhere if the mouth is closed.
    gap
        Largest opening by the landmarks, of the eye distance.
    """

    upper: FloatArray
    lower: FloatArray
    gap: float

    @property
    def is_closed(self) -> bool:
        """Whether the lips touch."""
        return self.gap < CLOSED_GAP


def find_lip_line(pixels: Pixels, face: FoundFace) -> InnerLips:
    """Inner edges of the lips of a face in a picture (H, W, 3).

    Notes
    -----
    Closed lips meet in the darkest seam near the landmarks, open ones end where the colour of the lip does; both are
    cheapest paths (dynamic programming) over places across the line.
    """
    weights = spline_weights(len(INNER_LIP_UPPER), N_LIP)
    inner = [weights @ face.landmarks[list(numbers)] for numbers in (INNER_LIP_UPPER, INNER_LIP_LOWER)]
    gap = float(np.linalg.norm((inner[0] - inner[1])[:, :2], axis=1).max() / face.eye_distance_px)
    scale = face.eye_distance_px
    if gap < CLOSED_GAP:
        seam = _seam(pixels, (inner[0] + inner[1]) / 2, scale)
        return InnerLips(seam, seam.copy(), gap)
    outer = [weights @ face.landmarks[list(numbers)] for numbers in (OUTER_LIP_UPPER, OUTER_LIP_LOWER)]
    upper, lower = (_edge(pixels, line, around, scale) for line, around in zip(inner, outer, strict=True))
    crossed = lower[:, 1] < upper[:, 1]
    crossed[[0, -1]] = True
    upper[crossed] = lower[crossed] = ((upper + lower) / 2)[crossed]
    return InnerLips(upper, lower, gap)


def spline_weights(n: int, m: int) -> FloatArray:
    """(m, n) values at m places of the natural cubic spline through n equidistant ones."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(np.linspace(0, 1, n), np.eye(n), bc_type="natural")(np.linspace(0, 1, m)))


def darken_lip_edges(pixels: Pixels, lips: InnerLips, scale: float) -> Pixels:
    """Picture (H, W, 3) whose parted lips darken towards their inner edges, as lips that meet do."""
    if lips.is_closed:
        return pixels
    margin = int(np.ceil(EDGE_REACH * EDGE_SHADE * scale)) + 2
    every = np.concatenate([lips.upper, lips.lower])[:, :2]
    low = np.maximum(np.floor(every.min(axis=0)).astype(int) - margin, 0)
    high = np.minimum(np.ceil(every.max(axis=0)).astype(int) + margin, pixels.shape[1::-1])
    down, across = np.mgrid[low[1] : high[1], low[0] : high[0]]
    places = np.column_stack([across.ravel(), down.ravel()]).astype(np.float64)
    fine = spline_weights(N_LIP, EDGE_FINE * N_LIP)
    edges = np.concatenate([fine @ lips.upper, fine @ lips.lower])[:, :2]
    away = np.asarray(cKDTree(edges).query(places)[0]).reshape(down.shape)
    bright = 1 - EDGE_DARKNESS * np.exp(-((away / (EDGE_SHADE * scale)) ** 2))
    darker = pixels.copy()
    part = pixels[low[1] : high[1], low[0] : high[0]] * bright[..., None]
    darker[low[1] : high[1], low[0] : high[0]] = np.rint(part).astype(np.uint8)
    return darker


def _seam(pixels: Pixels, line: FloatArray, scale: float) -> FloatArray:
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


def _edge(pixels: Pixels, line: FloatArray, outer: FloatArray, scale: float) -> FloatArray:
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
    from_corner = np.minimum(np.arange(N_LIP), np.arange(N_LIP)[::-1])
    moved = line.copy()
    moved[:, :2] += (steps * np.minimum(1, from_corner / CORNER_POINTS))[:, None] * scale * inwards
    return moved


def cheapest_path(cost: FloatArray, offsets: FloatArray, stiffness: float) -> FloatArray:
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


def _smooth(values: FloatArray, n: int) -> FloatArray:
    """Means of n neighbours along the first axis, (N, K); the ends are held."""
    padded = np.pad(values, ((n // 2, n // 2), (0, 0)), mode="edge")
    kernel = np.ones(n) / n
    return np.stack([np.convolve(column, kernel, "valid") for column in padded.T], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class LidLines:
    """Margins of the lids: the upper and lower one (25, 3) of each eye, pixels and depths; equal in the corners.

    The folds lie `fold` pixels above the upper margins.
    """

    upper: tuple[FloatArray, FloatArray]
    lower: tuple[FloatArray, FloatArray]
    fold: float


def find_lid_lines(pixels: Pixels, landmarks: FloatArray, scale: float) -> LidLines:
    """Margins of the lids in a picture (H, W, 3) from landmarks (478, 3); `scale` is the eye distance, pixels."""
    weights = spline_weights(len(RIGHT_LIDS[0]), N_LID)
    lines = [[weights @ landmarks[list(numbers)] for numbers in lids] for lids in LID_MARGINS]
    eyes = [_Eye(pixels, landmarks, upper, lower, scale, eye) for eye, (upper, lower) in enumerate(lines)]
    step = _lower_step(eyes)
    if step > 0:
        lines = [eye.enlarged(step * scale) for eye in eyes]
    if min(eye.opening for eye in eyes) > LARGE_EYES:
        lines = [eye.grown(*line) for eye, line in zip(eyes, lines, strict=True)]
    (first, second) = lines
    return LidLines((first[0], second[0]), (first[1], second[1]), _fold(eyes) * scale)


def _hull(places: FloatArray) -> FloatArray:
    """Corners (M, 2) of the convex polygon around places (N, 2)."""
    from scipy.spatial import ConvexHull

    found: FloatArray = places[ConvexHull(places).vertices]
    return found


def _lower_step(eyes: "list[_Eye]") -> float:
    """How far the lower lids of a picture lie below the landmarks, of the eye distance; 0 where they fit.

    Both eyes are tried together: the picture of one may mislead.
    """
    scores = np.mean([eye.edge_scores() for eye in eyes], axis=0)
    trust = LARGE_EYES_TRUST if min(eye.opening for eye in eyes) > LARGE_EYES else 1.0
    gains = scores[:-1] - trust * COST * np.abs(LOWER_STEPS)
    best = int(gains.argmax())
    is_better = gains[best] > scores[-1] + trust * GAIN and LOWER_STEPS[best] > LEAST_STEP
    more = LARGE_EYES_MORE if trust < 1 else 0.0
    return float(LOWER_STEPS[best]) + more if is_better else 0.0


class _Eye:
    """An eye whose margins the landmarks give."""

    def __init__(
        self, pixels: Pixels, landmarks: FloatArray, upper: FloatArray, lower: FloatArray, scale: float, eye: int
    ) -> None:
        self._pixels, self._landmarks, self._eye = pixels, landmarks, eye
        self._upper, self._lower, self._scale = upper, lower, scale
        self._bow = np.sin(np.linspace(0, np.pi, N_LID))[:, None] ** 0.6
        down = (lower - upper)[N_LID // 2, :2]
        along = upper[-1, :2] - upper[0, :2]
        self._along = along / np.linalg.norm(along)
        across = np.array([-self._along[1], self._along[0]])
        self._down = down / np.linalg.norm(down) if np.linalg.norm(down) > 1e-6 else across * np.sign(across[1])
        self._skin = self._lab(landmarks[list(BELOW[eye]), :2]).mean(axis=0)

    def _lab(self, places: FloatArray) -> FloatArray:
        return lab_at(self._pixels, places, max(0.6, LID_BLUR * self._scale))

    def _is_skin(self, places: FloatArray) -> FloatArray:
        """(...) likeness of the hue at places (..., 2) to that of the skin below the eye."""
        off = (self._lab(places) - self._skin)[..., 1:] / HUE_SPREAD
        found: FloatArray = np.exp(-(off**2).sum(axis=-1) / 2)
        return found

    @property
    def opening(self) -> float:
        """Height of the opening by the landmarks, of the eye distance."""
        return float(np.linalg.norm((self._lower - self._upper)[N_LID // 2, :2])) / self._scale

    def edge_scores(self) -> FloatArray:
        """(K + 1,) how well the lower lid fits there by which `LOWER_STEPS` it may lie lower, and at the landmarks."""
        steps = np.append(LOWER_STEPS, 0.0) * self._scale
        lines = self._lower[None, MIDDLE, :2] + steps[:, None, None] * self._bow[MIDDLE] * self._down
        inside, outside = (self._is_skin(lines + way * self._scale * self._down) for way in (-INSIDE, OUTSIDE))
        scores: FloatArray = (outside - inside).mean(axis=1)
        return scores

    def enlarged(self, step: float) -> list[FloatArray]:
        """Margins of an eye whose lower lid lies lower, with corners where skin begins."""
        upper, lower = self._upper.copy(), self._lower.copy()
        lower[:, :2] += step * self._bow * self._down
        share = np.linspace(0, 1, N_LID)[:, None]
        for corner, sign, weight in ((0, -1, (1 - share) ** 3), (-1, 1, share**3)):
            places = self._upper[corner, :2] + sign * CORNER_STEPS[:, None] * self._scale * self._along
            open_steps = np.flatnonzero(self._is_skin(places) > CORNER_SKIN)
            n = int(open_steps[0]) if len(open_steps) else len(CORNER_STEPS)
            shift = sign * (CORNER_STEPS[n - 1] if n else 0.0) * self._scale * weight * self._along
            upper[:, :2] += shift
            lower[:, :2] += shift
        return [upper, lower]

    def grown(self, upper: FloatArray, lower: FloatArray) -> list[FloatArray]:
        """Margins (25, 3) of a drawn eye around all that is joined to it and neither skin nor as dark as lashes."""
        reach, corner = GROWN_REACH * self._scale, upper[0, :2]
        across = np.array([-self._along[1], self._along[0]])
        across *= np.sign(across @ self._down)
        every = (np.concatenate([upper, lower])[:, :2] - corner) @ np.stack([self._along, across]).T
        low, high = every.min(axis=0) - reach, every.max(axis=0) + reach
        step = max(GROWN_STEP * self._scale, 0.5)
        columns, rows = (np.arange(first, last, step) for first, last in zip(low, high, strict=True))
        grid = np.stack(np.broadcast_arrays(columns[None], rows[:, None]), axis=-1)
        places = corner + grid[..., :1] * self._along + grid[..., 1:] * across
        colours = self._lab(places)
        skin = self._lab(self._landmarks[[*BELOW[self._eye], *ABOVE[self._eye]], :2])
        off = (colours[..., None, :] - skin) / (BRIGHT_SPREAD, HUE_SPREAD, HUE_SPREAD)
        n = len(upper)
        least = np.interp(columns, every[:n, 0], every[:n, 1]) - GROWN_UP * self._scale
        inside = points_in_polygon(grid.reshape(-1, 2), np.concatenate([every[:n], every[:n:-1]])).reshape(
            grid.shape[:2]
        )
        is_eye = (np.exp(-(off**2).sum(axis=-1) / 2).max(axis=-1) < GROWN_SKIN) & (
            colours[..., 0] > DARK_LASHES * self._skin[0]
        )
        is_eye = binary_opening(is_eye, iterations=GROWN_THICK) & (grid[..., 1] > least)
        pieces, _ = label((is_eye & (distance_transform_edt(~inside) * step < reach)) | inside)
        eye = pieces == np.bincount(pieces[inside], minlength=1).argmax()
        hull = points_in_polygon(grid.reshape(-1, 2), _hull(grid[eye])).reshape(eye.shape) | eye
        seen = np.flatnonzero(eye.any(axis=0))
        edges = [np.where(part, rows[:, None], sign * np.inf) for part, sign in ((eye, 1), (hull, -1))]
        heights = [edges[0].min(axis=0)[seen], edges[1].max(axis=0)[seen]]
        at = np.linspace(columns[seen[0]], columns[seen[-1]], n)
        lines = []
        for line, height, sign in zip((upper, lower), heights, (-1, 1), strict=True):
            way = _smooth(np.interp(at, columns[seen], height)[:, None], SMOOTHING) + sign * GROWN_MORE * self._scale
            way[[0, -1]] = [[np.mean([height[end] for height in heights])] for end in (0, -1)]
            lines.append(np.column_stack([corner + at[:, None] * self._along + way * across, line[:, 2]]))
        return lines

    def skin_above(self) -> FloatArray:
        """(K,) likeness to skin below the brow, at `FOLD_STEPS` above the upper margin; 1 too near to that skin."""
        brow = self._landmarks[list(ABOVE[self._eye]), :2]
        skin = np.median(self._lab(brow), axis=0)
        room = FOLD_ROOM * float(np.linalg.norm(brow.mean(axis=0) - self._upper[N_LID // 2, :2])) / self._scale
        ways = (FOLD_STEPS * self._scale)[:, None, None] * self._bow[FOLD_COLUMNS] * self._down
        off = (self._lab(self._upper[None, FOLD_COLUMNS, :2] - ways) - skin) / (BRIGHT_SPREAD, HUE_SPREAD, HUE_SPREAD)
        return np.where(room < FOLD_STEPS, 1.0, np.exp(-(off**2).sum(axis=2) / 2).mean(axis=1))


def _fold(eyes: "list[_Eye]") -> float:
    """Height of the lashes above the upper margins, of the eye distance: more with the liner of drawn eyes."""
    is_drawn = min(eye.opening for eye in eyes) > LARGE_EYES
    steps = FOLD_STEPS if is_drawn else FOLD_STEPS[FOLD_STEPS < MOST_LASHES]
    is_skin = np.flatnonzero(np.mean([eye.skin_above() for eye in eyes], axis=0)[: len(steps)] > FOLD_SKIN)
    return float(steps[is_skin[0]]) if len(is_skin) else float(steps[0] if is_drawn else steps[-1])
