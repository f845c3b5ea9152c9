"""Lips that touch at rest; MakeHuman's are 0.5 to 1 mm apart beside the middle."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from corpus_tools.shipped.head.edge_rings import EdgeRings, find_narrowest_ring
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.numeric.arrays import FloatArray

PRESS_MM = 0.12  # lips overlap by this at rest, so that no light falls between them
REACH_MM = 5.0  # from the line of contact to where the skin's motion has decayed
N_COLUMNS = 61
N_RIM_STEPS, N_RING_STEPS = 5, 20
RING_PRESS_MM, RING_SPREAD_MM = 0.06, 1.5  # overlap of the ring at rest, and distance over which its motion is averaged
MIDDLE_MM = 6.0
OPENING = 0.3  # weight of jawOpen at which the lips are apart
RING_REACH_MM = 40.0
BETWEEN_MM = 1.5  # from the middle of the opening to where a vertex belongs to one lip alone
LIP_MIDDLES = np.array([(0.0, 6.696, 1.596), (0.0, 6.47, 1.54)])  # on the source's base mesh, upper and lower lip
MOUTH_BOX = ((-0.32, 0.32), (6.45, 6.75), (1.25, 1.75))  # around the lips on the source's base mesh
DEPTH_MM = 12.0  # depth of a lip behind its foremost point at each x; lips touch up to 10 mm behind it


@dataclass(frozen=True, slots=True, eq=False)
class LipLine:
    """The line between the lips: half its width in mm, and the lip of each vertex (N,), -1 upper to 1 lower."""

    half_width: float
    lower: FloatArray


def lip_ring(skin: HeadSkin) -> NDArray[np.int64]:
    """Vertices of the ring of edges where the lips meet; the same for every identity."""
    middles = [int(np.linalg.norm(skin.base - place, axis=1).argmin()) for place in LIP_MIDDLES]
    opened = skin.vertices + OPENING * skin.shapes["jawOpen"]
    return find_narrowest_ring(EdgeRings(skin.quads, skin.base), opened, opened[middles].mean(axis=0), RING_REACH_MM)


def lip_front(vertices: FloatArray, ring: NDArray[np.int64]) -> float:
    """Mean z in mm of the line between the lips near the middle."""
    line = vertices[ring]
    return float(line[np.abs(line[:, 0]) < MIDDLE_MM, 2].mean())


def find_lip_line(skin: HeadSkin, ring: NDArray[np.int64]) -> LipLine:
    """The line between the lips, found with the jaw open."""
    opened = skin.vertices + OPENING * skin.shapes["jawOpen"]
    ring = np.roll(ring, -int(opened[ring, 0].argmin()))
    line = opened[np.append(ring, ring[0])]
    turn = int(line[:, 0].argmax())
    arcs = [np.interp(opened[:, 0], arc[:, 0], arc[:, 1]) for arc in (line[: turn + 1], line[turn:][::-1])]
    half = float(np.abs(skin.vertices[ring, 0]).max())
    lower = np.clip(((arcs[0] + arcs[1]) / 2 - opened[:, 1]) / BETWEEN_MM, -1, 1)
    return LipLine(half, lower * (np.abs(opened[:, 0]) < half))


def close_lips(skin: HeadSkin, ring: NDArray[np.int64]) -> HeadSkin:
    """The skin with lips in contact: first where they bulge most, then along the whole ring where they meet."""
    line = find_lip_line(skin, ring)
    vertices = skin.vertices
    for _ in range(N_RIM_STEPS):
        vertices = vertices + _closing_step(replace(skin, vertices=vertices), line)
    for _ in range(N_RING_STEPS):
        vertices = vertices + _ring_step(replace(skin, vertices=vertices), line, ring)
    return replace(skin, vertices=vertices)


def ring_arcs(skin: HeadSkin, ring: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Vertices of the upper and of the lower half of the ring, each from the right corner to the left one."""
    ring = np.roll(ring, -int(skin.base[ring, 0].argmin()))
    turn = int(skin.base[ring, 0].argmax())
    arcs = (ring[: turn + 1], np.append(ring[turn:], ring[0])[::-1])
    lower, upper = sorted(
        arcs, key=lambda arc: float((skin.vertices + OPENING * skin.shapes["jawOpen"])[arc, 1].mean())
    )
    return upper, lower


