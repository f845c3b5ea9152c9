"""Split a marked text into sentences, and sentences into phrases, which a voice synthesises one by one.

Positions are counted in letters, that is in characters other than white space, since splitting a text into sentences
changes only its white space.
"""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from lexicon.capitals import sentence_case
from lexicon.gesture_names import GESTURES
from lexicon.given_phones import TextWord, ToneSpan, phrase_words
from lexicon.ipa import IpaPhone
from lexicon.marked_text import MAX_PAUSE_S, GestureMark, Mark, MarkedText, PauseMark, PhoneMark, StyleRun
from lexicon.normalize import spoken_form
from lexicon.pauses import PARAGRAPH_S, pause_behind
from lexicon.sentence_length import n_letters, overlapping_runs, pieces_of_text
from lexicon.tones import EVEN

MAX_LAST_GESTURE_S = 1.2  # of silence behind the last word, for a gesture that stands there
_BLANK_LINE = re.compile(r"\n\s*\n")


@dataclass(frozen=True, slots=True)
class Phrase:
    """A part of a sentence with one rate, voice and language, synthesised as a whole.

    Parameters
    ----------
    source, text
        Written form and spoken form.
    first, last
        Half-open range of letters in the whole text.
    pause
        Seconds of marked silence after it; None without a mark.
    voice, language
        Set in a span of another voice or language; None elsewhere.
    words
        The words of `text` if phones are given for some of them, or a tone; empty otherwise.
    seconds
        In which it is spoken, whatever the rate; None: by the rate.
    """

    source: str
    text: str
    first: int
    last: int
    rate: float = 1.0
    pause: float | None = None
    voice: str | None = None
    language: str | None = None
    words: tuple[TextWord, ...] = ()
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Sentence:
    """A sentence, which becomes one piece of a clip.

    Parameters
    ----------
    utterances
        At least one.
    runs, marks
        Runs and marks within it, by letters of the whole text: the first run covers its first letter; pauses and phones
        are not among the marks.
    leading_pause
        Seconds of silence marked before the first sentence.
    n_characters
        Number of characters of the text that it covers.
    pause_s
        Seconds of silence between it and the next one, at a rate of 1; None for the last one of a text.
    """

    utterances: tuple[Phrase, ...]
    runs: tuple[StyleRun, ...]
    marks: tuple[Mark, ...]
    leading_pause: float
    n_characters: int
    pause_s: float | None = None

    @property
    def first(self) -> int:
        """Index of its first letter in the whole text."""
        return self.utterances[0].first

    @property
    def last(self) -> int:
        """Index of the letter after it."""
        return self.utterances[-1].last

    @property
    def words(self) -> tuple[TextWord, ...]:
        """Words as they are spoken, with the punctuation after them."""
        return tuple(word for part in self.utterances for word in part.words or map(TextWord, part.text.split()))

    def relative(self) -> "Sentence":
        """The sentence with positions counted from its first letter: equal for equal sentences anywhere in a text."""
        first = self.first
        return replace(
            self,
            utterances=tuple(
                replace(part, first=part.first - first, last=part.last - first) for part in self.utterances
            ),
            runs=tuple(replace(run, start=run.start - first) for run in self.runs),
            marks=tuple(replace(mark, at=mark.at - first) for mark in self.marks),
        )


