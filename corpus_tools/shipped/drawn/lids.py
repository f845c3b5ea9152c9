"""Lids over larger eyeballs: blinks that shut, and a lining that stays inside."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from corpus_tools.shipped.head.lid_edges import LidEdge
from corpus_tools.shipped.head.parts import Eyeball
from corpus_tools.shipped.head.shapes import neighbour_means
from corpus_tools.shipped.head.skin import HeadSkin, vertex_normals
from tts2face.numeric.arrays import FloatArray, Mask, smoothstep

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


def facing(skin: HeadSkin, ball: Eyeball) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Offset (N, 3) of the skin from an eyeball's centre, its length (N,), and its cosine (N,) with the normal."""
    off = skin.vertices - ball.centre
    distance = np.linalg.norm(off, axis=1)
    normals = vertex_normals(skin.vertices, skin.quads, skin.base)
    return off, distance, np.einsum("nc,nc->n", off / distance[:, None], normals)


def find_lining(skin: HeadSkin, balls: Sequence[Eyeball], most: float) -> Mask:
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


def _raise_lower_lid(skin: HeadSkin, moved: FloatArray, ball: Eyeball, edge: LidEdge) -> FloatArray:
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


def _way_factors(vertices: FloatArray, moved: FloatArray, edge: LidEdge) -> FloatArray:
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


def _lay_on_ball(
    skin: HeadSkin, moved: FloatArray, ball: Eyeball, edge: LidEdge, means: sparse.csr_array
) -> FloatArray:
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


def tuck_lining(skin: HeadSkin, balls: Sequence[Eyeball], lining: Mask) -> HeadSkin:
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


def keep_outside(skin: HeadSkin, vertices: FloatArray, balls: Sequence[Eyeball]) -> FloatArray:
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
