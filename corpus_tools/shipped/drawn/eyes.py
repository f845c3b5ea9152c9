"""Lids over larger eyeballs: blinks that shut, and a lining that stays inside.

Upper lashes of a drawn character: one tapered band along each lid, which ends in a wing and turns with the lid.

Brows of a drawn character: solid ribbons that move as one body.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from corpus_tools.shipped.drawn.character import Brow, Colour, Profile
from corpus_tools.shipped.drawn.fields import Front, arc_length, profile, smooth_line, smooth_rows
from corpus_tools.shipped.head.correspondence import nearest_surface_points
from corpus_tools.shipped.head.mesh import Eyeball, HeadPart, MaterialSpan, grid_triangles, triangulate
from corpus_tools.shipped.head.shapes import LidEdge, neighbour_means
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from tts2face.numeric.arrays import smoothstep, unit_vectors

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

WAY_LIMITS, N_WAY_COLUMNS = (0.7, 1.9), 60  # factors of the upper lid's way, and columns in which they are found
OVERLAP_MM = 0.1  # of the lids' edges when they are shut
LID_MM = (1.0, 2.4)  # least and greatest distance of a shut lid from the eyeball
N_RELAXATIONS = 4
ARC, LOWER_LID_MM = 0.62, 8.0  # sag of a shut eye, a share of the lower lid's, and reach of the motion below it
UNDER_MM, UNDER_REACH_MM = 0.3, 3.5  # distance from the eyeball of the lower lid's edge when shut, and how far below
LINING_REACH_MM, LINING_Z = 5.0, -5.0  # from the eyeball, and the least depth before its centre
REST_GAP_MM = 0.5  # between the skin at rest and the eyeballs
LINING_MM, LINING_DEEP_MM = 0.2, 14.0  # distance of the tucked lining from the eyeball, and how far off it is tucked
BROWS = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight", "browDownLeft", "browDownRight")


def facing(skin: HeadSkin, ball: Eyeball) -> tuple[Floats, Floats, Floats]:
    """Offset (N, 3) of the skin from an eyeball's centre, its length (N,), and its cosine (N,) with the normal."""
    off = skin.vertices - ball.centre
    distance = np.linalg.norm(off, axis=1)
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    return off, distance, np.einsum("nc,nc->n", off / distance[:, None], normals)


def find_lining(skin: HeadSkin, balls: Sequence[Eyeball], most: float) -> Bools:
    """(N,) inner side of the lids: near an eyeball, with a cosine of its normal below `most`."""
    lining = np.zeros(len(skin.vertices), bool)
    for ball in balls:
        off, distance, cosine = facing(skin, ball)
        lining |= (cosine < most) & (distance < ball.radius + LINING_REACH_MM) & (off[:, 2] > LINING_Z)
    return lining


def shut_lids(skin: HeadSkin, balls: Sequence[Eyeball], lids: Sequence[LidEdge]) -> HeadSkin:
    """Blinks that shut: larger openings stay open with MakeHuman's.

    The way of the upper lid is scaled column by column until its edge meets the lower one; it is then laid on the
    eyeball and relaxed to one surface, as a folded lid would keep its dents.
    """
    means, shapes = neighbour_means(skin), dict(skin.shapes)
    for ball, edge, side in zip(balls, lids, ("Left", "Right"), strict=True):
        name = f"eyeBlink{side}"
        moved = _raise_lower_lid(skin, shapes[name], ball, edge)
        factor = _way_factors(skin.vertices, moved, edge)
        moved = np.where((moved[:, 1] < -0.2)[:, None], moved * factor[:, None], moved)
        shapes[name] = _lay_on_ball(skin, moved, ball, edge, means)
    return replace(skin, shapes=shapes)