def split_sentences(
    text: MarkedText, language: str, own: Mapping[str, tuple[IpaPhone, ...]] | None = None
) -> Iterator[Sentence]:
    """Sentences that contain words, lazily and in linear time, each of bounded length with the silence in it.

    `own` has the user's pronunciations by `word_key`, which count for the length of a sentence.

    Sentence boundaries are those of the text without marks. A pause or a change of rate, voice or language within a
    sentence begins a new phrase. A first sentence of more than `FIRST_PIECE_CHARACTERS` is divided after its first
    phrase.
    """
    placed = index_by_letters(replace(text, text=sentence_case(text.text, text.language or language)))
    starts = [run.start for run in placed.runs]
    pauses = [mark for mark in placed.marks if isinstance(mark, PauseMark)]
    pause_positions = [mark.at for mark in pauses]
    phones = [mark for mark in placed.marks if isinstance(mark, PhoneMark)]
    phone_positions = [mark.at for mark in phones]
    others = [mark for mark in placed.marks if not isinstance(mark, PauseMark | PhoneMark)]
    paragraphs = frozenset(_paragraph_ends(placed.text))
    pending: Sentence | None = None
    leading_pause = sum(mark.seconds for mark in pauses[:1] if mark.at == 0)
    end = 0
    n_used = 0
    for chunk, is_cut in pieces_of_text(placed, language, own or {}):
        start, end = end, end + n_letters(chunk)
        runs = overlapping_runs(placed.runs, starts, start, end)
        inside = pauses[bisect_right(pause_positions, start) : bisect_right(pause_positions, end)]
        utterances, silence = _phrases(chunk, start, runs, inside, language)
        given = phones[bisect_left(phone_positions, start) : bisect_left(phone_positions, end)]
        if given or any(run.tone != EVEN for run in runs):
            utterances = [_add_words(part, given, runs, part.language or language) for part in utterances]
        if pending is not None:
            pending = _extend_last_pause(pending, silence)
        else:
            leading_pause += silence
        if not utterances:
            continue
        if pending is not None:
            yield pending
        first_mark = n_used
        while n_used < len(others) and others[n_used].at < end:
            n_used += 1
        utterances[-1] = _continued_phrase(utterances[-1], is_cut=is_cut)
        marks = tuple(others[first_mark:n_used])
        pause_s = PARAGRAPH_S if end in paragraphs else pause_behind(chunk, is_cut=is_cut)
        pending = Sentence(tuple(utterances), runs, marks, leading_pause, len(chunk), pause_s)
        leading_pause = 0.0
    if pending is not None:
        yield replace(pending, marks=(*pending.marks, *others[n_used:]), pause_s=None)


def _paragraph_ends(text: str) -> Iterator[int]:
    """Number of letters before each blank line."""
    start = letters = 0
    for match in _BLANK_LINE.finditer(text):
        letters += n_letters(text[start : match.start()])
        start = match.end()
        yield letters


def _continued_phrase(phrase: Phrase, *, is_cut: bool) -> Phrase:
    """A phrase whose spoken form ends with a comma if its sentence continues, so that the voice does not end it."""
    if not is_cut or not phrase.text[-1:].isalnum():
        return phrase
    words = (*phrase.words[:-1], *(replace(word, after=word.after or ",") for word in phrase.words[-1:]))
    return replace(phrase, text=f"{phrase.text},", words=words)


def text_prefix(written: str, n: int) -> str:
    """The beginning of a text with `n` letters."""
    for at, character in enumerate(written):
        if n == 0 and not character.isspace():
            return written[:at]
        n -= not character.isspace()
    return written


def index_by_letters(text: MarkedText) -> MarkedText:
    """A marked text with positions in letters; at one position the last run, the sum of pauses, the largest gestures.

    Gestures behind the last word get a pause in which they are seen.
    """
    ends = (mark.end for mark in text.marks if isinstance(mark, PhoneMark))
    positions = sorted({0, len(text.text), *(run.start for run in text.runs), *(mark.at for mark in text.marks), *ends})
    letters = {0: 0}
    for before, position in pairwise(positions):
        letters[position] = letters[before] + n_letters(text.text[before:position])
    runs = {letters[run.start]: replace(run, start=letters[run.start]) for run in text.runs}
    pauses: dict[int, PauseMark] = {}
    gestures: dict[tuple[int, str], GestureMark] = {}
    names: list[Mark] = []
    for mark in text.marks:
        at = letters[mark.at]
        if isinstance(mark, PauseMark):
            seconds = mark.seconds + (pauses[at].seconds if at in pauses else 0.0)
            pauses[at] = PauseMark(at, min(seconds, MAX_PAUSE_S))
        elif isinstance(mark, GestureMark):
            gesture, earlier = replace(mark, at=at), gestures.get((at, mark.name))
            gestures[at, mark.name] = earlier if earlier and earlier.size > mark.size else gesture
        elif isinstance(mark, PhoneMark):
            names.append(replace(mark, at=at, end=letters[mark.end]))
        else:
            names.append(replace(mark, at=at))
    last = letters[len(text.text)]
    pauses |= _pause_of_gestures([mark for mark in gestures.values() if mark.at == last and last not in pauses])
    marks = sorted([*gestures.values(), *names, *pauses.values()], key=lambda mark: mark.at)
    return replace(text, runs=tuple(runs.values()), marks=tuple(marks))


