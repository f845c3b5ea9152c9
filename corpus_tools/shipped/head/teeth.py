"""Teeth: two arches of crowns and gums along the curves of MakeHuman's teeth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.grids import grid_triangles
from corpus_tools.shipped.head.cage import SCALE
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.subdivision import join_triangles
from tts2face.numeric.arrays import FloatArray, smoothstep

# Sizes after Wheeler, Dental Anatomy. The incisors touch the inner side of the lips, 2.5 mm (upper) and 6 mm (lower)
# behind the line between them, the canines and premolars that of the cheeks; the molars are those of MakeHuman's strip.
UPPER_CURVE = np.array(
    [(0, 26.6), (8.6, 25.2), (16.2, 20.4), (21.6, 13.4), (24.9, 5.0), (27.0, -5.0), (28.6, -16.0)]
)  # fmt: skip
LOWER_CURVE = np.array(
    [(0, 23.2), (7.6, 21.9), (14.7, 17.3), (19.9, 10.6), (23.3, 2.5), (26.3, -7.0), (28.1, -18.0)]
)  # fmt: skip
SHADE = np.array([1.0, 0.98, 0.88, 0.72, 0.54, 0.38])  # brightness of the crowns; cheeks shade the back ones
TOOTH, TOOTH_DARK = np.array([0.86, 0.83, 0.77]), np.array([0.79, 0.72, 0.62])
GAP_SHADE = np.array([0.50, 0.44, 0.38])  # share of the light that the sides of a crown lack: its neighbours shade it
GUM = np.array([0.68, 0.36, 0.36])
BACK_Z, FRONT_Z, MOST_SHIFT_MM = -16.0, 14.0, 5.0  # molars stay; front teeth follow the lips
COVER_MM = {"upper": 2.2, "lower": 3.8}  # of skin in front of teeth and gums at rest; a smile draws the lower lip back
# Of the gums near the roots, outwards: the chin's fold lies before the lower ones.
UPPER_PLATE_MM = 0.5
LOWER_PLATE_MM = -2.2
N_AROUND, LEVELS = 12, np.array([0.0, 0.04, 0.13, 0.45, 1.0])
MATERIALS = {
    "teeth": {"specular": 0.5, "shininess": 60.0, "wrap": 0.3},
    "gums": {"specular": 0.4, "shininess": 40.0, "wrap": 0.3},
}
# A crown by levels of its height, from the biting edge, 0, to the neck, 1; it goes on into the gum.
CROWN_LEVELS = (0, 0.03, 0.10, 0.25, 0.6, 1)
BREADTHS = (0.70, 0.86, 0.955, 0.985, 0.95, 0.80)  # shares of the width
CUTTING_MM = 6.5  # depth below which a crown cuts
CUTTING_EDGE, GRINDING_EDGE = 0.28, 0.62  # shares of the depth that the biting edge has
EDGE_ROUNDING, EDGE_STEPS, NECK_THICKNESSES = 0.6, (0.1, 0.2), (0.86, 1.0)  # and the thickness from there to the neck
FRONT_LEVELS, FRONT_MM = (0, 0.1, 0.35, 1), (0.9, 0.35, 0.0, 0.5)  # distance of the outer face from the arch's curve
BOX_EXPONENT = 0.7  # of a crown's section, between an ellipse, 1, and a box, 0
IN_GUM_MM, CAP_MM = 1.5, 0.05  # length of a crown within the gum, and rise of its biting edge's middle
DARK_FROM, DARK_EXPONENT, SIDE_EXPONENT = 0.35, 1.5, 6  # level where the neck's colour begins, and how colours change
# The gum: its edge dips between teeth; rings of its section as height over the edge or the necks, and outwards, in mm.
DIP, DIP_EXPONENT = 0.20, 0.8  # share of a crown's height
UNDER_CROWN_MM, BULGE_MM = -0.5, (0.8, 0.45)
PLATE_UP_MM, ROOT_UP_MM, ROOT_IN_MM = 3.0, 6.5, 2.3
INNER_TOP_MM, INNER_BULGE_MM, INNER_EDGE_MM, INNER_FOOT_MM = (7.0, -1), (3.0, -2.5), (0.8, -1.0), 0.3
N_NEAR_SKIN = 8  # vertices of the skin ahead of a point, in front view
_GUM_GRID = (61, 8)


@dataclass(frozen=True, slots=True, eq=False)
class Arch:
    """One row of teeth.

    Parameters
    ----------
    curve : (K, 2)
        x and z of the crowns' outer faces from the middle to the left end, mm.
    edge_y : float
        Height of the biting edge, mm.
    up : float
        1 when the roots are above the edge, -1 below.
    widths, heights, depths : (6,)
        Crowns from the middle to the first molar, mm.
    """

    curve: FloatArray
    edge_y: float
    up: float
    widths: FloatArray
    heights: FloatArray
    depths: FloatArray


UPPER = Arch(
    UPPER_CURVE, -0.636 * SCALE, 1.0,
    np.array([8.6, 6.7, 7.7, 7.0, 6.8, 9.8]),
    np.array([10.6, 9.3, 10.2, 8.6, 8.0, 7.4]),
    np.array([5.0, 4.6, 6.0, 8.0, 8.4, 9.6]),
)  # fmt: skip


LOWER = Arch(
    LOWER_CURVE, -0.632 * SCALE, -1.0,
    np.array([5.6, 6.1, 7.0, 7.0, 7.1, 10.4]),
    np.array([7.8, 8.0, 9.0, 8.2, 7.8, 7.4]),
    np.array([4.6, 4.8, 6.0, 7.2, 8.0, 9.4]),
)  # fmt: skip


def arch_piece(arch: Arch, name: str) -> HeadPart:
    """Crowns and gum of an arch; its two spans are ``teeth_<name>`` and ``gums_<name>``."""
    path = arch_path(arch.curve)
    points, colours = [], []
    for side in (1.0, -1.0):
        along = 0.0
        for width, height, depth, light in zip(arch.widths, arch.heights, arch.depths, SHADE, strict=True):
            crown, enamel = _crown(width, height, depth)
            points.append(_place_crown(crown, path, side * (along + width / 2), arch))
            colours.append(light * enamel)
            along += width
    vertices = np.concatenate(points)
    tube = _tube_triangles(len(LEVELS), N_AROUND, closed_start=True)
    faces = join_triangles([tube] * len(points), map(len, points))
    gum = gum_piece(path, arch, GUM)
    spans = (
        MaterialSpan(f"teeth_{name}", _wind_outward(faces, arch.up), MATERIALS["teeth"]),
        MaterialSpan(f"gums_{name}", gum.spans[0].triangles + len(vertices), MATERIALS["gums"]),
    )
    return HeadPart(np.concatenate([vertices, gum.vertices]), spans, np.concatenate([*colours, gum.colours]))


def gum_piece(path: "ArchPath", arch: Arch, colour: FloatArray) -> HeadPart:
    """The gum of an arch, darker towards its ends."""
    vertices = _gum(path, arch)
    faces = _wind_outward(_tube_triangles(*_GUM_GRID, closed_start=False), arch.up)
    colours = np.repeat(_light_along(arch), _GUM_GRID[1])[:, None] * colour
    return HeadPart(vertices, (MaterialSpan("gums", faces, MATERIALS["gums"]),), colours)


def fit_teeth(points: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Points scaled and shifted per axis as the strip of teeth `before` (N, 3) is to `after` (N, 3)."""
    scale = after.std(axis=0) / before.std(axis=0)
    moved: FloatArray = after.mean(axis=0) + scale * (points - before.mean(axis=0))
    return moved


