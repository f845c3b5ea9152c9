"""Intensity and pitch of a voice over time, by Praat."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.types import Waveform

MIN_PITCH_HZ = 100.0  # intensity is averaged over 3.2 periods of this pitch, 32 ms (Praat's rule)
MIN_INTENSITY_DB = 0.0  # threshold of hearing, for digital silence, which has no level
PITCH_RANGE_HZ = (75.0, 600.0)  # Praat's default
SEMITONES_PER_OCTAVE = 12.0


def intensity(sound: Waveform, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """(T,) intensity of a sound in dB relative to 20 micropascals, at times (T,) in seconds.

    Raises
    ------
    DataError
        The sound is shorter than the analysis window.
    """
    import parselmouth

    try:
        levels = _praat_sound(sound).to_intensity(minimum_pitch=MIN_PITCH_HZ, subtract_mean=True)
    except parselmouth.PraatError as refused:
        raise DataError(
            f"a sound of {sound.duration:.3f} s is too short to measure; give a longer recording"
        ) from refused
    values = np.maximum(
        np.nan_to_num(levels.values[0], nan=MIN_INTENSITY_DB, neginf=MIN_INTENSITY_DB), MIN_INTENSITY_DB
    )
    at_times: NDArray[np.float64] = np.interp(times, levels.xs(), values)
    return at_times.astype(np.float32)


def pitch(sound: Waveform, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """(T,) pitch in semitones relative to the sound's median, at times (T,) in seconds; 0 for unvoiced frames.

    Raises
    ------
    DataError
        The sound is shorter than the analysis window.
    """
    import parselmouth

    low, high = PITCH_RANGE_HZ
    try:
        found = _praat_sound(sound).to_pitch_ac(pitch_floor=low, pitch_ceiling=high)
    except parselmouth.PraatError as refused:
        raise DataError(
            f"a sound of {sound.duration:.3f} s is too short to have a pitch; give a longer one"
        ) from refused
    hertz = np.interp(times, found.xs(), found.selected_array["frequency"])
    nearest = np.clip(np.rint((times - found.xs()[0]) / found.dx).astype(int), 0, found.n_frames - 1)
    voiced = found.selected_array["frequency"][nearest] > low
    if not voiced.any():
        return np.zeros(len(times), np.float32)
    median = float(np.median(hertz[voiced]))
    semitones = SEMITONES_PER_OCTAVE * np.log2(np.maximum(hertz, low) / median)
    return np.where(voiced, semitones, 0.0).astype(np.float32)


def _praat_sound(sound: Waveform):  # type: ignore[no-untyped-def] # parselmouth has no types
    import parselmouth

    return parselmouth.Sound(sound.samples.astype(np.float64), sampling_frequency=sound.rate)
