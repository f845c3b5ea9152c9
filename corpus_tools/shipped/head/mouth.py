"""Teeth: two arches of crowns and gums along the curves of MakeHuman's teeth.

Light inside the mouth: wet flesh scatters the light that enters between the lips.

The tongue: MakeHuman's, with a narrow tip behind the lower incisors, and shapes that lift or put out the tip.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.mesh import (
    SCALE,
    Cage,
    HeadPart,
    MaterialSpan,
    catmull_clark,
    grid_triangles,
    triangulate,
)
from corpus_tools.shipped.head.shapes import Jaw
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.models.face import Face
from tts2face.numeric.arrays import smoothstep
from tts2face.picture.occlusion import sphere_directions

Floats = NDArray[np.float64]


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

    curve: Floats
    edge_y: float
    up: float
    widths: Floats
    heights: Floats
    depths: Floats


# Sizes after Wheeler, Dental Anatomy. The incisors touch the inner side of the lips, 2.5 mm (upper) and 6 mm (lower)
# behind the line between them, the canines and premolars that of the cheeks; the molars are those of MakeHuman's strip.
UPPER_CURVE = np.array(
    [(0, 26.6), (8.6, 25.2), (16.2, 20.4), (21.6, 13.4), (24.9, 5.0), (27.0, -5.0), (28.6, -16.0)]
)  # fmt: skip
LOWER_CURVE = np.array(
    [(0, 23.2), (7.6, 21.9), (14.7, 17.3), (19.9, 10.6), (23.3, 2.5), (26.3, -7.0), (28.1, -18.0)]
)  # fmt: skip
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
SHADE = np.array([1.0, 0.98, 0.88, 0.72, 0.54, 0.38])  # brightness of the crowns; cheeks shade the back ones
TOOTH, TOOTH_DARK = np.array([0.86, 0.83, 0.77]), np.array([0.79, 0.72, 0.62])
GAP_SHADE = np.array([0.50, 0.44, 0.38])  # share of the light that the sides of a crown lack: its neighbours shade it
GUM = np.array([0.68, 0.36, 0.36])
BACK_Z, FRONT_Z, MOST_SHIFT_MM = -16.0, 14.0, 5.0  # molars stay; front teeth follow the lips
COVER_MM = {"upper": 2.2, "lower": 3.8}  # of skin in front of teeth and gums at rest; a smile draws the lower lip back
UPPER_PLATE_MM, LOWER_PLATE_MM = (
    0.5,
    -2.2,
)  # of the gums near the roots, outwards: the chin's fold lies before the lower
N_AROUND, LEVELS = 12, np.array([0.0, 0.04, 0.13, 0.45, 1.0])
MATERIALS = {
    "teeth": {"specular": 0.5, "shininess": 60.0, "wrap": 0.3},
    "gums": {"specular": 0.4, "shininess": 40.0, "wrap": 0.3},
}


def arch_piece(arch: Arch, name: str) -> HeadPart:
    """Crowns and gum of an arch; its two spans are ``teeth_<name>`` and ``gums_<name>``."""
    path = arch_path(arch.curve)
    points, colours, triangles, count = [], [], [], 0
    for side in (1.0, -1.0):
        along = 0.0
        for width, height, depth, light in zip(arch.widths, arch.heights, arch.depths, SHADE, strict=True):
            crown, enamel = _crown(width, height, depth)
            points.append(_place_crown(crown, path, side * (along + width / 2), arch))
            colours.append(light * enamel)
            triangles.append(_tube_triangles(len(LEVELS), N_AROUND, closed_start=True) + count)
            count += len(crown)
            along += width
    vertices, faces = np.concatenate(points), np.concatenate(triangles)
    gum = gum_piece(path, arch, GUM)
    spans = (
        MaterialSpan(f"teeth_{name}", _wind_outward(faces, arch.up), MATERIALS["teeth"]),
        MaterialSpan(f"gums_{name}", gum.spans[0].triangles + count, MATERIALS["gums"]),
    )
    return HeadPart(np.concatenate([vertices, gum.vertices]), spans, np.concatenate([*colours, gum.colours]))


def gum_piece(path: "ArchPath", arch: Arch, colour: Floats) -> HeadPart:
    """The gum of an arch, darker towards its ends."""
    vertices = _gum(path, arch)
    faces = _wind_outward(_tube_triangles(*_GUM_GRID, closed_start=False), arch.up)
    colours = np.repeat(_light_along(arch), _GUM_GRID[1])[:, None] * colour
    return HeadPart(vertices, (MaterialSpan("gums", faces, MATERIALS["gums"]),), colours)


def fit_teeth(points: Floats, before: Floats, after: Floats) -> Floats:
    """Points scaled and shifted per axis as the strip of teeth `before` (N, 3) is to `after` (N, 3)."""
    scale = after.std(axis=0) / before.std(axis=0)
    moved: Floats = after.mean(axis=0) + scale * (points - before.mean(axis=0))
    return moved


def follow_lips(points: Floats, default: Floats, ahead: float) -> Floats:
    """Points (N, 3) whose front teeth follow lips that lie `ahead` mm further forward than the default person's.

    `default` holds the same points on the default person.
    """
    own = float(points[:, 2].max() - default[:, 2].max())
    share = smoothstep(default[:, 2], BACK_Z, FRONT_Z)
    moved = points.copy()
    moved[:, 2] += share * np.clip(ahead - own, -MOST_SHIFT_MM, MOST_SHIFT_MM)
    return moved


def keep_behind(points: Floats, skin: Floats, cover: float) -> Floats:
    """Points (N, 3) at least `cover` mm behind the foremost of the skin's vertices (S, 3) nearby, in front view."""
    from scipy.spatial import cKDTree

    near = cKDTree(skin[:, :2]).query(points[:, :2], 8)[1]
    moved = points.copy()
    moved[:, 2] = np.minimum(points[:, 2], skin[near, 2].max(axis=1) - cover)
    return moved


