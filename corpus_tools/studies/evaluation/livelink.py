"""Reference utterances from an ARKit capture: lips of the default head moved by it, phones from its sound."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import find_capture_sound
from corpus_tools.recordings.observation import Observation, Quality, trim_to_picture
from corpus_tools.recordings.sound import CachedAligner
from corpus_tools.run_options import RunOptions
from lexicon.errors import InputError
from tts2face.face.landmarks import moved_landmarks
from tts2face.lips.performer import match_shapes
from tts2face.models.face_loading import load_face
from tts2face.sound.pauses import cut_at_pauses
from tts2face.sound.praat import intensity
from tts2face.video.livelink import read_livelink

LIVELINK_SUFFIX = ".csv"
MAX_UTTERANCE_S = 6.0  # cut at pauses into utterances of about a sentence, which the bootstrap resamples


def observe_livelink(path: Path, run_options: RunOptions) -> tuple[Observation, ...]:
    """Utterances of a Live Link Face capture and the one sound file that lies beside it, in sync with it.

    Raises
    ------
    InputError
        There is no such capture, or no sound beside it, or several.
    DataError
        The capture or its sound cannot be read, or it contains no speech.
    BackendError
        No phone recogniser is installed.
    """
    capture = read_livelink(path)
    sound = find_capture_sound(path)
    if sound is None:
        raise InputError(f"there is no sound file beside {path.name}; put one there")
    face = load_face("head")
    motion = match_shapes(capture.weights, face)
    aligner = CachedAligner(run_options.folder())
    found = []
    for number, span in enumerate(cut_at_pauses(aligner.sound(sound), MAX_UTTERANCE_S), start=1):
        start, end = (round(second * motion.fps) for second in span)
        landmarks = moved_landmarks(face, motion.part(start, end))
        found.append(_build_observation(f"{path.stem}-{number:02d}", (aligner, sound), span, landmarks, motion.fps))
    return tuple(found)


def _build_observation(
    name: str,
    source: tuple[CachedAligner, Path],
    span: tuple[float, float],
    landmarks: NDArray[np.float32],
    fps: float,
) -> Observation:
    aligner, sound = source
    speech = aligner.align(sound, None, span)
    phones, words = trim_to_picture(speech, 0.0, len(landmarks) / fps)
    return Observation(
        name,
        fps,
        landmarks,
        np.zeros((len(landmarks), 6), np.float32),
        phones,
        words,
        intensity(speech.sound, np.arange(len(landmarks)) / fps),
        Quality(speech.fit, 1.0, 0, cut=span[0]),
        sound,
        is_recognised=True,
    )
