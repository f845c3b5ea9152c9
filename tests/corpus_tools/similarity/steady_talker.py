"""A talker with known classes: three mouth shapes with three phones each, distinct in lip opening and width."""

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, MOUTH_CORNER_LEFT, MOUTH_CORNER_RIGHT, N_LANDMARKS
from tts2face.models.talker import ShapeModel, Talker, Utterance

FPS = 50.0
PHONE_S = 0.12
POSES = {
    "p": (0.0, 0.0), "b": (0.3, 0.2), "m": (0.5, -0.2),
    "u": (4.0, -8.0), "o": (4.5, -7.5), "w": (3.5, -8.5),
    "a": (14.0, 2.0), "ɛ": (13.0, 2.6), "æ": (14.5, 1.5),
    SILENCE: (0.0, 0.0),
}  # fmt: skip
OTHER = (6.0, 0.0)
BLOCKS = ({"p", "b", "m"}, {"u", "o", "w"}, {"a", "ɛ", "æ"})
POSITIONS = ("head", "middle", "tail")


def made_model() -> ShapeModel:
    """Mode 0 opens the lips by 1 mm a unit, mode 1 widens them by 1.4 mm, mode 2 lifts a point of the chin."""
    basis = np.zeros((3, N_LANDMARKS, 3), np.float32)
    basis[0, LOWER_LIP_INNER_MID, 1] = -1.0
    basis[1, MOUTH_CORNER_LEFT, 0] = np.sqrt(0.5)
    basis[1, MOUTH_CORNER_RIGHT, 0] = -np.sqrt(0.5)
    basis[2, 200, 1] = 1.0
    spread = np.array([6.0, 4.0 * np.sqrt(0.5), 1.0], np.float32)
    return ShapeModel(np.zeros((N_LANDMARKS, 3), np.float32), basis, spread, 3, np.zeros(3, np.float32))


def made_talker(n_utterances: int = 60, seed: int = 1, gain: float = 1.0, phones: tuple[str, ...] = ()) -> Talker:
    """Each phone holds its pose with a little noise; mode 2 is noise alone. `gain` scales the closed phones apart."""
    stream = np.random.default_rng(seed)
    speech = phones or tuple(label for label in POSES if label != SILENCE)
    utterances = []
    for number in range(n_utterances):
        labels = [SILENCE, *(speech[at] for at in stream.permutation(len(speech))), SILENCE]
        edges = np.arange(len(labels) + 1) * PHONE_S
        phone_at = np.minimum((np.arange(round(edges[-1] * FPS)) / FPS / PHONE_S).astype(int), len(labels) - 1)
        poses = np.array([(*POSES.get(label, OTHER), 0.0) for label in labels])
        poses[[label in BLOCKS[0] for label in labels], 1] *= gain
        shape = poses[phone_at] + stream.normal(0.0, (0.5, 0.5, 1.0), (len(phone_at), 3))
        shape[:, 1] *= np.sqrt(0.5)  # POSES are mm
        third = len(speech) // 3
        words = tuple(
            WordSpan(f"{POSITIONS[k]}{number % 4}", 1 + k * third, 1 + (k + 1) * third) for k in range(3)
        )  # fmt: skip
        still = np.zeros((len(phone_at), 6), np.float32)
        sequence = PhoneSequence(labels, edges)
        utterances.append(Utterance(f"u{number}", sequence, words, shape.astype(np.float32), still, still[:, 0]))
    return Talker(FPS, made_model(), tuple(utterances), {"name": "made"})