@dataclass(frozen=True, slots=True, eq=False)
class ArchPath:
    """The curve by arc length from the middle, left positive: (n,) lengths, (n, 2) x and z, (n, 2) outward normals."""

    lengths: Floats
    places: Floats
    normals: Floats

    def at(self, along: Floats) -> tuple[Floats, Floats]:
        """Positions and normals (..., 2) at arc lengths."""
        both = [np.stack([np.interp(along, self.lengths, line[:, k]) for k in (0, 1)], axis=-1)
                for line in (self.places, self.normals)]  # fmt: skip
        return both[0], both[1]


def arch_path(curve: Floats) -> ArchPath:
    """The curve of an arch, mirrored, from its points (K, 2) on the left."""
    from scipy.interpolate import CubicSpline

    mirrored = np.concatenate([curve[:0:-1] * [-1, 1], curve])
    knots = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(mirrored, axis=0), axis=1))])
    places = CubicSpline(knots, mirrored)(np.linspace(0, knots[-1], 601))
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    tangents = np.gradient(places, lengths, axis=0)
    normals = np.column_stack([-tangents[:, 1], tangents[:, 0]])
    return ArchPath(lengths - lengths[-1] / 2, places, normals)


def _crown(width: float, height: float, depth: float) -> tuple[Floats, Floats]:
    """Points (n, 3) of a crown, x along the arch, y from the edge, z outwards, and their colours (n, 3)."""
    around = np.linspace(0, 2 * np.pi, N_AROUND, endpoint=False)
    corner = np.stack([np.cos(around), np.sin(around)], axis=1)
    corner = np.sign(corner) * np.abs(corner) ** 0.7  # between an ellipse and a box
    is_cutting = depth < 6.5
    breadth = np.interp(LEVELS, [0, 0.03, 0.10, 0.25, 0.6, 1], [0.70, 0.86, 0.955, 0.985, 0.95, 0.80]) * width / 2
    edge = 0.28 if is_cutting else 0.62
    thick = (
        np.interp(LEVELS, [0, 0.03, 0.10, 0.25, 0.6, 1], [0.6 * edge, edge, edge + 0.1, edge + 0.2, 0.86, 1.0]) * depth
    )
    front = -np.interp(LEVELS, [0, 0.1, 0.35, 1], [0.9, 0.35, 0.0, 0.5]) - thick / 2
    rings = np.stack([
        breadth[:, None] * corner[:, 0],
        np.broadcast_to((LEVELS * (height + 1.5))[:, None], (len(LEVELS), N_AROUND)),
        front[:, None] + thick[:, None] / 2 * corner[:, 1],
    ], axis=-1)  # fmt: skip
    cap = np.array([[0.0, -0.05, front[0]]])
    share = np.concatenate([np.repeat(LEVELS, N_AROUND), [0.0]])[:, None]
    colours = TOOTH + (TOOTH_DARK - TOOTH) * np.clip((share - 0.35) / 0.65, 0, 1) ** 1.5
    beside = np.abs(corner[:, 0]) ** 6
    sides = np.concatenate([np.tile(beside, len(LEVELS)), [0.0]])[:, None]
    return np.concatenate([rings.reshape(-1, 3), cap]), colours * (1 - sides * GAP_SHADE)


