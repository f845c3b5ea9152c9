"""Close pictures of mouths in random mixes of speech and moods, and the outline of the lips in them."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import tts2face.face
from tts2face.face.deformation import FaceRig, build_rig
from tts2face.models.face import Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.picture.camera import CameraMatrices, camera_matrices
from tts2face.picture.camera_view import CameraView
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer

FOLDER = Path(tts2face.face.__file__).parent
FRONT = CameraView(0.0, 2.0)
ASIDE = CameraView(30.0, 2.0)
BELOW = CameraView(0.0, -25.0)
OUTER_LIPS, INNER_LIPS = (
    (*upper, *lower[::-1][1:-1])
    for upper, lower in ((OUTER_LIP_UPPER, OUTER_LIP_LOWER), (INNER_LIP_UPPER, INNER_LIP_LOWER))
)
MORE = (
    "mouthSmile*", "mouthFrown*", "mouthUpperUp*", "mouthLowerDown*", "mouthStretch*", "mouthDimple*", "mouthPress*",
    "mouthPucker", "mouthFunnel", "jawForward", "jawLeft", "jawRight", "mouthLeft", "mouthRight", "mouthShrugUpper",
    "mouthShrugLower", "noseSneer*", "cheekPuff", "mouthRollLower", "mouthRollUpper", "mouthClose",
)  # fmt: skip  # movements beside those of visemes and moods
SIDE_PX, BELOW_MIDDLE = 96, 0.12  # of a picture, and the share of it by which the mouth is above: chins sink
SPAN = 1.5  # its side in widths of the mouth
FINE = 4  # points of the outline a pixel


def rows(name: str) -> list[list[str]]:
    lines = (FOLDER / name).read_text("utf-8").splitlines()
    return [row for row in csv.reader(lines, delimiter="\t") if not row[0].startswith("#")]


def visemes() -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for viseme, shape, weight in rows("visemes.tsv")[1:]:
        found.setdefault(viseme, {})[shape] = float(weight)
    return found


def moods() -> dict[str, dict[str, float]]:
    names, *table = rows("expressions.tsv")
    return {name: {row[0]: float(row[k]) for row in table if row[k]} for k, name in enumerate(names[1:], start=1)}


def shape_weights(face: Face, shown: Mapping[str, float]) -> np.ndarray:
    """(K,) weights within the limits; ``mouthSmile*`` is both sides."""
    both = [name.removesuffix("Left").removesuffix("Right") + "*" for name in face.shape_names]
    wanted = [shown.get(name, 0.0) + shown.get(word, 0.0) for name, word in zip(face.shape_names, both, strict=True)]
    return np.clip(wanted, *face.limits.T).astype(np.float32)


def mixes(face: Face, n: int, seed: int = 5) -> np.ndarray:
    """(n, K) weights: two visemes and their speech's tongue, a mood, and two other movements, summed and clipped."""
    random = np.random.default_rng(seed)
    spoken, felt = visemes(), moods()
    made = []
    for _ in range(n):
        shown: dict[str, float] = {}
        share = random.random()
        first, second = random.choice(list(spoken), 2)
        mood = random.choice(list(felt))
        parts = [(spoken[first], 1.2 * share), (spoken[second], 1.2 * (1 - share)), (felt[mood], random.random())]
        parts += [({name: 0.6}, random.random()) for name in random.choice(MORE, 2)]
        parts += [
            ({name: most}, random.random())
            for name, most, often in (("tongueUp", 1.0, 0.4), ("tongueOut", 0.6, 0.3), ("jawOpen", 0.4, 0.3))
            if random.random() < often
        ]
        for part, weight in parts:
            for name, value in part.items():
                shown[name] = shown.get(name, 0.0) + weight * value
        made.append(shape_weights(face, shown))
    return np.array(made)


@dataclass(frozen=True, slots=True, eq=False)
class MouthCamera:
    """A camera close to the mouth of a face, which draws transparent pictures (S, S, 4)."""

    face: Face
    rig: FaceRig
    optics: CameraMatrices
    renderer: MeshRenderer

    @classmethod
    def of(cls, face: Face, view: CameraView, background: str = "transparent") -> "MouthCamera":
        picture = Picture(size=f"{SIDE_PX}x{SIDE_PX}", supersampling=1, background=background)
        whole = camera_matrices(view, face, picture.samples)
        lips = landmarks(face, face.vertices, OUTER_LIPS)
        x, y, z = whole.view[:, :3] @ lips.mean(axis=0) + whole.view[:, 3]
        focal = SIDE_PX / (SPAN * np.ptp(lips[:, 0])) * z
        middle = SIDE_PX / 2 - focal * np.array([x, y]) / z - (0, BELOW_MIDDLE * SIDE_PX)
        optics = CameraMatrices(whole.view, np.array([focal, *middle, whole.lens[3]]))
        return cls(face, build_rig(face), optics, mesh_renderer(face, picture).seen_by(optics))

    def draw(self, weights: np.ndarray) -> np.ndarray:
        return self.renderer.draw(weights)

    def within(self, weights: np.ndarray, ring: tuple[int, ...] = OUTER_LIPS) -> np.ndarray:
        """(S, S) pixels that lie wholly inside the outline of the lips."""
        outline = self.optics.pixels(landmarks(self.face, self.rig.pose(weights), ring))
        fine = Image.new("1", (SIDE_PX * FINE, SIDE_PX * FINE))
        ImageDraw.Draw(fine).polygon([tuple(place * FINE) for place in outline], fill=1)
        return np.asarray(fine).reshape(SIDE_PX, FINE, SIDE_PX, FINE).all(axis=(1, 3))

    def n_holes(self, weights: np.ndarray) -> int:
        """Pixels of the background inside the lips."""
        return int((self.within(weights) & (self.draw(weights)[:, :, 3] < 255)).sum())


def landmarks(face: Face, points: np.ndarray, names: tuple[int, ...]) -> np.ndarray:
    at = {int(number): row for row, number in enumerate(face.landmarks)}
    used = [at[name] for name in names]
    return np.einsum("lc,lcx->lx", face.landmark_weights[used], points[face.landmark_vertices[used]])
