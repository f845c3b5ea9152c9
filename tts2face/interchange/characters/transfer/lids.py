"""Lids of a head without shapes: their edges by sight of the eyeballs, and blinks that shut them."""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from tts2face.interchange.characters.transfer.parts import triangles_of, vertices_of
from tts2face.interchange.characters.transfer.registration import Similarity, factorise
from tts2face.interchange.characters.transfer.sight import Sight, view_ahead
from tts2face.interchange.characters.transfer.skin import Skin
from tts2face.models.face import Face
from tts2face.models.landmarks import LEFT_LIDS, RIGHT_LIDS
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, true_runs

LIDS = {"Right": RIGHT_LIDS, "Left": LEFT_LIDS}
MIN_COLUMNS = 8  # of cells in which an eyeball is seen, for an eye to have edges
SIGHT_STEP_MM = 0.5
LID_SHAPES = ("eyeBlink", "eyeWide", "eyeSquint", "eyeLook")
SEEN_MM = 0.1  # of an eyeball in a blink above which the lids do not shut; a cell of the view has .25
MAX_CROSSING = 1.25  # of the opening: a blink that closes more overshoots
PULL, SMOOTH = 20.0, 20.0  # weights of a pair of lids and of smoothness
LOWER_HELD = 6.0  # weight of the lower lid's rest
FREE, FIXED = 1e-3, 1e3  # weights of rest near the lids and beyond `LID_REACH_MM`
LID_REACH_MM = 30.0
OPENING_RATIOS = (0.2, 3.0)  # of a target's opening over the source's; beyond them landmarks are wrong
CLEARANCE_MM = 0.3  # of a shut lid over the eyeball
LID_RADII = 1.8  # from the centre of an eyeball within which lids are kept off it
MOVED_MM = 0.5  # by which a shape moves lids that are
N_PUSHES = 5  # of lids, which bring other triangles to the front


def eyeballs(face: Face) -> list[tuple[FloatArray, float]]:
    """Centre (3,) and radius of the eyeballs on the left and on the right, mm."""
    used = vertices_of(face, "eyes")
    places = face.vertices[used].astype(np.float64)
    found = []
    for rows in (places[:, 0] > np.median(places[:, 0]), places[:, 0] <= np.median(places[:, 0])) if len(used) else ():
        ball = places[rows]
        if len(ball) >= 4:
            table = np.column_stack([2 * ball, np.ones(len(ball))])
            centre = np.linalg.lstsq(table, (ball**2).sum(axis=1), rcond=None)[0][:3]
            found.append((centre, float(np.percentile(np.linalg.norm(ball - centre, axis=1), 90))))
    return found


def lids_in_sight(face: Face, landmarks: FloatArray) -> FloatArray:
    """Landmarks (468, 3) whose lids lie at the edges of what is seen of separate eyeballs; others are unchanged.

    The tracker's lids are millimetres off on plain heads, and further on drawn ones with large eyes.
    """
    moved, is_eye = landmarks.copy(), triangles_of(face, "eyes")
    shown = is_eye | triangles_of(face, "skin")
    places = face.vertices.astype(np.float64)
    for centre, radius in eyeballs(face):
        lids = min(LIDS.values(), key=lambda lids: float(np.linalg.norm(landmarks[[*lids[0]]].mean(axis=0) - centre)))
        box = (centre - 1.2 * radius, centre + 1.2 * radius)
        sight = view_ahead(places, face.triangles[shown], box, SIGHT_STEP_MM)
        seen = np.append(is_eye[shown], False)[sight.triangle]
        edges = {}
        for column in range(len(seen)):
            runs = true_runs(seen[column])
            if len(runs):
                edges[column] = runs[(runs[:, 1] - runs[:, 0]).argmax()]
        widest = _longest_run(sorted(edges))
        if len(widest) < MIN_COLUMNS:
            continue
        _move_lids(moved, lids, (sight.low, sight.step, sight.depth), {column: edges[column] for column in widest})
    return moved


