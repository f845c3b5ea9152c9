"""Poses whose light is baked: expressions, frames of speech that lie far apart, and turns of the head.

Light of a character in its poses and from several cameras, as the path tracer saw it.

Which triangles of a face are ever seen, over its poses and all around it, by the product's own kernels.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing

from tts2face.face.deformation import build_rig
from tts2face.models.face import Face
from tts2face.models.talker_file import load_talker
from tts2face.picture.baked.visibility import N_COLUMNS, TRIANGLE_MASK, X, Y, nearest_triangles, project
from tts2face.picture.camera import camera_matrices
from tts2face.picture.camera_view import CameraView
from tts2face.session.session import Session

Float32Array = NDArray[np.float32]

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
    nearest = np.min([((scaled - one * share) ** 2).sum(axis=1) for one in known], axis=0)
    chosen = []
    for _ in range(number):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, ((scaled - scaled[chosen[-1]]) ** 2).sum(axis=1))
    return chosen


CAMERA_YAWS_DEG = (-35, -20, 20, 35)  # about the face at rest
SKIN, FAR = ("skin",), ("hair", "shirt")  # parts with a texture of light: those that speak, and those that do not
MOUTH = ("teeth", "gums", "tongue")
FRONT = CameraView(0, 3, share=0.86)  # that sees the poses


@dataclass(frozen=True, slots=True, eq=False)
class PoseLight:
    """Light of P poses, the first at rest, of T turns of the head among them, and of C cameras round the pose at rest.

    Colours are as displayed, 0..1; those of eyeballs are linear light on white.

    Attributes
    ----------
    names : (P,)
    weights : (P, K)
    heads : (P, 6)
    skin_rest, far_rest : (S, S, 3)
        In texels at rest.
    skin : (P, s, s, 3)
    far : (T + C + 1, s, s, 3)
        Of hair and clothes at rest, in the turns of the head, then from the cameras.
    skin_from : (C, s, s, 3)
        Of the skin from the cameras.
    far_other : (C, h, S / 2, 3)
        Of hair at rest in other colours, to the bottom of its tiles.
    other_colours : (1 + C, 3)
        The hair's own colour and the others, sRGB.
    other_vertices : (C, N, 3)
        Colours of the face's last vertices, those of the hair, in the others.
    rows : (N,)
        Vertices of the face whose light ``small`` (P, N, 3) holds: of all other parts; in turns of the head, as at
        rest.
    view : (33, 33, 33, 3)
        View transform at `tts2face.models.baked_light.table_levels`.
    lamps : (L, 17)
        As eyes mirror them (`tts2face.models.baked_light`).
    backdrop : (S, S, 3)
        The wall, out of focus.
    """

    names: NDArray[np.str_]
    weights: Float32Array
    heads: Float32Array
    skin_rest: Float32Array
    far_rest: Float32Array
    skin: Float32Array
    far: Float32Array
    skin_from: Float32Array
    far_other: Float32Array
    other_colours: Float32Array
    other_vertices: NDArray[np.uint8]
    rows: NDArray[np.int64]
    small: Float32Array
    view: Float32Array
    lamps: Float32Array
    backdrop: NDArray[np.uint8]

    def save(self, path: Path) -> None:
        """Write into an .npz file."""
        np.savez_compressed(path, **{one.name: getattr(self, one.name) for one in fields(self)})

    @classmethod
    def load(cls, path: Path) -> "PoseLight":
        """Read what `save` wrote."""
        with np.load(path) as stored:
            return cls(**{one.name: stored[one.name] for one in fields(cls)})


SIDE_PX = 900
MIDDLE_LIPS = (13, 14)  # landmarks
YAWS_DEG, PITCHES_DEG = range(-180, 180, 20), (-25.0, -12.0, -4.0, 4.0, 12.0, 25.0)
MOST_YAW_DEG = 60  # of the cameras that see more than the pose at rest
EVERY = 3  # pose of speech
TILE_MM = 20.0  # triangles that are drawn one after the other lie in one tile, outer ones first
INSIDE_MM = 14.0  # behind the lips, from where on the back of skin lies in the dark


def seen_triangles(face: Face, poses: PoseLight) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """Triangles in the order of drawing, ``~t`` for the back of one, and whether it is the inside of the head."""
    n = len(face.triangles)
    both = np.concatenate([face.triangles, face.triangles[:, ::-1]]).astype(np.int32)
    rig, seen = build_rig(face), np.zeros(2 * n, bool)
    for number in _looked_at(poses):
        points = rig.pose(poses.weights[number], poses.heads[number])
        for nearest, _ in _looks(face, points, _cameras(is_at_rest=number == 0)):
            shown = np.unique(nearest)
            seen[shown[shown >= 0]] = True
    found = np.flatnonzero(seen | _beside(face, seen[:n]))
    centres = face.vertices[both[found]].mean(axis=1)
    middle = np.array([0.0, 20.0, -60.0])
    out = -(np.linalg.norm(centres - middle, axis=1) // TILE_MM)
    order = np.lexsort((centres[:, 0] // TILE_MM, centres[:, 1] // TILE_MM, out))
    found, centres = found[order], centres[order]
    is_inside = (found >= n) & (centres[:, 2] < mouth_middle(face)[2] - INSIDE_MM)
    return np.where(found < n, found, ~(found - n)).astype(np.int32), is_inside


def shown_skin(
    face: Face, poses: PoseLight, numbers: Iterable[int], corners: NDArray[np.int64], side: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Vertices (P, V) and texels of the skin (P, side, side) that the camera in front sees of these poses.

    `corners` (F, 3) are the skin's triangles.
    """
    skin = np.unique(corners)
    is_skin = np.isin(face.triangles, skin).sum(axis=1) == 3
    uv = np.zeros((len(face.vertices), 2), np.float32) if face.uv is None else face.uv
    texel = np.clip(uv[skin] * side, 0, side - 1).astype(int)
    rig, n = build_rig(face), len(face.triangles)
    vertices, texels = [], []
    for number in numbers:
        points = rig.pose(poses.weights[number], poses.heads[number])
        ((nearest, table),) = _looks(face, points, [FRONT])
        shown = np.zeros(len(face.vertices), bool)
        at = np.clip(np.rint(table[:, [Y, X]]), 1, SIDE_PX - 2).astype(int)
        for down, right in np.ndindex(3, 3):
            found = nearest[at[:, 0] + down - 1, at[:, 1] + right - 1]
            around = np.asarray(face.triangles[np.clip(found, 0, n - 1)] == np.arange(len(at))[:, None])
            shown[around.any(axis=1) & (found >= 0) & (found < n)] = True
        down, across = np.nonzero((nearest >= 0) & (nearest < n) & is_skin[np.clip(nearest, 0, n - 1)])
        used = face.triangles[nearest[down, across]]
        a, b, c = np.moveaxis(table[used][:, :, [X, Y]].astype(np.float64), 1, 0)
        place = np.column_stack([across, down]) - a
        first, second = b - a, c - a
        whole = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        at_b = (place[:, 0] * second[:, 1] - place[:, 1] * second[:, 0]) / whole
        at_c = (first[:, 0] * place[:, 1] - first[:, 1] * place[:, 0]) / whole
        shares = np.column_stack([1 - at_b - at_c, at_b, at_c])
        places = np.clip(np.einsum("nk,nkx->nx", shares, uv[used]) * side, 0, side - 1).astype(int)
        marked = np.zeros((side, side), bool)
        marked[places[:, 1], places[:, 0]] = True
        marked = np.asarray(binary_closing(marked, iterations=2))
        shown[skin] &= marked[texel[:, 1], texel[:, 0]]  # a triangle may be seen where the vertex lies in a fold
        vertices.append(shown)
        texels.append(marked)
    return np.array(vertices), np.array(texels)


