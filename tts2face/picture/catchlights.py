"""Catchlights: a small light in the upper third of what is seen of each iris, on the side of the key light.

Animators place them so; the mirror image of a lamp leaves the iris with the gaze and with turns of the head.
"""

import math
from bisect import bisect_right
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import UNIT, ZERO, inlined_kernel

# Columns of a row: two axes across the line of sight, the place along them, one over the radius, and the strength.
RIGHT, UP, PLACE_RIGHT, PLACE_UP, SCALE, STRENGTH = 0, 3, 6, 7, 8, 9
N_CATCHLIGHT_COLUMNS = 10
HEIGHT_SHARE, ASIDE_SHARE = 0.74, 0.34  # of the height seen of the iris, from below, and of half its width, to the side
# radius over the iris's, by the radius of the eyeball over the distance of the eyes: drawn ones shine
SIZE_OF_EYE = 0.6
SIZES, LONE_EYE = (0.15, 0.22), 0.18  # limits of that radius, and that of a face with one eye
MOST_OF_SEEN = 0.24  # of the height seen of the iris: its radius under narrow lids
SMALL, WHOLE = 0.1, 1.2  # heights seen, over the iris's radius, between which it grows
HIDDEN, CLEAR = 0.06, 0.3  # those between which it appears
AWAY, TOWARDS = 0.05, 0.35  # cosines of the gaze from the line of sight between which it appears
SOFT = 0.45  # of its radius, over which it fades
FIRST_AXIS = np.array([1.0, 0.0, 0.0])


def catchlight_sizes(centres: NDArray[np.floating], radius: NDArray[np.floating]) -> NDArray[np.float64]:
    """(E,) radii of catchlights over those of the irises, of eyes with centres (E, 3) and a radius (E,)."""
    if len(centres) < 2:
        return np.full(len(centres), LONE_EYE)
    apart = max(float(np.linalg.norm(np.ptp(centres, axis=0))), 1e-3)
    return np.clip(SIZE_OF_EYE * np.asarray(radius, np.float64) / apart, *SIZES)


def place_catchlight(
    centre: NDArray[np.floating],
    gaze: NDArray[np.floating],
    lids: NDArray[np.floating] | None,
    iris: tuple[float, float],
    side: float,
) -> NDArray[np.float64]:
    """Row (N_CATCHLIGHT_COLUMNS,) of an eye in camera space (x right, y down, z ahead).

    Parameters
    ----------
    centre, gaze : (3,)
        Of the eyeball, mm, and a unit vector.
    lids : (2, L, 3)
        Edges of the upper and the lower lid from the centre, over the eyeball's radius; None without.
    iris
        Cosine of the angle between gaze and the edge of the iris, and the catchlight's size from `catchlight_sizes`.
    side
        Of the key light, from -1, the left of the picture, to 1.
    """
    row = np.zeros(N_CATCHLIGHT_COLUMNS)
    axes = row[:PLACE_RIGHT].reshape(2, 3)
    sight = centre / np.sqrt(centre.dot(centre))
    right = FIRST_AXIS - sight[0] * sight
    right /= np.sqrt(right.dot(right))
    (a, b, c), (d, e, f) = right, sight
    axes[0], axes[1] = right, (b * f - c * e, c * d - a * f, a * e - b * d)
    towards = -float(gaze @ sight)
    x, y = (axes @ gaze * iris[0]).tolist()
    radius = math.sqrt(1 - iris[0] ** 2)
    # the iris is seen as an ellipse, narrow along the way from the eye's middle
    away, narrow = max(x * x + y * y, 1e-12), 1 - max(towards, 0.0) ** 2
    wide, high = (radius * math.sqrt(1 - narrow * of**2 / away) for of in (x, y))
    left, end = x - wide, x + wide
    edges = [] if lids is None else [sorted(lid) for lid in (lids @ axes.T).tolist()]
    if edges:
        left, end = max(left, min(lid[0][0] for lid in edges)), min(end, max(lid[-1][0] for lid in edges))
    across = (left + end) / 2 + side * ASIDE_SHARE * max(end - left, 0.0) / 2
    half = high * math.sqrt(max(1 - ((across - x) / max(wide, 1e-6)) ** 2, 0.0))
    low, top = y - half, y + half
    if edges:
        upper, lower = (_height(lid, across) for lid in edges)
        low, top = max(low, lower), min(top, upper)
    seen = max(top - low, 0.0)
    size = min(iris[1] * radius * _rise(seen / radius, SMALL, WHOLE), MOST_OF_SEEN * seen)
    row[PLACE_RIGHT], row[PLACE_UP] = across, low + HEIGHT_SHARE * seen
    row[SCALE] = 1 / max(size, 1e-3)
    row[STRENGTH] = _rise(seen / radius, HIDDEN, CLEAR) * _rise(towards, AWAY, TOWARDS)
    return row


def _height(edge: list[list[float]], across: float) -> float:
    """Height at a place across of an edge whose points [across, height] are sorted, as `numpy.interp` gives it."""
    after = bisect_right(edge, across, key=itemgetter(0))
    if after in (0, len(edge)):
        return edge[0 if after == 0 else -1][1]
    (x0, y0), (x1, y1) = edge[after - 1 : after + 1]
    return (y1 - y0) / (x1 - x0) * (across - x0) + y0


def _rise(value: float, low: float, high: float) -> float:
    """`tts2face.numeric.arrays.smoothstep` of a number."""
    share = min(max((value - low) / (high - low), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


@inlined_kernel
def catchlight(eye: Array, at: int, x: Any, y: Any, z: Any) -> Any:
    """Share, 0 to 1, of a catchlight at a normal (x, y, z) of an eyeball, whose row has it from column `at` on."""
    right = eye[at + RIGHT] * x + eye[at + RIGHT + 1] * y + eye[at + RIGHT + 2] * z - eye[at + PLACE_RIGHT]
    up = eye[at + UP] * x + eye[at + UP + 1] * y + eye[at + UP + 2] * z - eye[at + PLACE_UP]
    off = np.sqrt(right * right + up * up) * eye[at + SCALE]
    share = min(max((UNIT + np.float32(SOFT) - off) * np.float32(1 / (2 * SOFT)), ZERO), UNIT)
    return eye[at + STRENGTH] * share * share * (np.float32(3) - np.float32(2) * share)