def _longest_run(columns: Sequence[int]) -> list[int]:
    runs = np.split(np.array(columns, np.int64), np.flatnonzero(np.diff(columns) > 1) + 1)
    return max((run.tolist() for run in runs), key=len, default=[])


def _move_lids(
    landmarks: FloatArray,
    lids: tuple[tuple[int, ...], tuple[int, ...]],
    grid: tuple[FloatArray, float, FloatArray],
    edges: dict[int, IntArray],
) -> None:
    """Move the landmarks of an eye to the cells beyond the edges, columns -> first and last row of the eyeball."""
    low, step, depth = grid
    columns = np.array(sorted(edges))
    is_outwards = landmarks[lids[0][0], 0] > landmarks[lids[0][-1], 0]
    ends = (columns[-1], columns[0]) if is_outwards else (columns[0], columns[-1])
    for line, is_upper in zip(lids, (True, False), strict=True):
        for number, share in zip(line, np.linspace(0.0, 1.0, len(line)), strict=True):
            column = int(columns[np.abs(columns - (ends[0] * (1 - share) + ends[1] * share)).argmin()])
            row = int(edges[column][1]) if is_upper else int(edges[column][0]) - 1
            row = int(np.clip(row, 0, depth.shape[1] - 1))
            z = depth[column, row]
            landmarks[number] = (*(low + (np.array([column, row]) + 0.5) * step), z if np.isfinite(z) else 0.0)
            if not np.isfinite(z):
                landmarks[number, 2] = depth[np.isfinite(depth)].max()
    for end in (0, -1):
        landmarks[lids[0][end]] = landmarks[lids[1][end]] = landmarks[[lids[0][end], lids[1][end]]].mean(axis=0)


def seen_eyeball(face: Face, landmarks: FloatArray, places: FloatArray, side: str) -> float:
    """Largest height in mm that is seen of an eyeball from straight ahead, with vertices (V, 3) in these places."""
    around = landmarks[list({*LIDS[side][0], *LIDS[side][1]})]
    is_eye = triangles_of(face, "eyes")
    shown = is_eye | triangles_of(face, "skin")
    sight = view_ahead(places, face.triangles[shown], (around.min(axis=0) - 2.0, around.max(axis=0) + 2.0))
    return float(sight.heights(is_eye[shown]).max(initial=0.0))


def lid_pairs(skin: Skin) -> IntArray:
    """(14, 2) vertices of the upper and the lower lid that lie opposite each other, of the right eye, then the left."""
    pairs = []
    for first, (upper, lower) in ((3, RIGHT_LIDS), (5, LEFT_LIDS)):
        above = skin.nearest(skin.landmarks[list(upper[1:-1])], first)
        below = skin.nearest(skin.landmarks[list(lower[1:-1])], first + 1)
        pairs.append(np.column_stack([above, below]))
    return np.concatenate(pairs)


def shut_lids(
    source: tuple[Skin, FloatArray], target: tuple[Skin, FloatArray], names: Sequence[str], similarity: Similarity
) -> FloatArray:
    """Shapes (K, S, 3) of the target whose lids open and close as the source's, by shares of the openings.

    `source` and `target` are skins with their displacements (K, S, 3). A blink shuts whatever the source leaves open.
    """
    skin, shapes = target
    pairs, own = lid_pairs(skin), lid_pairs(source[0])
    opening = _gap(skin.vertices, pairs)
    ratio = opening / np.maximum(similarity.scale * _gap(source[0].vertices, own), 1.0)
    moves = similarity.moves(source[1])
    wanted = _gap(moves, own) * np.clip(ratio, *OPENING_RATIOS)
    for number, name in enumerate(names):
        if name.startswith("eyeBlink"):
            eye = slice(0, 7) if name.endswith("Right") else slice(7, 14)
            wanted[number, eye] = -opening[eye]
    missing = np.where([[name.startswith(LID_SHAPES)] for name in names], wanted - _gap(shapes, pairs), 0.0)
    row = np.arange(len(pairs))
    apart = sp.csr_matrix(
        (np.repeat([1.0, -1.0], len(row)), (np.tile(row, 2), pairs.T.ravel())), (len(row), len(skin.vertices))
    )
    far = np.asarray(cKDTree(skin.vertices[np.unique(pairs)]).query(skin.vertices)[0])
    held = np.where(far > LID_REACH_MM, FIXED, FREE)
    held[np.unique(pairs[:, 1])] += LOWER_HELD
    laplacian = skin.laplacian()
    system = SMOOTH * (laplacian.T @ laplacian) + PULL * (apart.T @ apart) + sp.diags(held)
    changed = shapes.copy()
    # lids slide over the eyeball up and down; the registration gives the other axes
    changed[:, :, 1] += factorise(system).solve(PULL * (apart.T @ missing.T)).T
    return changed


