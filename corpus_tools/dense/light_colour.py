"""Colour of the light in videos, estimated from skin and eyes, and colours without it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.skin_canvas import polygon_depth
from corpus_tools.dense.skin_colour import sample_picture
from tts2face.models.landmarks import LID_RINGS
from tts2face.numeric.arrays import (
    LUMINANCE,
    FloatArray,
    Mask,
    decode_srgb,
    encode_light,
    encode_srgb,
    smoothstep,
)

DARKEST = 0.004  # linear light, added before logarithms: noise of dark pixels has no colour
# log R/G and B/G in neutral light. Skin: between light and dark skin of a colour chart (.57 -.31; .71 -.37), and
# rendered people of all tones (.53 to .89, -.32 to -.66): tones differ in luminance far more than in these. White of
# the eye: median of rendered people. What is within the spread of either is no cast.
SKIN_CHROMA, SKIN_SPREAD = np.array([0.67, -0.45]), np.array([0.18, 0.10])
SCLERA_CHROMA, SCLERA_SPREAD = np.array([0.18, -0.11]), np.array([0.10, 0.05])
SKIN_ALONE = 0.5  # share of the skin's cast that is corrected where no white of the eye is seen
SKIN_LANDMARKS = (50, 280, 205, 425, 151, 9, 108, 337)  # cheeks and forehead
IRISES = ((468, (469, 470, 471, 472)), (473, (474, 475, 476, 477)))  # centre and rim, as in LID_RINGS
MIN_IRIS_PX = 3.5  # radius; below it iris, lashes and white are mixed
IRIS_RING, IRIS_TOP = (0.4, 0.9), 0.35  # of the radius: between pupil and limbus, below the lashes' shadow
MIN_BRIGHT = 0.6  # share of the ring
PUPIL = 0.25  # of the light of the ring's brighter cells: less is a wide pupil, as drawn people have
OFF_IRIS, OFF_LIDS = 1.35, 0.18  # of the radius: what is white of the eye, and how far lids reach into it
# Drawn eyes are open by so many radii of what the tracker takes for the iris (2.0 to 2.35; people by 1.4 to 1.8), which
# is their pupil; the coloured part lies beyond it, lit below.
DRAWN_OPEN, DRAWN_REACH = 1.9, 1.9
LIT_WHITE, OFF_WHITE = 0.97, 0.3  # quantile of luminance that is white or catchlight; most light of an iris, of that
BRIGHT_RIM = 1  # samples around both, which are mixed
DRAWN_BRIGHT, DRAWN_PUPIL = (
    0.95,
    0.4,
)  # quantile of the brightest drawn iris, and the light of it that a pupil has at most
IRIS_MIX_PX = 0.5  # over the radius: share of the surroundings' light; rendered eyes have .05 to .1 at 5 px
MIN_OWN_LIGHT = 0.5  # of what is seen
# quantiles of luminance: white without shadow, that of a whole drawn eye, iris without catchlights
BRIGHT_WHITE, DRAWN_WHITE, PLAIN_IRIS = (0.6, 1.0), (0.9, 1.0), (0.2, 0.8)
# of a colour, below which its median is noise
MIN_PIXELS = 6
# Skin of cheeks and forehead in the renderer's studio light is gain * texture ** power in linear light, by channel:
# least squares of logarithms over the head's eight identities, residuals .1. The tone curve compresses red.
STUDIO_GAIN, STUDIO_POWER = np.array([1.02, 1.36, 1.51]), np.array([0.70, 0.96, 1.04])
GLOSSY = (1.1, 1.25)  # of the skin's luminance, between which gloss begins to be removed
FEW_PLAIN = 0.02  # share of places without gloss, around a place, that counts as much as the usual skin
SKIN_SHARE = (0.2, 0.7)  # of the skin's luminance: hair and shadow up to the first, skin from the second
EYE_GRID = (41, 25)  # samples across and down an eye


@dataclass(frozen=True, slots=True, eq=False)
class EyeColours:
    """Colours (3,), `log_colour`, of skin, white of the eye and iris; those that are not seen are NaN; radius in px.

    `is_drawn` where the eyes are open as drawn people's are.
    """

    skin: FloatArray
    sclera: FloatArray
    iris: FloatArray
    radius_px: float
    is_drawn: bool = False


def log_colour(srgb: NDArray[np.floating]) -> FloatArray:
    """(..., 3) logarithms of luminance, R/G and B/G in linear light, of colours (..., 3), sRGB 0..255."""
    light = decode_srgb(np.clip(srgb, 0.0, 255.0) / 255.0) + DARKEST
    green = light[..., 1]
    found: FloatArray = np.log(np.stack([light @ LUMINANCE, light[..., 0] / green, light[..., 2] / green], axis=-1))
    return found


def linear_light(colour: FloatArray) -> FloatArray:
    """Linear light (..., 3) of `log_colour` values."""
    ratio = np.exp(np.stack([colour[..., 1], np.zeros(colour.shape[:-1]), colour[..., 2]], axis=-1))
    light: FloatArray = ratio * (np.exp(colour[..., 0]) / (ratio @ LUMINANCE))[..., None] - DARKEST
    return light


def srgb_colour(colour: FloatArray) -> NDArray[np.uint8]:
    """8-bit sRGB (..., 3) of `log_colour` values."""
    return encode_srgb(linear_light(colour))


def sample_eyes(picture: NDArray[np.uint8], points: NDArray[np.floating]) -> EyeColours:
    """Colours of skin, sclera and iris in a picture (H, W, 3) with landmarks (478, 3) in pixels."""
    places = points[:, :2].astype(np.float64)
    skin = np.median(log_colour(sample_picture(picture, places[list(SKIN_LANDMARKS)])[0]), axis=0)
    whites, irises, radii = [], [], []
    for number, lids in enumerate(LID_RINGS):
        middle, opening, radius = places[IRISES[number][0]], places[list(lids)], _radius(places, number)
        low, high = opening.min(axis=0), opening.max(axis=0)
        across, down = (np.linspace(low[axis], high[axis], EYE_GRID[axis]) for axis in (0, 1))
        grid = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)
        colours = log_colour(sample_picture(picture, grid)[0])
        off = np.linalg.norm(grid - middle, axis=1) / radius
        is_open = polygon_depth(grid, opening, radius) > OFF_LIDS * radius
        is_drawn = _is_drawn(opening, radius)
        if is_drawn:
            ring = _drawn_ring(colours, is_open, off < DRAWN_REACH)
            whites.append(_median_between(colours[is_open], DRAWN_WHITE))
        else:
            ring = is_open & (off > IRIS_RING[0]) & (off < IRIS_RING[1]) & (grid[:, 1] > middle[1] - IRIS_TOP * radius)
            whites.append(_median_between(colours[is_open & (off > OFF_IRIS)], BRIGHT_WHITE))
        irises.append(_median_between(_without_pupil(colours[ring], is_drawn=is_drawn), PLAIN_IRIS))
        radii.append(radius)
    return EyeColours(skin, _mean_known(whites), _mean_known(irises), float(np.mean(radii)), are_drawn(points))


def are_drawn(points: NDArray[np.floating]) -> bool:
    """Whether both eyes of landmarks (478, 3) in pixels are open as drawn people's are."""
    places = points[:, :2].astype(np.float64)
    return all(_is_drawn(places[list(lids)], _radius(places, number)) for number, lids in enumerate(LID_RINGS))


