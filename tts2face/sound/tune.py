"""F0 of a sentence, shaped by its prosody, by the tones of its words, and by its questions and lists."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from lexicon.intonation import Movement
from lexicon.tones import EVEN, Tone
from tts2face.numeric.arrays import FloatArray
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody

VOICED_HZ = 40.0
LOWEST_HZ = 42.0  # of a voice whose pitch is lowered
LIMITS_HZ = (50.0, 480.0)  # of changed F0 at the usual pitch
SEMITONES = 12.0  # of an octave
EMPHASIS_PEAK = 4.0  # semitones
EMPHASIS_LENGTH = 1.3  # factor of the durations of its phones
EMPHASIS_REACH_S, LEAST_REACH_S = 0.05, 0.1  # beyond half of the word
AFTER_EMPHASIS, AFTER_S = 0.6, 0.1  # range above the median behind an emphasised word, and its onset
WORD_RAMP_S = 0.04  # between words of different tones
# A rise begins below the median; of what is known of 30 questions it is heard as one by Praat in all
DIP, DIP_S = 1.5, 0.075  # semitones, and how soon they are reached
BEND = 1.2  # exponent of its curve
LEAST_RISE_S, LONGEST_RISE_S = 0.2, 0.3
BEYOND_S = 0.15  # of voice behind the end of the word
HEIGHTS = MappingProxyType({"rise": 9.0, "item": 4.0, "fall": -5.0})  # semitones above the median, at the end
FALL_START = 2.5
PAUSE_S = 0.12  # behind which F0 begins anew
FRAME_S = 0.0125
MOST_RANGE = 1.4  # factor of the height of rises


@dataclass(frozen=True, slots=True)
class PlacedWord:
    """Seconds of a word and of its vowel with the main stress, and how it is said."""

    start: float
    end: float
    vowel: tuple[float, float]
    tone: Tone = EVEN


@dataclass(frozen=True, slots=True)
class Tune:
    """Prosody, words and movements that shape the F0 of a sentence."""

    prosody: Prosody
    words: Sequence[PlacedWord]
    movements: Sequence[Movement] = ()

    @property
    def is_plain(self) -> bool:
        """Whether F0 stays as it is."""
        even = (PLAIN_PROSODY.pitch, PLAIN_PROSODY.range)
        return (
            not self.movements
            and (self.prosody.pitch, self.prosody.range) == even
            and all(word.tone == EVEN for word in self.words)
        )


@dataclass(frozen=True, slots=True, eq=False)
class ShapedPitch:
    """F0 (T,) in Hz, and where the movement of its last word lies: pairs of frames, half-open."""

    f0: FloatArray
    moved: tuple[tuple[int, int], ...]


def shape_pitch(
    f0: NDArray[np.floating], times: FloatArray, tune: Tune, heard: NDArray[np.bool_] | None = None
) -> ShapedPitch:
    """F0 with prosody, tones and movements.

    Parameters
    ----------
    f0, times : (T,)
        F0 in Hz, below `VOICED_HZ` where there is no voice, and its times in seconds.
    heard : (T,)
        Whether the voice is loud enough that movements end there; None: everywhere.
    """
    voiced = np.asarray(f0) > VOICED_HZ
    if tune.is_plain or not voiced.any():
        return ShapedPitch(np.asarray(f0, np.float64), ())
    tones = SEMITONES * np.log2(np.where(voiced, f0, 1.0))
    middle = float(np.median(tones[voiced]))
    above = (tones - middle) * tune.prosody.range
    above *= 1.0 + _by_words(times, [(word, word.tone.range - 1.0) for word in tune.words])
    for word in tune.words:
        above = _emphasised(above, times, word) if word.tone.emphasis else above
    above += _by_words(times, [(word, word.tone.pitch) for word in tune.words])
    for words, contour in _contours(tune.words):
        shares = (times - words[0].start) / max(words[-1].end - words[0].start, 1e-3)
        points = np.array(contour)
        above += np.interp(shares, points[:, 0], points[:, 1]) * _within(times, words[0].start, words[-1].end)
    moved = []
    for movement in tune.movements:
        above, span = _moved(above, times, voiced if heard is None else voiced & heard, tune, movement)
        # only there the voice creaks: elsewhere a changed spectrum is understood less well (20.4 for 14.9 %)
        moved += [span] if movement.until + 1 == len(tune.words) else []
    low, high = LIMITS_HZ
    shift = 2.0 ** (tune.prosody.pitch / SEMITONES)
    lowest = max(low * min(shift, 1.0), LOWEST_HZ)
    hertz = np.clip(2.0 ** ((middle + above + tune.prosody.pitch) / SEMITONES), lowest, max(high * shift, lowest))
    return ShapedPitch(np.where(voiced, hertz, f0), tuple(moved))


def _within(times: FloatArray, start: float, end: float) -> FloatArray:
    """(T,) 1 within a span, 0 beyond, with ramps."""
    rising = (times - start) / WORD_RAMP_S
    return np.clip(np.minimum(rising, (end - times) / WORD_RAMP_S) + 0.5, 0.0, 1.0)


def _by_words(times: FloatArray, values: Sequence[tuple[PlacedWord, float]]) -> FloatArray:
    """(T,) values of words at their times; pauses between equal ones have them, too."""
    found = np.zeros(len(times))
    for value, group in groupby(values, key=lambda pair: pair[1]):
        words = [word for word, _ in group]
        found += value * _within(times, words[0].start, words[-1].end)
    return found


def _contours(words: Sequence[PlacedWord]) -> Iterator[tuple[list[PlacedWord], tuple[tuple[float, float], ...]]]:
    """Successive words of one contour."""
    for contour, group in groupby(words, key=lambda word: word.tone.contour):
        if contour:
            yield list(group), contour


def _emphasised(above: FloatArray, times: FloatArray, word: PlacedWord) -> FloatArray:
    """F0 with a peak on the stressed vowel of a word; behind it the voice is flatter, so that the peak stands out."""
    much = word.tone.emphasis
    reach = max((word.end - word.start) / 2 + EMPHASIS_REACH_S, LEAST_REACH_S)
    apart = np.abs(times - sum(word.vowel) / 2) / reach
    raised: FloatArray = above + EMPHASIS_PEAK * much * np.where(apart < 1.0, 0.5 + 0.5 * np.cos(np.pi * apart), 0.0)
    if much > 0:
        late = np.clip((times - word.end) / AFTER_S, 0.0, 1.0)
        raised -= late * (1.0 - AFTER_EMPHASIS) * np.maximum(raised, 0.0)
    return raised


def _moved(
    above: FloatArray, times: FloatArray, voiced: NDArray[np.bool_], tune: Tune, movement: Movement
) -> tuple[FloatArray, tuple[int, int]]:
    """F0 relative to the median with a movement, and the frames that have it."""
    stressed, last_word = tune.words[movement.at], tune.words[movement.until]
    following = next(iter(tune.words[movement.until + 1 :]), None)
    until = last_word.end + BEYOND_S if following is None else min(last_word.end + BEYOND_S, following.start)
    spoken = np.flatnonzero(voiced & (times >= stressed.start) & (times <= until))
    if not len(spoken):
        return above, (0, 0)
    end = float(times[spoken[-1]])
    start = max(min(max(stressed.vowel[0], end - LONGEST_RISE_S), end - LEAST_RISE_S), stressed.start)
    low = FALL_START if movement.tune == "fall" else -DIP
    height = HEIGHTS[movement.tune]
    share = np.clip((times - start) / max(end - start, FRAME_S), 0.0, 1.0)
    curve = min(tune.prosody.range, MOST_RANGE) * (low + (height - low) * share**BEND)
    onset = min(stressed.vowel[0], start)
    weight = np.clip((times - onset) / DIP_S + 1.0, 0.0, 1.0)
    if following is not None:
        # the next word comes down from it, unless there is a pause
        behind = following.end if following.start - end < PAUSE_S else following.start
        weight *= np.clip((behind - times) / max(behind - end, FRAME_S), 0.0, 1.0)
    frames = np.flatnonzero((times >= start) & (times <= end))
    span = (int(frames[0]), int(frames[-1]) + 1) if len(frames) else (0, 0)
    return above * (1.0 - weight) + curve * weight, span