def _looks(
    face: Face, points: NDArray[np.float32], views: Iterable[CameraView]
) -> Iterable[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Triangle (S, S) that each camera sees of posed vertices (V, 3), -1 of none, and the projected vertices.

    From the number of triangles on, these are backs.
    """
    both = np.concatenate([face.triangles, face.triangles[:, ::-1]]).astype(np.int32)
    table = np.zeros((len(face.vertices), N_COLUMNS), np.float32)
    every = np.arange(len(face.vertices), dtype=np.int32)
    for view in views:
        optics = camera_matrices(view, face, (SIDE_PX, SIDE_PX))
        project(points, every, optics.view.astype(np.float32), optics.lens.astype(np.float32), table)
        nearest, _, _ = nearest_triangles(table, both, (SIDE_PX, SIDE_PX))
        yield (nearest[:, :SIDE_PX] & TRIANGLE_MASK) - 1, table


def mouth_middle(face: Face) -> NDArray[np.float32]:
    """(3,) place between the lips at rest."""
    lips = np.isin(face.landmarks, MIDDLE_LIPS)
    middle: NDArray[np.float32] = face.vertices[face.landmark_vertices[lips]].mean(axis=(0, 1))
    return middle


def _beside(face: Face, seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(2 F,) triangles that share an edge with seen ones (F,): some are seen between the poses and cameras."""
    reached = np.zeros(len(face.vertices), bool)
    reached[face.triangles[seen]] = True
    beside = reached[face.triangles].sum(axis=1) >= 2
    return np.concatenate([beside, np.zeros_like(beside)])


def _looked_at(poses: PoseLight) -> Iterable[int]:
    """Numbers of the poses that are looked at: all but some of speech."""
    spoken = 0
    for number, name in enumerate(poses.names):
        is_speech = str(name).startswith("speech")
        spoken += is_speech
        if not is_speech or spoken % EVERY == 0:
            yield number


def _cameras(*, is_at_rest: bool) -> Iterable[CameraView]:
    """Cameras that look at a pose."""
    for yaw in YAWS_DEG:
        if is_at_rest or abs(yaw) <= MOST_YAW_DEG:
            yield from (CameraView(float(yaw), pitch) for pitch in PITCHES_DEG)