def follow_lips(points: FloatArray, default: FloatArray, ahead: float) -> FloatArray:
    """Points (N, 3) whose front teeth follow lips that lie `ahead` mm further forward than the default person's.

    `default` holds the same points on the default person.
    """
    own = float(points[:, 2].max() - default[:, 2].max())
    share = smoothstep(default[:, 2], BACK_Z, FRONT_Z)
    moved = points.copy()
    moved[:, 2] += share * np.clip(ahead - own, -MOST_SHIFT_MM, MOST_SHIFT_MM)
    return moved


def keep_behind(points: FloatArray, skin: FloatArray, cover: float) -> FloatArray:
    """Points (N, 3) at least `cover` mm behind the foremost of the skin's vertices (S, 3) nearby, in front view."""
    from scipy.spatial import cKDTree

    near = cKDTree(skin[:, :2]).query(points[:, :2], N_NEAR_SKIN)[1]
    moved = points.copy()
    moved[:, 2] = np.minimum(points[:, 2], skin[near, 2].max(axis=1) - cover)
    return moved


@dataclass(frozen=True, slots=True, eq=False)
class ArchPath:
    """The curve by arc length from the middle, left positive: (n,) lengths, (n, 2) x and z, (n, 2) outward normals."""

    lengths: FloatArray
    places: FloatArray
    normals: FloatArray

    def at(self, along: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions and normals (..., 2) at arc lengths."""
        both = [np.stack([np.interp(along, self.lengths, line[:, k]) for k in (0, 1)], axis=-1)
                for line in (self.places, self.normals)]  # fmt: skip
        return both[0], both[1]


def arch_path(curve: FloatArray) -> ArchPath:
    """The curve of an arch, mirrored, from its points (K, 2) on the left."""
    from scipy.interpolate import CubicSpline

    mirrored = np.concatenate([curve[:0:-1] * [-1, 1], curve])
    knots = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(mirrored, axis=0), axis=1))])
    places = CubicSpline(knots, mirrored)(np.linspace(0, knots[-1], 601))
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    tangents = np.gradient(places, lengths, axis=0)
    normals = np.column_stack([-tangents[:, 1], tangents[:, 0]])
    return ArchPath(lengths - lengths[-1] / 2, places, normals)


def _crown(width: float, height: float, depth: float) -> tuple[FloatArray, FloatArray]:
    """Points (n, 3) of a crown, x along the arch, y from the edge, z outwards, and their colours (n, 3)."""
    around = np.linspace(0, 2 * np.pi, N_AROUND, endpoint=False)
    corner = np.stack([np.cos(around), np.sin(around)], axis=1)
    corner = np.sign(corner) * np.abs(corner) ** BOX_EXPONENT
    breadth = np.interp(LEVELS, CROWN_LEVELS, BREADTHS) * width / 2
    edge = CUTTING_EDGE if depth < CUTTING_MM else GRINDING_EDGE
    thicknesses = [EDGE_ROUNDING * edge, edge, *(edge + step for step in EDGE_STEPS), *NECK_THICKNESSES]
    thick = np.interp(LEVELS, CROWN_LEVELS, thicknesses) * depth
    front = -np.interp(LEVELS, FRONT_LEVELS, FRONT_MM) - thick / 2
    rings = np.stack([
        breadth[:, None] * corner[:, 0],
        np.broadcast_to((LEVELS * (height + IN_GUM_MM))[:, None], (len(LEVELS), N_AROUND)),
        front[:, None] + thick[:, None] / 2 * corner[:, 1],
    ], axis=-1)  # fmt: skip
    cap = np.array([[0.0, -CAP_MM, front[0]]])
    share = np.concatenate([np.repeat(LEVELS, N_AROUND), [0.0]])[:, None]
    colours = TOOTH + (TOOTH_DARK - TOOTH) * np.clip((share - DARK_FROM) / (1 - DARK_FROM), 0, 1) ** DARK_EXPONENT
    beside = np.abs(corner[:, 0]) ** SIDE_EXPONENT
    sides = np.concatenate([np.tile(beside, len(LEVELS)), [0.0]])[:, None]
    return np.concatenate([rings.reshape(-1, 3), cap]), colours * (1 - sides * GAP_SHADE)


def _place_crown(points: FloatArray, path: ArchPath, along: float, arch: Arch) -> FloatArray:
    """Points of a crown in head coordinates, upright on the arch's curve."""
    place, normal = path.at(np.array(along))
    normal = normal / np.linalg.norm(normal)
    tangent = np.array([normal[1], -normal[0]])
    flat = place + points[:, :1] * tangent + points[:, 2:] * normal
    return np.column_stack([flat[:, 0], arch.edge_y + arch.up * points[:, 1], flat[:, 1]])


def _light_along(arch: Arch) -> FloatArray:
    """(61,) brightness of the rings of a gum."""
    ends = np.cumsum(arch.widths)
    along = np.linspace(-ends[-1], ends[-1], _GUM_GRID[0])
    light: FloatArray = np.interp(np.abs(along), ends - arch.widths / 2, SHADE)
    return light


def _gum(path: ArchPath, arch: Arch) -> FloatArray:
    """Points of a tube along the arch, scalloped about the necks of the teeth."""
    total = arch.widths.sum()
    along = np.linspace(-total, total, _GUM_GRID[0])
    bounds = np.concatenate([[0], np.cumsum(arch.widths)])
    tooth = np.clip(np.searchsorted(bounds, np.abs(along), side="right") - 1, 0, 5)
    within = (np.abs(along) - bounds[tooth]) / arch.widths[tooth]
    middles = (bounds[1:] + bounds[:-1]) / 2
    height = np.interp(np.abs(along), middles, arch.heights)
    depth = np.interp(np.abs(along), middles, arch.depths)
    line = height * (1 - DIP + DIP * np.abs(np.sin(np.pi * within)) ** DIP_EXPONENT)
    even = np.ones_like(line)
    plate = UPPER_PLATE_MM if arch.up > 0 else LOWER_PLATE_MM
    ring = [  # height, outwards
        (line, UNDER_CROWN_MM * even),
        (line + BULGE_MM[0], BULGE_MM[1] * even),
        (height + PLATE_UP_MM, plate * even),
        (height + ROOT_UP_MM, (plate - ROOT_IN_MM) * even),
        (height + INNER_TOP_MM[0], -depth + INNER_TOP_MM[1]),
        (height + INNER_BULGE_MM[0], -depth + INNER_BULGE_MM[1]),
        (line + INNER_EDGE_MM[0], -depth + INNER_EDGE_MM[1]),
        (line, -depth + INNER_FOOT_MM),
    ]
    place, normal = path.at(along)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    rows = []
    for up, out in ring:
        flat = place + out[:, None] * normal
        rows.append(np.column_stack([flat[:, 0], arch.edge_y + arch.up * up, flat[:, 1]]))
    return np.stack(rows, axis=1).reshape(-1, 3)


def _tube_triangles(n_rings: int, n_around: int, closed_start: bool) -> NDArray[np.int64]:
    """Triangles between consecutive closed rings; `closed_start` adds a cap whose vertex follows the last ring."""
    faces = [grid_triangles(n_rings, n_around, is_closed=True)]
    if closed_start:
        k = np.arange(n_around)
        faces.append(np.stack([np.full(n_around, n_rings * n_around), (k + 1) % n_around, k], 1))
    return np.concatenate(faces).astype(np.int64)


def _wind_outward(faces: NDArray[np.int64], up: float) -> NDArray[np.int64]:
    """Faces with outward winding; mirrored heights reverse it."""
    return faces if up < 0 else faces[:, ::-1]
