"""A voice speaks a sentence with its marks: the sound with its pauses, and when each mark is reached."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lexicon.cleaning import canonical_text
from lexicon.errors import InputError
from lexicon.languages import language_code
from lexicon.marked_text import Mark, MarkedText, NameMark, NodMark, StyleRun
from lexicon.pronounce import PAUSES_S
from lexicon.sentences import Phrase, Sentence, index_by_letters, n_letters, text_prefix
from lexicon.sequence import PhoneSequence, WordSpan
from lexicon.spoken_form import spoken_form
from tts2face.clock import first_sample
from tts2face.gesture.easing import span_weights
from tts2face.gesture.notation import parse_style
from tts2face.gesture.spans import Nod, StyleSpan
from tts2face.gesture.timeline import Timeline
from tts2face.request import RATE_LIMITS, VOLUME_LIMITS, Request
from tts2face.synthesis.speech_joining import join_utterances, silent_speech
from tts2face.types import Speech, Waveform, concatenate_speech, frame_count
from tts2face.voice.engine import SpokenWord, Voice, apply_volume
from tts2face.voice.level import level_speech
from tts2face.voice.resample import resampled_speech
from tts2face.voice.spans import Voices, speaker_of

MIN_UTTERANCE_GAP_S = 0.02  # between utterances of a sentence: less cuts into their sounds (edges are good to 16 ms)
SPEED_CHANGE_PAUSE_S = 0.06  # where only the speed changes
IDLE_PART_S = 10.0  # of a silent clip, as a long sentence
IDLE_RATE = 48_000  # Hz, of its silence
LOUDNESS_RAMP_S = 0.03  # from one loudness to another

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MarkTime:
    """A named mark, and the second at which it is reached."""

    name: str
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class SpokenSentence:
    """A sentence's sound, and what its marks ask for, on its own clock.

    ``speech`` is as the voice gives it, which motion is computed from; ``sound`` the same at the loudness of the clip.
    """

    speech: Speech
    timeline: Timeline
    marks: tuple[MarkTime, ...]
    sound: Waveform


class WordTimes:
    """When the letters of a text are spoken: each word at its onset, known from the words that a voice tells.

    The words before a letter are counted in the text as it is said. Where a voice counts its words in another way the
    letter is placed at the border of words that has the most nearly equal share of letters before it.

    Parameters
    ----------
    first
        Number of the text's first letter.
    """

    def __init__(
        self, written: str, phones: PhoneSequence, words: Sequence[WordSpan], *, language: str, first: int = 0
    ) -> None:
        self._written, self._language, self._first = written, language, first
        self._n_letters = max(n_letters(written), 1)
        self._onsets = [float(phones.edges[word.first]) for word in words] or [phones.start]
        self._ends = [float(phones.edges[word.last]) for word in words] or [phones.end]
        self._are_counted = self._count_words(written) == len(self._onsets)
        lengths = [max(n_letters(word.text), 1) for word in words] or [1]
        self._found: dict[int, int] = {}
        self._shares = np.concatenate([[0.0], np.cumsum(lengths) / sum(lengths)])

    def onset(self, letter: int) -> float:
        """Second at which the word at or behind a letter begins; behind the last word its end."""
        word = self._words_before(letter)
        return self._onsets[word] if word < len(self._onsets) else self._ends[-1]

    def end(self, letter: int) -> float:
        """Second at which the word before a letter ends; the first word's onset where there is none."""
        word = self._words_before(letter)
        return self._ends[word - 1] if word > 0 else self._onsets[0]

    def _words_before(self, letter: int) -> int:
        if letter not in self._found:
            self._found[letter] = self._search_word(min(max(letter - self._first, 0), self._n_letters))
        return self._found[letter]

    def _search_word(self, at: int) -> int:
        if not self._are_counted:
            return int(np.abs(self._shares - at / self._n_letters).argmin())
        before = text_prefix(self._written, at).rstrip()
        rest = self._written[len(before) :]
        is_inside = before[-1:].isalnum() and rest[:1].isalnum()
        return min(self._count_words(before) - is_inside, len(self._onsets))

    def _count_words(self, written: str) -> int:
        said = spoken_form(written, self._language)
        if not self._language.startswith("en"):
            said = canonical_text(said, keep_marks=True)
        return sum(any(letter.isalnum() for letter in word) for word in said.split())


class _LetterTimes(Protocol):
    def onset(self, letter: int) -> float: ...

    def end(self, letter: int) -> float: ...