def _radius(places: FloatArray, number: int) -> float:
    """Radius of an iris, px, in landmarks (478, 2)."""
    centre, rim = IRISES[number]
    return float(np.linalg.norm(places[list(rim)] - places[centre], axis=1).mean())


def _is_drawn(opening: FloatArray, radius: float) -> bool:
    """Whether lids (N, 2) are open as a drawn eye's, whose iris the tracker reads with such a radius, px."""
    return bool(np.ptp(opening[:, 1]) > DRAWN_OPEN * radius)


def _drawn_ring(colours: FloatArray, is_open: Mask, is_near: Mask) -> Mask:
    """(N,) samples near the middle of a drawn eye that may be iris, off the white and off catchlights."""
    from scipy.ndimage import binary_dilation

    white = np.quantile(colours[is_open, 0], LIT_WHITE) if is_open.any() else 0.0
    is_bright = (colours[:, 0] > white + np.log(OFF_WHITE)).reshape(EYE_GRID[::-1])
    return np.asarray(is_open & is_near & ~binary_dilation(is_bright, iterations=BRIGHT_RIM).ravel())


def _without_pupil(ring: FloatArray, *, is_drawn: bool) -> FloatArray:
    """Colours (N, 3) of a ring of the iris that are not as dark as a pupil beside its brighter ones."""
    if not len(ring):
        return ring
    brightest = DRAWN_BRIGHT if is_drawn else PLAIN_IRIS[1]
    bright: FloatArray = ring[
        ring[:, 0] > np.quantile(ring[:, 0], brightest) + np.log(DRAWN_PUPIL if is_drawn else PUPIL)
    ]
    # where few cells are so bright, they are reflections in a dark iris
    return bright if is_drawn or len(bright) > MIN_BRIGHT * len(ring) else ring


def _median_between(colours: FloatArray, quantiles: tuple[float, float]) -> FloatArray:
    if len(colours) < MIN_PIXELS:
        return np.full(3, np.nan)
    low, high = np.quantile(colours[:, 0], quantiles)
    middle: FloatArray = np.median(colours[(colours[:, 0] >= low) & (colours[:, 0] <= high)], axis=0)
    return middle


def _mean_known(colours: list[FloatArray]) -> FloatArray:
    known = [colour for colour in colours if np.isfinite(colour).all()]
    return np.asarray(np.mean(known, axis=0) if known else np.full(3, np.nan), np.float64)