def _ring_step(skin: HeadSkin, lips: LipLine, ring: NDArray[np.int64]) -> FloatArray:
    """(N, 3) displacement by which each point of the ring meets the one opposite, with the lip around it."""
    upper, lower = ring_arcs(skin, ring)
    moved = np.zeros_like(skin.vertices)
    low, high = np.array(MOUTH_BOX).T
    near = np.flatnonzero(np.all((skin.base > low) & (skin.base < high), axis=1))
    for arc, other, sign in ((upper, lower, -1.0), (lower, upper, 1.0)):
        place, across = skin.vertices[arc], skin.base[other, 0]
        opposite = np.stack([np.interp(skin.base[arc, 0], across, skin.vertices[other, k]) for k in (1, 2)], axis=1)
        half = (opposite - place[:, 1:]) / 2
        half[:, 0] += sign * RING_PRESS_MM / 2
        half[[0, -1]] = 0.0
        own = near[(sign * lips.lower[near] > 0) | np.isin(near, arc)]
        distance = np.linalg.norm(skin.vertices[own][:, None] - place[None], axis=2)
        weights = np.exp(-((distance / RING_SPREAD_MM) ** 2)) + 1e-12
        reach = np.exp(-((distance.min(axis=1) / REACH_MM) ** 2)) * np.clip(sign * lips.lower[own], 0, 1)
        reach[np.isin(own, arc)] = 1.0
        moved[own, 1:] += reach[:, None] * (weights @ half) / weights.sum(axis=1)[:, None]
    return moved


def lip_gaps(skin: HeadSkin, lips: LipLine) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Columns x (C,), and the upper and lower lip's edges there as (C, 2) of y and z, mm."""
    low, high = np.array(MOUTH_BOX).T
    near = np.all((skin.base > low) & (skin.base < high), axis=1)
    quads = skin.quads[near[skin.quads].all(axis=1)]
    edges = np.unique(np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)
    is_lower = lips.lower[edges].mean(axis=1)
    columns = lips.half_width * np.linspace(-0.985, 0.985, N_COLUMNS)
    upper = _rims(skin.vertices, edges[is_lower < 0], columns, 1.0)
    lower = _rims(skin.vertices, edges[is_lower > 0], columns, -1.0)
    return columns, upper, lower


def _rims(vertices: FloatArray, edges: NDArray[np.int64], columns: FloatArray, sign: float) -> FloatArray:
    """(C, 2) y and z of the lowest (sign 1) or highest (-1) point of a lip at each x; NaN where there is none."""
    rims = np.full((len(columns), 2), np.nan)
    ends = vertices[edges]
    for at, x in enumerate(columns):
        crossed = (ends[:, 0, 0] <= x) != (ends[:, 1, 0] <= x)
        if crossed.any():
            start, end = ends[crossed, 0], ends[crossed, 1]
            points = start + ((x - start[:, 0]) / (end[:, 0] - start[:, 0]))[:, None] * (end - start)
            points = points[points[:, 2] > points[:, 2].max() - DEPTH_MM]
            rims[at] = points[np.argmin(sign * points[:, 1]), 1:]
    return rims


def _closing_step(skin: HeadSkin, lips: LipLine) -> FloatArray:
    """(N, 3) displacement of half the remaining gap on each lip."""
    columns, upper, lower = lip_gaps(skin, lips)
    gap = np.nan_to_num(upper[:, 0] - lower[:, 0]) + PRESS_MM
    gap = gaussian_filter1d(gap, 1.0)
    share = lips.lower
    x = skin.vertices[:, 0]
    moved = np.zeros_like(skin.vertices)
    for sign, rim in ((-1.0, upper), (1.0, lower)):
        line = np.stack(
            [np.interp(x, columns, np.nan_to_num(rim[:, k], nan=float(np.nanmean(rim[:, k])))) for k in (0, 1)], 1
        )
        off = np.linalg.norm((skin.vertices[:, 1:] - line) * [1.0, 0.7], axis=1)
        reach = np.exp(-((off / REACH_MM) ** 2)) * np.clip(sign * share, 0, 1) * (np.abs(x) < columns.max())
        moved[:, 1] += sign * 0.5 * reach * np.interp(x, columns, gap)
    return moved
