"""Speech and its pauses in a sound: level, onset and pauses, and division of long recordings at these."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.arrays import true_runs
from tts2face.numeric.filters import moving_mean
from tts2face.types import Waveform

LEVEL_WINDOW_S = 0.01
SMOOTHING_WINDOWS = 3  # enough to bridge a click in a pause, too few to bridge the closure of a stop
QUIET_SHARE = 0.3  # threshold of pauses: share of the range in dB from noise to speech
NOISE_QUANTILE, SPEECH_QUANTILE = 0.05, 0.95
MIN_CONTRAST_DB = 6.0  # least range from noise to speech in which pauses can be detected
MIN_PAUSE_S = 0.2  # longer than the closure of any stop (Crystal and House 1988)
ONSET_WINDOW_S = 0.005  # an onset is exact to this
ONSET_DB = -40.0  # of the loudest window: weak fricatives (five, thick) begin at -38, what is lower is not heard
ONSET_ABOVE_NOISE_DB = 10.0  # in noise, the onset is where the sound exceeds the quietest twentieth by this
LATEST_ONSET_DB = -20.0  # of the loudest window: speech without silence has no such twentieth
MAX_CLOSURE_S = 0.025  # quiet within a sound that begins: between the burst of a stop and its vowel, within a trill
MIN_SOUND_S, BREATH_DB = 0.02, -25.0  # what is shorter is a click; a weak sound before silence is a breath
LONG_PAUSE_S = 1.0  # a pause that may be cut outside of its middle
FRAMES_PER_S = (
    50  # of a recogniser, at which sounds are cut: frames of a part are frames of the whole, and its edges too
)
MIN_STRETCH_SHARE = 0.5  # least length of a part, relative to the largest one; the last part may be shorter

LOUD_S, LOUD_RANGE_DB = 0.5, 30.0  # what is at most so far below the loudest half second is speech; a slam is shorter
NEAR_SPEECH_S = 1.0  # of speech: the pauses between sentences belong to it
NEAR_SOUND_S = 0.3  # of silence before and after sound
SPEECH_RANGE_DB = 15.0  # least range of speech with its pauses; noise has half of it in windows of 10 ms
SMOOTH_RANGE_DB = 12.0  # the same of levels over 30 ms, in which noise has at most half of it, too
SILENCE_DB = 60.0  # below the loudest half second: digital silence and noise of a converter, no room
Span = tuple[float, float]


def is_near_speech(levels: NDArray[np.floating], step_s: float) -> NDArray[np.bool_]:
    """Whether levels (T,) in dB, `step_s` apart, are of speech or its pauses, not of long silence or noise around it.

    Measures of a whole recording are taken from these, so that they do not depend on how much else it holds. Where most
    of what sounds is softer, and has the range of speech, the loud part is a jingle or applause.
    """
    near, sounding = _is_near_loud(levels, step_s), is_near_sound(levels, step_s)
    return sounding if _is_speech_softer(levels[sounding], near[sounding], SPEECH_RANGE_DB) else near


def _is_near_loud(levels: NDArray[np.floating], step_s: float) -> NDArray[np.bool_]:
    """Whether levels (T,) are at most `LOUD_RANGE_DB` below the loudest half second, or near those that are."""
    return _is_near(levels >= loudest_level(levels, step_s) - LOUD_RANGE_DB, round(NEAR_SPEECH_S / step_s))


def _is_speech_softer(levels: NDArray[np.floating], is_loud: NDArray[np.bool_], least_range_db: float) -> bool:
    """Whether most of what sounds is softer than the loud part, and has the range of speech."""
    softer = levels[~is_loud]
    if 2 * len(softer) <= len(levels):
        return False
    low, high = np.quantile(softer, (NOISE_QUANTILE, SPEECH_QUANTILE))
    return bool(high - low >= least_range_db)


def _without_jingle(levels: NDArray[np.floating]) -> NDArray[np.floating]:
    """The (N,) of smooth levels that are of speech with its pauses: all, or those behind a jingle or applause."""
    near, sounding = _is_near_loud(levels, LEVEL_WINDOW_S), is_near_sound(levels, LEVEL_WINDOW_S)
    return levels[~near] if _is_speech_softer(levels[sounding], near[sounding], SMOOTH_RANGE_DB) else levels


def is_near_sound(levels: NDArray[np.floating], step_s: float) -> NDArray[np.bool_]:
    """Whether levels (T,) in dB, `step_s` apart, are of any sound or at most `NEAR_SOUND_S` away from one."""
    return _is_near(levels > loudest_level(levels, step_s) - SILENCE_DB, round(NEAR_SOUND_S / step_s))


def _is_near(chosen: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Whether places (T,) are at most `reach` away from a chosen one."""
    at = np.flatnonzero(chosen)
    changes = np.zeros(len(chosen) + 1, np.int64)
    np.add.at(changes, np.maximum(at - reach, 0), 1)
    np.add.at(changes, np.minimum(at + reach + 1, len(chosen)), -1)
    return np.cumsum(changes[:-1]) > 0


