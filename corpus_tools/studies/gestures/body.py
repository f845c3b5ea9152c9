"""Measures of the body's own motion: breaths, micro-saccades and pupils of minutes of speech and silence."""

from dataclasses import dataclass

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.breathing import BREATH_SHAPE, Breathing
from tts2face.face.pupils import DILATION, PUPIL_SHAPE, Pupils
from tts2face.gestures.gaze import microsaccades
from tts2face.models.palette import GESTURE_FPS
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory

MINUTES = 4
PHRASE_S, PAUSE_S = 3.0, 0.5
RISING = 0.001  # of a full breath in a frame
LEAST_JUMP_DEG = 0.06  # of eyes in a frame: they drift by less


@dataclass(frozen=True, slots=True)
class BodyMeasure:
    """A measure, its value, and the range that its source gives."""

    name: str
    value: float
    unit: str
    published: tuple[float, float]
    source: str


def measure_body(seed: int) -> tuple[BodyMeasure, ...]:
    """Measures of a seed."""
    silence = PhoneSequence([SILENCE], [0.0, 60.0 * MINUTES])
    pauses = np.arange(0, 60.0 * MINUTES, PHRASE_S + PAUSE_S)
    edges = np.sort(np.concatenate([pauses, pauses + PAUSE_S]))
    speech = PhoneSequence([SILENCE, "ɑ"] * (len(edges) // 2 - 1) + [SILENCE], edges.tolist())
    still, spoken = (_channels(phones, seed) for phones in (silence, speech))
    eyes = np.degrees(microsaccades(np.arange(GESTURE_FPS * 60 * MINUTES) / GESTURE_FPS, seed))
    jumps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    jumps = jumps[jumps > LEAST_JUMP_DEG]
    pupils = 1 + DILATION * still[:, 1]
    return (
        BodyMeasure("breaths at rest", _breaths(still[:, 0]), "a minute", (12, 18), "Conrad and Schönle 1979"),
        BodyMeasure("breaths in speech", _breaths(spoken[:, 0]), "a minute", (8, 25), "Winkworth et al. 1995"),
        BodyMeasure("micro-saccades", len(jumps) / 60 / MINUTES, "a second", (1, 2), "Martinez-Conde et al. 2004"),
        BodyMeasure("their size, median", float(np.median(jumps)), "degrees", (0.1, 1), "Martinez-Conde et al. 2004"),
        BodyMeasure("pupils, deviation", 100 * float(pupils.std() / pupils.mean()), "%", (2, 10), "Stark et al. 1958"),
        BodyMeasure(
            "wider in speech by",
            100 * DILATION * float(spoken[:, 1].mean() - still[:, 1].mean()),
            "%",
            (2, 15),
            "Kahneman and Beatty 1966",
        ),
    )


def _channels(phones: PhoneSequence, seed: int) -> FloatArray:
    """(T, 2) breath and pupils with phones."""
    n_frames = round(float(phones.edges[-1]) * GESTURE_FPS)
    motion = Trajectory((BREATH_SHAPE, PUPIL_SHAPE), np.zeros((n_frames, 2), np.float32), float(GESTURE_FPS))
    breathing, pupils = Breathing(0), Pupils(1)
    moved, _ = pupils.apply(breathing.apply(motion, phones, seed, None)[0], phones, seed, None)
    return moved.values.astype(np.float64)


def _breaths(level: FloatArray) -> float:
    """Breaths a minute: beginnings of a rise."""
    rises = np.diff(level) > RISING
    starts = int((rises[1:] & ~rises[:-1]).sum())
    return starts * 60 * GESTURE_FPS / len(level)
