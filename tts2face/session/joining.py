"""Utterances with pauses between them, exact to the sample, and the times of the letters that they speak."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from lexicon.normalize import spoken_form, spoken_forms
from lexicon.sentence_length import n_letters
from lexicon.sentences import text_prefix
from lexicon.sequence import MIN_PHONE_S, SILENCE, PhoneSequence, WordSpan, enforce_increasing
from lexicon.sources import written_groups
from lexicon.written_words import written_words
from tts2face.sound.pauses import speech_onset
from tts2face.sound.spacing import fade_gains
from tts2face.types import Speech, Waveform, concatenate_speech, first_sample

CUT_SILENCE_S = 0.05  # around words that are cut out of a sentence
JOIN_LEAD_S = 0.1  # of the silence between two sentences, in which the lips open for the second one
LEAST_TAIL_S = 0.05  # of silence at the end of a sentence: a frame from 20 a second on, so that no sound is cut
END_S = 0.3  # of silence at the end of a text, in which the lips close
AUDIBLE_SHARE = 0.01  # of the largest amplitude
SAME_EDGE_S = 1e-4  # within which two times are the same edge of a phone; phones last 5 ms or more


def join_utterances(speeches: Sequence[Speech], gaps: Sequence[float]) -> tuple[Speech, list[float]]:
    """Concatenate utterances with given pauses.

    Parameters
    ----------
    speeches
        N utterances at one sample rate.
    gaps
        N - 1 pauses in seconds; silences at the ends of the utterances count as part of them.

    Returns
    -------
    speech
        The utterances in sequence.
    starts
        N offsets in seconds from times of the utterances to times of the whole.
    """
    parts: list[Speech] = []
    starts: list[float] = []
    at = 0.0
    for number, speech in enumerate(speeches):
        before = gaps[number - 1] if number > 0 else math.inf
        behind = gaps[number] if number < len(gaps) else math.inf
        short, cut = trim_silence(speech, before=before / 2, behind=behind / 2)
        if parts:
            missing = before - _silence_at_ends(parts[-1])[1] - _silence_at_ends(short)[0]
            if round(missing * speech.waveform.rate) > 0:
                parts.append(silent_speech(missing, speech.waveform.rate))
                at += parts[-1].waveform.duration
        parts.append(short)
        starts.append(at - cut)
        at += short.waveform.duration
    return (concatenate_speech(parts) if len(parts) > 1 else parts[0]), starts


def trim_silence(speech: Speech, *, before: float, behind: float) -> tuple[Speech, float]:
    """Limit the silence at the start and end of speech to `before` and `behind` seconds.

    Returns
    -------
    speech
        The trimmed speech.
    cut
        Seconds removed from the start.
    """
    sound = speech.waveform
    lead, trail = _silence_at_ends(speech)
    start = round(max(lead - before, 0.0) * sound.rate)
    end = len(sound.samples) - round(max(trail - behind, 0.0) * sound.rate)
    return _part(speech, start, end), start / sound.rate


def lead_in(speech: Speech, lead: float) -> Speech:
    """Speech whose first sound (`speech_onset`) is at `lead` seconds: its start is cut, or silence precedes it."""
    return shift_start(speech, round((speech_onset(speech.waveform) - lead) * speech.waveform.rate))


def shift_start(speech: Speech, cut: int) -> Speech:
    """Speech without its first `cut` samples; with as much silence before it if the number is negative."""
    rate = speech.waveform.rate
    if cut < 0:
        return concatenate_speech([silent_speech(-cut / rate, rate), speech])
    return _part(speech, cut, len(speech.waveform.samples))


@dataclass(frozen=True, slots=True)
class Excerpt:
    """Words of a text that are kept of its speech: those of its letters [first, last), and seconds of silence after it.

    The whole text is spoken, so that they sound as in their sentence.
    """

    first: int
    last: int
    silence: float = 0.0


def excerpt_of_speech(speech: Speech, start: float, end: float) -> Speech:
    """Speech from `start` to `end` seconds, faded there, with the phones and whole words within; see `word_bounds`."""
    sound, edges = speech.waveform, speech.phones.edges
    first, last = round(start * sound.rate), max(round(end * sound.rate), round(start * sound.rate) + 1)
    gains = fade_gains(last - first, sound.rate, first > 0, last < len(sound.samples))
    cut = Waveform(sound.samples[first:last] * gains[: len(sound.samples) - first], sound.rate)
    at = int(np.searchsorted(edges[1:], start + SAME_EDGE_S))
    until = max(int(np.searchsorted(edges[:-1], end - SAME_EDGE_S)), at + 1)
    inner = np.clip(edges[at : until + 1] - start, 0.0, cut.duration)
    inner[0], inner[-1] = 0.0, cut.duration
    words = tuple(word.shift(-at) for word in speech.words if at <= word.first and word.last <= until)
    return Speech(cut, PhoneSequence(speech.phones.phones[at:until], enforce_increasing(inner)), words)


def word_bounds(speech: Speech, start: float, end: float) -> tuple[float, float]:
    """Seconds at which the words between two onsets of words are cut out: little silence stays around them."""
    labels, edges = speech.phones.phones, speech.phones.edges
    voiced = [at for at, label in enumerate(labels) if label != SILENCE and start - SAME_EDGE_S <= edges[at] < end]
    if not voiced:
        return start, end
    before = CUT_SILENCE_S if voiced[0] > 0 and labels[voiced[0] - 1] == SILENCE else 0.0
    first = float(edges[voiced[0]])
    return max(first - before, 0.0), min(float(edges[voiced[-1] + 1]) + CUT_SILENCE_S, end)


def end_after(speech: Speech, seconds: float) -> Speech:
    """Speech with so much silence after its last audible sample, whatever its phones; silence stays as it is."""
    sound = speech.waveform
    end = last_audible(sound)
    end = end + round(seconds * sound.rate) if end else len(sound.samples)
    return _part(speech, 0, end) if end < len(sound.samples) else with_length(speech, end)


def last_audible(sound: Waveform) -> int:
    """Number of samples up to the last audible one; 0 in silence."""
    level = np.abs(sound.samples)
    audible = np.flatnonzero(level > AUDIBLE_SHARE * level.max(initial=0.0))
    return int(audible[-1]) + 1 if len(audible) else 0


def _part(speech: Speech, start: int, end: int) -> Speech:
    """Samples [start, end) of speech, faded at the cuts, with all its phones and words: none is shorter than 5 ms."""
    sound, phones = speech.waveform, speech.phones
    # nothing is cut: no fade
    if (start, end) == (0, len(sound.samples)):
        return speech
    gains = fade_gains(end - start, sound.rate, start > 0, end < len(sound.samples))
    short = Waveform(sound.samples[start:end] * gains, sound.rate)
    edges = enforce_increasing(np.clip(phones.edges - start / sound.rate, 0.0, short.duration))
    return Speech(short, PhoneSequence(phones.phones, edges), speech.words)


def silent_speech(seconds: float, rate: int) -> Speech:
    """Speech that consists of silence, of at least one sample."""
    n_samples = max(round(seconds * rate), 1)
    return Speech.without_phones(Waveform(np.zeros(n_samples, np.float32), rate))


def silent_frames(first: int, last: int, rate: int, fps: Fraction) -> Speech:
    """Silence of the frames of a clip from `first` to before `last`."""
    return silent_speech((first_sample(last, rate, fps) - first_sample(first, rate, fps)) / rate, rate)


def with_length(speech: Speech, n_samples: int) -> Speech:
    """Speech that is cut, or followed by silence, to a number of samples; it keeps all its phones and words."""
    if n_samples == len(speech.waveform.samples):
        return speech
    sound = speech.waveform.padded(n_samples).part(0, n_samples)
    phones, edges = list(speech.phones.phones), speech.phones.edges
    # silence behind speech would belong to a phone
    if phones[-1] != SILENCE and n_samples > len(speech.waveform.samples):
        phones.append(SILENCE)
        edges = np.append(edges, edges[-1])
    edges = np.append(edges[:-1], sound.duration)
    if np.diff(edges).min() < MIN_PHONE_S:
        edges = enforce_increasing(np.minimum(edges, sound.duration))
    return Speech(sound, PhoneSequence(phones, edges), speech.words)


def resampled_speech(speech: Speech, rate: int) -> Speech:
    """Resample speech to `rate` Hz; all phone edges but the last, the duration of the sound, are unchanged."""
    if speech.waveform.rate == rate:
        return speech
    sound = speech.waveform.resampled(rate)
    edges = speech.phones.edges.copy()
    edges[-1] = sound.duration
    return Speech(sound, PhoneSequence(speech.phones.phones, edges), speech.words)


def _silence_at_ends(speech: Speech) -> tuple[float, float]:
    """Seconds of silence at the start and at the end."""
    labels, edges = speech.phones.phones, speech.phones.edges
    lead = float(edges[1]) if labels[0] == SILENCE else 0.0
    return lead, float(edges[-1] - edges[-2]) if labels[-1] == SILENCE else 0.0


def fade_out(n_samples: int, rate: int) -> NDArray[np.float32]:
    """(n_samples,) gains with a fade at their end."""
    return fade_gains(n_samples, rate, starts=False, ends=True)


class WordTimes:
    """Times of the letters of a text, from the onsets and ends of its spoken words.

    The words before a letter are counted in the normalised text. If a voice divides the text into another number of
    words, the letter is assigned to the word boundary whose share of preceding letters is most similar.

    Parameters
    ----------
    written
        The text as written.
    phones, words
        Spoken phones and words of the text.
    language
        espeak-ng code.
    first
        Index of the text's first letter.
    """

    def __init__(
        self, written: str, phones: PhoneSequence, words: Sequence[WordSpan], *, language: str, first: int = 0
    ) -> None:
        self._written = written
        self._language = language
        self._first = first
        self._n_letters = max(n_letters(written), 1)
        self._onsets = [float(phones.edges[word.first]) for word in words] or [phones.start]
        self._ends = [float(phones.edges[word.last]) for word in words] or [phones.end]
        self._counts_agree = self._count_words(written) == len(self._onsets)
        lengths = [max(n_letters(word.text), 1) for word in words] or [1]
        self._cache: dict[int, int] = {}
        self._shares = np.concatenate([[0.0], np.cumsum(lengths) / sum(lengths)])

    def onset(self, letter: int) -> float:
        """Start in seconds of the word at or after a letter; after the last word, the end of that word."""
        word = self._words_before(letter)
        return self._onsets[word] if word < len(self._onsets) else self._ends[-1]

    def end(self, letter: int) -> float:
        """End in seconds of the word before a letter; before the first word, the onset of that word."""
        word = self._words_before(letter)
        return self._ends[word - 1] if word > 0 else self._onsets[0]

    def _words_before(self, letter: int) -> int:
        if letter not in self._cache:
            self._cache[letter] = self._search_word(min(max(letter - self._first, 0), self._n_letters))
        return self._cache[letter]

    def _search_word(self, at: int) -> int:
        if not self._counts_agree:
            return int(np.abs(self._shares - at / self._n_letters).argmin())
        before = text_prefix(self._written, at).rstrip()
        rest = self._written[len(before) :]
        is_inside = before[-1:].isalnum() and rest[:1].isalnum()
        return min(self._count_words(before) - is_inside, len(self._onsets))

    def _count_words(self, written: str) -> int:
        if self._language.startswith("en"):
            words = spoken_form(written, self._language).split()
            return sum(any(letter.isalnum() for letter in word) for word in words)
        forms = spoken_forms(written, self._language)
        spoken = written_words("".join(form.spoken for form in forms), self._language)
        return len(written_groups([word.text for word in spoken], forms))


@dataclass(frozen=True, slots=True)
class SentenceTimes:
    """Times of the letters of several utterances: index of the first letter, word times and start of each."""

    firsts: tuple[int, ...]
    word_times: tuple[WordTimes, ...]
    starts: tuple[float, ...]

    def onset(self, letter: int) -> float:
        """Start in seconds of the word at or after a letter."""
        at = max(bisect_right(self.firsts, letter) - 1, 0)
        return self.starts[at] + self.word_times[at].onset(letter)

    def end(self, letter: int) -> float:
        """End in seconds of the word before a letter."""
        at = max(bisect_left(self.firsts, letter) - 1, 0)
        return self.starts[at] + self.word_times[at].end(letter)
