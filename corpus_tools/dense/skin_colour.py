"""The talker's skin colour, averaged over many frames: the dense mesh is fitted to each (eqs 3 and 4).

Colour of the light in videos, estimated from skin and eyes, and colours without it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.mesh_fit import face_landmarks, face_width
from corpus_tools.dense.texels import SkinCanvas, TrackedPictures, eye_opening, polygon_depth
from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.models.landmarks import LID_RINGS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import (
    LUMINANCE,
    decode_srgb,
    encode_light,
    encode_srgb,
    points_in_polygon,
    smoothstep,
    unit_vectors,
    vertex_normals,
)
from tts2face.numeric.splines import DECAY_LENGTH, FACE_WIDTH, rbf_values
from tts2face.types import Progress
from tts2face.video.pose import similarity_transforms

Floats = NDArray[np.float64]
OnFrame = Callable[[NDArray[np.uint8], NDArray[np.float32]], None]

N_FRAMES = 160  # averaged; a few dozen remove the noise of the pictures
FACING_COSINES = (0.15, 0.75)  # cosine between normal and camera at which the weight of a texel starts and is full
MIN_EYE_OPENING = 0.8  # of the median eye opening; frames with less are skipped
REMAP_COLUMNS = 1024  # OpenCV maps pictures, not lists


@dataclass(frozen=True, slots=True, eq=False)
class SkinColours:
    """Numbers (R,) of texels of a canvas that show the talker, their colours (R, 3), sRGB 0..255, and weights (R,)."""

    rows: NDArray[np.int64]
    colour: Floats
    weight: Floats


@dataclass(frozen=True, slots=True, eq=False)
class PictureFitter:
    """Fit of a head's vertices to pictures: a similarity on the landmarks, then eqs 3 and 4 on the residual.

    ``rows`` (V,) are the numbers of these vertices in the face, rising.
    """

    rows: NDArray[np.int64]
    vertices: Floats
    marks: Floats
    used: NDArray[np.int64]
    spread: Floats

    def fit(self, points: NDArray[np.floating]) -> tuple[Floats, Floats]:
        """(V, 3) vertices, x right, y up, z towards the camera in pixels, and the (3, 3) rotation, for (478, 3)."""
        linear, shift, turn = self.pose(points)
        left = self._wanted(points) - (self.marks[self.used] @ linear.T + shift)
        placed: Floats = self.vertices @ linear.T + shift + self.spread @ left
        return placed, turn

    def pose(self, points: NDArray[np.floating]) -> tuple[Floats, Floats, Floats]:
        """Scaled rotation (3, 3) and shift (3,) from the head to such pixels, and the rotation, for (478, 3)."""
        wanted, own = self._wanted(points), self.marks[self.used]
        turns, scales = similarity_transforms(own[None], wanted, np.full(len(own), 1.0 / len(own)))
        linear = scales[0] * turns[0]
        return linear, wanted.mean(axis=0) - linear @ own.mean(axis=0), turns[0]

    def _wanted(self, points: NDArray[np.floating]) -> Floats:
        return np.asarray(points[self.used], np.float64) * (1.0, -1.0, -1.0)


def build_picture_fitter(
    face: Face, opened: Floats, used: NDArray[np.int64], rows: NDArray[np.int64] | None = None
) -> PictureFitter:
    """The fitter of all vertices of a face, or of `rows`; at `opened` (V, 3), the lips apart, is interpolated."""
    from scipy.linalg import solve

    centres = face_landmarks(face, opened)[used]
    marks = face_landmarks(face, face.vertices.astype(np.float64))[:N_MESH_LANDMARKS]
    reach = DECAY_LENGTH / FACE_WIDTH * face_width(marks)
    matrix = rbf_values(centres, centres, reach)
    rows = np.arange(len(opened)) if rows is None else rows
    spread = solve(matrix, rbf_values(opened[rows], centres, reach).T, assume_a="pos").T
    return PictureFitter(rows, face.vertices[rows].astype(np.float64), marks, used, spread)


def average_skin_colours(
    face: Face,
    canvas: SkinCanvas,
    fit: PictureFitter,
    seen: Sequence[TrackedPictures],
    *,
    on_frame: OnFrame,
    on_progress: Progress,
) -> SkinColours:
    """Colours from the frames of all videos that show open eyes; `on_frame` gets each picture and its landmarks.

    Raises
    ------
    DataError
        No frame is suitable, or a video can no longer be read.
    """
    rows = np.flatnonzero(canvas.share > 0)
    texels = canvas.texels.at(rows)
    own_normals = unit_vectors(texels.interpolate(welded_normals(face)))
    texels = replace(texels, corners=np.searchsorted(fit.rows, texels.corners))
    total, weight = np.zeros((len(rows), 3)), np.zeros(len(rows))
    for one, picture, points in select_frames(seen, on_progress):
        placed, turn = fit.fit(points)
        places = texels.interpolate(placed[:, :2] * (1.0, -1.0))
        colour, inside = sample_picture(picture, places)
        if one.opening is not None:
            inside = inside & ~points_in_polygon(places, one.opening)
        facing = one.weight * smoothstep(own_normals @ turn[2], *FACING_COSINES) * inside
        total += facing[:, None] * colour
        weight += facing
        if one.weight == 1:
            on_frame(picture, points)
    if not weight.any():
        raise DataError("no frame shows the face with open eyes; give a video of the person looking at the camera")
    return SkinColours(rows, total / np.maximum(weight, 1e-9)[:, None], weight)


def select_frames(
    videos: Sequence[TrackedPictures], on_progress: Progress
) -> Iterator[tuple[TrackedPictures, NDArray[np.uint8], NDArray[np.float32]]]:
    """Yield video, picture (H, W, 3) and landmarks (478, 3) of `N_FRAMES` frames over the videos, eyes open."""
    per_video = int(np.ceil(N_FRAMES / len(videos)))
    usual = float(np.nanmedian(np.concatenate([eye_opening(one.landmarks) for one in videos])))
    for number, one in enumerate(videos):
        awake = np.flatnonzero(np.nan_to_num(eye_opening(one.landmarks)) > MIN_EYE_OPENING * usual)
        if len(awake):
            wanted = set(awake[np.linspace(0, len(awake) - 1, per_video).round().astype(int)].tolist())
            for at, pixels in enumerate(one.frames()):
                if at in wanted:
                    yield one, pixels, one.points[at]
        on_progress(number + 1, len(videos))


def sample_picture(picture: NDArray[np.uint8], places: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Colours (P, 3) of a picture (H, W, 3) at positions (P, 2), and a mask of those inside it; cubic interpolation."""
    import cv2

    height, width = picture.shape[:2]
    n = len(places)
    grid = np.zeros((-(-n // REMAP_COLUMNS), REMAP_COLUMNS, 2), np.float32)
    grid.reshape(-1, 2)[:n] = places
    found = cv2.remap(picture, grid[..., 0], grid[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    inside = np.all((places >= 0) & (places <= (width - 1, height - 1)), axis=1)
    return found.reshape(-1, 3)[:n].astype(np.float64), inside


def welded_normals(face: Face) -> Floats:
    """(V, 3) outward unit normals of the face at rest; vertices at one position share one normal."""
    places, shared = np.unique(face.vertices, axis=0, return_inverse=True)
    shared = shared.reshape(-1)
    return vertex_normals(places.astype(np.float64), shared[face.triangles])[shared]


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
IRIS_RING, IRIS_TOP = (0.4, 0.8), 0.35  # of the radius: between pupil and limbus, below the lashes' shadow
OFF_IRIS, OFF_LIDS = 1.35, 0.18  # of the radius: what is white of the eye, and how far lids reach into it
IRIS_MIX_PX = 0.5  # over the radius: share of the surroundings' light; rendered eyes have .05 to .1 at 5 px
MIN_OWN_LIGHT = 0.5  # of what is seen
BRIGHT_WHITE, PLAIN_IRIS = 0.6, (0.2, 0.8)  # quantiles of luminance: white without shadow, iris without catchlights
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
    """Colours (3,), `log_colour`, of skin, white of the eye and iris; those that are not seen are NaN; radius in px."""

    skin: Floats
    sclera: Floats
    iris: Floats
    radius_px: float


def log_colour(srgb: NDArray[np.floating]) -> Floats:
    """(..., 3) logarithms of luminance, R/G and B/G in linear light, of colours (..., 3), sRGB 0..255."""
    light = decode_srgb(np.clip(srgb, 0.0, 255.0) / 255.0) + DARKEST
    green = light[..., 1]
    found: Floats = np.log(np.stack([light @ LUMINANCE, light[..., 0] / green, light[..., 2] / green], axis=-1))
    return found


def linear_light(colour: Floats) -> Floats:
    """Linear light (..., 3) of `log_colour` values."""
    ratio = np.exp(np.stack([colour[..., 1], np.zeros(colour.shape[:-1]), colour[..., 2]], axis=-1))
    light: Floats = ratio * (np.exp(colour[..., 0]) / (ratio @ LUMINANCE))[..., None] - DARKEST
    return light


def srgb_colour(colour: Floats) -> NDArray[np.uint8]:
    """8-bit sRGB (..., 3) of `log_colour` values."""
    return encode_srgb(linear_light(colour))


def sample_eyes(picture: NDArray[np.uint8], points: NDArray[np.floating]) -> EyeColours:
    """Colours of skin, sclera and iris in a picture (H, W, 3) with landmarks (478, 3) in pixels."""
    places = points[:, :2].astype(np.float64)
    skin = np.median(log_colour(sample_picture(picture, places[list(SKIN_LANDMARKS)])[0]), axis=0)
    whites, irises, radii = [], [], []
    for (centre, rim), lids in zip(IRISES, LID_RINGS, strict=True):
        middle, opening = places[centre], places[list(lids)]
        radius = float(np.linalg.norm(places[list(rim)] - middle, axis=1).mean())
        low, high = opening.min(axis=0), opening.max(axis=0)
        across, down = (np.linspace(low[axis], high[axis], EYE_GRID[axis]) for axis in (0, 1))
        grid = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)
        colours = log_colour(sample_picture(picture, grid)[0])
        off = np.linalg.norm(grid - middle, axis=1) / radius
        is_open = polygon_depth(grid, opening, radius) > OFF_LIDS * radius
        ring = (off > IRIS_RING[0]) & (off < IRIS_RING[1]) & (grid[:, 1] > middle[1] - IRIS_TOP * radius)
        whites.append(_median_between(colours[is_open & (off > OFF_IRIS)], (BRIGHT_WHITE, 1.0)))
        irises.append(_median_between(colours[is_open & ring], PLAIN_IRIS))
        radii.append(radius)
    return EyeColours(skin, _mean_known(whites), _mean_known(irises), float(np.mean(radii)))


def _median_between(colours: Floats, quantiles: tuple[float, float]) -> Floats:
    if len(colours) < MIN_PIXELS:
        return np.full(3, np.nan)
    low, high = np.quantile(colours[:, 0], quantiles)
    middle: Floats = np.median(colours[(colours[:, 0] >= low) & (colours[:, 0] <= high)], axis=0)
    return middle


def _mean_known(colours: list[Floats]) -> Floats:
    known = [colour for colour in colours if np.isfinite(colour).all()]
    return np.asarray(np.mean(known, axis=0) if known else np.full(3, np.nan), np.float64)


def median_eyes(seen: list[EyeColours]) -> EyeColours:
    """The medians of many frames."""
    skin, sclera, iris = (_median_known([getattr(one, name) for one in seen]) for name in ("skin", "sclera", "iris"))
    return EyeColours(skin, sclera, iris, float(np.median([one.radius_px for one in seen])))


def clear_iris(eyes: EyeColours) -> Floats:
    """Colour (3,), `log_colour`, of the iris without the light of skin and white that a small picture mixes into it."""
    share = IRIS_MIX_PX / eyes.radius_px
    around = linear_light(eyes.skin)
    if np.isfinite(eyes.sclera).all():
        around = (around + linear_light(eyes.sclera)) / 2
    seen = linear_light(eyes.iris)
    own = np.maximum((seen - share * around) / (1.0 - share), MIN_OWN_LIGHT * seen)
    return log_colour(255.0 * encode_light(own))


def _median_known(colours: list[Floats]) -> Floats:
    known = [colour for colour in colours if np.isfinite(colour).all()]
    return np.asarray(np.median(known, axis=0) if known else np.full(3, np.nan), np.float64)


def estimate_cast(eyes: EyeColours) -> Floats:
    """(2,) cast of the light: the logarithms by which it raises R/G and B/G.

    Skin and white of the eye each tell it, and each may err: a skin is ruddy or olive, a white is mixed with lids and
    reddened. Where they do not agree in direction, there is none; where they do, it is their mean in B/G and the
    smaller one in R/G.
    """
    of_skin = _beyond(eyes.skin[1:] - SKIN_CHROMA, SKIN_SPREAD)
    if not np.isfinite(eyes.sclera).all():
        return SKIN_ALONE * of_skin
    of_white = _beyond(eyes.sclera[1:] - SCLERA_CHROMA, SCLERA_SPREAD)
    smaller = np.sign(of_skin) * np.minimum(np.abs(of_skin), np.abs(of_white))
    agreed = np.array([smaller[0], (of_skin[1] + of_white[1]) / 2])
    return np.where(of_skin * of_white > 0, agreed, 0.0)


def _beyond(off: Floats, spread: Floats) -> Floats:
    return np.sign(off) * np.maximum(np.abs(off) - spread, 0.0)


def remove_cast(srgb: Floats, cast: Floats, skin: Floats) -> Floats:
    """Colours (..., 3), sRGB 0..255, as in neutral light; the luminance of a `skin`, `log_colour`, stays the same."""
    gains = np.exp([-cast[0], 0.0, -cast[1]])
    before = np.exp([skin[1], 0.0, skin[2]])
    gains *= (before @ LUMINANCE) / ((before * gains) @ LUMINANCE)
    return 255.0 * encode_light(decode_srgb(np.clip(srgb, 0.0, 255.0) / 255.0) * gains)


def skin_texture(srgb: Floats, blurred: Callable[[Floats], Floats]) -> Floats:
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


def without_gloss(light: Floats, usual: Floats) -> Floats:
    """Linear light (N, 3) of skin without what is white in places lighter than the usual (3,) or (N, 3) skin.

    Shafer 1985, the dichromatic reflection model: light is a multiple of the skin's colour and a share of the lamp's,
    which is white here. Wrinkles and shadows, which are darker, stay.
    """
    skin = np.maximum((light[:, 0] - light[:, 2]) / np.maximum(usual[..., 0] - usual[..., 2], DARKEST), GLOSSY[0])
    share = smoothstep(light @ LUMINANCE / (usual @ LUMINANCE), *GLOSSY)[:, None]
    found: Floats = light + share * (np.minimum(light, skin[:, None] * usual) - light)
    return found
