"""Silence at the punctuation within a sentence, by one table for voices that pause as they were trained to."""

from collections.abc import Sequence
from difflib import SequenceMatcher
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lexicon.normalize import spoken_form
from lexicon.pauses import MARKS, PAUSES_S
from lexicon.sequence import SILENCE, PhoneSequence, enforce_increasing
from lexicon.written_words import written_words
from tts2face.numeric.arrays import FloatArray, true_runs
from tts2face.sound.pauses import sound_windows
from tts2face.sound.voice import SpeechInput, pronounce_content
from tts2face.types import Speech, Waveform

WINDOW_S = 0.005
QUIET_DB = -40.0  # of the loudest window: what is below is not heard as speech
REACH_S = 0.08  # around a silence between two words, in which the quiet part of the sound lies
LEAST_CHANGE_S = 0.02  # edges and windows are not more exact
FADE_S = 0.005  # linear fade at each cut, which avoids clicks


class Cut(NamedTuple):
    """A place within a silence in seconds, and the seconds that are added there; removed from there on if negative."""

    place: float
    change: float


def has_pauses(content: SpeechInput) -> bool:
    """Whether a content may have punctuation before its last word."""
    words = content.split() if isinstance(content, str) else [word.text + word.after for word in content]
    return any(MARKS.intersection(word) for word in words[:-1])


def with_pauses(speech: Speech, content: SpeechInput, language: str) -> Speech:
    """Speech of a content with the pauses of the table at its marks; words whose mark is unknown keep theirs.

    Edges behind a pause move with the sound.

    Parameters
    ----------
    language
        Code of the content.
    """
    phones, edges = speech.phones.phones, speech.phones.edges
    levels = sound_levels(speech.waveform)
    cuts: list[Cut] = []
    for (word, following), mark in zip(pairwise(speech.words), _marks(speech, content, language), strict=False):
        if not mark or SILENCE not in phones[word.last : following.first]:
            continue
        cuts += pause_cuts(levels, (float(edges[word.last]), float(edges[following.first])), PAUSES_S[mark])
    if not cuts:
        return speech
    sound = respaced(speech.waveform, cuts)
    edges = enforce_increasing(respaced_times(edges, cuts))
    edges[-1] = sound.duration
    return Speech(sound, PhoneSequence(phones, edges), speech.words)


def pause_cuts(levels: FloatArray, silence: tuple[float, float], wanted: float, reach: float = REACH_S) -> list[Cut]:
    """The change that makes a silence between two words as long as is wanted in seconds, if it is worth while.

    Parameters
    ----------
    levels : (T,)
        `sound_levels`.
    silence
        In seconds; the sound decides what of it, and within `reach` around it, is quiet.
    """
    start, end = quiet_span(levels, silence, reach)
    change = wanted - (end - start)
    if abs(change) < LEAST_CHANGE_S:
        return []
    middle = min(max((start + end) / 2, silence[0] + WINDOW_S), silence[1])
    return [Cut(middle if change > 0.0 else min(max(middle + change / 2, start), end + change), change)]


def _marks(speech: Speech, content: SpeechInput, language: str) -> list[str]:
    """Mark behind each word of the speech but the last, as far as the words of the content are found again."""
    written = content if isinstance(content, str) else " ".join(word.text + word.after for word in content)
    if language.partition("-")[0] == "en":
        known = [(word.text, word.mark) for word in pronounce_content(content, language, {})]
    else:
        known = [(word.text, word.mark) for word in written_words(spoken_form(written, language), language)]
    spoken = [word.text.lower() for word in speech.words]
    if len(known) == len(spoken):
        return [mark for _, mark in known[:-1]]
    marks = [""] * len(spoken)
    texts = [text.lower() for text, _ in known]
    for at, block, size in SequenceMatcher(None, spoken, texts, autojunk=False).get_matching_blocks():
        marks[at : at + size] = [mark for _, mark in known[block : block + size]]
    return marks[:-1]


def sound_levels(sound: Waveform) -> FloatArray:
    """Levels (T,) of windows in dB, relative to the loudest one."""
    powers = np.square(sound_windows(sound, WINDOW_S), dtype=np.float64).mean(axis=1)
    levels: FloatArray = 10.0 * np.log10(np.maximum(powers, 1e-12) / max(powers.max(initial=0.0), 1e-12))
    return levels


def quiet_span(levels: FloatArray, silence: tuple[float, float], reach: float = REACH_S) -> tuple[float, float]:
    """Times of the longest quiet part around a silence between two words; the silence where there is none."""
    first = max(round((silence[0] - reach) / WINDOW_S), 0)
    runs = true_runs(levels[first : round((silence[1] + reach) / WINDOW_S)] < QUIET_DB) + first
    longest = max(runs.tolist(), key=lambda run: run[1] - run[0], default=None)
    return silence if longest is None else (longest[0] * WINDOW_S, longest[1] * WINDOW_S)


def respaced(sound: Waveform, cuts: Sequence[Cut]) -> Waveform:
    """Sound with silence added and removed at places in the order of time, faded there."""
    rate, samples = sound.rate, sound.samples
    parts: list[NDArray[np.float32]] = []
    start = 0
    for place, change in cuts:
        at = round(place * rate)
        parts.append(samples[start:at] * fade_gains(at - start, rate, starts=start > 0, ends=True))
        if change > 0.0:
            parts.append(np.zeros(round(change * rate), np.float32))
        start = at + round(max(-change, 0.0) * rate)
    parts.append(samples[start:] * fade_gains(len(samples) - start, rate, starts=True, ends=False))
    return Waveform(np.concatenate(parts), rate)


def respaced_times(times: FloatArray, cuts: Sequence[Cut]) -> FloatArray:
    """Seconds (N,) after cuts of times (N,) before them."""
    moved = times.copy()
    for place, change in cuts:
        removed = np.clip(times, place, place - change) - place
        moved += np.where(times >= place, change if change > 0.0 else -removed, 0.0)
    return moved


def fade_gains(n_samples: int, rate: int, starts: bool, ends: bool) -> NDArray[np.float32]:
    """(n_samples,) gains of a part of a sound at `rate` Hz, with a fade where it is cut."""
    ramp = np.linspace(0.0, 1.0, min(round(FADE_S * rate), n_samples // 2), endpoint=False, dtype=np.float32)
    gain = np.ones(n_samples, np.float32)
    if starts:
        gain[: len(ramp)] = ramp
    if ends:
        gain[n_samples - len(ramp) :] = ramp[::-1]
    return gain