def keep_off_eyeballs(face: Face, skin: Skin, shape: FloatArray) -> None:
    """Move lids that a shape (S, 3) brings behind an eyeball before it, in place; corneas bulge, drawn eyes are flat.

    What is hidden at rest, as the inner side of a lid, stays behind what is seen.
    """
    is_eye = triangles_of(face, "eyes")
    is_lid = (skin.side > 2) & (np.abs(shape).max(axis=1) > MOVED_MM)
    lids = is_lid[skin.triangles].all(axis=1)
    is_inner = lids & ~skin.is_seen[skin.triangles].any(axis=1)
    for centre, radius in eyeballs(face):
        box = (centre - LID_RADII * radius, centre + LID_RADII * radius)
        eye = view_ahead(face.vertices.astype(np.float64), face.triangles[is_eye], box)
        for _ in range(N_PUSHES):
            outer = view_ahead(skin.vertices + shape, skin.triangles[~is_inner], box)
            push = _missing(eye, outer, np.append(lids[~is_inner], False)[outer.triangle], radius)
            forward = _at_vertices(push, outer, skin.triangles[~is_inner], len(shape))
            shape[:, 2] += forward
            inner = view_ahead(skin.vertices + shape, skin.triangles[is_inner], box)
            push = _missing(inner, outer, np.append(lids[~is_inner], False)[outer.triangle], np.inf)
            back = _at_vertices(push, inner, skin.triangles[is_inner], len(shape)) * ~skin.is_seen
            shape[:, 2] -= back
            if not forward.any() and not back.any():
                break


def _missing(behind: Sight, before: Sight, is_asked: Mask, most: float) -> FloatArray:
    """(X, Y) distance by which what should lie behind is not `CLEARANCE_MM` behind the other; 0 beyond `most`."""
    both = is_asked & np.isfinite(behind.depth) & np.isfinite(before.depth)
    missing: FloatArray = np.where(both, behind.depth, 0.0) - np.where(both, before.depth, 0.0) + CLEARANCE_MM
    return np.where(both & (missing < most), np.maximum(missing, 0.0), 0.0)


def _at_vertices(push: FloatArray, sight: Sight, triangles: IntArray, n: int) -> FloatArray:
    """(N,) largest of the distances (X, Y) in the cells of the triangles (F, 3) around each vertex."""
    found, hit = np.zeros(n), push > 0
    np.maximum.at(found, triangles[sight.triangle[hit]], push[hit][:, None])
    return found


def closed_share(skin: Skin, shape: FloatArray, side: str) -> float:
    """Share of its opening at rest by which a shape (S, 3) closes an eye."""
    pairs = lid_pairs(skin)[slice(0, 7) if side == "Right" else slice(7, 14)]
    return float(-_gap(shape, pairs).mean() / max(float(_gap(skin.vertices, pairs).mean()), 1e-6))


def _gap(places: FloatArray, pairs: IntArray) -> FloatArray:
    """Heights (..., P) of the first over the second vertex of pairs."""
    heights: FloatArray = places[..., pairs[:, 0], 1] - places[..., pairs[:, 1], 1]
    return heights
