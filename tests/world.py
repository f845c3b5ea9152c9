"""A small made world with known answers: a talker, a face, a palette and a voice, in memory and as files.

Doors, sessions, gestures and exports are tested on it where the shipped models are not the subject. A command, or a
process of its own, finds the files by ``--talker``, ``--face`` and ``--palette``, and the voice of tones, a plugin, by
``--voice tones`` (`World.environment`).
"""

import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from lexicon.languages import language_code
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.models.face import Eye, Face, FacePart
from tts2face.models.face_file import read_face, write_face
from tts2face.models.landmarks import (
    CHIN,
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LEFT_LIDS,
    N_LANDMARKS,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    RIGHT_LIDS,
)
from tts2face.models.palette import (
    FIXED_CHANNELS,
    REGION_FEATURES,
    Delivery,
    Derivation,
    FaceRegion,
    FeatureChange,
    Palette,
    Style,
)
from tts2face.models.palette_file import read_palette, write_palette
from tts2face.models.talker import ShapeModel, Talker, Utterance
from tts2face.models.talker_file import read_talker, write_talker
from tts2face.plugins import declared
from tts2face.session.session import Session
from tts2face.sound.voice import (
    PronunciationMap,
    SpeechInput,
    Voice,
    VoiceInfo,
    VoiceSetting,
    pronounce_content,
)
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import Speech, Waveform

ROOT = Path(__file__).resolve().parents[1]

# The face: x to its own left, y up, z ahead, in mm.
MOUTH, MOUTH_WIDTH, LIP_HEIGHT = (0.0, -60.0), 50.0, 9.0
EYES, EYE_WIDTH, EYE_HEIGHT, EYEBALL = ((32.0, 0.0), (-32.0, 0.0)), 28.0, 10.0, 12.0
OVAL, OVAL_SIZE = (0.0, -20.0), (70.0, 95.0)
NOSE = (168, 6, 197, 195, 5, 4, 1, 2)  # landmarks from its root to its base
BROWS = ((300, 293, 334, 296, 336), (70, 63, 105, 66, 107))  # from the temples to the nose, left and right
IRISES = (range(473, 478), range(468, 473))
LIDS = (LEFT_LIDS, RIGHT_LIDS)
CHEEKS = ((425, 427, 411, 426, 436), (205, 207, 187, 206, 216))  # left and right
CHIN_SKIN = (208, 171, 175, 199, 396, 428)
LIPS = (*OUTER_LIP_UPPER, *OUTER_LIP_LOWER[1:-1], *INNER_LIP_UPPER, *INNER_LIP_LOWER[1:-1])
N_OTHER = 12  # places of landmarks without a name
PUPIL, SKIN, EYE_WHITE = (20, 30, 60), (206, 150, 124), (240, 240, 240)
GAZE_TURN = 0.5  # rad at weight 1
SPOKEN_SHAPES = {  # mm of the lips' corners outwards, of the upper and the lower lip upwards, of the lips ahead
    "mouthClose": (0.0, 0.0, 6.0, 0.0),
    "jawOpen": (-3.0, 0.0, -22.0, 0.0),
    "mouthFunnel": (-4.0, 3.0, -4.0, 4.0),
    "mouthPucker": (-8.0, 0.0, 0.0, 5.0),
    "mouthSmile": (8.0, 1.0, 1.0, -1.0),
    "mouthLowerDown": (0.0, 0.0, -6.0, 0.0),
}
ONE_SIDED = ("mouthSmile", "mouthLowerDown")

# The talker: the opening of the mouth in the middle of each phone, and how much wider it is than at rest, in mm.
TALKER_FPS = 25.0
OPENINGS = {
    "p": 0.0, "b": 0.0, "m": 0.5, "f": 2.0, "s": 4.0, "t": 4.5, "k": 5.0, "n": 4.5, "u": 6.0, "i": 8.0, "ɛ": 11.0,
    "ɑ": 16.0, SILENCE: 1.0,
}  # fmt: skip
WIDTHS = {"i": 4.0, "s": 2.0, "ɛ": 1.0, "u": -5.0}
N_UTTERANCES = 4  # each holds every phone once

