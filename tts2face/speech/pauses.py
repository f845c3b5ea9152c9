"""Where a speaker pauses, and long recordings cut there."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.types import Waveform

LEVEL_WINDOW_S = 0.01
SMOOTHING_WINDOWS = 3  # a stop's closure is not bridged, a click in a pause is
QUIET_SHARE = 0.3  # of the way in dB from the noise to the speech; below it nobody speaks
NOISE_QUANTILE, SPEECH_QUANTILE = 0.05, 0.95
MIN_CONTRAST_DB = 6.0  # between them; with less there is no telling pauses from speech
MIN_PAUSE_S = 0.2  # longer than the closure of any stop (Crystal and House 1988)
MIN_STRETCH_SHARE = 0.5  # of the longest stretch: none is shorter, but for the last

Span = tuple[float, float]


def find_pauses(sound: Waveform) -> tuple[Span, ...]:
    """Spans in seconds in which nobody speaks, each of `MIN_PAUSE_S` or more."""
    levels = _window_levels(sound)
    if not len(levels):
        return ()
    noise, speech = np.quantile(levels, NOISE_QUANTILE), np.quantile(levels, SPEECH_QUANTILE)
    if speech - noise < MIN_CONTRAST_DB:
        return ()
    quiet = levels < noise + QUIET_SHARE * (speech - noise)
    borders = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8)))
    spans = (borders.reshape(-1, 2) * LEVEL_WINDOW_S).tolist()
    return tuple((begin, end) for begin, end in spans if end - begin >= MIN_PAUSE_S)


def cut_at_pauses(sound: Waveform, longest: float) -> tuple[Span, ...]:
    """Spans in seconds that cover a sound, none longer than `longest`, cut in the middle of long pauses.

    Where somebody speaks on without a pause the cut falls into the quietest moment.

    Raises
    ------
    InputError
        The longest stretch is not positive.
    """
    if longest <= 0:
        raise InputError(f"a stretch of sound must be longer than {longest} s")
    found, levels, cuts = find_pauses(sound), _window_levels(sound), [0.0]
    while sound.duration - cuts[-1] > longest:
        earliest, latest = cuts[-1] + MIN_STRETCH_SHARE * longest, cuts[-1] + longest
        middles = [(end - begin, (begin + end) / 2) for begin, end in found if earliest <= (begin + end) / 2 <= latest]
        cuts.append(max(middles)[1] if middles else _quietest_instant(levels, earliest, latest))
    cuts.append(sound.duration)
    return tuple(pairwise(cuts))


def _quietest_instant(levels: NDArray[np.float64], earliest: float, latest: float) -> float:
    first, last = int(np.ceil(earliest / LEVEL_WINDOW_S)), int(latest / LEVEL_WINDOW_S)
    return (first + int(levels[first:last].argmin()) + 0.5) * LEVEL_WINDOW_S


def _window_levels(sound: Waveform) -> NDArray[np.float64]:
    """(T,) dB of full scale in windows of `LEVEL_WINDOW_S`."""
    from scipy.ndimage import uniform_filter1d

    window = max(1, round(LEVEL_WINDOW_S * sound.rate))
    n_windows = len(sound.samples) // window
    power = np.square(sound.samples[: n_windows * window].reshape(n_windows, window), dtype=np.float64).mean(axis=1)
    smooth = uniform_filter1d(power, SMOOTHING_WINDOWS, mode="nearest") if n_windows else power
    levels: NDArray[np.float64] = 10.0 * np.log10(np.maximum(smooth, 1e-10))
    return levels
