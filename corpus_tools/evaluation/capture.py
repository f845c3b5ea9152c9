"""An ARKit capture as recordings of somebody: lips as it shows them on the default head, phones from its sound."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.effort import Effort
from corpus_tools.listen import Ears
from corpus_tools.observation import Observation, Quality, trimmed
from lexicon.errors import DataError, InputError
from tts2face.face.file import load_face
from tts2face.face.model import Face
from tts2face.landmarks import N_LANDMARKS
from tts2face.mimic import motion_of_capture
from tts2face.speech.loudness import intensity
from tts2face.speech.pauses import stretches
from tts2face.video.livelink import read_livelink

SUFFIX = ".csv"
SOUNDS = (".flac", ".wav", ".mp3", ".m4a", ".ogg", ".opus", ".mov", ".mp4")
LONGEST_S = 6.0  # cut at pauses into utterances of about a sentence: intervals come from drawing utterances again


def captured(path: Path, effort: Effort) -> tuple[Observation, ...]:
    """Utterances of a Live Link Face capture and the one sound file that lies beside it, in sync with it.

    Raises
    ------
    InputError
        There is no such capture, or no sound beside it, or several.
    DataError
        The capture or its sound cannot be read, or nobody speaks.
    BackendError
        Nothing on this machine recognises phones.
    """
    capture = read_livelink(path)
    sound = _sound_of(path)
    face = load_face("head")
    motion = motion_of_capture(capture, face).face
    ears = Ears(effort.folder())
    found = []
    for number, span in enumerate(stretches(ears.sound(sound), LONGEST_S), start=1):
        begin, end = (round(second * motion.fps) for second in span)
        landmarks = landmarks_of(face, motion.values[begin:end])
        found.append(_observed(f"{path.stem}-{number:02d}", (ears, sound), span, landmarks, motion.fps))
    return tuple(found)


def _observed(
    name: str, heard_in: tuple[Ears, Path], span: tuple[float, float], landmarks: NDArray[np.float32], fps: float
) -> Observation:
    ears, sound = heard_in
    heard = ears.heard(sound, None, span)
    phones, words = trimmed(heard, 0.0, len(landmarks) / fps)
    return Observation(
        name,
        fps,
        landmarks,
        np.zeros((len(landmarks), 6), np.float32),
        phones,
        words,
        intensity(heard.sound, np.arange(len(landmarks)) / fps),
        Quality(heard.confidence, 1.0, 0, cut=span[0]),
        sound,
        is_recognised=True,
    )


def landmarks_of(face: Face, weights: NDArray[np.floating]) -> NDArray[np.float32]:
    """(T, L, 3) landmarks of a face for (T, K) weights of its shapes, the head at rest.

    Raises
    ------
    DataError
        The face lacks landmarks.
    """
    if len(face.landmarks) != N_LANDMARKS:
        raise DataError(f"the face has {len(face.landmarks)} of {N_LANDMARKS} landmarks; build it again")
    mixed = face.landmark_weights[..., None]
    rest = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)
    moved = (face.shapes[:, face.landmark_vertices] * mixed).sum(axis=2)
    points = np.zeros((len(weights), N_LANDMARKS, 3), np.float32)
    points[:, face.landmarks] = rest + np.tensordot(weights, moved, axes=1)
    return points


def _sound_of(path: Path) -> Path:
    beside = sorted(one for one in path.parent.iterdir() if one.suffix.lower() in SOUNDS)
    same = [one for one in beside if one.stem == path.stem]
    found = same or beside
    if len(found) != 1:
        raise InputError(f"beside {path.name} lie {len(found)} sound files; put one there, or one of its name")
    return found[0]
