"""A marked text in sentences, and each sentence in utterances: what a voice speaks in one go.

Places in the text are counted in letters here, that is in characters that are no space: cutting a text into sentences
changes its spaces and nothing else.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from lexicon.chunks import split_chunks
from lexicon.given import GivenWord, given_words
from lexicon.marked_text import Mark, MarkedText, NodMark, PauseMark, PhoneMark, StyleRun
from lexicon.said import as_said

MAX_SENTENCE_CHARACTERS = 300  # characters; a sentence that is longer is cut at a clause mark or a space


@dataclass(frozen=True, slots=True)
class Phrase:
    """What is spoken in one go, at one speed.

    Parameters
    ----------
    written, text
        As it stands in the text, and as it is said.
    first, last
        Its letters in the whole text, half open.
    pause
        Seconds of silence that are marked behind it; None where nothing is.
    voice, language
        Of a span that another voice speaks, or in another language; None elsewhere.
    words
        The words of `text` where phones are given for some of them; empty elsewhere.
    """

    source: str
    text: str
    first: int
    last: int
    rate: float = 1.0
    pause: float | None = None
    voice: str | None = None
    language: str | None = None
    words: tuple[GivenWord, ...] = ()


@dataclass(frozen=True, slots=True)
class Sentence:
    """What becomes one piece of a clip.

    Parameters
    ----------
    utterances
        At least one.
    runs, marks
        What is marked in it, by letters of the whole text: runs begin with the one in force at its first letter; marks
        are all but pauses and phones.
    lead
        Seconds of silence marked before the first sentence.
    n_characters
        Its share of the text.
    """

    utterances: tuple[Phrase, ...]
    runs: tuple[StyleRun, ...]
    marks: tuple[Mark, ...]
    leading_pause: float
    n_characters: int

    @property
    def first(self) -> int:
        """Its first letter in the whole text."""
        return self.utterances[0].first

    @property
    def last(self) -> int:
        """The letter behind it."""
        return self.utterances[-1].last


def split_sentences(text: MarkedText, language: str) -> Iterator[Sentence]:
    """Sentences that hold something to say; English ones as they are said. Linear, and lazy but for one sentence.

    Sentences are those of the text without marks. A pause or a change of speed within one begins a new utterance.
    """
    placed = index_by_letters(text)
    starts = [run.start for run in placed.runs]
    pauses = [mark for mark in placed.marks if isinstance(mark, PauseMark)]
    silent = [mark.at for mark in pauses]
    phones = [mark for mark in placed.marks if isinstance(mark, PhoneMark)]
    phoned = [mark.at for mark in phones]
    others = [mark for mark in placed.marks if not isinstance(mark, PauseMark | PhoneMark)]
    held: Sentence | None = None
    lead, done, told = sum(mark.seconds for mark in pauses[:1] if mark.at == 0), 0, 0
    for chunk in split_chunks(text.text, MAX_SENTENCE_CHARACTERS, language):
        begin, done = done, done + n_letters(chunk)
        runs = _overlapping_runs(placed.runs, starts, begin, done)
        inside = pauses[bisect_right(silent, begin) : bisect_right(silent, done)]
        utterances, silence = _phrases(chunk, begin, runs, inside, language)
        given = phones[bisect_left(phoned, begin) : bisect_left(phoned, done)]
        if given:
            utterances = [_with_phones(part, given, part.language or language) for part in utterances]
        if held is not None:
            held = _extend_last_pause(held, silence)
        else:
            lead += silence
        if not utterances:
            continue
        if held is not None:
            yield held
        behind = told
        while told < len(others) and others[told].at < done:
            told += 1
        held = Sentence(tuple(utterances), runs, tuple(others[behind:told]), lead, len(chunk))
        lead = 0.0
    if held is not None:
        yield replace(held, marks=(*held.marks, *others[told:]))


def n_letters(text: str) -> int:
    """Characters that are no space."""
    return len("".join(text.split()))


def text_prefix(written: str, n: int) -> str:
    """The beginning of a text with so many letters."""
    for at, character in enumerate(written):
        if n == 0 and not character.isspace():
            return written[:at]
        n -= not character.isspace()
    return written


def index_by_letters(text: MarkedText) -> MarkedText:
    """The same with places counted in letters; what meets at one place is one: last run, one pause, largest nod.

    Raises
    ------
    InputError
        The pauses at one place are too long together.
    """
    ends = (mark.end for mark in text.marks if isinstance(mark, PhoneMark))
    places = sorted({0, *(run.start for run in text.runs), *(mark.at for mark in text.marks), *ends})
    letters = {0: 0}
    for before, place in pairwise(places):
        letters[place] = letters[before] + n_letters(text.text[before:place])
    runs = {letters[run.start]: replace(run, start=letters[run.start]) for run in text.runs}
    pauses: dict[int, PauseMark] = {}
    nods: dict[int, NodMark] = {}
    names: list[Mark] = []
    for mark in text.marks:
        at = letters[mark.at]
        if isinstance(mark, PauseMark):
            pauses[at] = PauseMark(at, mark.seconds + (pauses[at].seconds if at in pauses else 0.0))
        elif isinstance(mark, NodMark):
            nods[at] = NodMark(at, max(mark.size, nods[at].size if at in nods else 0.0))
        elif isinstance(mark, PhoneMark):
            names.append(replace(mark, at=at, end=letters[mark.end]))
        else:
            names.append(replace(mark, at=at))
    marks = sorted([*nods.values(), *names, *pauses.values()], key=lambda mark: mark.at)
    return replace(text, runs=tuple(runs.values()), marks=tuple(marks))


def _overlapping_runs(runs: tuple[StyleRun, ...], starts: list[int], begin: int, end: int) -> tuple[StyleRun, ...]:
    return runs[bisect_right(starts, begin) - 1 : bisect_right(starts, end - 1)]


def _phrases(
    chunk: str, begin: int, runs: tuple[StyleRun, ...], pauses: Sequence[PauseMark], language: str
) -> tuple[list[Phrase], float]:
    """Utterances of a chunk of text, and the silence that is marked before the first of them."""
    places = [at for at, character in enumerate(chunk) if not character.isspace()]
    end = begin + len(places)
    silences = {mark.at: mark.seconds for mark in pauses}
    changes = [run.start for before, run in pairwise(runs) if _speaker(run) != _speaker(before)]
    bounds = sorted({begin, end, *changes, *silences})
    found: list[Phrase] = []
    before = 0.0
    for first, last in pairwise(bounds):
        written = chunk[places[first - begin] : places[last - begin - 1] + 1]
        run = next(run for run in reversed(runs) if run.start <= first)
        text = as_said(written, run.language or language)
        pause = silences.get(last)
        if any(character.isalnum() for character in text):
            found.append(Phrase(written, text, first, last, run.rate, pause, run.voice, run.language))
        elif found:  # punctuation by itself belongs to the words before it
            found[-1] = _extend_phrase(found[-1], written, last, pause, language)
        else:
            before += pause or 0.0
    return found, before


def _extend_phrase(utterance: Phrase, written: str, last: int, pause: float | None, language: str) -> Phrase:
    whole = utterance.source + written
    text = as_said(whole, utterance.language or language)
    seconds = [silence for silence in (utterance.pause, pause) if silence is not None]
    return replace(utterance, source=whole, text=text, last=last, pause=sum(seconds) if seconds else None)


def _speaker(run: StyleRun) -> tuple[float, str | None, str | None]:
    return run.rate, run.voice, run.language


def _with_phones(part: Phrase, phones: Sequence[PhoneMark], language: str) -> Phrase:
    """An utterance with the phones that are given for words within it."""
    places = [at for at, character in enumerate(part.source) if not character.isspace()]
    inside = [
        replace(mark, at=places[mark.at - part.first], end=places[mark.end - part.first - 1] + 1)
        for mark in phones
        if part.first <= mark.at < mark.end <= min(part.last, part.first + len(places))
    ]
    return replace(part, words=given_words(part.source, inside, language)) if inside else part


def _extend_last_pause(sentence: Sentence, seconds: float) -> Sentence:
    """A sentence with more silence behind it."""
    if seconds == 0.0:
        return sentence
    *others, last = sentence.utterances
    return replace(sentence, utterances=(*others, replace(last, pause=(last.pause or 0.0) + seconds)))