def median_eyes(seen: list[EyeColours]) -> EyeColours:
    """The medians of many frames."""
    skin, sclera, iris = (
        _median_known([getattr(observed, name) for observed in seen]) for name in ("skin", "sclera", "iris")
    )
    radius = float(np.median([observed.radius_px for observed in seen]))
    return EyeColours(skin, sclera, iris, radius, 2 * sum(observed.is_drawn for observed in seen) > len(seen))


def clear_iris(eyes: EyeColours) -> FloatArray:
    """Colour (3,), `log_colour`, of the iris without the light of skin and white that a small picture mixes into it.

    Samples of drawn irises lie off both.
    """
    if eyes.is_drawn:
        return eyes.iris
    share = IRIS_MIX_PX / eyes.radius_px
    around = linear_light(eyes.skin)
    if np.isfinite(eyes.sclera).all():
        around = (around + linear_light(eyes.sclera)) / 2
    seen = linear_light(eyes.iris)
    own = np.maximum((seen - share * around) / (1.0 - share), MIN_OWN_LIGHT * seen)
    return log_colour(255.0 * encode_light(own))


def _median_known(colours: list[FloatArray]) -> FloatArray:
    known = [colour for colour in colours if np.isfinite(colour).all()]
    return np.asarray(np.median(known, axis=0) if known else np.full(3, np.nan), np.float64)


def estimate_cast(eyes: EyeColours) -> FloatArray:
    """(2,) cast of the light: the logarithms by which it raises R/G and B/G.

    Skin and white of the eye each tell it, and each may err: a skin is ruddy or olive, a white is mixed with lids and
    reddened. Where they do not agree in direction, there is none; where they do, it is their mean in B/G and the
    smaller one in R/G.
    """
    of_skin = _beyond(eyes.skin[1:] - SKIN_CHROMA, SKIN_SPREAD)
    if not np.isfinite(eyes.sclera).all():
        return SKIN_ALONE * of_skin
    of_white = _beyond(eyes.sclera[1:] - SCLERA_CHROMA, SCLERA_SPREAD)
    # only a cast that skin and white of the eye agree on is corrected (decision 034)
    smaller = np.sign(of_skin) * np.minimum(np.abs(of_skin), np.abs(of_white))
    agreed = np.array([smaller[0], (of_skin[1] + of_white[1]) / 2])
    return np.where(of_skin * of_white > 0, agreed, 0.0)


def _beyond(off: FloatArray, spread: FloatArray) -> FloatArray:
    return np.sign(off) * np.maximum(np.abs(off) - spread, 0.0)


def remove_cast(srgb: FloatArray, cast: FloatArray, skin: FloatArray) -> FloatArray:
    """Colours (..., 3), sRGB 0..255, as in neutral light; the luminance of a `skin`, `log_colour`, stays the same."""
    gains = np.exp([-cast[0], 0.0, -cast[1]])
    before = np.exp([skin[1], 0.0, skin[2]])
    gains *= (before @ LUMINANCE) / ((before * gains) @ LUMINANCE)
    return 255.0 * encode_light(decode_srgb(np.clip(srgb, 0.0, 255.0) / 255.0) * gains)


def skin_texture(srgb: FloatArray, blurred: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Colours (N, 3) of a texture, sRGB 0..255, of a face whose skin looks so in the renderer's studio light.

    `blurred` gives means (N, D) of values (N, D) around each place: under gloss lies what lies around it. Hair,
    brows and shadows, which are darker than skin, keep their hue.
    """
    light = decode_srgb(np.clip(srgb, 0.0, 255.0) / 255.0)
    usual = np.median(light, axis=0)
    plain = 1.0 - smoothstep(light @ LUMINANCE / (usual @ LUMINANCE), *GLOSSY)[:, None]
    sums = blurred(np.column_stack([plain, plain * light]))
    around = (sums[:, 1:] + FEW_PLAIN * usual) / (sums[:, :1] + FEW_PLAIN)
    light = without_gloss(light, around)
    gains = (usual / STUDIO_GAIN) ** (1.0 / STUDIO_POWER) / usual
    grey = (gains * usual) @ LUMINANCE / (usual @ LUMINANCE)
    is_skin = smoothstep(light @ LUMINANCE / (usual @ LUMINANCE), *SKIN_SHARE)
    return 255.0 * encode_light(light * grey * (gains / grey) ** is_skin[:, None])


def without_gloss(light: FloatArray, usual: FloatArray) -> FloatArray:
    """Linear light (N, 3) of skin without what is white in places lighter than the usual (3,) or (N, 3) skin.

    Shafer 1985, the dichromatic reflection model: light is a multiple of the skin's colour and a share of the lamp's,
    which is white here. Wrinkles and shadows, which are darker, stay.
    """
    skin = np.maximum((light[:, 0] - light[:, 2]) / np.maximum(usual[..., 0] - usual[..., 2], DARKEST), GLOSSY[0])
    share = smoothstep(light @ LUMINANCE / (usual @ LUMINANCE), *GLOSSY)[:, None]
    found: FloatArray = light + share * (np.minimum(light, skin[:, None] * usual) - light)
    return found