def loudest_level(levels: NDArray[np.floating], step_s: float) -> float:
    """Level that levels (T,), `step_s` apart, exceed for `LOUD_S` in all, or half of the loud ones of a short sound."""
    loud = np.sort(levels[levels >= levels.max() - LOUD_RANGE_DB], axis=None)
    return float(loud[-min(round(LOUD_S / step_s), (len(loud) + 1) // 2)])


def speech_level(levels: NDArray[np.floating], step_s: float, *, is_recording: bool = False) -> float:
    """Mean in dB of those (T, 1) levels, `step_s` apart, that exceed the midpoint of the noise and speech levels.

    Of a recording silence is no noise; a voice is silent between words.
    """
    silence = loudest_level(levels, step_s) - SILENCE_DB if is_recording else -np.inf
    levels = levels[is_near_speech(levels[:, 0], step_s) & (levels[:, 0] >= silence)]
    noise_db, speech_db = np.quantile(levels, NOISE_QUANTILE), np.quantile(levels, SPEECH_QUANTILE)
    return float(levels[levels >= (noise_db + speech_db) / 2].mean())


def find_pauses(sound: Waveform) -> tuple[Span, ...]:
    """Spans (start, end) in seconds without speech, each at least `MIN_PAUSE_S` long."""
    levels = _window_levels(sound)
    if not len(levels):
        return ()
    measured = _without_jingle(levels)
    silence = loudest_level(measured, LEVEL_WINDOW_S) - SILENCE_DB
    counted = measured[is_near_speech(measured, LEVEL_WINDOW_S) & (measured > silence)]
    if not len(counted):
        return ()
    noise_db, speech_db = np.quantile(counted, NOISE_QUANTILE), np.quantile(counted, SPEECH_QUANTILE)
    if speech_db - noise_db < MIN_CONTRAST_DB:
        if levels.min() > silence:
            return ()
        noise_db = np.float64(silence)  # speech without a noise, between silences
    quiet = levels < noise_db + QUIET_SHARE * (speech_db - noise_db)
    spans = (true_runs(quiet) * LEVEL_WINDOW_S).tolist()
    return tuple((start, end) for start, end in spans if end - start >= MIN_PAUSE_S)


def speech_onset(sound: Waveform, *, is_recording: bool = False) -> float:
    """Seconds from the start of a sound to the first speech in it; 0.0 if it is silent.

    Parameters
    ----------
    is_recording
        Whether noise may follow digital silence, as in the stem of a film; a voice has none.

    Notes
    -----
    Levels are relative to the loudest window, and to the noise. Clicks, and breaths that silence follows, are passed.
    """
    windows = sound_windows(sound, ONSET_WINDOW_S)
    levels = 10.0 * np.log10(np.maximum(np.square(windows, dtype=np.float64).mean(axis=1), 1e-12))
    if not len(levels) or levels.max() <= -120.0:
        return 0.0
    relative = levels - levels.max()
    counted = relative[relative > -SILENCE_DB] if is_recording else relative
    threshold = np.quantile(counted, NOISE_QUANTILE) + ONSET_ABOVE_NOISE_DB
    loud = relative > np.clip(threshold, ONSET_DB, LATEST_ONSET_DB)
    closure, shortest = round(MAX_CLOSURE_S / ONSET_WINDOW_S), round(MIN_SOUND_S / ONSET_WINDOW_S)
    starts, ends = true_runs(loud).T
    is_new = np.concatenate([[True], starts[1:] - ends[:-1] > closure])
    starts, ends = starts[is_new], ends[np.concatenate([is_new[1:], [True]])]
    for start, end in zip(starts, ends, strict=True):
        if end - start >= shortest and relative[start:end].max() > BREATH_DB:
            return float(start * ONSET_WINDOW_S)
    return float(starts[0] * ONSET_WINDOW_S)


def cut_at_pauses(sound: Waveform, longest: float) -> tuple[Span, ...]:
    """Divide a sound into spans of at most `longest` seconds, cut in the middle of long pauses, between two frames.

    Speech without a pause is cut at its quietest time.

    Raises
    ------
    InputError
        `longest` is not above 0.
    """
    if longest <= 0:
        raise InputError(f"the longest part of a sound must be above 0 s, not {longest:g} s")
    found = find_pauses(sound)
    levels = _window_levels(sound)
    cuts = [0.0]
    while sound.duration - cuts[-1] > longest:
        earliest, latest = cuts[-1] + MIN_STRETCH_SHARE * longest, cuts[-1] + longest
        middles = [(end - start, _place_in(start, end, earliest, latest)) for start, end in found]
        middles = [(length, place) for length, place in middles if earliest <= place <= latest]
        place = max(middles)[1] if middles else _quietest_instant(levels, earliest, latest)
        cuts.append(min(round(place * FRAMES_PER_S), int(latest * FRAMES_PER_S + 1e-6)) / FRAMES_PER_S)
    cuts.append(sound.duration)
    return tuple(pairwise(cuts))


def _place_in(start: float, end: float, earliest: float, latest: float) -> float:
    """Where a pause is cut: in its middle, or in a long one where that is allowed."""
    middle = (start + end) / 2
    if end - start < LONG_PAUSE_S:
        return middle
    return min(max(middle, min(earliest, end - NEAR_SOUND_S)), max(latest, start + NEAR_SOUND_S))


def _quietest_instant(levels: NDArray[np.float64], earliest: float, latest: float) -> float:
    first, last = int(np.ceil(earliest / LEVEL_WINDOW_S)), int(latest / LEVEL_WINDOW_S)
    return (first + int(levels[first:last].argmin()) + 0.5) * LEVEL_WINDOW_S


def _window_levels(sound: Waveform) -> NDArray[np.float64]:
    """(T,) levels in dB relative to full scale, in windows of `LEVEL_WINDOW_S`."""
    power = np.square(sound_windows(sound, LEVEL_WINDOW_S), dtype=np.float64).mean(axis=1)
    smooth = moving_mean(power, SMOOTHING_WINDOWS) if len(power) else power
    levels: NDArray[np.float64] = 10.0 * np.log10(np.maximum(smooth, 1e-10))
    return levels


def cut_sound(sound: Waveform, span: tuple[float, float]) -> Waveform:
    """The sound in a span of seconds."""
    return sound.part(*(round(second * sound.rate) for second in span))


def sound_windows(sound: Waveform, window_s: float) -> NDArray[np.float32]:
    """(T, W) samples of the whole windows of `window_s` seconds, one after another."""
    window = max(1, round(window_s * sound.rate))
    n_windows = len(sound.samples) // window
    return sound.samples[: n_windows * window].reshape(n_windows, window)