def _place_crown(points: Floats, path: ArchPath, along: float, arch: Arch) -> Floats:
    """Points of a crown in head coordinates, upright on the arch's curve."""
    place, normal = path.at(np.array(along))
    normal = normal / np.linalg.norm(normal)
    tangent = np.array([normal[1], -normal[0]])
    flat = place + points[:, :1] * tangent + points[:, 2:] * normal
    return np.column_stack([flat[:, 0], arch.edge_y + arch.up * points[:, 1], flat[:, 1]])


_GUM_GRID = (61, 8)


def _light_along(arch: Arch) -> Floats:
    """(61,) brightness of the rings of a gum."""
    ends = np.cumsum(arch.widths)
    along = np.linspace(-ends[-1], ends[-1], _GUM_GRID[0])
    light: Floats = np.interp(np.abs(along), ends - arch.widths / 2, SHADE)
    return light


def _gum(path: ArchPath, arch: Arch) -> Floats:
    """Points of a tube along the arch, scalloped about the necks of the teeth."""
    total = arch.widths.sum()
    along = np.linspace(-total, total, _GUM_GRID[0])
    bounds = np.concatenate([[0], np.cumsum(arch.widths)])
    tooth = np.clip(np.searchsorted(bounds, np.abs(along), side="right") - 1, 0, 5)
    within = (np.abs(along) - bounds[tooth]) / arch.widths[tooth]
    middles = (bounds[1:] + bounds[:-1]) / 2
    height = np.interp(np.abs(along), middles, arch.heights)
    depth = np.interp(np.abs(along), middles, arch.depths)
    line = height * (0.80 + 0.20 * np.abs(np.sin(np.pi * within)) ** 0.8)
    one = np.ones_like(line)
    plate = UPPER_PLATE_MM if arch.up > 0 else LOWER_PLATE_MM
    ring = [  # height, outwards
        (line, -0.5 * one), (line + 0.8, 0.45 * one), (height + 3.0, plate * one), (height + 6.5, (plate - 2.3) * one),
        (height + 7.0, -depth - 1), (height + 3.0, -depth - 2.5), (line + 0.8, -depth - 1.0), (line, -depth + 0.3),
    ]  # fmt: skip
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


MOUTH_PARTS = ("teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue")
AHEAD_Z = 0.2  # directions from which light enters the mouth, by their z
LIT_SHARE, TONGUE_LIT_SHARE = 0.45, 0.7  # of these directions, open to each vertex in addition to those seen from it
MOUTH_U, MOUTH_V = (0.75, 0.93), 0.14  # MakeHuman's island of the mouth's cavity
SEED = 5


def scatter_in_mouth(face: Face, skin: HeadSkin) -> Face:
    """A face whose mouth is lit from inside: as with open lips at rest, where it is hidden, and by scattered light.

    `skin` is that of the reference head, whose vertices correspond to the face's first ones.
    """
    if face.occlusion is None:
        return face
    bits = np.unpackbits(face.occlusion, axis=2)
    inside = mouth_vertices(face, skin)
    bits[0, inside] = bits[-1, inside]
    ahead = np.flatnonzero(sphere_directions(bits.shape[2])[:, 2] > AHEAD_Z)
    lit_share = np.where(np.isin(inside, part_vertices(face, ("tongue",))), TONGUE_LIT_SHARE, LIT_SHARE)
    is_lit = np.random.default_rng(SEED).random((len(inside), len(ahead))) < lit_share[:, None]
    for pose in bits:
        pose[np.ix_(inside, ahead)] &= ~is_lit
    return replace(face, occlusion=np.packbits(bits, axis=2))


def mouth_vertices(face: Face, skin: HeadSkin) -> NDArray[np.int64]:
    """Vertices of teeth, gums, tongue and the cavity."""
    u, v = skin.source_uv.T
    cavity = np.flatnonzero((u > MOUTH_U[0]) & (u < MOUTH_U[1]) & (v < MOUTH_V))
    return np.union1d(cavity, part_vertices(face, MOUTH_PARTS))


def part_vertices(face: Face, names: tuple[str, ...]) -> NDArray[np.int64]:
    """Vertices of the parts with these names."""
    triangles = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.name in names]
    return np.unique(np.concatenate(triangles)).astype(np.int64)


