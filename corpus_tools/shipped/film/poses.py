"""Poses whose light is baked: expressions, frames of speech that lie far apart, and turns of the head."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tts2face.models.face import Face
from tts2face.models.talker_file import load_talker
from tts2face.numeric.arrays import Float32Array
from tts2face.session.session import Session

EXPRESSIONS: Mapping[str, Mapping[str, float]] = {
    "smile": {"mouthSmile": 0.8, "cheekSquint": 0.5, "eyeSquint": 0.2},
    "a": {"jawOpen": 0.6},
    "i": {"mouthStretch": 0.4, "mouthSmile": 0.3, "jawOpen": 0.1},
    "u": {"mouthPucker": 0.8, "mouthFunnel": 0.3, "jawOpen": 0.1},
    "f": {"mouthRollLower": 0.6, "mouthUpperUp": 0.2, "jawOpen": 0.05},
    "blink": {"eyeBlink": 1.0},
    "half shut": {"eyeBlink": 0.5},
    "nearly shut": {"eyeBlink": 0.75},
    "shut under lowered brows": {"eyeBlink": 1.0, "browDown": 0.9},
    "shut under raised brows": {"eyeBlink": 1.0, "browInnerUp": 0.8, "browOuterUp": 0.8},
    "looks down": {"eyeLookDown": 0.8},
    "looks up": {"eyeLookUp": 0.8},
    "squint": {"eyeSquint": 0.8, "cheekSquint": 0.8},
    "funnel": {"mouthFunnel": 0.8, "jawOpen": 0.2},
    "teeth": {"mouthUpperUp": 0.9, "mouthLowerDown": 0.8, "mouthStretch": 0.3},
    "rolled": {"mouthRollUpper": 0.8, "mouthRollLower": 0.4},
    "sad": {"browInnerUp": 0.8, "mouthFrown": 0.5, "eyeBlink": 0.15},
    "angry": {"browDown": 0.9, "noseSneer": 0.4, "mouthPress": 0.4},
    "surprised": {"browInnerUp": 0.8, "browOuterUp": 0.8, "eyeWide": 0.8, "jawOpen": 0.35},
    "grin": {"mouthSmile": 1.0, "mouthUpperUp": 0.3, "jawOpen": 0.3, "cheekSquint": 0.8},
}  # shapes of both sides without their side
SPOKEN: Mapping[str, Sequence[str]] = {
    "neutral": ("People who move to Boston often choose a house by the sea; my father would have found that funny.",),
    "delighted": ("Peter, please show us the five big apples. I was afraid everybody had gone away.",),
    "depressed": ("Who knew that you would join us? Thin things, she should choose blue shoes, maybe.",),
    "annoyed": ("Who knew that you would join us? Five big maps were moved by Bob a year ago.",),
    "exaggerated": ("People who move to Boston often choose a house by the sea. Peter, show us five apples.",),
}  # styles, and what is said in them
HELD_OUT: Mapping[str, Sequence[str]] = {
    "delighted": ("Would you bring both of these oranges upstairs before we leave for the theatre?",),
    "neutral": ("Every morning the old ferry carries forty passengers and a very small dog.",),
    "annoyed": ("No! Put that back, or I shall have to phone your mother.",),
}  # said in poses on which light is measured, never fitted
HELD_OUT_TURNS_DEG = ((12, 6), (-14, -5), (8, 4), (-6, 8), (17, 2), (-10, -9))  # of half of them
N_HELD_OUT = 12
N_SPEECH = 32
GAZE_SHARE = 0.4  # of the gaze in the distance between poses
TURNS_DEG = (
    *((-20, 0), (-10, 0), (10, 0), (20, 0), (0, -12), (0, 12)),
    *((14, -8), (-14, 8), (14, 8), (-14, -8)),
)  # yaw and pitch


@dataclass(frozen=True, slots=True, eq=False)
class LitPose:
    """Weights (K,) of a face's shapes and the head's pose (6,), rad and mm."""

    name: str
    weights: Float32Array
    head: Float32Array

    @property
    def is_still(self) -> bool:
        """Whether the face rests, whatever the head does."""
        return not self.weights.any()


def lit_poses(face: Face) -> list[LitPose]:
    """The pose at rest, then expressions, frames of speech and turns of the head."""
    still = np.zeros(6, np.float32)
    poses = [LitPose("rest", np.zeros(len(face.shape_names), np.float32), still)]
    poses += [LitPose(name, expression_pose(face, shown), still) for name, shown in EXPRESSIONS.items()]
    known = np.stack([pose.weights for pose in poses])
    frames = spoken_weights(face)
    poses += [LitPose(f"speech {at}", frames[at], still) for at in farthest(frames, known, face, N_SPEECH)]
    for yaw, pitch in TURNS_DEG:
        head = np.radians([pitch, yaw, 0, 0, 0, 0]).astype(np.float32)
        poses.append(LitPose(f"head {yaw} {pitch}", poses[0].weights, head))
    return poses


def held_out_poses(face: Face) -> list[LitPose]:
    """Poses of other speech, half of them with the head turned."""
    frames = spoken_weights(face, HELD_OUT)
    chosen = farthest(frames, np.zeros((1, len(face.shape_names)), np.float32), face, N_HELD_OUT)
    heads = [(0, 0)] * (N_HELD_OUT - len(HELD_OUT_TURNS_DEG)) + list(HELD_OUT_TURNS_DEG)
    return [
        LitPose(f"test {number}", frames[at], np.radians([pitch, yaw, 0, 0, 0, 0]).astype(np.float32))
        for number, (at, (yaw, pitch)) in enumerate(zip(chosen, heads, strict=True))
    ]


def expression_pose(face: Face, shown: Mapping[str, float]) -> Float32Array:
    """(K,) weights of shapes that are named without their sides; those that the face lacks are left out."""
    weights = np.zeros(len(face.shape_names), np.float32)
    for number, name in enumerate(face.shape_names):
        weights[number] = shown.get(name, shown.get(name.removesuffix("Left").removesuffix("Right"), 0.0))
    return weights


def spoken_weights(face: Face, spoken: Mapping[str, Sequence[str]] = SPOKEN) -> Float32Array:
    """(T, K) weights of what is said in each style, of the face's own shapes."""
    session = Session(load_talker("grid_s1"), face)
    frames = []
    for style, texts in spoken.items():
        for text in texts:
            frames.append(session.clip(text, style=style).motion.columns(face.shape_names))
    return np.concatenate(frames).astype(np.float32)


def farthest(frames: Float32Array, known: Float32Array, face: Face, number: int) -> list[int]:
    """Indices of the frames (T, K) that lie farthest from the known poses (P, K) and from each other, one by one.

    Source: Gonzalez 1985, farthest-point clustering.
    """
    share = np.array([GAZE_SHARE if name.startswith("eyeLook") else 1.0 for name in face.shape_names], np.float32)
    scaled = frames * share
    nearest = np.min([((scaled - recording * share) ** 2).sum(axis=1) for recording in known], axis=0)
    chosen = []
    for _ in range(number):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, ((scaled - scaled[chosen[-1]]) ** 2).sum(axis=1))
    return chosen
