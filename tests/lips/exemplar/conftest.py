"""A tiny talker with a known answer: every phone has one mouth opening, at its centre."""

import numpy as np
import pytest

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, N_LANDMARKS, UPPER_LIP_INNER_MID
from tts2face.models.talker import ShapeModel, Talker, Utterance

FPS = 25.0
OPENINGS = {"p": 0.0, "b": 0.0, "m": 0.5, "f": 2.0, "s": 4.0, "t": 4.5, "i": 8.0, "ɑ": 16.0, "u": 6.0, SILENCE: 1.0}
WIDTHS = {"i": 4.0, "s": 2.0, "u": -5.0}


def made_talker(n_utterances: int = 40, seed: int = 3) -> Talker:
    """Utterances of random phones; parameter 0 opens the lips by 1 mm per unit, 1 widens them, 2 is noise."""
    stream = np.random.default_rng(seed)
    speech = [label for label in OPENINGS if label != SILENCE]
    utterances = []
    for number in range(n_utterances):
        labels = [SILENCE, *(speech[at] for at in stream.integers(0, len(speech), 10)), SILENCE]
        durations = [0.4, *stream.uniform(0.06, 0.16, 10), 0.4]
        phones = PhoneSequence(labels, np.concatenate([[0.0], np.cumsum(durations)]))
        times = np.arange(int(phones.end * FPS)) / FPS
        middles = (phones.edges[:-1] + phones.edges[1:]) / 2
        shape = np.zeros((len(times), 4), np.float32)
        shape[:, 0] = np.interp(times, middles, [OPENINGS[label] for label in labels])
        shape[:, 1] = np.interp(times, middles, [WIDTHS.get(label, 0.0) for label in labels])
        shape[:, 2] = stream.normal(0.0, 0.1, len(times))
        still = np.zeros((len(times), 6), np.float32)
        utterances.append(Utterance(f"u{number:03d}", phones, (), shape, still, still[:, 0]))
    return Talker(FPS, made_model(), tuple(utterances), {"name": "made"})


def made_model() -> ShapeModel:
    basis = np.zeros((4, N_LANDMARKS, 3), np.float32)
    basis[0, LOWER_LIP_INNER_MID, 1] = -1.0
    basis[1, 61, 0], basis[1, 291, 0] = -(0.5**0.5), 0.5**0.5
    basis[2, 152, 2] = 1.0
    basis[3, 10, 1] = 1.0
    mean = np.zeros((N_LANDMARKS, 3), np.float32)
    mean[UPPER_LIP_INNER_MID, 1] = mean[LOWER_LIP_INNER_MID, 1] = -40.0
    mean[33, 0], mean[263, 0], mean[61, 0], mean[291, 0] = -45.0, 45.0, -25.0, 25.0
    spread = np.array([5.0, 2.5, 0.1, 0.1], np.float32)
    return ShapeModel(mean, basis, spread, 3, np.array([1.0, 0.0, 0.0, 0.0], np.float32))


@pytest.fixture(scope="session")
def talker() -> Talker:
    return made_talker()


@pytest.fixture(scope="session")
def voice(talker: Talker) -> ExemplarModel:
    return build_exemplar_model(talker)