TONGUE_UP = "tongueUp"
FREE_MM = 34.0  # length of the part that narrows towards the tip
NARROWER, THINNER = 0.42, 0.50  # shares taken from width and thickness at the tip
FORWARD_MM, RAISED_MM = 4.0, 0.8  # displacement of the tip: it rests behind the edges of the lower incisors
FLATTENING = 0.72  # of the body, whose back otherwise hides the upper teeth
GROOVE_MM, GROOVE_WIDTH_MM = 0.8, 2.4
OUT_RISE_MM = 2.2  # the tip that is put out passes over the lower incisors
UP_MM, UP_FREE_MM = 12.2, 15.0  # rise of the tip's upper side, to the ridge with a jawOpen of 0.25, and its length
COLOUR, ROOT_COLOUR, TIP_COLOUR = (
    np.array([0.70, 0.34, 0.34]),
    np.array([0.56, 0.22, 0.22]),
    np.array([0.74, 0.39, 0.38]),
)
UNDERSIDE_LAG = 0.75  # of the rise that the lowest vertices lack: the underside of a raised tip faces forward
UNDERSIDE_COLOUR = np.array([0.92, 0.52, 0.50])  # seen in the shade, when the tip is up
MATERIAL = {"specular": 0.35, "shininess": 30.0, "wrap": 0.3}


def tongue_piece(cage: Cage, jaw: Jaw) -> HeadPart:
    """The tongue with the shapes ``jaw...``, ``tongueOut`` and ``tongueUp``."""
    used, quads = np.unique(cage.source.groups["helper-tongue"].corners, return_inverse=True)
    matrix, fine = catmull_clark(len(used), quads.reshape(-1, 4))
    source = matrix @ cage.vertices[used]
    points, tip = shape_tip(source)
    out = matrix @ cage.units["tongueOut"][used]
    out[:, 1] += OUT_RISE_MM * tip
    near = smoothstep(points[:, 2], points[:, 2].max() - UP_FREE_MM, points[:, 2].max())
    height = _height_in_tongue(points)
    up = np.outer(near * (1 - UNDERSIDE_LAG * (1 - height) / 2), [0.0, UP_MM, 2.0])
    depth = np.clip((points[:, 2].max() - points[:, 2]) / 45.0, 0, 1)[:, None]
    colour = COLOUR + (ROOT_COLOUR - COLOUR) * depth
    colour += (tip**2)[:, None] * (TIP_COLOUR - colour)
    below = smoothstep(-height, 0.0, 1.0) * tip
    colour += below[:, None] * (UNDERSIDE_COLOUR - colour)
    groove = np.exp(-((points[:, 0] / GROOVE_WIDTH_MM) ** 2)) * (tip < 0.9)
    return HeadPart(
        points,
        (MaterialSpan("tongue", triangulate(fine), MATERIAL),),
        colour * (1 - 0.12 * groove[:, None]),
        {**jaw.shapes(points), "tongueOut": out, TONGUE_UP: up},
    )


def _height_in_tongue(points: Floats) -> Floats:
    """(N,) height of vertices above the middle of the tongue's cross-section, -1 lowest to 1 highest."""
    bins = np.linspace(points[:, 2].min(), points[:, 2].max(), 40)
    near = [points[np.abs(points[:, 2] - z) < 3.0, 1] for z in bins]
    low, high = (np.interp(points[:, 2], bins, [pick(line) for line in near]) for pick in (np.min, np.max))
    height: Floats = (2 * points[:, 1] - low - high) / np.maximum(high - low, 1e-9)
    return height


def shape_tip(source: Floats) -> tuple[Floats, Floats]:
    """Vertices (N, 3) with a tip, and the share (N,) of the tip, 0 at the body to 1 at its end."""
    points = source.copy()
    middle = float(np.median(points[:, 1]))
    points[:, 1] = middle + FLATTENING * (points[:, 1] - middle)
    front = float(points[:, 2].max())
    tip = np.clip(1 - (front - points[:, 2]) / FREE_MM, 0, 1)
    bins = np.linspace(front - FREE_MM, front, 18)
    axis = [points[np.abs(points[:, 2] - z) < 3.0, 1] for z in bins]
    centre = np.interp(points[:, 2], bins, [(line.min() + line.max()) / 2 for line in axis])
    is_top = points[:, 1] > centre
    points[:, 0] *= 1 - NARROWER * tip**2.2
    points[:, 1] = centre + (points[:, 1] - centre) * (1 - THINNER * tip**1.6) + RAISED_MM * tip
    dent = GROOVE_MM * np.exp(-((points[:, 0] / GROOVE_WIDTH_MM) ** 2)) * 4 * tip * (1 - tip)
    points[:, 1] -= np.where(is_top, dent, 0.0)
    points[:, 2] += FORWARD_MM * tip**1.5
    return points, tip
