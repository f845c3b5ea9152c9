"""Opening of a closed mouth: the skin is cut along the line of the lips, and a mouth lies behind the cut."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from tts2face.interchange.characters.surface import SHADING
from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.interchange.characters.transfer.sight import view_ahead
from tts2face.interchange.characters.transfer.skin import Skin
from tts2face.interchange.characters.transfer.walls import keep_triangles
from tts2face.models.face import VERTEX_COLOURS, Face, FacePart
from tts2face.models.landmarks import (
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
)
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, connected_pieces

CLOSED = 0.3  # of the mouth's width: a way along the surface from lip to lip that is shorter is one through a seam
ACROSS = 0.05  # of the mouth's width: how far above and below the seam that way starts
MIDDLE = slice(3, 8)  # of the eleven landmarks of the inner lips: those at which it is measured
NEAR = 0.2  # of the mouth's width: height beside the seam, and depth behind it, within which triangles are cut
LEAST_MM = 0.12  # from the seam: nearer vertices count as so far off it, so that no triangle is a sliver
POCKET, POCKET_DEPTH = 0.7, 0.05  # of the mouth's width: half side of the room behind the lips, and where it begins
LEAST_SPAN = 0.15  # of the mouth's width: shorter stretches of cut triangles belong to folds beside the seam
LOOSE = 0.06  # of the mouth's width: stretches as short and so near the cut would hold the lips together, and go
# Depth behind the lips and height beside the seam, mm on the shipped head, of the rows from a lip to the throat.
ROLL = np.array([(0.8, 0.3), (2.2, 1.2), (4.0, 4.0), (6.0, 10.0), (14.0, 16.0), (30.0, 15.0), (42.0, 6.0)])
N_LIP_ROWS = 2  # of these: the rolled edge of the lip, with its colours
CARRIED = np.array([1.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.0])  # share of a lip's motion that each row takes
COVER_MM = 5.0  # of skin before the mouth, on the shipped head
WIDENED = 0.35  # by which the mouth is wider than the lips at its back
INSIDE = (96, 34, 36)  # sRGB of a mouth that no light reaches
MOUTH, LIP_EDGES = "mouth:inside", "mouth:lips"  # names of its part, and of that of the rolled edges
# Least height of lips and groove over a smooth profile, of the distance of the outer eye corners: scans have .047 and
# more, one of .6 mm noise too, and a head whose mouth was smoothed away .009.
RELIEF = 0.018
RELIEF_BOX = (0.15, 0.32)  # of the same distance: half width and half height of the profile around the lips


@dataclass(frozen=True, slots=True, eq=False)
class OpenedMouth:
    """A face whose lips are parted by a cut, with the part `MOUTH` behind it.

    Parameters
    ----------
    sides : (V,)
        1 for vertices of the upper and 2 for those of the lower lip at the cut, 0 elsewhere.
    rows : (2, R, N)
        Vertices of the mouth behind the upper and the lower lip, by rows from the lip to the throat.
    lips, shares : (M,)
        Vertices of the lips that they follow, and the share of their motion.
    jaw : (M,)
        Share of the jaw's motion that they take.
    rolled : (E, 3)
        Triangles of the rolled edges of the lips; they belong to the part that was cut.
    scale
        Size of the face over that of the shipped head.
    """

    face: Face
    sides: IntArray
    rows: IntArray
    lips: IntArray
    shares: FloatArray
    jaw: FloatArray
    rolled: IntArray
    scale: float

    def edges(self, skin: Skin) -> tuple[IntArray, IntArray]:
        """Vertices of the skin at the cut, of the upper and of the lower lip."""
        upper, lower = (np.unique(skin.of_face[(self.sides == side) & (skin.of_face >= 0)]) for side in (1, 2))
        return upper, lower


def with_edges_apart(face: Face, rolled: IntArray) -> Face:
    """Face whose rolled edges of the lips (E, 3) are a part with own vertices: they leave the light on the lips alone.

    Their triangles are the last of the part that was cut.
    """
    first = int(np.flatnonzero((face.triangles == rolled[0]).all(axis=1))[0])
    rows, corners = np.unique(rolled, return_inverse=True)
    parts: list[FacePart] = []
    for part in face.parts:
        if part.first <= first < part.first + part.count:
            edges = replace(part, name=LIP_EDGES, first=first, count=len(rolled))
            parts += [replace(part, count=first - part.first), edges]
        else:
            parts.append(part)
    triangles = face.triangles.copy()
    triangles[first : first + len(rolled)] = len(face.vertices) + corners.reshape(-1, 3)
    return replace(
        face, vertices=np.concatenate([face.vertices, face.vertices[rows]]), triangles=triangles, parts=tuple(parts),
        colours=np.concatenate([face.colours, face.colours[rows]]),
        uv=None if face.uv is None else np.concatenate([face.uv, face.uv[rows]]),
        shapes=np.concatenate([face.shapes, face.shapes[:, rows]], axis=1), occlusion=None,
    )  # fmt: skip


def is_closed(skin: Skin) -> bool:
    """Whether upper and lower lip are one surface at most of the seam: the way from one to the other is short."""
    upper, lower = (skin.landmarks[list(line)] for line in (INNER_LIP_UPPER, INNER_LIP_LOWER))
    seam, width = (upper + lower) / 2, float(np.linalg.norm(upper[0] - upper[-1]))
    off = np.array([0.0, ACROSS * width, 0.0])
    above, below = skin.nearest(seam[MIDDLE] + off), skin.nearest(seam[MIDDLE] - off)
    far = dijkstra(skin.graph(), False, above, limit=2 * CLOSED * width)
    return bool(np.median(far[np.arange(len(above)), below]) < CLOSED * width)


def lip_relief(face: Face, landmarks: FloatArray) -> float:
    """Height of lips and groove over a smooth profile of the face's middle, as a share of the eye corners' distance."""
    size = float(np.linalg.norm(landmarks[EYE_OUTER_LEFT] - landmarks[EYE_OUTER_RIGHT]))
    middle = landmarks[[*INNER_LIP_UPPER, *INNER_LIP_LOWER]].mean(axis=0)
    half = np.array([RELIEF_BOX[0], RELIEF_BOX[1], 0.0]) * size
    shown = face.triangles[triangles_of(face, "skin")]
    sight = view_ahead(face.vertices.astype(np.float64), shown, (middle - half, middle + half), 0.006 * size)
    depth = np.where(np.isfinite(sight.depth), sight.depth, np.nan)
    with np.errstate(all="ignore"):
        profile = np.nanmedian(depth, axis=0)
    known = np.flatnonzero(np.isfinite(profile))
    if len(known) < 8:
        return 0.0
    heights = known / len(profile)
    off = profile[known] - np.polyval(np.polyfit(heights, profile[known], 2), heights)
    return float(np.quantile(off, 0.95) - np.quantile(off, 0.05)) / size


def open_mouth(face: Face, skin: Skin, scale: float) -> OpenedMouth | None:
    """The face with its lips cut apart; None where no triangle lies at the line of the lips.

    `scale` is the size of the face over that of the shipped head.
    """
    seam = (skin.landmarks[list(INNER_LIP_UPPER)] + skin.landmarks[list(INNER_LIP_LOWER)]) / 2
    seam = seam[np.argsort(seam[:, 0])]
    ends = np.sort(skin.landmarks[[MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT], 0])
    seam[0, 0], seam[-1, 0] = (seam[0, 0] + ends[0]) / 2, (seam[-1, 0] + ends[1]) / 2
    face = _without_buried(face, skin, seam)
    slit = _cut(face, skin, seam)
    return None if slit is None else _add_mouth(face, slit, skin.landmarks, scale)


def _without_buried(face: Face, skin: Skin, seam: FloatArray) -> Face:
    """Face without what is hidden behind its lips: pockets of a scan, in whose place the mouth comes."""
    places, width = face.vertices.astype(np.float64), float(seam[-1, 0] - seam[0, 0])
    behind = np.interp(places[:, 0], seam[:, 0], seam[:, 2]) - places[:, 2]
    near = (np.abs(places - seam.mean(axis=0)) < POCKET * width).all(axis=1) & (behind > POCKET_DEPTH * width)
    is_buried = np.zeros(len(places), bool)
    on_skin = skin.of_face >= 0
    is_buried[on_skin] = ~skin.is_seen[skin.of_face[on_skin]]
    gone = (is_buried & near)[face.triangles].all(axis=1)
    return keep_triangles(face, ~gone) if gone.any() else face


@dataclass(frozen=True, slots=True, eq=False)
class _Slit:
    """Cut skin: ends (E, 2) of the cut edges, shares of the way between them, vertices (E,) of both lips there.

    Vertices from the face's on are new. ``triangles`` (G, 3) are the parts of the divided triangles ``source`` (G,);
    the triangles ``loose`` (L,) go without any.
    """

    ends: IntArray
    share: FloatArray
    upper: IntArray
    lower: IntArray
    triangles: IntArray
    source: IntArray
    loose: IntArray
    places: FloatArray


def _cut(face: Face, skin: Skin, seam: FloatArray) -> _Slit | None:
    places, corners = face.vertices.astype(np.float64), face.triangles.astype(np.int64)
    heights, is_near = _heights(face, skin, seam)
    above = heights > 0
    n_above = above[corners].sum(axis=1)
    rows = np.flatnonzero(is_near & (n_above > 0) & (n_above < 3))
    is_tip = n_above[rows] == 1
    odd = np.where(is_tip, above[corners[rows]].argmax(axis=1), above[corners[rows]].argmin(axis=1))
    alone, after, before = (corners[rows, (odd + step) % 3] for step in range(3))
    pairs = np.sort(np.concatenate([np.column_stack([alone, after]), np.column_stack([alone, before])]), axis=1)
    ends, number = np.unique(pairs, axis=0, return_inverse=True)
    to_after, to_before = number.reshape(2, -1)
    share = heights[ends[:, 0]] / (heights[ends[:, 0]] - heights[ends[:, 1]])
    at = places[ends[:, 0]] + share[:, None] * (places[ends[:, 1]] - places[ends[:, 0]])
    inside = (at[:, 0] > seam[0, 0]) & (at[:, 0] < seam[-1, 0])
    across = inside[to_after] & inside[to_before]
    width = float(np.ptp(seam[:, 0]))
    whole = across & _in_long_stretches(np.column_stack([to_after, to_before]), at, across, width)
    if whole.sum() < 3:
        return None
    far = np.asarray(cKDTree(at[to_after[whole]]).query(at[to_after])[0])
    loose = across & ~whole & (far < LOOSE * width)
    used = np.zeros(len(ends), bool)
    used[to_after[whole]] = used[to_before[whole]] = True
    # the cut ends in the edge of a triangle that stays whole: there both lips share one vertex, without a thread
    is_end = np.zeros(len(ends), bool)
    stays = ~whole & ~loose
    is_end[to_after[stays]] = is_end[to_before[stays]] = True
    is_end &= used
    n, rank = len(places), np.cumsum(used) - 1
    upper = n + rank
    lower = np.where(is_end, upper, n + int(used.sum()) + rank)
    triangles, source = [], []
    for chosen, own, other in ((is_tip & whole, upper, lower), (~is_tip & whole, lower, upper)):
        a, b, c, p, q = (values[chosen] for values in (alone, after, before, to_after, to_before))
        triangles += [
            np.column_stack([a, own[p], own[q]]), np.column_stack([other[p], b, c]),
            np.column_stack([other[p], c, other[q]]),
        ]  # fmt: skip
        source += [rows[chosen]] * 3
    for edge, opposite, tip in ((to_after, before, after), (to_before, after, before)):
        chosen = stays & is_end[edge]
        a, b = alone[chosen], tip[chosen]
        c, m = opposite[chosen], upper[edge[chosen]]
        halves = [np.column_stack([a, m, c]), np.column_stack([m, b, c])]
        triangles += halves if edge is to_after else [half[:, ::-1] for half in halves]
        source += [rows[chosen]] * 2
    return _Slit(
        ends[used],
        share[used],
        upper[used],
        lower[used],
        np.concatenate(triangles),
        np.concatenate(source),
        rows[loose],
        at[used],
    )


def _heights(face: Face, skin: Skin, seam: FloatArray) -> tuple[FloatArray, Mask]:
    """Heights (V,) over the line of the lips, never 0, and the triangles (F,) of skin that it may cut."""
    places = face.vertices.astype(np.float64)
    heights = places[:, 1] - np.interp(places[:, 0], seam[:, 0], seam[:, 1])
    heights = np.where(np.abs(heights) < LEAST_MM, np.where(heights < 0, -LEAST_MM, LEAST_MM), heights)
    depth = np.interp(places[:, 0], seam[:, 0], seam[:, 2]) - places[:, 2]
    reach = NEAR * float(seam[-1, 0] - seam[0, 0])
    # the bottom of a groove is seen from nowhere, and must be cut, too
    is_near = (skin.of_face >= 0) & (np.abs(heights) < 2 * reach) & (depth < reach)
    near: Mask = np.asarray(is_near[face.triangles].all(axis=1))
    return heights, near


def _in_long_stretches(edges: IntArray, at: FloatArray, whole: Mask, width: float) -> Mask:
    """(F,) triangles of connected stretches of cut triangles, by their two cut edges (F, 2), that are long enough."""
    kept = np.zeros(len(edges), bool)
    # stretches that meet at a seam of the texture are one: edges at one place
    place = np.unique(np.rint(at * 1e2), axis=0, return_inverse=True)[1].reshape(-1)
    piece = connected_pieces(place[edges[whole]][:, [0, 1, 1]], int(place.max()) + 1)[place]
    for number in np.unique(piece[edges[whole]]).tolist():
        rows = whole & (piece[edges[:, 0]] == number)
        if np.ptp(at[edges[rows]][:, :, 0]) > LEAST_SPAN * width:
            kept |= rows
    return kept


def _add_mouth(face: Face, slit: _Slit, landmarks: FloatArray, scale: float) -> OpenedMouth:
    _, first = np.unique(np.rint(slit.places * 1e2), axis=0, return_index=True)
    chain = first[np.argsort(slit.places[first, 0])]
    line, n = slit.places[chain], len(chain)
    n_new = int(max(slit.upper.max(), slit.lower.max())) + 1
    width = float(np.ptp(line[:, 0]))
    along = (line[:, 0] - line[0, 0]) / max(width, 1e-9)
    bulge = np.sqrt(np.clip(1 - (2 * along - 1) ** 2, 0, 1))  # the mouth narrows to its corners
    depth, height = ROLL[:, :1] * scale, ROLL[:, 1:] * scale
    grid = np.zeros((2, len(ROLL), n, 3))
    grid[..., 0] = line[:, 0] + (line[:, 0] - line[:, 0].mean()) * WIDENED * bulge * depth / depth.max()
    grid[..., 1] = line[:, 1] + np.stack([1, -1])[:, None, None] * height * bulge
    grid[..., 2] = line[:, 2] - depth * (0.3 + 0.7 * bulge)
    _keep_behind_skin(face, grid[:, N_LIP_ROWS:], scale)
    lips = np.stack([slit.upper[chain], slit.lower[chain]])
    numbers = n_new + np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    ladder = np.concatenate([lips[:, None], numbers], axis=1)
    quads = [_strips(ladder[0], is_upper=True), _strips(ladder[1], is_upper=False)]
    last = ladder[:, -1]
    back = [np.column_stack([last[1, :-1], last[1, 1:], last[0, 1:]]),
            np.column_stack([last[1, :-1], last[0, 1:], last[0, :-1]])]  # fmt: skip
    lip_skin = np.concatenate([strip[:N_LIP_ROWS].reshape(-1, 3) for strip in quads])
    inside = np.concatenate([*(strip[N_LIP_ROWS:].reshape(-1, 3) for strip in quads), *back])
    of = np.broadcast_to(lips[:, None], grid.shape[:3]).reshape(-1)
    row = np.tile(np.repeat(np.arange(len(ROLL)), n), 2)
    made = _joined(face, slit, (grid.reshape(-1, 3), of, row), (lip_skin, inside))
    sides = np.zeros(len(made.vertices), np.int64)
    sides[slit.upper], sides[slit.lower] = 1, 2
    sides[slit.upper[slit.upper == slit.lower]] = 0
    share = np.broadcast_to(CARRIED[None, :, None], grid.shape[:3])
    # the floor of the mouth sinks with the lower teeth
    jaw = (1 - share) * np.stack([0.0, 1.0])[:, None, None] * np.linspace(1.0, 0.3, len(ROLL))[None, :, None]
    return OpenedMouth(
        _with_lip_landmarks(made, slit, landmarks), sides, numbers, of.astype(np.int64), share.reshape(-1),
        jaw.reshape(-1), lip_skin, scale,
    )  # fmt: skip


def _keep_behind_skin(face: Face, rows: FloatArray, scale: float) -> None:
    """Move places (..., 3) of a mouth back to `COVER_MM` behind the skin before them, in place: chins recede."""
    flat = rows.reshape(-1, 3)
    shown = face.triangles[triangles_of(face, "skin")]
    sight = view_ahead(face.vertices.astype(np.float64), shown, (flat.min(axis=0) - 1.0, flat.max(axis=0) + 1.0), 1.0)
    column, row = np.floor((flat[:, :2] - sight.low) / sight.step).astype(np.int64).T
    skin = sight.depth[column, row]
    least = np.where(np.isfinite(skin), skin - COVER_MM * scale, np.inf)
    rows[..., 2] = np.minimum(flat[:, 2], least).reshape(rows.shape[:-1])


def _strips(ladder: IntArray, *, is_upper: bool) -> IntArray:
    """Triangles (rows, 2 columns, 3) between the rows (R, N) of a lip's vertices, which face the mouth."""
    a, b = ladder[:-1, :-1], ladder[:-1, 1:]
    c, d = ladder[1:, :-1], ladder[1:, 1:]
    triangles = np.concatenate([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)], axis=1)
    strips: IntArray = triangles if is_upper else triangles[..., ::-1]
    return strips