@dataclass(frozen=True, slots=True)
class _SentenceTimes:
    """When the letters of several utterances are spoken: the letters that each begins with, its clock, its seconds."""

    firsts: tuple[int, ...]
    clocks: tuple[WordTimes, ...]
    begins: tuple[float, ...]

    def onset(self, letter: int) -> float:
        at = max(bisect_right(self.firsts, letter) - 1, 0)
        return self.begins[at] + self.clocks[at].onset(letter)

    def end(self, letter: int) -> float:
        at = max(bisect_left(self.firsts, letter) - 1, 0)
        return self.begins[at] + self.clocks[at].end(letter)


def speak_sentence(voice: Voice, sentence: Sentence, request: Request, voices: Voices | None = None) -> SpokenSentence:
    """Speak a sentence with its pauses, speeds and loudness, and find when its marks are reached.

    The speech of a sentence in which nothing is marked is what the voice makes of it, byte for byte; its sound is
    brought to the loudness of all clips, to which the loudness of the request and of marks is relative.

    Parameters
    ----------
    voices
        Gives the voices of spans in another voice or language; their sound gets the sample rate of `voice`.

    Raises
    ------
    InputError
        The voice cannot say it.
    """
    spoken: list[Speech] = []
    clocks: list[WordTimes] = []
    gains: list[Floats] = []
    for part in sentence.utterances:
        speaker = speaker_of(part, voice, request, voices)
        given = [SpokenWord(word.text, word.segments, word.after) for word in part.words] or part.text
        speech = speaker.speak(given, rate=request.rate * part.rate, seed=request.seed)
        speech = resampled_speech(speech, voice.sample_rate)
        language = part.language or request.language
        clock = WordTimes(part.source, speech.phones, speech.words, language=language, first=part.first)
        spoken.append(speech)
        clocks.append(clock)
        gains.append(_gain(speech.waveform, sentence.runs, part, clock))
    quiet = [_turned_down(speech, request.volume, gain) for speech, gain in zip(spoken, gains, strict=True)]
    speech, begins = _joined_sentence(quiet, sentence, voice.sample_rate)
    levelled = level_speech(spoken, [request.volume * gain for gain in gains])
    sound = _joined_sentence(levelled, sentence, voice.sample_rate)[0].waveform
    times = _SentenceTimes(tuple(part.first for part in sentence.utterances), tuple(clocks), tuple(begins))
    return SpokenSentence(
        speech, *resolve_marks(sentence.runs, sentence.marks, times, (sentence.first, sentence.last)), sound
    )


def _joined_sentence(speeches: Sequence[Speech], sentence: Sentence, rate: int) -> tuple[Speech, list[float]]:
    """Utterances of a sentence with its silences, and the second that is now each one's 0."""
    speech, begins = join_utterances(speeches, [_pause_after(part) for part in sentence.utterances[:-1]])
    if sentence.leading_pause > 0:
        before = silent_speech(sentence.leading_pause, rate)
        speech, begins = concatenate_speech([before, speech]), [second + before.waveform.duration for second in begins]
    if pause := sentence.utterances[-1].pause:
        speech = concatenate_speech([speech, silent_speech(pause, rate)])
    return speech, begins


def silent_sentences(seconds: float, fps: Fraction, n_steps: int) -> Iterator[tuple[SpokenSentence, int]]:
    """Seconds in which nothing is said, in parts that end on frames, and the share of each in so many steps."""
    n_frames = frame_count(seconds, float(fps))
    bounds = [*range(0, n_frames, max(round(IDLE_PART_S * fps), 1)), n_frames]
    for first, last in pairwise(bounds):
        n_samples = first_sample(last, IDLE_RATE, fps) - first_sample(first, IDLE_RATE, fps)
        steps = n_steps * last // n_frames - n_steps * first // n_frames
        quiet = silent_speech(n_samples / IDLE_RATE, IDLE_RATE)
        yield SpokenSentence(quiet, Timeline(), (), quiet.waveform), steps


def resolve_marks(
    runs: Sequence[StyleRun], marks: Sequence[Mark], times: _LetterTimes, letters: tuple[int, int]
) -> tuple[Timeline, tuple[MarkTime, ...]]:
    """What marks ask for in a stretch of letters, on the clock that tells when these are spoken.

    A style from the first letter on holds from 0 s, one to the last letter without end; between them it begins with its
    first word and ends with its last one, or where another style goes on.
    """
    first, last = letters
    spans: list[StyleSpan] = []
    behind = 0.0
    for run, following in zip(runs, [*runs[1:], None], strict=True):
        start = max(times.onset(run.start) if run.start > first else 0.0, behind)
        if following is None or following.start >= last:
            end = math.inf
        else:
            end = times.onset(following.start) if following.styles else times.end(following.start)
        behind = max(end, behind)
        if start < end:
            spans += [StyleSpan(feature, style, start, end) for feature, style in innermost_styles(run.styles).items()]
    nods = tuple(Nod(times.onset(mark.at), mark.size) for mark in marks if isinstance(mark, NodMark))
    names = tuple(MarkTime(mark.name, times.onset(mark.at)) for mark in marks if isinstance(mark, NameMark))
    return Timeline(spans=tuple(spans), nods=nods), names


