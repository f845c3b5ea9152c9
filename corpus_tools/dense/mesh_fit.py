"""Warp from the default head's skin to a talker's (eqs 3 and 4) with rigid eyeballs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Eye, Face
from tts2face.models.landmarks import FACE_OVAL, INNER_LIP_LOWER, INNER_LIP_UPPER, LID_RINGS, N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray, smoothstep
from tts2face.numeric.splines import Interpolant, fit_interpolant
from tts2face.video.pose import similarity_transforms

OPEN_JAW_WEIGHT = 0.12  # weight of jawOpen at which the warp is fitted; with closed lips the mouth would tear
EYE_CORNERS = ((33, 133), (263, 362))
EYE_SCALE_LIMITS = (0.92, 1.08)  # eyeballs of adults differ in size by less than this
FULL_EYE_DISTANCE_MM, FREE_SKIN_DISTANCE_MM = (
    2.0,
    11.0,
)  # from an eyeball: skin up to the first keeps its distance from it, beyond the second it is free
N_NEIGHBOURS = 10  # neighbouring landmarks with whose motion a landmark's is compared
# Maximum deviation from the neighbours' motion; larger ones are errors of correspondence at the face's rim.
MAX_STRAY_MM = 4.0
JOIN_MM = 2.0  # up to which vertices count as neighbours, in lips and across them
N_ROUNDS = 3  # landmarks lie inside triangles, so that residuals are fitted again


@dataclass(frozen=True, slots=True, eq=False)
class EyeSocket:
    """An eyeball's centre (3,) and radius before, centre (3,) and scale after."""

    before: FloatArray
    radius: float
    after: FloatArray
    scale: float

    def keep_distance(self, places: FloatArray, moved: FloatArray) -> FloatArray:
        """(P, 3) moved positions with the scaled distance from the eyeball that positions (P, 3) near it had."""
        off = np.linalg.norm(places - self.before, axis=1)
        share = smoothstep((self.radius + FREE_SKIN_DISTANCE_MM - off) / (FREE_SKIN_DISTANCE_MM - FULL_EYE_DISTANCE_MM))
        towards = moved - self.after
        length = np.maximum(np.linalg.norm(towards, axis=1), 1e-9)
        wanted = self.scale * off / length
        placed: FloatArray = self.after + towards * (1.0 + share * (wanted - 1.0))[:, None]
        return placed


@dataclass(frozen=True, slots=True, eq=False)
class HeadWarp:
    """Warp of positions on the default head to the talker.

    ``opened`` (V, 3) is the displacement of each vertex by a slightly open jaw, at which the field is evaluated; lips
    that touch share it, so that they touch in the talker's face.
    ``landmarks`` (N,) are the indices of the field's centres.
    """

    field: Interpolant
    opened: FloatArray
    sockets: tuple[EyeSocket, ...]
    landmarks: NDArray[np.int64]

    def apply(self, places: FloatArray, rows: NDArray[np.int64]) -> FloatArray:
        """(P, 3) warped positions of the vertices `rows` (P,) from positions (P, 3) on the head with closed lips."""
        moved = places + self.field(places + self.opened[rows])
        for socket in self.sockets:
            moved = socket.keep_distance(places, moved)
        return moved


def fit_head_warp(face: Face, talker: NDArray[np.floating]) -> HeadWarp:
    """The warp onto resting landmarks (478, 3) of a talker with closed lips, aligned with the head."""
    opened = OPEN_JAW_WEIGHT * face.shapes[face.shape_names.index("jawOpen")].astype(np.float64)
    rest = face_landmarks(face, face.vertices)[:N_MESH_LANDMARKS]
    target = correct_lips_and_lids(rest, align_to_head(talker, rest))
    used = np.flatnonzero(select_consistent_landmarks(rest, target))
    centres = (rest + face_landmarks(face, opened)[:N_MESH_LANDMARKS])[used]
    width = face_width(rest)
    missing = (target - rest)[used]
    opened = _joined_lips(face.vertices.astype(np.float64), opened)
    warp = HeadWarp(fit_interpolant(centres, missing, width), opened, fit_eye_sockets(face, rest, target), used)
    for _ in range(N_ROUNDS - 1):
        reached = face.vertices + warp.field(face.vertices + opened)
        missing = missing + (target - face_landmarks(face, reached)[:N_MESH_LANDMARKS])[used]
        warp = HeadWarp(fit_interpolant(centres, missing, width), opened, warp.sockets, used)
    return warp