def _raise_lower_lid(skin: HeadSkin, moved: Floats, ball: Eyeball, edge: LidEdge) -> Floats:
    """A blink (N, 3) whose lower lid comes up to an arc: a deep one would draw a shut eye with a hook at its corner."""
    low = (skin.vertices + moved)[edge.lower]
    ends = low[[low[:, 0].argmin(), low[:, 0].argmax()]]
    along = (low[:, 0] - ends[0, 0]) / (ends[1, 0] - ends[0, 0])
    chord = ends[0, 1] + along * (ends[1, 1] - ends[0, 1])
    deep = float((chord - low[:, 1]).max())
    lift = np.maximum(chord - ARC * deep * (1 - (2 * along - 1) ** 2) - low[:, 1], 0)
    distance, nearest = cKDTree(skin.vertices[edge.lower]).query(skin.vertices)
    way = lift[nearest] * np.exp(-((distance / LOWER_LID_MM) ** 2))
    off = skin.vertices + moved - ball.centre
    raised = off + way[:, None] * [0, 1, 0]
    length = np.linalg.norm(off, axis=1)  # it slides on the eyeball, and its edge behind that of the upper lid
    under = np.exp(-((distance / UNDER_REACH_MM) ** 2))
    length += under * np.minimum(ball.radius + UNDER_MM - length, 0)
    held = raised * (length / np.linalg.norm(raised, axis=1))[:, None]
    is_own = np.sign(skin.vertices[:, 0]) == np.sign(ball.centre[0])
    return np.asarray(moved + np.where((is_own & (distance < 3 * LOWER_LID_MM))[:, None], held - off, 0))


def _way_factors(vertices: Floats, moved: Floats, edge: LidEdge) -> Floats:
    """(N,) factors of a blink by which the upper edge reaches the lower one at each x."""
    low = vertices[edge.lower] + moved[edge.lower]
    order = np.argsort(low[:, 0])
    upper, way = vertices[edge.upper], moved[edge.upper, 1]
    wanted = np.interp(upper[:, 0] + moved[edge.upper, 0], low[order, 0], low[order, 1]) - OVERLAP_MM - upper[:, 1]
    across = np.argsort(upper[:, 0])
    moves = (way < -1.5)[across]
    columns = np.linspace(upper[:, 0].min(), upper[:, 0].max(), N_WAY_COLUMNS)
    ratio = (wanted / np.minimum(way, -1.5))[across][moves]
    smooth = gaussian_filter1d(
        np.clip(np.interp(columns, upper[across][moves, 0], ratio), *WAY_LIMITS), 4, mode="nearest"
    )
    return np.interp(vertices[:, 0], columns, smooth)


def _lay_on_ball(skin: HeadSkin, moved: Floats, ball: Eyeball, edge: LidEdge, means: sparse.csr_array) -> Floats:
    """A blink (N, 3) whose shut lid lies on the eyeball."""
    _, distance, cosine = facing(skin, ball)
    off = skin.vertices + moved - ball.centre
    is_own = np.sign(skin.vertices[:, 0]) == np.sign(ball.centre[0])
    is_outer = (cosine > -0.1) | (distance > ball.radius + LINING_REACH_MM)  # a heavy lid faces down
    share = smoothstep(np.linalg.norm(moved, axis=1), 1.0, 7.0) * is_outer * (moved[:, 1] < 0) * is_own
    wanted = ball.radius + np.clip(distance - ball.radius, *LID_MM)
    moved = moved + (share * (wanted / np.linalg.norm(off, axis=1) - 1))[:, None] * off
    free = share * is_outer
    free[edge.upper] = 0.0
    for _ in range(N_RELAXATIONS):
        shut = skin.vertices + moved
        moved = moved + 0.6 * free[:, None] * (means @ shut - shut)
    return moved


def tuck_lining(skin: HeadSkin, balls: Sequence[Eyeball], lining: Bools) -> HeadSkin:
    """Blinks whose lids' inner side lies on the eyeball: in front of the outer side it would be a dark patch."""
    shapes = dict(skin.shapes)
    for ball, side in zip(balls, ("Left", "Right"), strict=True):
        name = f"eyeBlink{side}"
        shut = skin.vertices + shapes[name]
        off = shut - ball.centre
        distance = np.linalg.norm(off, axis=1)
        deep = lining & (distance > ball.radius + LINING_MM) & (distance < ball.radius + LINING_DEEP_MM)
        deep &= np.sign(shut[:, 0]) == np.sign(ball.centre[0])
        inward = np.where(deep, (ball.radius + LINING_MM) / distance - 1, 0.0)
        shapes[name] = shapes[name] + inward[:, None] * off
    return replace(skin, shapes=shapes)


