"""Duration, F0 and formants of a finished sound by Praat's overlap-add (PSOLA)."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tts2face.numeric.arrays import FloatArray
from tts2face.types import Waveform

FLOOR_HZ, CEILING_HZ = 50.0, 600.0  # of F0; with a floor of 75 a voice of 70 Hz becomes one of 79
LEAST_S = 3.0 / FLOOR_HZ  # of a sound that Praat analyses
STEP_S = 0.8 / FLOOR_HZ  # of the analysis, as in Praat's own command; with 10 ms fast speech is understood less well
LEAST_CHANGE = 0.002  # of a factor
SAME_NUMBERS = "random_initializeWithSeedUnsafelyButPredictably (1)"
_RANDOM = threading.Lock()
ChangePitch = Callable[[FloatArray, FloatArray], FloatArray]  # times and F0 (N,) of voiced points to F0 (N,)


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A broken line of factors (N,) of duration at times (N,) in seconds; constant before and after."""

    times: FloatArray
    factors: FloatArray

    def moved(self, seconds: FloatArray) -> FloatArray:
        """Times after the stretch of times (M,) before it."""
        knots = np.concatenate([[0.0], self.times, [max(float(np.max(seconds, initial=0.0)), self.times[-1]) + 1.0]])
        factors = np.interp(knots, self.times, self.factors)
        ends = np.concatenate([[0.0], np.cumsum(np.diff(knots) * (factors[1:] + factors[:-1]) / 2)])
        at = np.clip(np.searchsorted(knots, seconds, side="right") - 1, 0, len(knots) - 2)
        since = seconds - knots[at]
        here = np.interp(seconds, self.times, self.factors)
        return np.asarray(ends[at] + since * (factors[at] + here) / 2, np.float64)


def even_stretch(rate: float) -> Stretch:
    """The stretch of a sound that is spoken faster by a factor."""
    return Stretch(np.zeros(1), np.full(1, 1.0 / rate))


def resynthesize(
    sound: Waveform, stretch: Stretch, change_pitch: ChangePitch | None = None, formants: float = 1.0
) -> Waveform:
    """A sound with other durations, F0 and formants; one too short to have an F0 is returned as it is.

    Parameters
    ----------
    change_pitch
        None: F0 stays.
    formants
        Factor of the frequencies of formants: the sound is played at another rate, and its time and F0 brought back.

    Notes
    -----
    Source: Moulines and Charpentier 1990, as in Praat's *Manipulation*.
    """
    if sound.duration < LEAST_S or (change_pitch is None and _is_small(stretch.factors) and _is_small(formants)):
        return sound
    import parselmouth

    call: Any = parselmouth.praat.call
    played = parselmouth.Sound(sound.samples.astype(np.float64), sampling_frequency=sound.rate * formants)
    manipulation = call(played, "To Manipulation", STEP_S, FLOOR_HZ * formants, CEILING_HZ * formants)
    durations = call("Create DurationTier", "stretch", 0.0, played.xmax)
    for time, factor in zip(stretch.times, stretch.factors, strict=True):
        call(durations, "Add point", float(time) / formants, float(factor) * formants)
    call([durations, manipulation], "Replace duration tier")
    if change_pitch is not None or not _is_small(formants):
        _replace_pitch(manipulation, played.xmax, change_pitch, formants)
    # Praat places periods of voiceless parts by random numbers of the whole process
    with _RANDOM:
        parselmouth.praat.run(SAME_NUMBERS)
        made = call(manipulation, "Get resynthesis (overlap-add)").values[0].astype(np.float32)
    if not _is_small(formants):
        import soxr

        made = soxr.resample(made, sound.rate * formants, sound.rate)
    n = max(round(float(stretch.moved(np.array([sound.duration]))[0]) * sound.rate), 1)
    return Waveform(np.clip(np.pad(made, (0, max(0, n - len(made))))[:n], -1.0, 1.0), sound.rate)


def _replace_pitch(manipulation: Any, end: float, change_pitch: ChangePitch | None, formants: float) -> None:
    import parselmouth

    call: Any = parselmouth.praat.call
    tier = call(manipulation, "Extract pitch tier")
    n = call(tier, "Get number of points")
    if not n:
        return
    times = np.array([call(tier, "Get time from index", at) for at in range(1, n + 1)])
    hertz = np.array([call(tier, "Get value at index", at) for at in range(1, n + 1)]) / formants
    made = call("Create PitchTier", "changed", 0.0, end)
    wanted = hertz if change_pitch is None else change_pitch(times * formants, hertz)
    for time, value in zip(times, wanted, strict=True):
        call(made, "Add point", float(time), float(value))
    call([made, manipulation], "Replace pitch tier")


def _is_small(factors: FloatArray | float) -> bool:
    return bool(np.all(np.abs(np.asarray(factors) - 1.0) < LEAST_CHANGE))
