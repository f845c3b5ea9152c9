"""Error of the coverage of people before the pictures of a folder: python tests/bench/bench_matte.py FOLDER.

The figures of docs/photo.md: scikit-image's coffee, chelsea, rocket, gravel, grass, brick, motorcycle and Hubble field,
scikit-learn's china and flower. Every other composite chose the limits; the others are reported.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps
from scipy.ndimage import distance_transform_edt, gaussian_filter

from lexicon.errors import DataError
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import CHIN
from tts2face.photo.found_face import FoundFace, find_face
from tts2face.photo.matte import HEAD_END, part_background
from tts2face.photo.photograph import Photograph
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.video.networks import LandmarkNetwork, find_segmenter
from tts2face.video.tracking import FaceTracker

SIDE, NEAR, BAD = 640, 0.25, 0.08  # px, of the eye distance, and error of a bad matte
DRAWN = ("ada", "ben", "noor", "zuri", "mara", "tomas")
HEADS = (
    ("erik", "afro01"), ("amara", "bob01"), ("kofi", "bob02"), ("mei", "braid01"), ("leila", "cropped"),
    ("ravi", "long01"), ("ingrid", "ponytail01"), ("nia", "short01"), ("erik", "short02"), ("amara", "short03"),
    ("kofi", "short04"),
)  # fmt: skip


def main() -> None:
    """Print a line for each background, and one for all."""
    segmenter = find_segmenter()
    if segmenter is None:
        raise DataError("the segmentation model is not installed: run `tts2face corpus setup`")
    network, rows = LandmarkNetwork(segmenter.read_bytes()), []
    for number, (person, found) in enumerate(people(FaceTracker())):
        for at, (name, wall) in enumerate(backgrounds(Path(sys.argv[1]), person)):
            if (number + at) % 2:
                rows.append((name, error(person, wall, found, network)))
    for name in [*dict.fromkeys(name for name, _ in rows), "all"]:
        errors = np.array([one for own, one in rows if name in (own, "all")])
        cut = errors[~np.isnan(errors)]
        figures = (cut.mean(), *np.percentile(cut, (50, 90, 100))) if len(cut) else ()
        bad = f", {(cut > BAD).sum()} above {BAD}" if len(cut) else ""
        print(name, f"{np.isnan(errors).mean():.0%} kept;", *(f"{figure:.3f}" for figure in figures), bad)


def people(tracker: FaceTracker) -> Iterator[tuple[np.ndarray, FoundFace]]:
    """Pictures (S, S, 4) of shipped people, and their faces."""
    faces = [load_face(name) for name in DRAWN] + [load_face("head", one, hair=hair) for one, hair in HEADS]
    for face in faces:
        shown = draw(face, picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))
        yield shown, find_face(composite(shown, np.full((SIDE, SIDE, 3), 150.0)), tracker, "a still")


def backgrounds(folder: Path, person: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Pictures of a folder, plain ones, a room, and one in the colour of the top of the hair."""
    for path in sorted(path for path in folder.iterdir() if path.suffix in (".png", ".jpg")):
        yield path.stem, np.asarray(ImageOps.fit(Image.open(path).convert("RGB"), (SIDE, SIDE)), np.float64)
    rng, at = np.random.default_rng(0), np.mgrid[:SIDE, :SIDE] / SIDE
    yield from ((str(level), np.full((SIDE, SIDE, 3), float(level))) for level in (12, 248))
    yield "light", np.repeat(190 - 100 * np.hypot(at[1] - 0.5, at[0] - 0.4)[..., None], 3, axis=2)
    spots = gaussian_filter(rng.normal(size=(SIDE, SIDE)), 12)
    hair = person[person[..., 3] > 250][:2000, :3].mean(axis=0)
    yield "hair", (hair + 12 * spots[..., None] / spots.std()).clip(0, 255)
    room = np.tile(np.array((196.0, 188.0, 170.0)), (SIDE, SIDE, 1))
    room[:, 141:173], room[:, 173:192], room[:, 422:448] = (120, 84, 56), (238, 236, 230), (238, 236, 230)
    room[:, 448:], room[115:128, :448], room[352:365, 448:] = (96, 120, 140), (90, 70, 50), (40, 40, 60)
    yield "room", (room + rng.normal(0, 3, room.shape)).clip(0, 255)


def composite(person: np.ndarray, wall: np.ndarray) -> np.ndarray:
    """Picture (S, S, 3) of a person (S, S, 4) before a wall."""
    share = person[..., 3:] / 255
    return np.rint(share * person[..., :3] + (1 - share) * wall).astype(np.uint8)


def error(person: np.ndarray, wall: np.ndarray, found: FoundFace, network: LandmarkNetwork) -> float:
    """Mean error of the coverage near the rim of the head; NaN where the person is not cut out."""
    layers = part_background(
        Photograph(composite(person, wall), None, 1.0), found.landmarks, found.eye_distance_px, network
    )
    if layers.alpha is None:
        return np.nan
    near = NEAR * found.eye_distance_px
    rim = (distance_transform_edt(person[..., 3] < 6) < near) & (distance_transform_edt(person[..., 3] > 250) < near)
    rim[round(found.landmarks[CHIN, 1] + HEAD_END * found.eye_distance_px) :] = False
    return float(np.abs(layers.alpha[rim].astype(float) - person[rim][:, 3]).mean() / 255)


if __name__ == "__main__":
    main()
