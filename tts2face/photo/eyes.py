"""Eyes of a photograph: a picture of each, as if there were no lids, on a patch that lies behind them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, label
from scipy.spatial import ConvexHull

from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, Pixels, points_in_polygon, smoothstep
from tts2face.photo.lines import LidLines, colours_at
from tts2face.photo.mesh import grid_triangles

IRISES = ((468, 469, 470, 471, 472), (473, 474, 475, 476, 477))  # middle and edge of the irises, right and left
SIDES = ("Right", "Left")
MARGIN = 0.12  # of the eye distance around the opening, and the radius of the iris
FINE = 3  # places along a pixel's side at which its share of the opening is counted
SCLERA_FROM = 1.12  # radii of the iris from its middle
IRIS_EDGE = (0.98, 1.28)  # over which the iris fades into the sclera
N_RINGS, N_RINGS_INSIDE = 10, 8  # whose mean colours complete the iris, and those within its radius
RING_WIDTH, LEAST_IN_RING = 0.1, 3  # radii to either side of a ring, and pixels for its own colour
LEAST_SEEN = 12  # pixels of the sclera for its own colours
SCLERA_SCALE = 8.0  # of the places of its polynomial, of the eye distance
SCLERA_RIDGE = np.array([0.0005, 0.05, 0.05, 0.05])  # that keeps its terms small
SCLERA_LIMITS = (10, 97)  # per cent of its colours, between which it stays
DARK_SHARE, DARK_WEIGHT = 35, 0.15  # per cent of its pixels that lids shade, and how much they count
WHITE_SHARES = (82, 97)  # per cent of an eye's pixels are less light than those of its white
SHADE_FADE = 0.03  # of the eye distance, over which the shadow of the lids goes on beyond them
GAZE_FADE = (1.2, 3.2)  # radii around the iris that turn with it, and beyond which nothing does
# shares of a pixel within the opening: for colours, for the white, and as seen
WHOLE = 0.99
MOSTLY = 0.5
SHOWN = 0.4
SHADE_BLUR_PX = 0.7  # of that shadow
CATCHLIGHT_IRIS_PX = 9.0  # radius of an iris on which catchlights are sharp enough to lie still
CATCHLIGHT_WITHIN, CATCHLIGHT_REACH = 0.95, 1.2  # radii of the iris, in which its peak and all of it lie
CATCHLIGHT_LEAST, CATCHLIGHT_OVER_WHITE = 45.0, 8.0  # of 255, its peak over the iris around it, and over the white
CATCHLIGHT_EDGE, CATCHLIGHT_PEAKS = 0.3, 0.6  # of the highest peak: the edge of one, and the least peak of others
BRIGHT_WHITE = 95  # per cent of the white of the eye are darker than what catchlights are compared with
CATCHLIGHT_SOLID = 0.55  # of the area of the polygon around one, which crescents of the white do not fill
CATCHLIGHT_SHARES = (0.004, 0.2)  # of the area of the iris
CATCHLIGHT_RIM_PX = 0.9  # by which a catchlight is widened
CATCHLIGHT_FOLLOW = 0.45  # of the iris's motion: so moves the middle of the cornea's sphere, which mirrors the lamp
CATCHLIGHT_AHEAD_MM = 1.0  # of the eye: what moves behind it must not come through
EYE_RADIUS_MM = 12.0
EYE_BEHIND_MM = 1.5  # the skin around it
N_CATCHLIGHT = 8  # directions in which a catchlight is widened
N_COLUMNS, N_ROWS = 25, 17  # vertices of a patch


@dataclass(frozen=True, slots=True, eq=False)
class EyePatch:
    """Picture (h, w, 3) of an eye, or of a catchlight before it, on a grid of places (N, 2), pixels.

    ``corner`` is where its left top pixel lies, ``white`` (3,) the colour of the eye's white, and ``turning`` (N,) the
    share of a turn of the gaze that the places follow. It lies ``ahead_mm`` before the eye.
    """

    picture: Pixels
    white: FloatArray
    corner: tuple[int, int]
    places: FloatArray
    turning: FloatArray
    triangles: IntArray
    ahead_mm: float = 0.0

    def colours(self) -> FloatArray:
        """(N, 3) colours of the picture at the places."""
        return colours_at(self.picture.astype(np.float64), self.places - self.corner)


def eye_patches(pixels: Pixels, landmarks: FloatArray, lids: LidLines, scale: float) -> list[list[EyePatch]]:
    """Patches of the person's right and left eye, each before those of catchlights that stay, if both have some."""
    found = [_patches(pixels, landmarks, lids, (eye, scale), stay=True) for eye in (0, 1)]
    if min(len(patches) for patches in found) > 1:
        return found
    return [_patches(pixels, landmarks, lids, (eye, scale), stay=False) for eye in (0, 1)]