def _joined_lips(vertices: FloatArray, opened: FloatArray) -> FloatArray:
    """Displacements (V, 3) of vertices (V, 3), mm, with those of others close by."""
    from scipy.spatial import cKDTree

    moving = np.flatnonzero(np.linalg.norm(opened, axis=1) > 0.0)
    tree = cKDTree(vertices)
    near = np.unique(np.concatenate(tree.query_ball_point(vertices[moving], JOIN_MM)).astype(np.int64))
    pairs = cKDTree(vertices[near]).sparse_distance_matrix(tree, JOIN_MM, output_type="coo_matrix")
    pairs.data = np.exp(-((2.0 * pairs.data / JOIN_MM) ** 2))
    joined = opened.copy()
    joined[near] = (pairs @ opened) / (pairs @ np.ones((len(opened), 1)))
    return joined


def face_landmarks(face: Face, vertices: NDArray[np.floating]) -> FloatArray:
    """(478, 3) landmarks, by number, of vertices (V, 3) in the face's topology."""
    found = np.zeros((int(face.landmarks.max()) + 1, 3))
    weights = face.landmark_weights.astype(np.float64)[..., None]
    found[face.landmarks] = (vertices[face.landmark_vertices] * weights).sum(axis=1)
    return found


def face_width(landmarks: FloatArray) -> float:
    """Width of a face's oval in its own unit, which corresponds to 200 pixels in the paper."""
    return float(np.ptp(landmarks[list(FACE_OVAL), 0]))


def align_to_head(talker: NDArray[np.floating], rest: FloatArray) -> FloatArray:
    """(468, 3) landmarks of the talker aligned with the head's by a similarity; their size is unknown."""
    own = np.asarray(talker, np.float64)[:N_MESH_LANDMARKS]
    weights = np.full(N_MESH_LANDMARKS, 1.0 / N_MESH_LANDMARKS)
    turns, scales = similarity_transforms(own[None], rest, weights)
    brought: FloatArray = scales[0] * (own - own.mean(axis=0)) @ turns[0].T + rest.mean(axis=0)
    return brought


def correct_lips_and_lids(rest: FloatArray, target: FloatArray) -> FloatArray:
    """(468, 3) landmarks of the talker with the lip contact of the head, and lids at the depth of the eyes."""
    placed = target.copy()
    upper, lower = list(INNER_LIP_UPPER[1:-1]), list(INNER_LIP_LOWER[1:-1])
    middle = (target[upper] + target[lower]) / 2
    half = (rest[upper] - rest[lower]) / 2
    placed[upper], placed[lower] = middle + half, middle - half
    for lids in LID_RINGS:
        edge = list(lids)
        placed[edge, 2] = rest[edge, 2] + (target[edge, 2] - rest[edge, 2]).mean()
    return placed


def select_consistent_landmarks(rest: FloatArray, target: FloatArray) -> NDArray[np.bool_]:
    """(468,) mask of landmarks whose motion agrees with that of their neighbours."""
    apart = np.linalg.norm(rest[:, None] - rest[None], axis=2)
    nearest = np.argsort(apart, axis=1)[:, : N_NEIGHBOURS + 1]
    moved = target - rest
    usual = np.median(moved[nearest], axis=1)
    fits: NDArray[np.bool_] = np.linalg.norm(moved - usual, axis=1) < MAX_STRAY_MM
    return fits


def fit_eye_sockets(face: Face, rest: FloatArray, target: FloatArray) -> tuple[EyeSocket, ...]:
    """Eyeballs moved with the centres of their lids and scaled with the length of the eyes."""
    found = []
    for eye, lids, (outer, inner) in zip(eyes_from_right(face), LID_RINGS, EYE_CORNERS, strict=True):
        edge = list(lids)
        longer = np.linalg.norm(target[outer] - target[inner]) / np.linalg.norm(rest[outer] - rest[inner])
        scale = float(np.clip(longer, *EYE_SCALE_LIMITS))
        centre = np.asarray(eye.centre, np.float64)
        after = target[edge].mean(axis=0) + scale * (centre - rest[edge].mean(axis=0))
        around = face.vertices[eye.first : eye.first + eye.count].astype(np.float64) - centre
        found.append(EyeSocket(centre, float(np.median(np.linalg.norm(around, axis=1))), after, scale))
    return tuple(found)


def eyes_from_right(face: Face) -> list[Eye]:
    """Eyes ordered from the person's right to left."""
    return sorted(face.eyes, key=lambda eye: float(eye.centre[0]))


def part_vertices(face: Face, starts: tuple[str, ...]) -> NDArray[np.int64]:
    """Vertices of the parts with one of the name prefixes."""
    spans = [
        face.triangles[part.first : part.first + part.count] for part in face.parts if part.name.startswith(starts)
    ]
    return np.unique(np.concatenate(spans)).astype(np.int64)