# The palette.
RECORDINGS = (70, 70, 60)  # frames
N_MODES = 2
MOODS = {
    "neutral": Derivation("calm", {"expression": FeatureChange(offset={"happy": 0.1})}, "calm, a little happier"),
    "depressed": Derivation(
        "calm", {"expression": FeatureChange(offset={"sad": 0.6}), "head": FeatureChange(gain=0.5)}, "sad",
        Delivery(0.9, -2.0),
    ),
    "delighted": Derivation(
        "calm", {"expression": FeatureChange(offset={"happy": 0.6}), "head": FeatureChange(gain=1.5)}, "happy",
        Delivery(1.05, 1.0),
    ),
    "annoyed": Derivation("wild", {"expression": FeatureChange(offset={"angry": 0.5})}, "wild, and angry"),
}  # fmt: skip

# The voice of tones.
VOICE = "tones"
RATE_HZ = 8000  # the lowest at which loudness is measured
LEAD_S, TRAIL_S, PHONE_S, LEVEL = 0.2, 0.3, 0.1, 0.25
LOWEST_HZ, STEP_HZ, N_TONES = 200.0, 40.0, 61


def landmark_places() -> np.ndarray:
    """(478, 3) landmarks of the face and of the talker at rest, lips closed."""
    few = _arc(OVAL, 1.6 * OVAL_SIZE[0], 0.8 * OVAL_SIZE[1], N_OTHER)
    flat = np.resize(few, (N_LANDMARKS, 2))  # landmarks without a name share places on the forehead: they cost little
    angles = np.pi / 2 - 2 * np.pi * np.arange(len(FACE_OVAL)) / len(FACE_OVAL)  # from the top over the left cheek
    flat[list(FACE_OVAL)] = np.add(OVAL, np.multiply(OVAL_SIZE, np.column_stack([np.cos(angles), np.sin(angles)])))
    for outer, inner, up in ((OUTER_LIP_UPPER, INNER_LIP_UPPER, 1.0), (OUTER_LIP_LOWER, INNER_LIP_LOWER, -1.0)):
        for lips, width, height in ((outer, MOUTH_WIDTH, LIP_HEIGHT), (inner, 0.9 * MOUTH_WIDTH, 0.0)):
            flat[list(lips)] = _arc(MOUTH, width, up * height, len(lips))
    for (x, y), lids, brow, iris in zip(EYES, LIDS, BROWS, IRISES, strict=True):
        side = np.sign(x)
        for lid, up in zip(lids, (1.0, -1.0), strict=True):  # both from the outer corner to the inner one
            flat[list(lid)] = _arc((x, y), -side * EYE_WIDTH, up * EYE_HEIGHT / 2, len(lid))
        flat[list(brow)] = _arc((x, y + 18.0), -side * 40.0, 5.0, len(brow))
        flat[iris[0]], flat[list(iris[1:])] = (x, y), np.add((x, y), [(5, 0), (0, 5), (-5, 0), (0, -5)])
    for numbers, (x, y) in ((CHEEKS[0], (38.0, -42.0)), (CHEEKS[1], (-38.0, -42.0)), (CHIN_SKIN, (0.0, -92.0))):
        flat[list(numbers)] = _arc((x, y), 16.0, -4.0, len(numbers))
    flat[list(NOSE)] = np.column_stack([np.zeros(len(NOSE)), np.linspace(2.0, -32.0, len(NOSE))])
    depth = 40.0 - 60.0 * np.square((flat - OVAL) / OVAL_SIZE).sum(axis=1)
    depth[list(NOSE)] += np.linspace(0.0, 20.0, len(NOSE))
    depth[N_MESH_LANDMARKS:] += EYEBALL / 2
    return np.column_stack([flat, depth])


