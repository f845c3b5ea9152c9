"""Mesh over a photograph: slits between lips and lids, bands of lashes, landmarks, and grids around them.

The band above the margin of an upper lid moves with it, as lashes do.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from tts2face.models.landmarks import (
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, points_in_polygon
from tts2face.photo.lines import LID_MARGINS, N_LID, InnerLips, LidLines

Frame = tuple[FloatArray, FloatArray]

LIP_RINGS = (
    (62, 183, 42, 41, 38, 12, 268, 271, 272, 407, 292),
    (62, 96, 89, 179, 86, 15, 316, 403, 319, 325, 292),
)  # landmarks within the red of the upper and the lower lip, from the person's right to the left
BAND_ROWS = (0.5, 1.0)  # rows of the band of lashes above an upper lid, of its height
BAND_AT_CORNER = 0.35  # of these in the corners of the eye
PART = 0.12  # by which lips are parted to find their triangles, of the eye distance
PART_REACH = 0.5  # over which that fades
LEAST_DISTANCE = 0.011  # of a landmark from lips and lids
GRIDS = ((0.035, -np.inf, 0.15), (0.075, 0.15, 0.8), (0.16, 0.8, np.inf))  # step, from and to what way from the face
GRID_CLEAR = 0.55  # of its step, which a point of a grid keeps from all others
ROW_STEP = 0.87  # between the rows of a grid, of its step
MOST_REACH = 4.0  # of what moves from the oval of the face, of the eye distance
EDGE_PX = 2.0  # from the picture's edge, which landmarks keep


@dataclass(frozen=True, slots=True, eq=False)
class PhotoMesh:
    """Vertices and triangles of a photograph of a person.

    Attributes
    ----------
    places : (V, 2)
        Pixels.
    known, depths : (N,), (N,)
        Vertices whose depth is known, and that depth, pixels towards the camera.
    triangles : (F, 3)
        Without the openings of mouth and eyes; counter-clockwise with y up.
    upper_lip, lower_lip : (41,)
        Vertices, which share the corners.
    upper_lids, lower_lids : two of (25,)
        Of the person's right and left eye, from the outer corner to the inner one.
    bands : two of (rows, 23)
        Vertices of the bands above the upper lids.
    landmarks : (N,), landmark_vertices : (N,)
        Landmarks that are vertices.
    outside : (V,)
        Way to the oval of the face, less than 0 in it, pixels.
    border
        Vertices at the edges of the mesh.
    frame
        Least and greatest (2,) pixel of the mesh: what may move of the picture.
    """

    places: FloatArray
    known: IntArray
    depths: FloatArray
    triangles: IntArray
    upper_lip: IntArray
    lower_lip: IntArray
    upper_lids: tuple[IntArray, IntArray]
    lower_lids: tuple[IntArray, IntArray]
    bands: tuple[IntArray, IntArray]
    landmarks: IntArray
    landmark_vertices: IntArray
    outside: FloatArray
    border: IntArray
    frame: Frame

    @property
    def vertex_of(self) -> dict[int, int]:
        """Vertices of the landmarks that are vertices."""
        return dict(zip(self.landmarks.tolist(), self.landmark_vertices.tolist(), strict=True))


def build_mesh(
    size: tuple[int, int], landmarks: FloatArray, lips: InnerLips, lids: LidLines, scale: float
) -> PhotoMesh:
    """Mesh of a picture of a size (width, height) with landmarks (478, 3), pixels and depths.

    `scale` is the distance of the outer eye corners, pixels.
    """
    points = _Points()
    upper_lip = points.add(lips.upper)
    lower_lip = points.add_between(upper_lip, lips.lower)
    upper_lids = [points.add(line) for line in lids.upper]
    lower_lids = [points.add_between(upper, line) for upper, line in zip(upper_lids, lids.lower, strict=True)]
    rows = [[points.add(row) for row in _band(line, lids.fold)] for line in lids.upper]
    lines = points.every[:, :2]
    openings = [np.concatenate([line, other[::-1]])[:, :2] for line, other in zip(lids.upper, lids.lower, strict=True)]
    if not lips.is_closed:
        openings.append(np.concatenate([lips.upper, lips.lower[::-1]])[:, :2])
    bands = [
        np.concatenate([line[:, :2], points.every[row[-1], :2][::-1]])
        for line, row in zip(lids.upper, rows, strict=True)
    ]
    mouth = _Mouth.between(lips, scale)
    used = _landmarks(landmarks, lines, [*openings, *bands], mouth, (size, scale))
    landmark_vertices = points.add(landmarks[used])
    known = points.every
    oval = landmarks[list(FACE_OVAL), :2]
    frame = _frame(size, oval, scale)
    grid = np.concatenate([*_grids(frame, oval, known[:, :2], scale)])
    grid = grid[~np.any([points_in_polygon(grid, polygon) for polygon in (*openings, *bands)], axis=0)]
    border = _border(frame, scale)
    places = np.concatenate([known[:, :2], grid, border])
    parted = mouth.part(places, np.zeros(len(places)))
    for line, side in ((upper_lip, -1.0), (lower_lip, 1.0)):
        parted[line] = mouth.part(places[line], np.full(len(line), side))
    triangles = _triangles(parted, [(upper_lip, lower_lip), *zip(upper_lids, lower_lids, strict=True)])
    return PhotoMesh(
        places=places,
        known=np.arange(len(known)),
        depths=known[:, 2],
        triangles=triangles,
        upper_lip=upper_lip,
        lower_lip=lower_lip,
        upper_lids=(upper_lids[0], upper_lids[1]),
        lower_lids=(lower_lids[0], lower_lids[1]),
        bands=(np.array(rows[0]), np.array(rows[1])),
        landmarks=used,
        landmark_vertices=landmark_vertices,
        outside=way_outside(places, oval),
        border=len(known) + len(grid) + np.arange(len(border)),
        frame=frame,
    )


class _Points:
    """Vertices that are added one line after the other."""

    def __init__(self) -> None:
        self._lines: list[FloatArray] = []
        self._count = 0

    @property
    def every(self) -> FloatArray:
        return np.concatenate(self._lines)

    def add(self, line: FloatArray) -> IntArray:
        """Vertices of a line (N, 3)."""
        self._lines.append(line)
        self._count += len(line)
        return np.arange(self._count - len(line), self._count)

    def add_between(self, other: IntArray, line: FloatArray) -> IntArray:
        """Vertices of a line (N, 3) that shares its ends with another one."""
        return np.concatenate([other[:1], self.add(line[1:-1]), other[-1:]])


def _band(margin: FloatArray, fold: float) -> Iterator[FloatArray]:
    """Rows (23, 3) of the band above the margin (25, 3) of an upper lid."""
    along = margin[-1, :2] - margin[0, :2]
    up = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    up *= -np.sign(up[1])
    bow = np.sin(np.linspace(0, np.pi, N_LID))[1:-1, None] ** 0.5
    for height in BAND_ROWS:
        row = margin[1:-1].copy()
        row[:, :2] += height * fold * up * (BAND_AT_CORNER + (1 - BAND_AT_CORNER) * bow)
        yield row


@dataclass(frozen=True, slots=True, eq=False)
class _Mouth:
    """Frame along the line between the lips, in which they are parted."""

    middle: FloatArray
    half_width: float
    axes: FloatArray
    line: FloatArray
    scale: float

    @classmethod
    def between(cls, lips: InnerLips, scale: float) -> "_Mouth":
        right, left = lips.upper[0, :2], lips.upper[-1, :2]
        half = float(np.linalg.norm(left - right)) / 2
        along = (left - right) / (2 * half)
        axes = np.stack([along, (-along[1], along[0])])
        middle = (left + right) / 2
        return cls(middle, half, axes, ((lips.upper + lips.lower)[:, :2] / 2 - middle) @ axes.T, scale)

    def below(self, places: FloatArray) -> FloatArray:
        """(N,) how far places (N, 2) lie below the line between the lips, pixels."""
        local = (places - self.middle) @ self.axes.T
        below: FloatArray = local[:, 1] - np.interp(local[:, 0], *self.line.T)
        return below

    def part(self, places: FloatArray, side: FloatArray) -> FloatArray:
        """Places (N, 2) with parted lips; side (N,) is -1 above, 1 below, 0 where they are."""
        off = self.below(places)
        across = (places - self.middle) @ self.axes[0] / self.half_width
        lens = np.sqrt(np.clip(1 - across**2, 0, 1)) * np.exp(-np.abs(off) / (PART_REACH * self.scale))
        way = np.where(side, side, np.sign(off)) * PART * self.scale * lens
        parted: FloatArray = places + way[:, None] * self.axes[1]
        return parted


def _landmarks(
    landmarks: FloatArray,
    lines: FloatArray,
    openings: Sequence[FloatArray],
    mouth: _Mouth,
    of_picture: tuple[tuple[int, int], float],
) -> IntArray:
    """Landmarks that become vertices: not on the lines, in the openings, or on the other side of the mouth."""
    size, scale = of_picture
    on_lines = {
        *INNER_LIP_UPPER,
        *INNER_LIP_LOWER,
        *(number for lids in LID_MARGINS for line in lids for number in line),
    }
    used = np.array([number for number in range(N_MESH_LANDMARKS) if number not in on_lines])
    places = landmarks[used, :2]
    side = np.zeros(N_MESH_LANDMARKS)
    for sign, rows in ((-1, (LIP_RINGS[0], OUTER_LIP_UPPER)), (1, (LIP_RINGS[1], OUTER_LIP_LOWER))):
        for row in rows:
            side[list(row[1:-1])] = sign
    kept = cKDTree(lines).query(places)[0] >= LEAST_DISTANCE * scale
    kept &= side[used] * mouth.below(places) >= 0
    kept &= ~np.any([points_in_polygon(places, polygon) for polygon in openings], axis=0)
    kept &= ((places >= EDGE_PX) & (places <= np.array(size) - 1 - EDGE_PX)).all(axis=1)
    chosen: IntArray = used[kept]
    return chosen


def way_outside(places: FloatArray, oval: FloatArray) -> FloatArray:
    """(N,) way from places (N, 2) to a closed line (M, 2), less than 0 inside."""
    ends = np.roll(oval, -1, axis=0)
    sides = ends - oval
    x, y = places[:, 0, None], places[:, 1, None]
    at = (x - oval[:, 0]) * sides[:, 0] + (y - oval[:, 1]) * sides[:, 1]
    at = np.clip(at / np.maximum((sides**2).sum(axis=1), 1e-12), 0, 1)
    right, up = x - (oval[:, 0] + at * sides[:, 0]), y - (oval[:, 1] + at * sides[:, 1])
    way = np.sqrt((right * right + up * up).min(axis=1))
    signed: FloatArray = np.where(points_in_polygon(places, oval), -way, way)
    return signed


def _frame(size: tuple[int, int], oval: FloatArray, scale: float) -> Frame:
    """Corners of the part of a picture (width, height), around the oval of a face, that may move."""
    low = np.maximum(oval.min(axis=0) - MOST_REACH * scale, -0.5)
    high = np.minimum(oval.max(axis=0) + MOST_REACH * scale, np.array(size) - 0.5)
    return low, high


def _grids(frame: Frame, oval: FloatArray, near: FloatArray, scale: float) -> Iterator[FloatArray]:
    tree = cKDTree(near)
    for share, first, last in GRIDS:
        step, reach = share * scale, min(last, MOST_REACH) * scale
        low, high = np.maximum(frame[0], oval.min(axis=0) - reach), np.minimum(frame[1], oval.max(axis=0) + reach)
        across, down = np.meshgrid(
            np.arange(low[0] + 0.7 * step, high[0] - step / 2, step),
            np.arange(low[1] + 0.7 * step, high[1] - step / 2, ROW_STEP * step),
        )
        across[1::2] += step / 2
        places = np.column_stack([across.ravel(), down.ravel()])
        places = places[places[:, 0] < high[0] - step / 4]
        way = way_outside(places, oval)
        places = places[(way >= first * scale) & (way < last * scale)]
        yield places[tree.query(places)[0] > GRID_CLEAR * step] if len(places) else places


def _border(frame: Frame, scale: float) -> FloatArray:
    step = GRIDS[-1][0] * scale
    (left, top), (right, bottom) = frame
    across, down = (np.linspace(a, b, max(8, int((b - a) / step))) for a, b in ((left, right), (top, bottom)))
    rows = [np.column_stack([across, np.full(len(across), edge)]) for edge in (top, bottom)]
    columns = [np.column_stack([np.full(len(down), edge), down])[1:-1] for edge in (left, right)]
    return np.concatenate([*rows, *columns])


def _triangles(places: FloatArray, slits: Sequence[tuple[IntArray, IntArray]]) -> IntArray:
    """Triangles between places (V, 2), counter-clockwise with y up, without those within slits."""
    found = np.asarray(Delaunay(places).simplices, np.int64)
    corners = places[found]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    found[area > 0] = found[area > 0][:, ::-1]
    middles = corners.mean(axis=1)
    kept: Mask = np.array(area != 0, bool)
    for upper, lower in slits:
        polygon = np.concatenate([upper, lower[::-1]])
        within = np.array(np.isin(found, polygon).all(axis=1), bool)
        within[within] = points_in_polygon(middles[within], places[polygon])
        kept &= ~within
    left: IntArray = found[kept]
    return left


def grid_triangles(numbers: IntArray) -> IntArray:
    """Triangles of a grid of vertices (R, C), of rows from above and columns from the left, seen from ahead."""
    a, b, c, d = (part.ravel() for part in (numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, :-1], numbers[1:, 1:]))
    return np.concatenate([np.column_stack([a, c, d]), np.column_stack([a, d, b])])
