"""Prosodic features of speech: intensity and pitch relative to the speaker's own level and median."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Float32Array
from tts2face.sound.pauses import speech_level
from tts2face.sound.praat import IntensityTrack, intensity_track, pitch
from tts2face.types import Waveform

AUDIBLE_DB = 30.0  # relative to 20 micropascals; a sound with a lower maximum contains no speech
# an octave above or below the median
HIGH_SEMITONES = 12.0
QUIET_DB, PROSODY_LOUD_DB = -35.0, 10.0  # limits relative to the mean level of speech; values beyond are clipped
SILENT_PROSODY = np.array([QUIET_DB, 0.0], np.float32)
PAUSE_DB = -20.0  # intensity of a pause, relative to the mean level of speech
LEVEL_STEP_S = 0.02  # between the instants from which the level of speech is taken
MIN_PITCH_SOUND_S = 0.1  # shorter sounds have no pitch


@dataclass(frozen=True, slots=True, eq=False)
class SpeechIntensity:
    """Intensity of a sound, and the mean level of speech in it in dB; None where it contains none."""

    track: IntensityTrack
    level: float | None


def speech_intensity(sound: Waveform) -> SpeechIntensity | None:
    """Intensity of a sound for `prosody_features`; None for a sound too short to have a pitch."""
    if sound.duration < MIN_PITCH_SOUND_S:
        return None
    return with_speech_level(intensity_track(sound), 0.0, sound.duration)


def with_speech_level(track: IntensityTrack, start: float, end: float) -> SpeechIntensity:
    """Intensity, and the mean level of speech from and to seconds of it."""
    levels = track.at(np.arange(start, end, LEVEL_STEP_S))
    is_audible = levels.max() >= AUDIBLE_DB
    return SpeechIntensity(track, speech_level(levels[:, None], LEVEL_STEP_S) if is_audible else None)


def prosody_features(
    sound: Waveform, times: NDArray[np.float64], intensity: SpeechIntensity | None, *, with_pitch: bool
) -> Float32Array:
    """(T, 1 or 2) intensity in dB relative to the mean level of speech, and pitch in semitones relative to the median.

    Times (T,) are in seconds; those outside the sound count as silence. `intensity` is its `speech_intensity`.
    """
    features = np.tile(SILENT_PROSODY[: 2 if with_pitch else 1], (len(times), 1))
    if intensity is None or intensity.level is None:
        return features
    inside = (times >= 0.0) & (times < sound.duration)
    features[inside, 0] = np.clip(intensity.track.at(times[inside]) - intensity.level, QUIET_DB, PROSODY_LOUD_DB)
    if with_pitch:
        features[inside, 1] = np.clip(pitch(sound, times[inside]), -HIGH_SEMITONES, HIGH_SEMITONES)
    return features
