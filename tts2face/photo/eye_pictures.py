"""Eyes of a photograph: a picture of each, as if there were no lids, on a patch that lies behind them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from tts2face.models.face import Face
from tts2face.numeric import points_in_polygon, smoothstep
from tts2face.photo.lid_lines import LidLines
from tts2face.photo.photo_mesh import grid_triangles

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

IRISES = ((468, 469, 470, 471, 472), (473, 474, 475, 476, 477))  # middle and edge of the irises, right and left
SIDES = ("Right", "Left")
MARGIN = 0.12  # of the eye distance around the opening, and the radius of the iris
FINE = 3  # places along a pixel's side at which its share of the opening is counted
SCLERA_FROM = 1.12  # radii of the iris from its middle
IRIS_EDGE = (0.98, 1.28)  # over which the iris fades into the sclera
N_RINGS = 10  # of the iris, whose mean colours complete it
LEAST_SEEN = 12  # pixels of the sclera for its own colours
DARK_SHARE, DARK_WEIGHT = 35, 0.15  # per cent of its pixels that lids shade, and how much they count
SHADE_FADE = 0.03  # of the eye distance, over which the shadow of the lids goes on beyond them
RIGID_TO, STILL_FROM = 1.2, 3.2  # radii around the iris that turn with it, and beyond which nothing does
EYE_RADIUS_MM = 12.0
BEHIND_MM = 1.5  # the skin around it
N_COLUMNS, N_ROWS = 25, 17  # vertices of a patch


@dataclass(frozen=True, slots=True, eq=False)
class EyePatch:
    """Picture (h, w, 3) of an eye, the colour (3,) of its white, where its left top pixel lies, and its grid (N, 2)."""

    picture: NDArray[np.uint8]
    white: Floats
    corner: tuple[int, int]
    places: Floats
    turning: Floats
    triangles: Ints


def eye_patch(pixels: NDArray[np.uint8], landmarks: Floats, lids: LidLines, eye: int, scale: float) -> EyePatch:
    """Picture and patch of an eye, 0 the person's right one; `turning` (N,) is its share of a turn of the gaze."""
    polygon = np.concatenate([lids.upper[eye], lids.lower[eye][::-1]])[:, :2]
    middle = landmarks[IRISES[eye][0], :2]
    radius = float(np.linalg.norm(landmarks[list(IRISES[eye][1:]), :2] - middle, axis=1).mean())
    margin = MARGIN * scale + radius
    limits = np.array(pixels.shape[1::-1])
    low = np.clip(np.floor(polygon.min(axis=0) - margin).astype(int), 0, limits - 2)
    high = np.clip(np.ceil(polygon.max(axis=0) + margin).astype(int) + 1, low + 2, limits)
    picture, white = _without_lids(
        pixels[low[1] : high[1], low[0] : high[0]], polygon - low, (middle - low, radius), scale
    )
    across, down = np.meshgrid(np.linspace(low[0], high[0] - 1, N_COLUMNS), np.linspace(low[1], high[1] - 1, N_ROWS))
    places = np.column_stack([across.ravel(), down.ravel()])
    away = np.linalg.norm(places - middle, axis=1) / radius
    return EyePatch(
        np.rint(picture).clip(0, 255).astype(np.uint8),
        white,
        (int(low[0]), int(low[1])),
        places,
        1 - smoothstep(away, RIGID_TO, STILL_FROM),
        grid_triangles(np.arange(N_ROWS * N_COLUMNS).reshape(N_ROWS, N_COLUMNS)),
    )


def gaze_shapes(head: Face, turning: Floats, eye: int) -> Mapping[str, Floats]:
    """Displacements (N, 3), mm, of a patch by the shapes of gaze that turn an eye of the head."""
    found = {}
    for own in head.eyes:
        for name, turn in own.turns.items():
            if name.endswith(SIDES[eye]):
                found[name] = turning[:, None] * np.cross(turn, (0.0, 0.0, EYE_RADIUS_MM))
    return found