def resolve_recording_marks(
    text: MarkedText, phones: PhoneSequence, words: Sequence[WordSpan], language: str
) -> tuple[Timeline, tuple[MarkTime, ...]]:
    """What marks ask for in a recording whose words are known, as `resolve_marks`; nothing where there are no words."""
    if not words:
        return Timeline(), ()
    placed = index_by_letters(text)
    times = WordTimes(text.text, phones, words, language=language)
    return resolve_marks(placed.runs, placed.marks, times, (0, n_letters(text.text)))


@lru_cache(maxsize=1000)
def innermost_styles(nested: tuple[str, ...]) -> Mapping[str, str]:
    """Style of each feature under nested marks, the innermost of which counts."""
    chosen: dict[str, str] = {}
    for written in nested:
        chosen |= parse_style(written)
    return chosen


def marked_styles(text: MarkedText) -> tuple[str, ...]:
    """Names of all styles that a text asks for, in order of first use; errors as `check_marks`."""
    runs = dict.fromkeys(run.styles for run in text.runs)
    return tuple(dict.fromkeys(style for styles in runs for style in innermost_styles(styles).values()))


def check_marks(text: MarkedText, request: Request) -> None:
    """Refuse marks that go with no request, or not with this one; cheap at any length.

    Raises
    ------
    InputError
        A style is written wrongly, speed or loudness are out of range together with the request's, the text names
        another language, or a recording is to pause or to change its voice.
    """
    if request.audio is not None and text.has_voice_changes:
        raise InputError(
            "a recording keeps its own pauses, speed, loudness and voice; "
            "leave [pause], <break>, <prosody>, <emphasis>, <voice> and <lang> away"
        )
    if text.language is not None and _primary(language_code(text.language)) != _primary(request.language):
        raise InputError(f"the text names the language {text.language}, not {request.language}; choose one of them")
    marked_styles(text)
    for what, marked, asked, (low, high) in (
        ("speed", {run.rate for run in text.runs}, request.rate, RATE_LIMITS),
        ("loudness", {run.volume for run in text.runs}, request.volume, VOLUME_LIMITS),
    ):
        for factor in marked:
            if not low <= factor * asked <= high:
                raise InputError(
                    f"a {what} of {factor:g} in the text times {asked:g} of the request lies outside "
                    f"{low:g} to {high:g}; change one of them"
                )


def _primary(language: str) -> str:
    """The language of a code without its variety."""
    return language.partition("-")[0]


def _pause_after(utterance: Phrase) -> float:
    """Seconds of silence between an utterance and the next one of its sentence."""
    if utterance.pause is not None:
        return max(utterance.pause, MIN_UTTERANCE_GAP_S)
    return max(PAUSES_S.get(utterance.source[-1:], 0.0), SPEED_CHANGE_PAUSE_S)


def _gain(sound: Waveform, runs: Sequence[StyleRun], part: Phrase, times: WordTimes) -> Floats:
    """(n,) or (1,) factor of an utterance's samples: the loudness of its runs."""
    mine = [
        (run.volume, max(run.start, part.first), end)
        for run, end in zip(runs, [*(run.start for run in runs[1:]), part.last], strict=True)
        if run.start < part.last and end > part.first
    ]
    if all(volume == 1.0 for volume, _, _ in mine):
        return np.ones(1)
    seconds = np.arange(len(sound.samples)) / sound.rate
    gain = np.ones(len(seconds))
    for volume, first, last in mine:
        start = times.onset(first) if first > part.first else 0.0
        end = times.end(last) if last < part.last else math.inf
        if start < end:
            gain += (volume - 1.0) * span_weights(seconds, start, end, LOUDNESS_RAMP_S)
    factors: Floats = np.maximum(gain, 0.0)
    return factors


def _turned_down(speech: Speech, volume: float, gain: Floats) -> Speech:
    """An utterance at a loudness, turned down where it would exceed full scale: what motion is computed from."""
    samples = apply_volume(speech.waveform.samples, volume)
    louder = samples if len(gain) == 1 else apply_volume(samples * gain, 1.0)
    return replace(speech, waveform=Waveform(louder, speech.waveform.rate))
