"""How alike pictures of people are: where landmarks lie, and the colours of skin, hair, brows and irises."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.light_colour import EyeColours, estimate_cast, remove_cast, sample_eyes, srgb_colour
from tts2face.models.face import Face
from tts2face.models.landmarks import CHIN, FACE_OVAL, N_MESH_LANDMARKS
from tts2face.numeric.arrays import decode_srgb, encode_light
from tts2face.photo.found_face import FoundFace, PhotographedFace, find_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.video.pose import similarity_transforms
from tts2face.video.tracking import FaceTracker

Floats = NDArray[np.float64]

SIDE_PX, CAMERA = 640, "0,0"
TOP = 10  # landmark
PLACES: Mapping[str, tuple[tuple[int, ...], ...]] = {  # landmarks, of whose means the colours are read
    "cheeks": ((50,), (280,), (205,), (425,)),
    "forehead": ((151,), (9,), (108,), (337,)),
    "brows": ((63, 53), (105, 52), (293, 283), (334, 282)),
}
HAIR_UP, HAIR_ASIDE = 0.2, (-0.12, -0.06, 0.0, 0.06, 0.12)  # above `TOP`, and beside it, of the face's height
SKIN, PARTS = ("cheeks", "forehead"), (*PLACES, "hair", "irises")
DISC = 0.02  # radius of the places, of the face's width
LINEAR_XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                       [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip  # sRGB, IEC 61966-2-1
N_POSE_STEPS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Likeness:
    """Landmarks (468, 2) of a face in a picture, and CIE Lab (N, 3) by part, in neutral light; NaN where not seen."""

    marks: Floats
    colours: Mapping[str, Floats]


def lab_colour(light: Floats) -> Floats:
    """CIE Lab (..., 3) of linear sRGB (..., 3), white D65."""
    white = LINEAR_XYZ.sum(axis=1)
    share = light @ LINEAR_XYZ.T / white
    root = np.where(share > (6 / 29) ** 3, np.cbrt(share), share / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def difference_2000(one: Floats, other: Floats) -> Floats:
    """(...) CIEDE2000 of CIE Lab (..., 3). Source: Sharma, Wu and Dalal 2005, eqs 2 to 22."""
    (l1, a1, b1), (l2, a2, b2) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    mean = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    g = 1.5 - 0.5 * np.sqrt(mean**7 / (mean**7 + 25.0**7))
    c1, c2 = np.hypot(g * a1, b1), np.hypot(g * a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, g * a1)) % 360, np.degrees(np.arctan2(b2, g * a2)) % 360
    turn = (h2 - h1 + 180) % 360 - 180
    h = (h1 + turn / 2) % 360
    c, light = (c1 + c2) / 2, (l1 + l2) / 2
    t = (1 - 0.17 * np.cos(np.radians(h - 30)) + 0.24 * np.cos(np.radians(2 * h))
         + 0.32 * np.cos(np.radians(3 * h + 6)) - 0.20 * np.cos(np.radians(4 * h - 63)))  # fmt: skip
    dl = (l2 - l1) / (1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2))
    dc = (c2 - c1) / (1 + 0.045 * c)
    dh = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * c * t)
    around = -2 * np.sqrt(c**7 / (c**7 + 25.0**7)) * np.sin(np.radians(60 * np.exp(-(((h - 275) / 25) ** 2))))
    found: Floats = np.sqrt(dl**2 + dc**2 + dh**2 + around * dc * dh)
    return found


def see_picture(pixels: NDArray[np.uint8], found: FoundFace) -> Likeness:
    """What a picture (H, W, 3) shows of a face, without the colour of its light."""
    eyes = sample_eyes(pixels, found.landmarks)
    return Likeness(found.landmarks[:N_MESH_LANDMARKS, :2], _colours(pixels, found, eyes, estimate_cast(eyes)))


def see_head(face: Face, shown: PhotographedFace, tracker: FaceTracker) -> tuple[NDArray[np.uint8], Likeness]:
    """A head drawn in the pose and with the expression of a photograph, and what the tracker sees of it."""
    weights = np.array([shown.scores.get(name, 0.0) for name in face.shape_names], np.float32)
    pose, wanted = np.zeros(6), np.radians(shown.found.angles_deg)
    pose[:3] = wanted
    for _ in range(N_POSE_STEPS):
        pixels = draw(face, weights, pose, Picture(size=f"{SIDE_PX}x{SIDE_PX}", camera=CAMERA))
        found = find_face(pixels, tracker, "the head")
        pose[:3] += wanted - np.radians(found.angles_deg)
    eyes = sample_eyes(pixels, found.landmarks)
    return pixels, Likeness(found.landmarks[:N_MESH_LANDMARKS, :2], _colours(pixels, found, eyes, np.zeros(2)))


def _colours(pixels: NDArray[np.uint8], found: FoundFace, eyes: EyeColours, cast: Floats) -> dict[str, Floats]:
    marks = found.landmarks[:, :2]
    places = {part: [marks[list(some)].mean(axis=0) for some in near] for part, near in PLACES.items()}
    up = marks[TOP] - marks[CHIN]
    places["hair"] = [marks[TOP] + HAIR_UP * up + aside * up[::-1] * (-1, 1) for aside in HAIR_ASIDE]
    radius = DISC * found.width_px
    seen = {part: np.array([_disc(pixels, place, radius) for place in near]) for part, near in places.items()}
    seen["irises"] = np.full((1, 3), np.nan)
    if np.isfinite(eyes.iris).all():
        seen["irises"] = srgb_colour(eyes.iris)[None].astype(np.float64)
    return {part: lab_colour(decode_srgb(remove_cast(own, cast, eyes.skin) / 255)) for part, own in seen.items()}


def _disc(pixels: NDArray[np.uint8], place: Floats, radius: float) -> Floats:
    """Mean colour (3,), sRGB 0..255, of the pixels around a place; NaN outside of the picture."""
    rows, columns = np.mgrid[: pixels.shape[0], : pixels.shape[1]]
    near = np.hypot(columns - place[0], rows - place[1]) <= max(radius, 1.0)
    return 255 * encode_light(decode_srgb(pixels[near] / 255).mean(axis=0)) if near.any() else np.full(3, np.nan)


def marks_apart(one: Likeness, other: Likeness) -> float:
    """Median distance of landmarks after a similarity, of the width of the face."""
    flat = [np.column_stack([seen.marks, np.zeros(len(seen.marks))]) for seen in (one, other)]
    turns, scales = similarity_transforms(flat[0][None], flat[1], np.full(len(flat[0]), 1 / len(flat[0])))
    placed = scales[0] * (flat[0] - flat[0].mean(axis=0)) @ turns[0].T + flat[1].mean(axis=0)
    width = np.ptp(other.marks[list(FACE_OVAL), 0])
    return float(np.median(np.linalg.norm(placed - flat[1], axis=1)) / width)


def colours_apart(one: Likeness, other: Likeness, parts: Sequence[str] = PARTS) -> float:
    """Mean over parts of the median CIEDE2000 of the places that both pictures show."""
    places = [difference_2000(one.colours[part], other.colours[part]) for part in parts]
    return float(np.mean([np.nanmedian(some) for some in places if np.isfinite(some).any()]))


def nearest(heads: Sequence[Likeness], pictures: Sequence[Likeness]) -> list[int]:
    """Picture that each head is most like, by landmarks and colours, each as shares of what lies between people."""
    total = np.zeros((len(heads), len(pictures)))
    for measure in (marks_apart, colours_apart):
        apart = np.array([[measure(head, picture) for picture in pictures] for head in heads])
        total += apart / np.median(apart[~np.eye(*apart.shape, dtype=bool)])
    return [int(number) for number in total.argmin(axis=1)]