def still_lining(skin: HeadSkin, balls: Sequence[Eyeball]) -> HeadSkin:
    """Brows that do not move the folded inner side of the lids, which would slit a shut lid under raised brows."""
    means, shapes = neighbour_means(skin), dict(skin.shapes)
    lining = find_lining(skin, balls, 0.1).astype(np.float64)
    for _ in range(2):
        lining = np.maximum(lining, 0.6 * (means @ lining))
    for name in BROWS:
        shapes[name] = shapes[name] * (1 - lining[:, None])
    return replace(skin, shapes=shapes)


def keep_outside(skin: HeadSkin, vertices: Floats, balls: Sequence[Eyeball]) -> Floats:
    """Skin (N, 3) around the eyes that stays outside the eyeballs at rest; the inner side of the lids is left alone."""
    means = neighbour_means(skin)
    moved = vertices
    for ball in balls:
        off, distance, cosine = facing(replace(skin, vertices=moved), ball)
        is_outer = cosine > 0.15
        is_near = is_outer & (off[:, 2] > 2) & (distance > ball.radius - 7)
        lack = np.where(is_near, np.maximum(ball.radius + REST_GAP_MM - distance, 0), 0)
        for _ in range(3):
            lack = np.maximum(lack, 0.85 * (means @ lack))
        moved = moved + np.where(is_outer, lack / distance, 0)[:, None] * off
    return moved


N_ALONG, N_ROWS = 72, 4
EDGE_SPREAD = 0.030  # of the lid's length, over which a lash follows its edge; the vertices of the edge zigzag
WING, WING_EXPONENT = (0.84, 1.0), 1.3  # shares of the lid over which the band runs into a point
GAPS_MM = (0.3, 0.55, 0.45)  # of the outer rows in front of the lid at rest; a shut lid has `SHUT_GAP_MM`
SHUT_GAP_MM = 0.35
TURNS = {"eyeBlink": 1.0, "eyeLookDown": 0.4}  # share of the turn of a shut lid
SHUT_ACROSS, SHUT_DOWN, SHUT_AHEAD, SHUT_AHEAD_MM = 0.9, 0.62, 0.70, 0.6  # offset from the roots on a shut lid
ROW_TURNS = np.array([0.0, 0.10, 0.8, 1.0])
MATERIAL = {"specular": 0.03, "shininess": 8.0, "wrap": 0.3}


def lash_piece(
    skin: HeadSkin, lids: Sequence[LidEdge], balls: Sequence[Eyeball], length: Profile, colour: Colour
) -> HeadPart:
    """The lashes of both eyes; `length` in mm by share of the lid from the inner corner."""
    rows = np.flatnonzero((skin.vertices[:, 2] > -25) & (np.abs(skin.vertices[:, 1]) < 34))
    points, faces = [], []
    shapes: dict[str, list[Floats]] = {name: [] for name in skin.shapes}
    for number, (edge, ball, side) in enumerate(zip(lids, balls, ("Left", "Right"), strict=True)):
        line = edge.upper if side == "Left" else edge.upper[::-1]
        band = _Band(skin, line, ball, 1.0 if side == "Left" else -1.0, length)
        band.come_forward(Front(skin.vertices[rows]))
        points.append(band.points())
        grid = grid_triangles(N_ALONG, N_ROWS)
        faces.append((grid[:, ::-1] if side == "Left" else grid) + number * N_ALONG * N_ROWS)
        for name, moved in skin.shapes.items():
            follow = np.repeat(band.share @ moved[line], N_ROWS, axis=0)
            turn = TURNS.get(name.removesuffix(side), 0.0) if name.endswith(side) else 0.0
            if turn:
                follow = band.turned(follow, turn, Front(skin.vertices[rows] + moved[rows]))
            shapes[name].append(follow)
    vertices = np.concatenate(points)
    joined = {name: np.concatenate(blocks) for name, blocks in shapes.items()}
    return HeadPart(
        vertices,
        (MaterialSpan("lashes", np.concatenate(faces), MATERIAL),),
        np.tile(colour, (len(vertices), 1)),
        {name: moved for name, moved in joined.items() if np.abs(moved).max() > 1e-3},
    )