def _pause_of_gestures(last: Sequence[GestureMark]) -> dict[int, PauseMark]:
    """Silence in which gestures behind the last word are seen, by its place."""
    needed = max((mark.seconds or GESTURES[mark.name].seconds for mark in last), default=0.0)
    return {mark.at: PauseMark(mark.at, min(needed, MAX_LAST_GESTURE_S)) for mark in last}


def _phrases(
    chunk: str, start: int, runs: tuple[StyleRun, ...], pauses: Sequence[PauseMark], language: str
) -> tuple[list[Phrase], float]:
    """Phrases of a chunk of text, and the marked silence before the first of them."""
    places = [at for at, character in enumerate(chunk) if not character.isspace()]
    end = start + len(places)
    silences = {mark.at: mark.seconds for mark in pauses}
    changes = [run.start for before, run in pairwise(runs) if _speech_settings(run) != _speech_settings(before)]
    bounds = sorted({start, end, *changes, *silences})
    found: list[Phrase] = []
    before = 0.0
    for first, last in pairwise(bounds):
        written = chunk[places[first - start] : places[last - start - 1] + 1]
        run = next(run for run in reversed(runs) if run.start <= first)
        text = spoken_form(written, run.language or language)
        pause = silences.get(last)
        if any(character.isalnum() for character in text):
            seconds = None if run.pace is None else run.pace * (last - first)
            found.append(Phrase(written, text, first, last, run.rate, pause, run.voice, run.language, seconds=seconds))
        elif found:  # punctuation alone belongs to the phrase before it
            found[-1] = _extend_phrase(found[-1], written, last, pause, language)
        else:
            before += pause or 0.0
    return found, before


def _extend_phrase(utterance: Phrase, written: str, last: int, pause: float | None, language: str) -> Phrase:
    whole = utterance.source + written
    text = spoken_form(whole, utterance.language or language)
    seconds = [silence for silence in (utterance.pause, pause) if silence is not None]
    return replace(utterance, source=whole, text=text, last=last, pause=sum(seconds) if seconds else None)


def _speech_settings(run: StyleRun) -> tuple[float, float | None, str | None, str | None]:
    """Settings that are the same within a phrase; tones change from word to word."""
    return run.rate, run.pace, run.voice, run.language


def _add_words(part: Phrase, phones: Sequence[PhoneMark], runs: Sequence[StyleRun], language: str) -> Phrase:
    """A phrase with its words, if phones are given for some of them, or a tone."""
    places = [at for at, character in enumerate(part.source) if not character.isspace()]
    last = min(part.last, part.first + len(places))
    inside = [
        replace(mark, at=places[mark.at - part.first], end=places[mark.end - part.first - 1] + 1)
        for mark in phones
        if part.first <= mark.at < mark.end <= last
    ]
    ends = [*(run.start for run in runs[1:]), last]
    spans = [
        ToneSpan(places[max(run.start, part.first) - part.first], places[min(end, last) - part.first - 1] + 1, run.tone)
        for run, end in zip(runs, ends, strict=True)
        if run.tone != EVEN and max(run.start, part.first) < min(end, last)
    ]
    return replace(part, words=phrase_words(part.source, inside, spans, language)) if inside or spans else part


def _extend_last_pause(sentence: Sentence, seconds: float) -> Sentence:
    """A sentence with a longer pause after it."""
    if seconds == 0.0:
        return sentence
    *others, last = sentence.utterances
    return replace(sentence, utterances=(*others, replace(last, pause=(last.pause or 0.0) + seconds)))
