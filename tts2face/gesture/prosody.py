"""What a voice tells a face besides its words: how loud and how high it is, against its own mean."""

import numpy as np
from numpy.typing import NDArray

from tts2face.speech.features import speech_level
from tts2face.speech.loudness import intensity, pitch
from tts2face.types import Waveform

QUIET_DB, LOUD_DB = -35.0, 10.0  # against the mean level of speech; what lies beyond tells nothing more
AUDIBLE_DB = 30.0  # a sound whose loudest instant is below, against 20 micropascals, holds no speech
HIGH_SEMITONES = 12.0
SILENT_PROSODY = np.array([QUIET_DB, 0.0], np.float32)
MIN_PITCH_SOUND_S = 0.1  # shorter sounds have no pitch

Float32Array = NDArray[np.float32]


def prosody_features(sound: Waveform, times: NDArray[np.float64], *, with_pitch: bool) -> Float32Array:
    """(T, 1 or 2) intensity in dB against the sound's speech, and pitch in semitones against its median.

    Instants beyond the sound are silent.
    """
    heard = np.tile(SILENT_PROSODY[: 2 if with_pitch else 1], (len(times), 1))
    if sound.duration < MIN_PITCH_SOUND_S:
        return heard
    grid = np.arange(0.0, sound.duration, 0.02)
    levels = intensity(sound, grid)
    inside = (times >= 0.0) & (times < sound.duration)
    if levels.max() < AUDIBLE_DB:
        return heard
    level = speech_level(levels[:, None])
    heard[inside, 0] = np.clip(intensity(sound, times[inside]) - level, QUIET_DB, LOUD_DB)
    if with_pitch:
        heard[inside, 1] = np.clip(pitch(sound, times[inside]), -HIGH_SEMITONES, HIGH_SEMITONES)
    return heard
