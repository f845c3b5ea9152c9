"""Intensity and pitch of a voice over time, as Praat defines them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.types import Waveform

LOUDNESS_WINDOW_S, STEP_S = 0.064, 0.008  # analysis window and interval of Praat for a pitch of 100 Hz or more
THRESHOLD_POWER = 4e-10  # square of 20 micropascals
MIN_INTENSITY_DB = 0.0  # threshold of hearing, for digital silence, which has no level
# approximations 9.8.1 and 9.8.2 of Abramowitz and Stegun, which Praat uses: one bit would change gestures
BESSEL_BORDER = 3.75
BESSEL_SMALL = (1.0, 3.5156229, 3.0899424, 1.2067492, 0.2659732, 0.0360768, 0.0045813)
BESSEL_LARGE = (
    0.39894228, 0.01328592, 0.00225319, -0.00157565, 0.00916281, -0.02057706, 0.02635537, -0.01647633, 0.00392377,
)  # fmt: skip
PITCH_RANGE_HZ = (75.0, 600.0)  # Praat's default
SEMITONES_PER_OCTAVE = 12.0


@dataclass(frozen=True, slots=True, eq=False)
class IntensityTrack:
    """Intensity of a sound in dB relative to 20 micropascals: `levels` (n,) at `centres` (n,) in seconds."""

    centres: NDArray[np.float64]
    levels: NDArray[np.float64]

    def at(self, times: NDArray[np.float64]) -> NDArray[np.float32]:
        """(T,) intensity at times (T,) in seconds."""
        return np.interp(times, self.centres, self.levels).astype(np.float32)


def intensity(sound: Waveform, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """(T,) `intensity_track` of a sound at times (T,) in seconds."""
    return intensity_track(sound).at(times)


def intensity_track(sound: Waveform) -> IntensityTrack:
    """Intensity of a sound.

    Raises
    ------
    DataError
        The sound is shorter than the analysis window.

    Notes
    -----
    Mean square in a Kaiser-20 window, less the mean, as Praat's *Sound: To Intensity*. Own code, since the library
    takes 62 MB of memory at run time (decision 073).
    """
    period = 1.0 / sound.rate
    half = int(np.floor(LOUDNESS_WINDOW_S / 2 / period))
    duration = period * len(sound.samples)
    n_frames = int(np.floor((duration - LOUDNESS_WINDOW_S) / STEP_S)) + 1
    if n_frames < 1:
        raise DataError(f"a sound of {sound.duration:.3f} s is too short to measure; give a longer recording")
    place = np.arange(-half, half + 1) * period / (LOUDNESS_WINDOW_S / 2)
    window = _bessel_i0((2 * np.pi**2 + 0.5) * np.sqrt(np.maximum(1.0 - place**2, 0.0)))
    first = 0.5 * duration - 0.5 * (n_frames * STEP_S) + 0.5 * STEP_S
    centres = np.asarray(first + np.arange(n_frames) * STEP_S, np.float64)
    nearest = np.floor((centres - 0.5 * period) / period + 1.5) - 1.0  # rounds ties as Praat does
    samples = sound.samples.astype(np.float64)
    powers, whole = np.zeros(n_frames), window.sum()
    for frame, centre in enumerate(nearest.astype(int).tolist()):
        start, end = max(centre - half, 0), min(centre + half + 1, len(samples))
        part, weights = samples[start:end], window[start - centre + half : end - centre + half]
        rest = part - np.add.reduce(part) / len(part)
        powers[frame] = np.dot(rest * rest, weights) / (whole if len(weights) == len(window) else weights.sum())
    levels = 10.0 * np.log10(np.maximum(powers / THRESHOLD_POWER, 10 ** (MIN_INTENSITY_DB / 10)))
    return IntensityTrack(centres, levels)


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
        praat_sound = parselmouth.Sound(sound.samples.astype(np.float64), sampling_frequency=sound.rate)
        found = praat_sound.to_pitch_ac(pitch_floor=low, pitch_ceiling=high)
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


def _bessel_i0(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Modified Bessel function of order 0 by the approximation that Praat uses, so that its levels are the same.

    Source: Abramowitz and Stegun (1964), 9.8.1 and 9.8.2.
    """
    small = np.polynomial.polynomial.polyval((values / BESSEL_BORDER) ** 2, BESSEL_SMALL)
    above = np.maximum(values, BESSEL_BORDER)
    large = np.polynomial.polynomial.polyval(BESSEL_BORDER / above, BESSEL_LARGE) * np.exp(above) / np.sqrt(above)
    return np.where(values < BESSEL_BORDER, small, large)
