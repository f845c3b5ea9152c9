"""Places in the spoken text from which and up to which the styles and gestures of marks apply.

The style of a tag or an action applies to what follows it, up to the next one or the end of the paragraph; that of an
emoji to the sentence in which it stands, or that it ends. What nothing follows in its paragraph belongs to the sentence
before it. A gesture comes with the word that follows, that of an emoji and a last one with the word before.
"""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from lexicon.chunks import split_chunks
from lexicon.mark_parts import Cue
from lexicon.marked_text import Mark, MarkedText, StyleRun

_WORD = re.compile(r"\S*\w\S*")
_BREAK = re.compile(r"\n\s*\n")
Span = tuple[int, int, str]  # of a style: half-open, in characters


@dataclass(frozen=True, slots=True)
class PlacedCue:
    """A cue with its position in the spoken text."""

    at: int
    cue: Cue

    @property
    def style(self) -> str:
        """The style that its marks have; empty without one."""
        return next((mark.style for mark in reversed(self.cue.marks) if mark.style), "")


class _Places:
    """Words, lines, sentences and paragraphs of a text, found by position."""

    def __init__(self, text: str, language: str) -> None:
        self._words = [match.start() for match in _WORD.finditer(text)]
        self._breaks = [match.start() for match in _BREAK.finditer(text)]
        self._lines = [match.start() for match in re.finditer("[\n\u2028]", text)]
        self._sentences = [*_sentence_starts(text, language)]
        self._length = len(text)

    def paragraph_end(self, at: int) -> int:
        """Where the paragraph of a position ends."""
        return _at(self._breaks, bisect_left(self._breaks, at), self._length)

    def has_word_ahead(self, at: int) -> bool:
        """Whether a word follows in the paragraph."""
        return self.next_word(at) < self.paragraph_end(at)

    def next_word(self, at: int) -> int:
        """Start of the next word, or the end of the text."""
        return _at(self._words, bisect_left(self._words, at), self._length)

    def word_before(self, at: int, *, in_line: bool = False) -> int | None:
        """Start of the last word before a position in its paragraph, or its line; None without one."""
        number = bisect_left(self._words, at) - 1
        bounds = self._lines if in_line else self._breaks
        before = _at(bounds, bisect_left(bounds, at) - 1, -1)
        return self._words[number] if number >= 0 and self._words[number] >= before else None

    def sentence(self, at: int) -> tuple[int, int]:
        """The sentence of a character."""
        number = bisect_right(self._sentences, at)
        start = self._sentences[number - 1] if number else 0
        return start, min(_at(self._sentences, number, self._length), max(self.paragraph_end(at), at))


def _at(values: Sequence[int], index: int, otherwise: int) -> int:
    return values[index] if 0 <= index < len(values) else otherwise


def _sentence_starts(text: str, language: str) -> Iterator[int]:
    """Index of the first letter of each sentence."""
    at = 0
    for chunk in split_chunks(text, max(len(text), 1), language):
        start = text.index(chunk[0], at)
        yield start
        for word in chunk.split():
            at = text.index(word, at) + len(word)


def with_cues(marked: MarkedText, cues: Sequence[PlacedCue], language: str) -> MarkedText:
    """A marked text with the styles and gestures of its cues."""
    if not any(placed.cue.marks or placed.cue.ends_style for placed in cues):
        return marked
    places = _Places(marked.text, language)
    tags = [placed for placed in cues if not placed.cue.is_within]
    within = [placed for placed in cues if placed.cue.is_within]
    following, ended = _tag_spans(tags, places)
    layers = (following, ended, [*_sentence_spans(within, places)])
    names = frozenset(style for layer in layers for _, _, style in layer)
    gestures = sorted([*marked.marks, *_gestures(cues, places)], key=lambda mark: mark.at)
    return replace(
        marked,
        runs=_with_styles(marked.runs, layers),
        marks=tuple(gestures),
        foreign_styles=marked.foreign_styles | names,
    )


def _tag_spans(tags: Iterable[PlacedCue], places: _Places) -> tuple[list[Span], list[Span]]:
    """Styles of tags up to the next one or the paragraph's end, and of those that end a paragraph."""
    found: list[Span] = []
    ended: list[Span] = []
    for placed in tags:
        if not (placed.style or placed.cue.ends_style):
            continue
        before = places.word_before(placed.at)
        if placed.style and before is not None and not places.has_word_ahead(placed.at):
            ended.append((*places.sentence(before), placed.style))
            continue
        if found and found[-1][1] > placed.at:
            found[-1] = (found[-1][0], placed.at, found[-1][2])
        if placed.style:
            found.append((placed.at, places.paragraph_end(_first_word(placed.at, places)), placed.style))
    return [span for span in found if span[0] < span[1]], ended


def _first_word(at: int, places: _Places) -> int:
    """The position, or that of the next word if a blank line stands between."""
    return at if places.has_word_ahead(at) else places.next_word(at)


def _sentence_spans(within: Iterable[PlacedCue], places: _Places) -> Iterator[Span]:
    """Styles of emoji, each from the one before it in the sentence, or its beginning; the last one to its end."""
    waiting: Span | None = None
    before_at = 0
    for placed in within:
        if not placed.style:
            continue
        before = places.word_before(placed.at, in_line=True)
        start, end = places.sentence(places.next_word(placed.at) if before is None else before)
        if waiting is not None and waiting[1] == end and before is not None:
            start = max(waiting[0], min(before_at, placed.at))
            yield (waiting[0], start, waiting[2])
        elif waiting is not None:
            yield waiting
        waiting, before_at = (start, end, placed.style), placed.at
    if waiting is not None:
        yield waiting


def _gestures(cues: Iterable[PlacedCue], places: _Places) -> Iterator[Mark]:
    for placed in cues:
        gestures = [mark.gesture for mark in placed.cue.marks if mark.gesture is not None][:1]
        if not gestures:
            continue
        is_last = placed.cue.is_within or not places.has_word_ahead(placed.at)
        before = places.word_before(placed.at, in_line=placed.cue.is_within) if is_last else None
        yield from (replace(gesture, at=placed.at if before is None else before) for gesture in gestures)


def _with_styles(runs: Sequence[StyleRun], layers: Sequence[Sequence[Span]]) -> tuple[StyleRun, ...]:
    """Runs with the styles of layers of spans, each in order, around those that they have."""
    bounds = {run.start for run in runs} | {edge for layer in layers for span in layer for edge in span[:2]}
    found: list[StyleRun] = []
    numbers, run_number = [0] * len(layers), 0
    for bound in sorted(bounds):
        while run_number + 1 < len(runs) and runs[run_number + 1].start <= bound:
            run_number += 1
        styles: list[str] = []
        for kind, layer in enumerate(layers):
            while numbers[kind] < len(layer) and layer[numbers[kind]][1] <= bound:
                numbers[kind] += 1
            span = layer[numbers[kind]] if numbers[kind] < len(layer) else None
            styles += [span[2]] if span and span[0] <= bound else []
        run = replace(runs[run_number], start=bound, styles=(*styles, *runs[run_number].styles))
        if not found or not found[-1].is_spoken_as(run):
            found.append(run)
    return tuple(found)