def _arc(centre: tuple[float, float], width: float, height: float, n: int) -> np.ndarray:
    """(n, 2) points of half an ellipse, from its end at the lower x to the other one."""
    angles = np.linspace(np.pi, 0.0, n)
    return np.asarray(centre) + np.column_stack([width / 2 * np.cos(angles), height * np.sin(angles)])


def made_face() -> Face:
    """73 vertices of skin, most of them landmarks, two eyeballs of 6, and 18 shapes of jaw, lips, lids and gaze."""
    places = landmark_places()
    lids = [lid[at] for pair in LIDS for lid in pair for at in ((0, 4, 5, 8) if lid is pair[0] else (4, 5))]
    few = (*FACE_OVAL[::4], *NOSE[::3], *(number for pair in (*BROWS, *CHEEKS) for number in pair[::4]), CHIN_SKIN[2])
    numbers = [*LIPS, *lids, *few]
    spread = places.copy()  # with an open mouth, so that no triangle lies across the lips
    lower = list(INNER_LIP_LOWER[1:-1])
    spread[lower, 1] -= LIP_HEIGHT / 2
    spread[list(INNER_LIP_UPPER[1:-1]), 1] += LIP_HEIGHT / 2
    mesh = Delaunay(spread[numbers, :2])
    skin = mesh.simplices[~_is_hole(spread[numbers][mesh.simplices][..., :2].mean(axis=1))]
    n_skin, ball = len(numbers), _octahedron()
    blocks = [places[numbers], *(np.array((x, y, _eye_depth(places))) + EYEBALL * ball for x, y in EYES)]
    vertices = np.concatenate(blocks).astype(np.float32)
    ball_triangles = _outwards(ball, np.array([(a, b, c) for a in (0, 1) for b in (2, 3) for c in (4, 5)]))
    triangles = [_facing(vertices, skin), *(ball_triangles + n_skin + k * len(ball) for k in range(2))]
    firsts = np.cumsum([0, *map(len, triangles)])
    colours = np.repeat([SKIN, EYE_WHITE], [n_skin, 2 * len(ball)], axis=0).astype(np.uint8)
    colours[[n_skin + 4, n_skin + len(ball) + 4]] = PUPIL
    names, shapes = _face_shapes(vertices, numbers)
    corners, weights = _landmark_weights(mesh, spread, numbers)
    centres = [block.mean(axis=0).astype(np.float32) for block in blocks[1:]]
    return Face(
        vertices=vertices,
        triangles=np.concatenate(triangles).astype(np.int32),
        parts=tuple(
            FacePart(name, int(first), len(part), specular=0.3, shininess=30.0)
            for name, first, part in zip(("skin", "eye_left", "eye_right"), firsts, triangles, strict=False)
        ),
        shape_names=names,
        shapes=shapes,
        limits=np.tile(np.float32([0.0, 1.0]), (len(names), 1)),
        eyes=tuple(
            Eye(n_skin + k * len(ball), len(ball), centre, _eye_turns(side))
            for k, (centre, side) in enumerate(zip(centres, ("Left", "Right"), strict=True))
        ),
        colours=colours,
        uv=None,
        textures=(),
        landmarks=np.arange(N_LANDMARKS, dtype=np.int32),
        landmark_vertices=corners,
        landmark_weights=weights,
        pivot=np.float32([0.0, -60.0, -60.0]),
        metadata={"name": "made", "licence": "none"},
        occlusion=np.zeros((2, len(vertices), 1), np.uint8),  # nothing hides it, which drawing need not find out
    )


def _is_hole(middles: np.ndarray) -> np.ndarray:
    """Whether points (N, 2) lie between the lips or the lids."""
    holes = [(MOUTH, 0.9 * MOUTH_WIDTH, LIP_HEIGHT / 2), *((eye, EYE_WIDTH, EYE_HEIGHT / 2) for eye in EYES)]
    inside = [np.square((middles - centre) / (width / 2, height)).sum(axis=1) < 1 for centre, width, height in holes]
    return np.any(inside, axis=0)


