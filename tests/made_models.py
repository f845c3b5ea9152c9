"""Talker and palette of the small made world, whose motion is known."""

from collections.abc import Sequence

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tests.made_face import BROWS, CHEEKS, MOUTH_WIDTH, jaw_share, landmark_places
from tts2face.models.landmarks import (
    CHIN,
    FACE_OVAL,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    N_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
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
from tts2face.models.talker import ShapeModel, Talker, Utterance

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


def made_model() -> ShapeModel:
    """Parameter 0 opens the mouth, 1 widens it, 2 moves a point of the chin ahead, 3 one of the forehead up."""
    mean = landmark_places()
    basis = np.zeros((4, N_LANDMARKS, 3))
    basis[0, :, 1] = -jaw_share(mean)
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
