"""Hair of large sculpted locks over a shell, as one opaque part."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from corpus_tools.dense.grids import grid_triangles, wind_outward
from corpus_tools.shipped.drawn.character import CharacterColours, Curls, Hairstyle, Lock
from corpus_tools.shipped.drawn.fields import arc_length, profile, smooth_rows
from corpus_tools.shipped.drawn.tiles import hair_tiles, in_tile
from corpus_tools.shipped.head.parts import HeadPart, MaterialSpan
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from corpus_tools.shipped.head.subdivision import join_triangles, triangulate
from tts2face.models.lit_hair import swing_shapes
from tts2face.numeric.arrays import FloatArray, IntArray, smoothstep, unit_vectors

# The volume of the hair: an ellipsoid, and below its middle a drop; half sizes in mm.
MIDDLE = np.array([0.0, 30.0, -58.0])
ACROSS, UP, AHEAD, BEHIND, DOWN = 80.0, 92.0, 100.0, 96.0, 118.0
LOWEST_DEG = 60.0  # elevation of the lowest tips, below the middle
DEPTH = (AHEAD + BEHIND) / 2
DROP_BULGE, DROP_TAPER = 0.05, 0.10  # of its breadth: halfway down the drop, and towards the lowest tips
# No hair grows on the ears, an ellipsoid about |x|, y, z with half sizes in mm, nor below the nape.
EAR_MM, EAR_HALF_MM = (78, -8, -66), (24, 30, 16)
EAR_MARGIN, EAR_DEG = 1.02, 30  # sizes of the ear at which hair begins, and degrees of height for one more
NAPE_Y, BELOW_NAPE_DEG = -75, -6.0  # mm, and the height over the hairline there
# Skin that hair stays outside of: above the neck's bottom and without the inner mouth, mm.
NECK_Y = -120
MOUTH_TOP_Y, MOUTH_HALF_X, MOUTH_Z = -45, 25, (-5, 20)
N_NEAR_SKIN, NEAR_SKIN_MM = 6, 45  # vertices about a point of hair, and the distance from which there is no skin
# The shell: degrees over the hairline in which it rises to two thirds, mm in a degree and most degrees of its sinking.
SHELL_RISE_DEG, SHELL_SINK_MM, SHELL_SINK_DEG = 5.0, 0.8, 3.0
SMOOTH_RINGS = 1.2  # rings over which the middle line of a lock is smoothed
LENS_EXPONENT, BALL_SWELL, RIM_EXPONENT = 2.2, 0.5, 0.6  # of a lock's section, of a ball's, and of its shade
RIDGE_HEIGHT = 0.10  # of the thickness
LEAST_HALF_MM, LEAST_THICK_MM = 0.15, 0.1
# Shares of half width and thickness along a lock, from root to tip, and exponents by which they run out.
WIDTHS_FROM_ROOT, TIP_SWELL = ((0.2, 0.9), (0.5, 1)), 0.35
THICKNESSES = ((0, 0.45), (0.2, 0.9), (0.55, 1), (1, 0.9))
POINTED, BLUNTER, THICK_END = (2.0, 0.80), (1.0, -0.3), (2.4, 0.6)
TIP_EXPONENT = 1.6  # of the way along a lock, by which it takes the colour of the tip
FADED_SKIN = 0.62  # of the skin's brightness between cropped hair
# Curls: elevation of the crown in degrees; distance, depth and half size of bumps in widths of a curl; rise at edges.
CROWN_DEG = 89.0
BUMP_APART, BUMP_DEPTH, BUMP_HALF, EDGE_RISE = 0.8, 0.9, 0.55, 1.5
FULL_CURL_MM = 12  # distance from the middle line from which curls have their whole height
N_ALONG, N_TOP, N_UNDER = 36, 11, 4
CURLED = 56, 29, 19  # the same of locks with curls
CURL_MM = 9.0  # width of a curl
CURLS_A_COLUMN = 0.6  # at most; more would not be resolved
N_ROUND, N_DOWN = 180, 60  # rings and points of curls all over the head, from the crown
EDGE_FROM, EDGE_SINKS = 0.5, 5.0  # of the way down, from where curls come closer to the skin; mm below it at the edge
ABOVE_EAR = ((0, -90), (54, -90), (62, 10), (84, 6), (100, 2), (116, -16), (180, -24))  # edge of curls
EVEN_COLUMNS = 6.0  # rings over which it, and the skull below, are evened
SIDES_FROM_TOP_DEG = (25.0, 70.0)
CURL_SHADE = 0.55  # between curls
LOOSE_FROM = 1.7  # exponent by which tips are looser than roots
TIP_DENSITY = 1.35  # exponent by which rings are closer at the tip
SHADE_ALONG = ((0, 0.72), (0.15, 0.92), (0.45, 1.06), (0.8, 1.0), (1, 0.92))
RIM_SHADE, UNDER_SHADE, END_SHADE, SHELL_SHADE = 0.74, 0.80, 0.6, 0.95
TIP_SHARE, PAINTED_SHADE = 0.9, 0.25  # of the colours of the tips, and of the shade: the light brings the rest
BLACK, LIGHT = (0.078, 0.063, 0.055), (0.69, 0.647, 0.565)
BLACK_TO, LIGHT_FROM = 0.13, 0.5  # mean of hair that is black already, or light
MOST_TO_TIP = 1.25  # factor of the colour from the root to the tip
# Matt: a gloss of .20 made it lilac plastic in the cool rim lights.
MATERIAL = {"specular": 0.05, "shininess": 10.0, "wrap": 0.5}


def hair_piece(skin: HeadSkin, style: Hairstyle, palette: CharacterColours) -> HeadPart:
    """The hair of a character, with a tile of the texture for the shell and for each lock."""
    scalp = Scalp(skin, style)
    still = [scalp.shell(), *(() if style.curls is None else (curled_tube(style.curls, scalp),))]
    locks = [lock_tube(lock, scalp) for lock in style.locks]
    tubes = [*still, *locks]
    colours, uv = [], []
    shares = [np.zeros(len(tube.points)) for tube in still]
    for lock, tube in zip(style.locks, locks, strict=True):
        shares.append(lock.loose * (np.ones_like(tube.along) if lock.is_ball else tube.along**LOOSE_FROM))
    for number, (tube, tile) in enumerate(zip(tubes, hair_tiles(len(tubes)), strict=True)):
        colour = _colours(tube, palette)
        if style.fade and number == 0:
            own = np.array(palette.skin) * FADED_SKIN
            colour = own + (colour - own) * scalp.fade()[:, None]
        colours.append(colour)
        uv.append(in_tile(tile, *tube.places.T))
    points = [tube.points for tube in tubes]
    triangles = join_triangles([tube.triangles for tube in tubes], map(len, points))
    return HeadPart(
        np.concatenate(points),
        (MaterialSpan("hair", triangles, MATERIAL),),
        np.concatenate(colours),
        shapes=swing_shapes(np.concatenate(points), np.concatenate(shares), MIDDLE),
        uv=np.concatenate(uv),
        tangents=np.concatenate([tube.tangents for tube in tubes]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class OtherHair:
    """Hair in C other colours: those (C, N, 3) of its vertices, and its own colour and the others (1 + C, 3), sRGB."""

    vertices: NDArray[np.uint8]
    colours: NDArray[np.float32]


def other_palettes(palette: CharacterColours) -> tuple[CharacterColours, ...]:
    """Colours with black and with light hair, as far as a character's own is neither.

    Between its pictures in these, hair is drawn in any colour.
    """
    own = float(np.mean(palette.hair))
    others = [item for item, is_far in ((BLACK, own > BLACK_TO), (LIGHT, own < LIGHT_FROM)) if is_far]
    to_tip = np.clip(np.divide(palette.hair_tip, palette.hair), 1.0, MOST_TO_TIP)
    return tuple(replace(palette, hair=other, hair_tip=tuple((np.array(other) * to_tip).tolist())) for other in others)


def hair_cover(skin: HeadSkin, style: Hairstyle) -> FloatArray:
    """(N,) share of the skin that hair covers, painted in its colour."""
    return smoothstep(height_over_hairline(skin.vertices, style), -1.0, 2.0)


def on_volume(azimuth: float, elevation: float, lift: float) -> FloatArray:
    """Point (3,) over the volume of the hair at an azimuth and elevation in degrees."""
    turn = np.radians(azimuth)
    half = np.array([ACROSS, UP, AHEAD if np.cos(turn) > 0 else BEHIND])
    if elevation >= 0:
        up = np.radians(elevation)
        place = half * [np.cos(up) * np.sin(turn), np.sin(up), np.cos(up) * np.cos(turn)]
        normal = place / half**2
    else:
        down = -elevation / LOWEST_DEG
        bulge = 1 + DROP_BULGE * np.sin(down * np.pi) - DROP_TAPER * down**2
        place = np.array([half[0] * bulge * np.sin(turn), -DOWN * down, half[2] * bulge * np.cos(turn)])
        normal = place / half**2 * [1, 0, 1]
    return np.asarray(MIDDLE + place + lift * normal / np.linalg.norm(normal))


def height_over_hairline(points: FloatArray, style: Hairstyle) -> FloatArray:
    """(N,) height over the edge of the hair in about degrees, below 0 where none grows: also around the ears."""
    off = (points - MIDDLE) / [ACROSS, UP, DEPTH]
    azimuth = np.degrees(np.arctan2(points[:, 0], points[:, 2] - MIDDLE[2]))
    elevation = np.degrees(np.arctan2(off[:, 1], np.hypot(off[:, 0], off[:, 2])))
    mirrored = np.column_stack([np.abs(points[:, 0]), points[:, 1:]])
    off_ear = np.linalg.norm((mirrored - EAR_MM) / EAR_HALF_MM, axis=1)
    height: FloatArray = np.minimum(
        elevation - np.interp(azimuth, *np.array(style.hairline).T), (off_ear - EAR_MARGIN) * EAR_DEG
    )
    return np.where(points[:, 1] < NAPE_Y, BELOW_NAPE_DEG, height)


@dataclass(frozen=True, slots=True, eq=False)
class Tube:
    """A lock or the shell.

    Parameters
    ----------
    points, triangles : (N, 3), (F, 3)
    shade : (N,)
    along : (N,)
        From the root, 0, to the tip.
    places : (N, 2)
        Across and down within its tile of the texture.
    tangents : (N, 3)
        Unit vectors along the hair.
    """

    points: FloatArray
    triangles: IntArray
    shade: FloatArray
    along: FloatArray
    places: FloatArray
    tangents: FloatArray


class Scalp:
    """The skin that hair grows on and stays outside of."""

    def __init__(self, skin: HeadSkin, style: Hairstyle) -> None:
        self._skin, self._style = skin, style
        self._height = height_over_hairline(skin.vertices, style)
        self._normals = vertex_normals(skin.vertices, skin.quads, skin.base)
        x, y, z = skin.vertices.T
        in_mouth = (y < MOUTH_TOP_Y) & (np.abs(x) < MOUTH_HALF_X) & (z > MOUTH_Z[0]) & (z < MOUTH_Z[1])
        self._rows = np.flatnonzero((y > NECK_Y) & ~in_mouth)
        self._places = cKDTree(skin.vertices[self._rows])
        triangles = triangulate(skin.quads)
        self._used, packed = np.unique(triangles[self._height[triangles].max(axis=1) > -1], return_inverse=True)
        self._triangles = packed.reshape(-1, 3).astype(np.int64)

    def keep_outside(self, points: FloatArray, clearance: float) -> FloatArray:
        """Points (N, 3) at least `clearance` mm above the skin near them."""
        distance, near = (np.asarray(found) for found in self._places.query(points, N_NEAR_SKIN))
        places, normals = self._skin.vertices[self._rows[near]], self._normals[self._rows[near]]
        heights = np.einsum("pkd,pkd->pk", points[:, None] - places, normals)
        lowest, row = heights.argmin(axis=1), np.arange(len(points))
        lack = np.maximum(clearance - heights[row, lowest], 0) * (distance[:, 0] < NEAR_SKIN_MM)
        moved: FloatArray = points + lack[:, None] * normals[row, lowest]
        return moved

    def hairline(self, azimuth: FloatArray) -> FloatArray:
        """(N,) elevation of the edge of curls at azimuths (N,) all around, in degrees; it runs above the ears."""
        low = np.interp(azimuth, *np.array(self._style.hairline).T)
        low = np.maximum(low, np.interp(np.abs(azimuth), *np.array(ABOVE_EAR).T))
        even = gaussian_filter1d(low[:-1], EVEN_COLUMNS, mode="wrap")
        return np.append(even, even[0])

    def shell(self) -> Tube:
        """The cap under the locks; it sinks through the skin along a level line, so that its edge is smooth."""
        height, lift = self._height[self._used], self._style.shell_lift
        risen = lift * (1 - np.exp(-np.maximum(height, 0) / SHELL_RISE_DEG))
        up = np.where(height > 0, risen, SHELL_SINK_MM * np.maximum(height, -SHELL_SINK_DEG))
        points = self._skin.vertices[self._used] + up[:, None] * self._normals[self._used]
        off = points - MIDDLE
        from_top = np.arccos(unit_vectors(off)[:, 1]) / np.pi  # places as on a map about the crown
        flat = 0.5 + 0.5 * (from_top / from_top.max())[:, None] * unit_vectors(off[:, [0, 2]] + 1e-9)
        down = np.cross(np.cross(off, [0.0, -1.0, 0.0]), off)
        n = len(points)
        shade, tangents = np.full(n, SHELL_SHADE), unit_vectors(down + 1e-9)
        return Tube(points, self._triangles, shade, np.zeros(n), flat, tangents)

    def fade(self) -> FloatArray:
        """(N,) share of its own colour that cropped hair has at the points of the shell."""
        return smoothstep(self._height[self._used], -1.0, self._style.fade)


def lock_tube(lock: Lock, scalp: Scalp) -> Tube:
    """The surface of a lock: rings with a lens-shaped top and a hollow underside, and a cap at either end."""
    known = np.array([on_volume(*place) for place in lock.path])
    n_along, n_top, n_under = CURLED if lock.curls else (N_ALONG, N_TOP, N_UNDER)
    length = arc_length(known)
    at = 1 - (1 - np.linspace(0, 1, n_along)) ** TIP_DENSITY
    middle = smooth_rows(scalp.keep_outside(CubicSpline(length / length[-1], known)(at), lock.clearance), SMOOTH_RINGS)
    along = unit_vectors(np.gradient(middle, axis=0))
    axis = np.column_stack([np.zeros(n_along), np.clip(middle[:, 1], -200, MIDDLE[1]), np.full(n_along, MIDDLE[2])])
    out = unit_vectors((middle - axis) / np.array([ACROSS, UP, DEPTH]) ** 2)
    out = unit_vectors(out - (out * along).sum(axis=1)[:, None] * along)
    side = np.cross(along, out)
    half, thick = _sizes(lock, at)
    place = np.sin(np.linspace(-1, 1, n_top) * np.pi / 2)
    swell = BALL_SWELL if lock.is_ball else 1.0
    lens = (1 - np.abs(place) ** LENS_EXPONENT) ** swell
    ridge = 1 + RIDGE_HEIGHT * np.cos(np.pi * (lock.ridges + 0.5) * place) * lens
    under = np.linspace(1, -1, n_under + 2)[1:-1]
    across = half[:, None] * np.concatenate([place, under])
    up = thick[:, None] * np.concatenate([lens * ridge, -lock.hollow * (1 - under**2) ** swell])
    rings = middle[:, None] + across[..., None] * side[:, None] + up[..., None] * out[:, None]
    shade = np.concatenate([RIM_SHADE + (1 - RIM_SHADE) * lens**RIM_EXPONENT, np.full(n_under, UNDER_SHADE)])
    closed = np.append(np.arange(n_top + n_under), 0)  # the texture is cut open along the first column
    if lock.curls:
        rings = _curled(rings, middle, lock.curls)
    rings, shade = rings[:, closed], shade[closed]
    points, triangles = _capped(rings)
    far = arc_length(rings.mean(axis=1))
    around = np.linspace(0, 1, len(closed))
    grid = np.stack(np.meshgrid(around, far / far[-1]), axis=-1).reshape(-1, 2)
    tangents = unit_vectors(np.gradient(rings, axis=0) + 1e-9)
    return Tube(
        points,
        wind_outward(points, triangles),
        np.concatenate([(profile(SHADE_ALONG, at)[:, None] * shade).ravel(), [END_SHADE, END_SHADE]]),
        np.concatenate([np.repeat(at, len(closed)), [0.0, 1.0]]),
        np.concatenate([grid, [[0.4, 0.0], [0.4, 1.0]]]),
        np.concatenate([tangents.reshape(-1, 3), along[[0, -1]]]),
    )


def curled_tube(curls: Curls, scalp: "Scalp") -> Tube:
    """Curls all over the head: a dome from the crown to the edge of the hair, with a round bump for each curl."""
    turn = np.linspace(-180, 180, N_ROUND + 1)
    down = np.linspace(0, 1, N_DOWN)
    elevation = CROWN_DEG + (scalp.hairline(turn) - CROWN_DEG) * down[:, None]
    volume = np.array([[on_volume(a, e, 0.0) for a, e in zip(turn, row, strict=True)] for row in elevation])
    out = unit_vectors(volume - MIDDLE)
    raised = ((scalp.keep_outside(volume.reshape(-1, 3), 0.0).reshape(out.shape) - volume) * out).sum(axis=2)
    raised = gaussian_filter1d(raised[:, :-1], EVEN_COLUMNS, axis=1, mode="wrap")  # not by each ear
    edge = np.sqrt(1 - (np.maximum(down - EDGE_FROM, 0) / (1 - EDGE_FROM)) ** 2)[:, None]
    sides = 1 - (1 - curls.sides) * smoothstep(90.0 - elevation, *SIDES_FROM_TOP_DEG)
    lift = curls.lift * edge * sides - EDGE_SINKS * (1 - edge)
    dome = volume + (raised[:, [*range(N_ROUND), 0]] + lift)[..., None] * out
    points, triangles = dome.reshape(-1, 3), grid_triangles(N_DOWN, N_ROUND + 1)
    triangles = wind_outward(points, triangles)
    near, _ = cKDTree(_spread(points, BUMP_APART * curls.width)).query(points)
    bump = np.sqrt(np.clip(1 - BUMP_DEPTH * (np.asarray(near) / (BUMP_HALF * curls.width)) ** 2, 0, 1))
    rise = (curls.height * (bump - 0.5)).reshape(lift.shape) * np.minimum(EDGE_RISE * edge, 1)
    dome = dome + rise[..., None] * out
    around = np.tile((turn + 180) / 360, N_DOWN)
    return Tube(
        dome.reshape(-1, 3),
        triangles,
        CURL_SHADE + (1 - CURL_SHADE) * bump,
        np.full(len(points), 0.5),
        np.column_stack([around, np.repeat(down, N_ROUND + 1)]),
        unit_vectors(np.gradient(dome, axis=0) + 1e-9).reshape(-1, 3),
    )


def _spread(points: FloatArray, apart: float) -> FloatArray:
    """Some of points (N, 3) that are at least so far from each other, in random order (seeded)."""
    order = np.random.default_rng(0).permutation(len(points))
    tree, is_free, kept = cKDTree(points), np.ones(len(points), bool), []
    for at in order:
        if is_free[at]:
            kept.append(at)
            is_free[tree.query_ball_point(points[at], apart)] = False
    return points[kept]


def _curled(rings: FloatArray, middle: FloatArray, height: float) -> FloatArray:
    """Rings (n, k, 3) around a middle line (n, 3) with round curls, each in the gap between those of the row before."""
    off = rings - middle[:, None]
    far = np.linalg.norm(off, axis=2, keepdims=True)
    sides = np.linalg.norm(np.diff(rings, axis=1, append=rings[:, :1]), axis=2)
    longest = float(sides.sum(axis=1).max())
    curl = max(CURL_MM, longest / (CURLS_A_COLUMN * rings.shape[1]))
    n_around = 2 * max(2, round(longest / curl / 2))
    across = np.cumsum(sides, axis=1) / np.maximum(sides.sum(axis=1, keepdims=True), 1e-9)
    outline = arc_length(np.column_stack([arc_length(middle), far.mean(axis=1)[:, 0], np.zeros(len(middle))]))
    rows = np.pi * outline / curl
    bumps = np.cos(np.pi * n_around * across) * np.cos(rows)[:, None]
    return np.asarray(
        rings + height * bumps[..., None] * off / np.maximum(far, 1e-6) * np.minimum(far / FULL_CURL_MM, 1)
    )


def _sizes(lock: Lock, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Half width and thickness (n,) of a lock along it, mm; both run out at the tip."""
    if lock.is_ball:
        ball = np.sqrt(np.clip(1 - (2 * at - 1) ** 2, 0, 1))
        return np.maximum(lock.half_width * ball, LEAST_HALF_MM), np.maximum(lock.thickness * ball, LEAST_THICK_MM)
    end = np.clip((at - 0.5) / 0.5, 0, 1)
    blunt = lock.bluntness
    widths = profile(((0, lock.root), *WIDTHS_FROM_ROOT, (1, 1 + TIP_SWELL * (lock.tip - 1))), at)
    runs_out, power = (pointed + more * blunt for pointed, more in zip(POINTED, BLUNTER, strict=True))
    half = lock.half_width * widths * (1 - end**runs_out) ** power
    thick = lock.thickness * profile(THICKNESSES, at) * (1 - end ** THICK_END[0]) ** THICK_END[1]
    return np.maximum(half, LEAST_HALF_MM), np.maximum(thick, LEAST_THICK_MM)


def _capped(rings: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points and triangles of a tube of rings (n, k, 3), whose last column is the first, with a fan at either end."""
    n, k = rings.shape[:2]
    column = np.arange(k - 1)
    fans = []
    for number, first in enumerate((0, (n - 1) * k)):
        fan = np.stack([np.full(k - 1, n * k + number), first + column + 1, first + column], axis=1)
        fans.append(fan if number == 0 else fan[:, ::-1])
    points = np.concatenate([rings.reshape(-1, 3), rings[[0, -1], 1:].mean(axis=1)])
    return points, np.concatenate([grid_triangles(n, k), *fans])


def _colours(tube: Tube, palette: CharacterColours) -> FloatArray:
    """(N, 3) colours of a lock: lighter tips, slightly darker rims; highlights are left to the light."""
    own, tip = np.array(palette.hair), np.array(palette.hair_tip)
    shade = 1 - PAINTED_SHADE * (1 - tube.shade[:, None])
    mixed: FloatArray = (own + TIP_SHARE * (tip - own) * tube.along[:, None] ** TIP_EXPONENT) * shade
    return mixed