def _patches(
    pixels: Pixels, landmarks: FloatArray, lids: LidLines, of_eye: tuple[int, float], *, stay: bool
) -> list[EyePatch]:
    """Patch of an eye, and those of its catchlights, if they shall stay."""
    eye, scale = of_eye
    polygon = np.concatenate([lids.upper[eye], lids.lower[eye][::-1]])[:, :2]
    middle = landmarks[IRISES[eye][0], :2]
    radius = float(np.linalg.norm(landmarks[list(IRISES[eye][1:]), :2] - middle, axis=1).mean())
    margin = MARGIN * scale + radius
    limits = np.array(pixels.shape[1::-1])
    low = np.clip(np.floor(polygon.min(axis=0) - margin).astype(int), 0, limits - 2)
    high = np.clip(np.ceil(polygon.max(axis=0) + margin).astype(int) + 1, low + 2, limits)
    part = pixels[low[1] : high[1], low[0] : high[0]]
    shown = _without_lids(part, polygon - low, (middle - low, radius), scale, stay=stay)
    across, down = np.meshgrid(np.linspace(low[0], high[0] - 1, N_COLUMNS), np.linspace(low[1], high[1] - 1, N_ROWS))
    places = np.column_stack([across.ravel(), down.ravel()])
    away = np.linalg.norm(places - middle, axis=1) / radius
    turning = 1 - smoothstep(away, *GAZE_FADE)
    triangles = grid_triangles(np.arange(N_ROWS * N_COLUMNS).reshape(N_ROWS, N_COLUMNS))
    corner = (int(low[0]), int(low[1]))
    picture = np.rint(shown.picture).clip(0, 255).astype(np.uint8)
    found = [EyePatch(picture, shown.white, corner, places, turning, triangles)]
    for ring in shown.catchlights:
        fan = np.arange(len(ring))
        triangles = np.column_stack([np.full(len(ring), len(ring)), np.roll(fan, -1), fan])
        spot = np.concatenate([ring, ring.mean(axis=0, keepdims=True)]) + low
        follow = np.full(len(spot), CATCHLIGHT_FOLLOW)
        found.append(EyePatch(part, shown.white, corner, spot, follow, triangles, CATCHLIGHT_AHEAD_MM))
    return found


def gaze_shapes(head: Face, turning: FloatArray, eye: int) -> Mapping[str, FloatArray]:
    """Displacements (N, 3), mm, of a patch by the shapes of gaze that turn an eye of the head."""
    found = {}
    for own in head.eyes:
        for name, turn in own.turns.items():
            if name.endswith(SIDES[eye]):
                found[name] = turning[:, None] * np.cross(turn, (0.0, 0.0, EYE_RADIUS_MM))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """An eye without lids and catchlights: its picture (h, w, 3), its white (3,), and their polygons (M, 2)."""

    picture: FloatArray
    white: FloatArray
    catchlights: list[FloatArray]


def _without_lids(
    part: Pixels, polygon: FloatArray, iris: tuple[FloatArray, float], scale: float, *, stay: bool
) -> _Shown:
    """An eye whose opening is a polygon (N, 2), completed beyond it, and under catchlights that shall stay."""
    middle, radius = iris
    height, width = part.shape[:2]
    colours = part.astype(np.float64)
    down, across = np.mgrid[:height, :width].astype(np.float64)
    opening = _coverage((height, width), polygon)
    inside = opening > WHOLE
    away = np.hypot(across - middle[0], down - middle[1]) / radius
    sclera = _sclera(colours, inside & (away > SCLERA_FROM), (across - middle[0], down - middle[1]), scale)
    if sclera is None:
        sclera = np.broadcast_to(
            np.median(colours[inside], axis=0) if inside.any() else colours.mean((0, 1)), part.shape
        )
    ring_iris = _rings(colours, inside & (away < SCLERA_FROM), away)
    share = (1 - smoothstep(away, *IRIS_EDGE))[..., None]
    base = sclera * (1 - share) + ring_iris * share
    white = _white(colours, opening > MOSTLY)
    if not inside.any():
        return _Shown(base, white, [])
    catchlights = _catchlights(colours, base, inside, away, radius) if stay else []
    known = opening > SHOWN
    for ring in catchlights:
        known &= _coverage((height, width), ring) == 0
    way, nearest = distance_transform_edt(~known, return_indices=True)
    shade = (colours - base)[nearest[0], nearest[1]] * np.exp(-way / (SHADE_FADE * scale))[..., None]
    beyond = gaussian_filter(shade, (SHADE_BLUR_PX, SHADE_BLUR_PX, 0))
    return _Shown(base + np.where(known[..., None], colours - base, beyond), white, catchlights)


