"""Inner lips on the mesh: facing points of both lips where they touch.

The tracker reads each inner lip to about 2 mm. Gestures and contacts hold eleven gaps between facing points; points
that do not face each other, or that lie apart on lips that touch, bend a mouth that is shut.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from tts2face.interchange.characters.surface_points import SurfacePoints
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.numeric.arrays import FloatArray, Mask

# Of depth, relative to distance: lips meet at the mouth of the crease between them, not where their insides meet.
DEPTH_COST = 0.25
# Places of the pairs between the middle of the mouth and its corners, as on the shipped faces.
COLUMNS = np.array([-1.0, -0.78, -0.65, -0.48, -0.25, 0.0, 0.25, 0.48, 0.65, 0.78, 1.0])
# Relative to the mouth's width.
STEP_SHARE = 0.003  # distance of the points of a cross-section, .15 mm
FINE_SHARE, REACH_SHARE = 0.0003, 0.006  # the same about the nearest points, and how far about them
INSIDE_SHARE = 0.3  # what lies deeper behind the foremost point of a lip is the inside of the mouth
PARTED_SHARE = 0.02  # motion apart of the borders of the lips, from which it separates the upper from the lower lip


def find_lip_line(
    points: SurfacePoints,
    vertices: NDArray[np.floating],
    triangles: NDArray[np.int64],
    opened: NDArray[np.floating],
) -> SurfacePoints:
    """Landmarks of the skin with the inner lips moved to where the lips touch; the others stay.

    Parameters
    ----------
    points
        Landmarks, in the order of their numbers.
    vertices, opened : (V, 3)
        The face at rest, and its displacement by an open mouth, mm: the lower lip moves down with the jaw.
    triangles : (F, 3)
        The skin.

    Notes
    -----
    Each pair lies in a cross-section of the lips: the nearest points of the upper and the lower lip, of touching ones
    the foremost.
    """
    rest, motion = vertices.astype(np.float64), opened.astype(np.float64)
    places, drops = points.places(rest), points.places(motion)[:, 1]
    left, right = places[MOUTH_CORNER_LEFT], places[MOUTH_CORNER_RIGHT]
    width = float(np.linalg.norm(left - right))
    columns = (left[0] + right[0]) / 2 + abs(left[0] - right[0]) / 2 * COLUMNS
    found = SurfacePoints(points.vertices.copy(), points.weights.copy())
    pairs = zip(INNER_LIP_UPPER, INNER_LIP_LOWER, OUTER_LIP_UPPER, OUTER_LIP_LOWER, columns.tolist(), strict=True)
    for upper, lower, above, below, x in pairs:
        if upper == lower or drops[above] - drops[below] < PARTED_SHARE * width:
            continue
        section = _cross_section(rest, triangles, x, STEP_SHARE * width)
        there, is_upper = section.places(rest), section.places(motion)[:, 1] > (drops[above] + drops[below]) / 2
        between = (there[:, 1] > places[below, 1]) & (there[:, 1] < places[above, 1])
        sides = [_outside(between & lip, there[:, 2], width) for lip in (is_upper, ~is_upper)]
        if not all(side.any() for side in sides):
            continue
        lips = [SurfacePoints(section.vertices[side], section.weights[side]) for side in sides]
        nearest = [lip.places(rest)[at] for lip, at in zip(lips, _nearest(lips, rest), strict=True)]
        fine = []
        for lip, place in zip(lips, nearest, strict=True):
            is_near = np.linalg.norm(lip.places(rest) - place, axis=1) < REACH_SHARE * width
            around = np.unique(lip.vertices[is_near], axis=0)
            fine.append(_cross_section(rest, around, x, FINE_SHARE * width))
        for number, lip, at in zip((upper, lower), fine, _nearest(fine, rest), strict=True):
            found.vertices[number], found.weights[number] = lip.vertices[at], lip.weights[at]
    return found


def _outside(lip: Mask, depth: FloatArray, width: float) -> Mask:
    """Those points of a lip that are not inside the mouth."""
    outside: Mask = lip & (depth > depth[lip].max(initial=-np.inf) - INSIDE_SHARE * width)
    return outside


def _nearest(lips: list[SurfacePoints], rest: FloatArray) -> tuple[int, int]:
    """Indices of the points of both lips where they meet."""
    upper, lower = (lip.places(rest) for lip in lips)
    cost = cdist(upper, lower) - DEPTH_COST * (upper[:, 2, None] + lower[:, 2]) / 2
    return divmod(int(cost.argmin()), len(lower))


def _cross_section(rest: FloatArray, triangles: NDArray[np.int64], x: float, step: float) -> SurfacePoints:
    """Points at distances of at most `step` along the lines in which a plane of one x cuts triangles."""
    side = rest[triangles, 0] - x
    is_cut = (side.min(axis=1) < 0) & (side.max(axis=1) >= 0)
    cut, side = triangles[is_cut], side[is_cut]
    # the corner that is alone on its side; both ends lie on its edges
    signs = side < 0
    alone = np.where(signs.sum(axis=1) == 1, signs.argmax(axis=1), (~signs).argmax(axis=1))
    row = np.arange(len(cut))
    ends = np.zeros((len(cut), 2, 3))
    for end in (0, 1):
        other = (alone + 1 + end) % 3
        share = side[row, alone] / (side[row, alone] - side[row, other])
        ends[row, end, alone], ends[row, end, other] = 1.0 - share, share
    places = np.einsum("fek,fkd->fed", ends, rest[cut])
    counts = np.ceil(np.linalg.norm(places[:, 0] - places[:, 1], axis=1) / step).astype(np.int64) + 1
    of = np.repeat(row, counts)
    rank = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    along = (rank / np.maximum(counts[of] - 1, 1))[:, None]
    return SurfacePoints(cut[of], (1.0 - along) * ends[of, 0] + along * ends[of, 1])