def _without_lids(
    part: NDArray[np.uint8], polygon: Floats, iris: tuple[Floats, float], scale: float
) -> tuple[Floats, Floats]:
    """Picture (h, w, 3) of an eye whose opening is a polygon (N, 2), completed beyond it, and its white (3,)."""
    middle, radius = iris
    height, width = part.shape[:2]
    colours = part.astype(np.float64)
    down, across = np.mgrid[:height, :width].astype(np.float64)
    opening = _coverage((height, width), polygon)
    inside = opening > 0.99
    away = np.hypot(across - middle[0], down - middle[1]) / radius
    sclera = _sclera(colours, inside & (away > SCLERA_FROM), (across - middle[0], down - middle[1]), scale)
    if sclera is None:
        sclera = np.broadcast_to(
            np.median(colours[inside], axis=0) if inside.any() else colours.mean((0, 1)), part.shape
        )
    ring_iris = _rings(colours, inside & (away < SCLERA_FROM), away)
    share = (1 - smoothstep(away, *IRIS_EDGE))[..., None]
    base = sclera * (1 - share) + ring_iris * share
    white = np.median(np.asarray(sclera)[opening > 0.5], axis=0) if (opening > 0.5).any() else colours.mean(axis=(0, 1))
    if not inside.any():
        return base, white
    inside = opening > 0.4
    way, nearest = distance_transform_edt(~inside, return_indices=True)
    shade = (colours - base)[nearest[0], nearest[1]] * np.exp(-way / (SHADE_FADE * scale))[..., None]
    beyond = gaussian_filter(shade, (0.7, 0.7, 0))
    return base + np.where(inside[..., None], colours - base, beyond), white


def _sclera(colours: Floats, seen: NDArray[np.bool_], off: tuple[Floats, Floats], scale: float) -> Floats | None:
    """Colours (h, w, 3) of the white of the eye: a polynomial through what is seen of it."""
    if int(seen.sum()) <= LEAST_SEEN:
        return None
    across, down = (way / scale * 8 for way in off)
    terms = np.stack([np.ones_like(across), across, down, across**2], axis=-1)
    rows, values = terms[seen], colours[seen]
    brightness = values.mean(axis=1)
    weights = np.where(brightness < np.percentile(brightness, DARK_SHARE), DARK_WEIGHT, 1.0)[:, None]
    ridge = np.diag([0.01, 1, 1, 1]) * len(rows) * 0.05
    factors = np.linalg.solve((rows * weights).T @ rows + ridge, (rows * weights).T @ values)
    limits = np.percentile(values, (10, 97), axis=0)
    return np.clip(terms @ factors, limits[0], limits[1])


def _rings(colours: Floats, seen: NDArray[np.bool_], away: Floats) -> Floats:
    """Colours (h, w, 3) of an iris that is seen whole: the means of its rings."""
    middles = (np.arange(N_RINGS) + 0.5) / (N_RINGS - 2)
    profile: list[Floats] = []
    for middle in middles:
        ring = seen & (np.abs(away - middle) < 0.1)
        usual = (
            profile[-1] if profile else np.median(colours[seen], axis=0) if seen.any() else colours.mean(axis=(0, 1))
        )
        profile.append(np.median(colours[ring], axis=0) if int(ring.sum()) > 3 else usual)
    return np.stack([np.interp(away, middles, np.array(profile)[:, c]) for c in range(3)], axis=-1)


def _coverage(shape: tuple[int, int], polygon: Floats) -> Floats:
    """(h, w) share of each pixel within a polygon."""
    offsets = (np.arange(FINE) - (FINE - 1) / 2) / FINE
    down, across = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    places = np.column_stack([across.ravel(), down.ravel()])
    shares = [points_in_polygon(places + np.array([right, below]), polygon) for right in offsets for below in offsets]
    return np.asarray(np.mean(shares, axis=0).reshape(shape))