def _eye_depth(places: np.ndarray) -> float:
    return float(places[LEFT_LIDS[0][0], 2]) - EYEBALL / 2


def _octahedron() -> np.ndarray:
    return np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)


def _outwards(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[corner] for corner in triangles.T)
    turned = np.einsum("tk,tk->t", np.cross(b - a, c - a), a + b + c) < 0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)


def _facing(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Triangles in the order that faces the viewer."""
    a, b, c = (vertices[corner] for corner in triangles.T)
    away = np.cross(b - a, c - a)[:, 2] < 0
    return np.where(away[:, None], triangles[:, ::-1], triangles)


def _face_shapes(vertices: np.ndarray, numbers: Sequence[int]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names (K,) and displacements (K, V, 3): of the lips by `SPOKEN_SHAPES`, of the lids; none where eyes turn."""
    at = {number: row for row, number in enumerate(numbers)}
    x = vertices[: len(numbers), 0]
    upper = [at[number] for number in (*OUTER_LIP_UPPER[1:-1], *INNER_LIP_UPPER[1:-1])]
    lower = [at[number] for number in (*OUTER_LIP_LOWER[1:-1], *INNER_LIP_LOWER[1:-1])]
    near = np.exp(-np.square((vertices[: len(numbers), :2] - MOUTH) / (MOUTH_WIDTH, 2 * LIP_HEIGHT)).sum(axis=1))
    jaw = _jaw_share(vertices[: len(numbers)])
    middle = 1.0 - np.square(x / (MOUTH_WIDTH / 2))
    shapes: dict[str, np.ndarray] = {}
    for name, (wider, upper_up, lower_up, ahead) in SPOKEN_SHAPES.items():
        moved = np.zeros(vertices.shape, np.float32)
        moved[: len(numbers), 0] = wider * near * np.clip(x / (MOUTH_WIDTH / 2), -1, 1)
        moved[upper, 1] = upper_up * middle[upper]
        moved[lower, 1] = lower_up * middle[lower]
        moved[: len(numbers), 2] = ahead * near
        if name == "jawOpen":
            moved[: len(numbers), 1] += lower_up * jaw
        if name not in ONE_SIDED:
            shapes[name] = moved
            continue
        for side, share in (("Left", x > 1.0), ("Right", x < -1.0)):
            half = np.zeros(vertices.shape, np.float32)
            half[: len(numbers)] = moved[: len(numbers)] * (share + 0.5 * (np.abs(x) <= 1.0))[:, None]
            shapes[name + side] = half
    for side, (upper_lid, lower_lid) in zip(("Left", "Right"), LIDS, strict=True):
        moved = np.zeros(vertices.shape, np.float32)
        for k in (4, 5):
            moved[at[upper_lid[k]], 1] = vertices[at[lower_lid[k]], 1] - vertices[at[upper_lid[k]], 1]
        shapes[f"eyeBlink{side}"] = moved
    for name in (*_eye_turns("Left"), *_eye_turns("Right")):
        shapes[name] = np.zeros(vertices.shape, np.float32)
    return tuple(shapes), np.stack(list(shapes.values()))


def _jaw_share(places: np.ndarray) -> np.ndarray:
    """(N,) share of the jaw's motion that places (N, 3) have."""
    return np.clip((MOUTH[1] - LIP_HEIGHT - places[:, 1]) / 20.0, 0.0, 1.0)


def _eye_turns(side: str) -> dict[str, np.ndarray]:
    out = 1.0 if side == "Left" else -1.0
    axes = {"Up": (-1, 0, 0), "Down": (1, 0, 0), "In": (0, -out, 0), "Out": (0, out, 0)}
    return {f"eyeLook{way}{side}": np.float32(GAZE_TURN) * np.float32(axis) for way, axis in axes.items()}


def _landmark_weights(mesh: Delaunay, spread: np.ndarray, numbers: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """(478, 3) vertices around each landmark, and their weights; a landmark that is a vertex is it alone."""
    points = spread[:, :2]
    found = mesh.find_simplex(np.add(OVAL, 0.92 * (points - OVAL)))  # the oval has vertices at every fourth point
    corners = mesh.simplices[found].astype(np.int32)
    across = mesh.transform[found]
    first = np.einsum("nij,nj->ni", across[:, :2], points - across[:, 2])
    weights = np.clip(np.column_stack([first, 1.0 - first.sum(axis=1)]), 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    for row, number in enumerate(numbers):
        corners[number], weights[number] = row, (1.0, 0.0, 0.0)
    return corners, weights.astype(np.float32)


def made_model() -> ShapeModel:
    """Parameter 0 opens the mouth, 1 widens it, 2 moves a point of the chin ahead, 3 one of the forehead up."""
    mean = landmark_places()
    basis = np.zeros((4, N_LANDMARKS, 3))
    basis[0, :, 1] = -_jaw_share(mean)
    for lips in (INNER_LIP_LOWER, OUTER_LIP_LOWER):
        basis[0, list(lips[1:-1]), 1] = np.square(mean[list(lips[1:-1]), 0] / (MOUTH_WIDTH / 2)) - 1.0
    for lips in (OUTER_LIP_UPPER, OUTER_LIP_LOWER, INNER_LIP_UPPER, INNER_LIP_LOWER):
        basis[1, list(lips), 0] = mean[list(lips), 0]
    basis[2, CHIN, 2] = basis[3, FACE_OVAL[0], 1] = 1.0
    assert abs(np.sum(basis[0] * basis[1])) < 1e-9
    basis /= np.linalg.norm(basis.reshape(4, -1), axis=1)[:, None, None]
    spread = np.array([5.0, 2.5, 0.1, 0.1]) * parameters_per_mm(basis)
    rest = np.array([1.0, 0.0, 0.0, 0.0]) * parameters_per_mm(basis)
    return ShapeModel(*(array.astype(np.float32) for array in (mean, basis, spread)), 3, rest.astype(np.float32))


def parameters_per_mm(basis: np.ndarray) -> np.ndarray:
    """(4,) parameters that move the landmark that a mode (4, 478, 3) moves most by 1 mm."""
    return 1.0 / np.linalg.norm(basis, axis=2).max(axis=1)


def made_talker(n_utterances: int = N_UTTERANCES, seed: int = 3) -> Talker:
    """Utterances that hold each phone of `OPENINGS` once, whose mouth has its opening and width in their middles."""
    stream, model = np.random.default_rng(seed), made_model()
    scale = parameters_per_mm(model.basis.astype(np.float64))
    speech = [label for label in OPENINGS if label != SILENCE]
    utterances = []
    for number in range(n_utterances):
        labels = [SILENCE, *(speech[at] for at in stream.permutation(len(speech))), SILENCE]
        durations = [0.4, *stream.uniform(0.06, 0.16, len(speech)), 0.4]
        phones = PhoneSequence(labels, np.concatenate([[0.0], np.cumsum(durations)]))
        times = np.arange(int(phones.end * TALKER_FPS)) / TALKER_FPS
        middles = (phones.edges[:-1] + phones.edges[1:]) / 2
        moved = np.zeros((len(times), 4))
        moved[:, 0] = np.interp(times, middles, [OPENINGS[label] for label in labels])
        moved[:, 1] = np.interp(times, middles, [WIDTHS.get(label, 0.0) for label in labels])
        moved[:, 2] = stream.normal(0.0, 0.1, len(times))
        still, word = np.zeros((len(times), 6), np.float32), WordSpan("word", 1, len(labels) - 1)
        shape = (moved * scale).astype(np.float32)
        utterances.append(Utterance(f"u{number:03d}", phones, (word,), shape, still, still[:, 0]))
    about = {"name": "made", "language": "en-us", "sources": "made", "licence": "none"}
    return Talker(TALKER_FPS, model, tuple(utterances), about)


def made_style(seed: int, size: float = 1.0, lengths: Sequence[int] = RECORDINGS) -> Style:
    """Smooth random motion in every feature, with a loudness and a pitch of its own; blinks a second apart."""
    stream, n_frames = np.random.default_rng(seed), sum(lengths)
    channels = {name: len(names) for name, names in FIXED_CHANNELS.items()} | dict.fromkeys(REGION_FEATURES, N_MODES)
    motion = {name: size * _smooth(stream, n, n_frames) for name, n in channels.items()}
    motion["head"] *= np.float32([0.01, 0.01, 0.01, 1, 1, 1])
    motion["expression"] *= np.float32(0.05)
    motion["gaze"] *= np.float32(0.05)
    motion["blink"] = np.zeros((n_frames, 2), np.float32)
    for first in np.arange(0, n_frames - 30, 30) + stream.integers(0, 25, (n_frames - 1) // 30):
        motion["blink"][first : first + 5] = np.float32([0.25, 0.9, 1.0, 0.6, 0.25])[:, None]
    prosody = _smooth(stream, 2, n_frames)
    about = {"sources": "made", "licence": "none"}
    return Style(np.asarray(lengths, np.int32), 3 * prosody[:, 0] - 15, prosody[:, 1], motion, about)


def _smooth(stream: np.random.Generator, n_channels: int, n_frames: int) -> np.ndarray:
    steps = stream.normal(size=(n_channels, n_frames))
    return np.stack([np.convolve(row, np.hanning(15), "same") for row in steps], axis=1).astype(np.float32)


def made_palette() -> Palette:
    """The recorded styles "calm" and "wild", of 200 frames each, and `MOODS`; brows and cheeks rise and part."""
    modes = np.zeros((N_MODES, 10, 3), np.float32)
    modes[0, :, 1] = np.sqrt(0.1)
    modes[1, :, 0] = np.sqrt(0.1) * np.repeat([1.0, -1.0], 5)
    brows = np.array([number for brow in BROWS for number in brow], np.int32)
    regions = {
        "brows": FaceRegion(brows, modes),
        "cheeks": FaceRegion(np.array([*CHEEKS[0], *CHEEKS[1]], np.int32), modes),
    }
    styles = {"calm": made_style(1), "wild": made_style(2, 3.0)}
    return Palette(landmark_places().astype(np.float32), regions, styles, MOODS, {"name": "made"})


class ToneVoice:
    """A tone of 0.1 s for each phone, a silence of 0.2 s before and of 0.3 s after the words; of equal level."""

    def __init__(self, setting: VoiceSetting | None = None) -> None:
        self._setting = setting or VoiceSetting("en-us")

    @property
    def sample_rate(self) -> int:
        return RATE_HZ

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        words = pronounce_content(content, self._setting.language, self._setting.own_words)
        return spoken([(word.text + word.mark, word.phones) for word in words if word.phones], rate)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.speak(content, rate=rate, seed=seed).waveform


class LetterVoice:
    """A phone of 0.1 s and of constant level for each letter; `splits` words at hyphens, as some voices do."""

    def __init__(self, splits: bool = False, rate: int = RATE_HZ) -> None:
        self.said: list[tuple[str, float]] = []
        self._splits, self._rate = splits, rate

    @property
    def sample_rate(self) -> int:
        return self._rate

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.speak(content, rate=rate, seed=seed).waveform

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        self.said.append((str(content), rate))
        words = re.findall(r"\w+" if self._splits else r"[\w'-]+", str(content))
        return spoken([(word, ["a"] * len(word)) for word in words], rate, self._rate, has_tones=False)


def spoken(
    words: Sequence[tuple[str, Sequence[str]]], rate: float = 1.0, rate_hz: int = RATE_HZ, *, has_tones: bool = True
) -> Speech:
    """Speech of words with their phones, each a tone of its own, or a constant."""
    phones = [phone for _, said in words for phone in said]
    edges = np.concatenate([[0.0], LEAD_S + np.arange(len(phones) + 1) * PHONE_S / rate, [0.0]])
    n_samples = round((edges[-2] + TRAIL_S) * rate_hz)
    edges[-1] = n_samples / rate_hz
    bounds = np.rint(edges * rate_hz).astype(int)
    samples = np.zeros(n_samples, np.float32)
    for phone, first, last in zip(phones, bounds[1:-2], bounds[2:-1], strict=True):
        tone_hz = LOWEST_HZ + STEP_HZ * (sum(map(ord, phone)) % N_TONES)
        tone = np.sin(2 * np.pi * tone_hz / rate_hz * np.arange(last - first))
        samples[first:last] = LEVEL * (tone if has_tones else 1.0)
    firsts = 1 + np.cumsum([0, *(len(said) for _, said in words)])
    spans = tuple(WordSpan(text, int(firsts[k]), int(firsts[k + 1])) for k, (text, _) in enumerate(words))
    return Speech(Waveform(samples, rate_hz), PhoneSequence([SILENCE, *phones, SILENCE], edges), spans)


class WorldVoices(VoicePool):
    """Voices of which the default one is that of tones."""

    def voice(
        self, name: str | None, language: str, dictionary: PronunciationMap, *, keeps_utterances: bool = False
    ) -> Voice:
        if name is None:
            return ToneVoice(VoiceSetting(language_code(language), dictionary))
        return super().voice(name, language, dictionary, keeps_utterances=keeps_utterances)


TONES = VoiceInfo("a tone for each phone", ToneVoice, "none", "numpy", "-", "none")


@dataclass(frozen=True, slots=True)
class World:
    """The made world: in memory, and as files of a folder."""

    talker: Talker
    face: Face
    palette: Palette
    folder: Path

    @property
    def talker_file(self) -> Path:
        return self.folder / "made.talker"

    @property
    def face_file(self) -> Path:
        return self.folder / "made.face"

    @property
    def palette_file(self) -> Path:
        return self.folder / "made.palette"

    @property
    def models(self) -> list[str]:
        """Options of the command line for its files."""
        files = {"--talker": self.talker_file, "--face": self.face_file, "--palette": self.palette_file}
        return [str(word) for pair in files.items() for word in pair]

    @property
    def flags(self) -> list[str]:
        """Options of the command line for its files and its voice."""
        return [*self.models, "--voice", VOICE]

    @property
    def environment(self) -> Mapping[str, str]:
        """Variables with which a process of its own finds the voice."""
        return {"PYTHONPATH": os.pathsep.join([str(ROOT), str(self.folder), os.environ.get("PYTHONPATH", "")])}

    def session(self, **options: Any) -> Session:
        """A session of the world, whose default voice is that of tones; options as of `Session`."""
        own = {"face": self.face, "palette": self.palette, "voices": WorldVoices()}
        return Session(**{"talker": self.talker, **own, **options})


def make_world(folder: Path) -> World:
    """Write the files of the world into a folder; what is in memory is read from them, with their rounding."""
    talker, face, palette = (folder / f"made.{kind}" for kind in ("talker", "face", "palette"))
    write_talker(talker, made_talker())
    write_face(face, made_face(), {})
    write_palette(palette, made_palette())
    about = folder / "made_world-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: made_world\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[tts2face.voices]\n{VOICE} = tests.world:TONES\n")
    return World(read_talker(talker), read_face(face), read_palette(palette), folder)


@contextmanager
def voice_of_tones(world: World) -> Iterator[None]:
    """This process has the voice of tones."""
    sys.path.append(str(world.folder))
    declared.cache_clear()
    try:
        yield
    finally:
        sys.path.remove(str(world.folder))
        declared.cache_clear()