class _Band:
    """The band of one eye: rows of points along the lid's edge `line`, from the root outwards."""

    def __init__(self, skin: HeadSkin, line: NDArray[np.int64], ball: Eyeball, sign: float, length: Profile) -> None:
        edge = skin.vertices[line]
        along = arc_length(edge)
        along /= along[-1]
        at = np.linspace(0.0, 1.0, N_ALONG)
        share = np.exp(-(((at[:, None] - along) / EDGE_SPREAD) ** 2)) * np.gradient(along)
        self.share: Floats = share / share.sum(axis=1, keepdims=True)
        self.root: Floats = self.share @ edge
        outward = unit_vectors(self.root - ball.centre)
        long = profile(length, at)[:, None]
        thick, lean = np.minimum(long, 1.7), smoothstep(at, 0.30, 1.0)
        up = unit_vectors(np.column_stack([sign * (1.15 * lean - 0.10), 1.0 - 0.28 * lean, 0.45 - 0.1 * lean]))
        self._rows = [
            self.root - 0.2 * outward + [0, 0.1, -0.2],
            self.root + thick * outward - thick * [0, 0.95, 0],  # thick below: half shut, the band is seen edge-on
            self.root + 1.5 * thick * outward + 0.5 * long * up,
            self.root + thick * outward + long * unit_vectors(up + np.array([0, 0.22, -0.08])),
        ]
        self._pointed: Floats = smoothstep(at, *WING)[:, None] ** WING_EXPONENT

    def come_forward(self, lid: Front) -> None:
        """Move the rows in front of the lid, then run them into a point."""
        for row, gap in zip(self._rows[1:], GAPS_MM, strict=True):
            row[:, 2] += lid.lacking(row, gap)
        self._rows = [row + self._pointed * (self._rows[-1] - row) for row in self._rows]

    def points(self) -> Floats:
        """(`N_ALONG` x `N_ROWS`, 3) points of the band."""
        return np.stack(self._rows, axis=1).reshape(-1, 3)

    def turned(self, follow: Floats, turn: float, lid: Front) -> Floats:
        """Displacements of the band that turns down with the lid, in front of it, from those of its roots."""
        points = self.points()
        off = points - np.repeat(self.root, N_ROWS, axis=0)
        size = np.linalg.norm(off[:, 1:], axis=1)
        down = np.column_stack([SHUT_ACROSS * off[:, 0], -SHUT_DOWN * size, SHUT_AHEAD * size + SHUT_AHEAD_MM])
        share = (ROW_TURNS * (1 - self._pointed) + self._pointed).reshape(-1, 1)
        shut = (points + follow + turn * share * (down - off)).reshape(N_ALONG, N_ROWS, 3)
        for row in range(1, N_ROWS):
            shut[:, row, 2] += lid.lacking(shut[:, row], SHUT_GAP_MM)
        moved: Floats = shut.reshape(-1, 3) - points
        return moved


N_ALONG_BROW, N_ACROSS = 96, 7
LIFT_MM, RIM_SINK_MM = 0.9, 1.6  # of the ribbon above the skin, and of its rims into it
FOREHEAD_MM = 130.0  # twice the radius of the forehead that the ribbon bends around
SMOOTH_STEPS = N_ALONG_BROW / 16  # spread along the brow of its place, normals and motion
N_HAIRS, SLANT = 11, 1.3  # along the brow, and how far they lean outwards over half its width, in hairs
GROOVE, FRINGE, SHADE = 0.28, 0.07, 0.30  # shares of thickness, width and brightness that are less between hairs
OWN_SHARE = 0.5  # of the motion across the brow that is kept
AHEAD_SHARE = 0.18  # of a rise by which the brow comes forward: it drowns in the raised forehead else
BROW_MATERIAL = {"specular": 0.05, "shininess": 10.0, "wrap": 0.5}