def _catchlights(
    colours: FloatArray, base: FloatArray, is_seen: Mask, away: FloatArray, radius: float
) -> list[FloatArray]:
    """Polygons (M, 2) around the brightest spots on an iris, pixels, as the axes of the picture turn.

    They are brighter than the white of the eye, round, and brighter than a smooth picture `base` (h, w, 3) of the eye;
    `away` (h, w) is the way from the middle of the iris in its radii.
    """
    light, more = colours.mean(axis=2), np.where(is_seen, (colours - base).mean(axis=2), 0.0)
    white = light[is_seen & (away > SCLERA_FROM)]
    is_peak = is_seen & (away < CATCHLIGHT_WITHIN)
    is_peak &= light > CATCHLIGHT_OVER_WHITE + (np.percentile(white, BRIGHT_WHITE) if len(white) else 0.0)
    highest = float(np.where(is_peak, more, 0.0).max(initial=0.0))
    if highest < CATCHLIGHT_LEAST or radius < CATCHLIGHT_IRIS_PX:
        return []
    spots, _ = label(more > CATCHLIGHT_EDGE * highest)
    circle = np.linspace(0, 2 * np.pi, N_CATCHLIGHT, endpoint=False)
    around = CATCHLIGHT_RIM_PX * np.column_stack([np.cos(circle), np.sin(circle)])
    rings = []
    for number in np.unique(spots[is_peak & (more > CATCHLIGHT_PEAKS * highest)]):
        spot = spots == number
        hull = ConvexHull((np.argwhere(spot)[:, None, ::-1] + around).reshape(-1, 2))
        area = float(spot.sum())
        is_round = area > CATCHLIGHT_SOLID * hull.volume
        low, high = CATCHLIGHT_SHARES
        if is_round and low < area / (np.pi * radius**2) < high and away[spot].max() < CATCHLIGHT_REACH:
            rings.append(hull.points[hull.vertices])
    return rings


def _sclera(colours: FloatArray, seen: Mask, off: tuple[FloatArray, FloatArray], scale: float) -> FloatArray | None:
    """Colours (h, w, 3) of the white of the eye: a polynomial through what is seen of it."""
    if int(seen.sum()) <= LEAST_SEEN:
        return None
    across, down = (way / scale * SCLERA_SCALE for way in off)
    terms = np.stack([np.ones_like(across), across, down, across**2], axis=-1)
    rows, values = terms[seen], colours[seen]
    brightness = values.mean(axis=1)
    weights = np.where(brightness < np.percentile(brightness, DARK_SHARE), DARK_WEIGHT, 1.0)[:, None]
    ridge = np.diag(SCLERA_RIDGE) * len(rows)
    factors = np.linalg.solve((rows * weights).T @ rows + ridge, (rows * weights).T @ values)
    limits = np.percentile(values, SCLERA_LIMITS, axis=0)
    return np.clip(terms @ factors, limits[0], limits[1])


def _white(colours: FloatArray, seen: Mask) -> FloatArray:
    """Colour (3,) of the white of an eye: of what is light in all channels, as no iris is, and no catchlight."""
    if not seen.any():
        return np.asarray(colours.mean(axis=(0, 1)))
    every = colours[seen]
    least = every.min(axis=1)
    low, high = np.percentile(least, WHITE_SHARES)
    return np.asarray(np.median(every[(least >= low) & (least <= high)], axis=0))


def _rings(colours: FloatArray, seen: Mask, away: FloatArray) -> FloatArray:
    """Colours (h, w, 3) of an iris that is seen whole: the means of its rings."""
    middles = (np.arange(N_RINGS) + 0.5) / N_RINGS_INSIDE
    profile: list[FloatArray] = []
    for middle in middles:
        ring = seen & (np.abs(away - middle) < RING_WIDTH)
        usual = (
            profile[-1] if profile else np.median(colours[seen], axis=0) if seen.any() else colours.mean(axis=(0, 1))
        )
        profile.append(np.median(colours[ring], axis=0) if int(ring.sum()) > LEAST_IN_RING else usual)
    return np.stack([np.interp(away, middles, np.array(profile)[:, c]) for c in range(3)], axis=-1)


def _coverage(shape: tuple[int, int], polygon: FloatArray) -> FloatArray:
    """(h, w) share of each pixel within a polygon."""
    offsets = (np.arange(FINE) - (FINE - 1) / 2) / FINE
    down, across = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    places = np.column_stack([across.ravel(), down.ravel()])
    shares = [points_in_polygon(places + np.array([right, below]), polygon) for right in offsets for below in offsets]
    return np.asarray(np.mean(shares, axis=0).reshape(shape))