def _joined(
    face: Face, slit: _Slit, mouth: tuple[FloatArray, IntArray, IntArray], triangles: tuple[IntArray, IntArray]
) -> Face:
    """Face with the divided triangles and the mouth: places (M, 3), the lip's vertex and the row of each."""
    places, lips, row = mouth
    order = np.zeros(int(max(slit.upper.max(), slit.lower.max())) + 1 - len(face.vertices), np.int64)
    order[slit.upper - len(face.vertices)] = order[slit.lower - len(face.vertices)] = np.arange(len(slit.upper))

    def extended(values: NDArray[np.generic]) -> NDArray[np.generic]:
        start, end = (values[slit.ends[:, k]].astype(np.float64) for k in (0, 1))
        at = (start + slit.share[:, None] * (end - start))[order]
        return np.concatenate([values, at.astype(values.dtype)])

    skin_colours, uv = extended(face.colours), None if face.uv is None else extended(face.uv)
    colours = np.where((row < N_LIP_ROWS)[:, None], skin_colours[lips], np.array(INSIDE, np.uint8))
    is_cut = np.zeros(len(face.triangles), bool)
    is_cut[slit.source] = is_cut[slit.loose] = True
    home = int(np.bincount(_part_of(face)[slit.source]).argmax())
    parts: list[FacePart] = []
    corners: list[NDArray[np.integer]] = []
    first = 0
    for number, part in enumerate(face.parts):
        own = np.arange(part.first, part.first + part.count)
        pieces: list[NDArray[np.integer]] = [
            face.triangles[own[~is_cut[own]]],
            slit.triangles[np.isin(slit.source, own)],
        ]
        pieces += [triangles[0]] if number == home else []
        corners += pieces
        count = sum(len(piece) for piece in pieces)
        parts.append(replace(part, first=first, count=count))
        first += count
    specular, shininess, wrap = SHADING["tongue"]
    # behind the opaque parts, before translucent ones
    parts.append(FacePart(MOUTH, first, len(triangles[1]), specular, shininess, wrap, 1.0, VERTEX_COLOURS))
    return replace(
        face,
        vertices=np.concatenate([extended(face.vertices), places]).astype(np.float32),
        colours=np.concatenate([skin_colours, colours]).astype(np.uint8),
        uv=None if uv is None else np.concatenate([uv, uv[lips]]).astype(np.float32),
        triangles=np.concatenate([*corners, triangles[1]]).astype(np.int32),
        parts=tuple(parts),
        shapes=np.zeros((0, len(face.vertices) + len(order) + len(places), 3), np.float32),
        shape_names=(), limits=np.zeros((0, 2), np.float32), occlusion=None,
        eyes=tuple(replace(eye, turns={}) for eye in face.eyes),
    )  # fmt: skip


def _part_of(face: Face) -> IntArray:
    return np.repeat(np.arange(len(face.parts)), [part.count for part in face.parts])


def _with_lip_landmarks(face: Face, slit: _Slit, landmarks: FloatArray) -> Face:
    """Face whose landmarks of the inner lips lie on the cut, each on its own lip."""
    vertices, weights = face.landmark_vertices.copy(), face.landmark_weights.copy()
    for line, lip in ((INNER_LIP_UPPER, slit.upper), (INNER_LIP_LOWER, slit.lower)):
        for number in line:
            row = np.flatnonzero(face.landmarks == number)
            nearest = int(np.abs(slit.places[:, 0] - landmarks[number, 0]).argmin())
            vertices[row], weights[row] = lip[nearest], (1.0, 0.0, 0.0)
    return replace(face, landmark_vertices=vertices, landmark_weights=weights)