def brow_piece(skin: HeadSkin, brow: Brow, colour: Colour) -> HeadPart:
    """Both brows on the skin of a character."""
    triangles = _forehead(skin)
    points, faces = [], []
    for number, sign in enumerate((1.0, -1.0)):
        points.append(_ribbon(skin, triangles, brow, sign))
        grid = grid_triangles(N_ALONG_BROW, N_ACROSS)
        faces.append((grid[:, ::-1] if sign > 0 else grid) + number * N_ALONG_BROW * N_ACROSS)
    vertices = np.concatenate(points)
    nearest, weights, _ = nearest_surface_points(vertices, skin.vertices, triangles)
    shapes = {}
    for name, moved in skin.shapes.items():
        follow = np.einsum("nk,nkd->nd", weights, moved[triangles[nearest]]).reshape(2, N_ALONG_BROW, N_ACROSS, 3)
        middle = np.stack([smooth_rows(one, SMOOTH_STEPS) for one in follow.mean(axis=2, keepdims=True)])
        follow = middle + OWN_SHARE * (follow - middle)
        if name.startswith("brow"):
            follow[..., 2] += AHEAD_SHARE * np.clip(follow[..., 1], 0, None)
        if np.abs(follow).max() > 1e-3:
            shapes[name] = follow.reshape(-1, 3)
    span = MaterialSpan("brows", np.concatenate(faces), BROW_MATERIAL)
    bright = 1 - SHADE * _between_hairs().ravel()
    return HeadPart(vertices, (span,), np.array(colour) * np.tile(bright, 2)[:, None], shapes)


def _between_hairs() -> Floats:
    """(`N_ALONG`, `N_ACROSS`) 0 on the hairs to 1 between them; they grow upwards and lean outwards."""
    along, place = np.linspace(0, 1, N_ALONG_BROW)[:, None], np.linspace(-1, 1, N_ACROSS)
    between: Floats = 0.5 - 0.5 * np.cos(2 * np.pi * (N_HAIRS * along - SLANT * place))
    return between


def _forehead(skin: HeadSkin) -> NDArray[np.int64]:
    """(F, 3) triangles of the skin on which brows lie."""
    triangles = triangulate(skin.quads)
    places = skin.vertices[triangles].mean(axis=1)
    return np.asarray(triangles[(places[:, 2] > -20) & (places[:, 1] > 2) & (places[:, 1] < 70)])


def _ribbon(skin: HeadSkin, triangles: NDArray[np.int64], brow: Brow, sign: float) -> Floats:
    """(`N_ALONG` x `N_ACROSS`, 3) points of the brow on the side of x with a sign."""
    places, normals = skin.vertices[triangles].mean(axis=1), vertex_normals(skin.vertices, skin.quads, skin.base)
    along = np.linspace(0, 1, N_ALONG_BROW)
    width, height = profile(brow.half_width, along), profile(brow.thickness, along)
    flat = smooth_line(brow.line, N_ALONG_BROW) * [sign, 1]
    ahead = places[cKDTree(places[:, :2]).query(flat)[1], 2]
    number, weights, _ = nearest_surface_points(np.column_stack([flat, ahead]), skin.vertices, triangles)
    on_skin = smooth_rows(np.einsum("nk,nkd->nd", weights, skin.vertices[triangles[number]]), SMOOTH_STEPS)
    normal = unit_vectors(np.einsum("nk,nkd->nd", weights, normals[triangles[number]]))
    normal = unit_vectors(smooth_rows(normal, SMOOTH_STEPS))
    across = sign * unit_vectors(np.cross(normal, unit_vectors(np.gradient(on_skin, axis=0))))
    place = np.linspace(-1, 1, N_ACROSS)
    between = _between_hairs()
    off = width[:, None] * place * (1 - FRINGE * between)
    lens = height[:, None] * np.sqrt(np.clip(1 - place**2, 0, 1)) * (1 - GROOVE * between)
    lift = lens + LIFT_MM - RIM_SINK_MM * (np.abs(place) > 0.99) - off**2 / FOREHEAD_MM
    points = on_skin[:, None] + off[..., None] * across[:, None] + lift[..., None] * normal[:, None]
    return np.asarray(points.reshape(-1, 3))
