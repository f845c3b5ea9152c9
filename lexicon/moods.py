"""The mood of a sentence from its words: ``--style auto``.

``mood_words.tsv`` lists words and phrases of each mood with a strength (3: the mood itself, 2: clear, 1: a hint; rows
of ``none`` are phrases without a mood), written for this program (CC0). They add up, weighted by what stands about
them; a mood is taken where its sum is clear and clearly above the others, so that doubt is neutral. English only.
"""

import functools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

from lexicon.chunks import split_chunks
from lexicon.dictionary import word_set
from lexicon.marked_text import MAX_NOTES, MarkedText, StyleRun
from lexicon.sentence_length import MAX_SENTENCE_CHARACTERS
from lexicon.ssml_leniency import nearest_style
from lexicon.written_forms import read_table

# Styles of speech services for moods; their nearest ones are shown (`lexicon.ssml_leniency.nearest_style`).
MOODS: Mapping[str, str] = MappingProxyType(
    {"happy": "happy", "sad": "sad", "angry": "angry", "frustrated": "disgruntled", "surprised": "surprised"}
)
LEAST, LEAST_OF_HINTS = 2.0, 3.0  # sum of the weights of a mood, and of hints alone
MARGIN = 0.5  # by which it is above the next mood
MAX_WORDS = 4  # of a phrase
CLAUSE_WORDS = 16  # before a word, by which it is weighted
NEGATION_WORDS = 4  # within which a negation reaches what follows it
OPPOSITE = 0.75  # of a negated joy, which is sad; other negated moods are none
INTENSIFIED, WEAKENED = 1.5, 0.5  # by a word before
EXCLAIMED, ASKED = 1.25, 0.5  # factors of an exclamation, and of a question
SUPPOSED = 0.25  # of a clause with if
LEFT_BEHIND = 0.5  # of what stands before "but"
NEGATIONS = word_set("not never no without hardly barely neither nor nothing nobody none stopped")
INTENSIFIERS = word_set(
    "very so really extremely absolutely incredibly truly deeply terribly awfully utterly totally completely such too "
    "most quite"
)
WEAKENERS = word_set("slightly somewhat fairly rather little bit almost nearly partly")
SUPPOSITIONS = word_set("if unless whether suppose supposing when whenever")
_WORD = re.compile(r"[A-Za-z]+(?:['’][A-Za-z]+)*|[.,;:!?—–]")
_SHORT_NOT = re.compile(r"(?i)\b(ca|wo|sha|[a-z]+?)n['’]t\b")
_FULL_VERBS = MappingProxyType({"ca": "can", "wo": "will", "sha": "shall"})
_SHORT_BE = ((re.compile(r"(?i)\bi['’]m\b"), "I am"), (re.compile(r"(?i)\b(you|we|they)['’]re\b"), r"\1 are"))


@dataclass(frozen=True, slots=True)
class Mood:
    """Mood of a sentence: its name, or None, the words that speak for it with their weights, and its strength."""

    name: str | None
    words: tuple[tuple[str, float], ...] = ()

    @property
    def style(self) -> str | None:
        """Style of the starter palette that shows it."""
        return None if self.name is None else nearest_style(MOODS[self.name])

    @property
    def reason(self) -> str:
        """The words with their weights, such as ``so sorry (3), died (3)``."""
        return ", ".join(f"{word} ({weight:.2g})" for word, weight in self.words)


@dataclass(frozen=True, slots=True)
class _Found:
    mood: str
    strength: float
    weight: float
    words: str


def sentence_mood(sentence: str) -> Mood:
    """Mood of an English sentence."""
    words = _words(sentence)
    found = [*_weighted(words, sentence)]
    sums: dict[str, float] = {}
    for part in found:
        sums[part.mood] = sums.get(part.mood, 0.0) + part.weight
    best, *others = sorted(sums, key=lambda mood: -sums[mood]) or [""]
    second = sums[others[0]] if others else 0.0
    strongest = max((part.strength for part in found if part.mood == best), default=0.0)
    if sums.get(best, 0.0) < (LEAST if strongest > 1.0 else LEAST_OF_HINTS) or sums[best] - second < MARGIN:
        return Mood(None)
    return Mood(best, tuple((part.words, part.weight) for part in found if part.mood == best))


def with_moods(text: MarkedText, language: str) -> tuple[MarkedText, tuple[str, ...]]:
    """A text whose sentences without a style of their own have that of their mood, and a note on each.

    A palette that lacks a style shows the sentence as it is.
    """
    if not language.startswith("en"):
        return text, (f"--style auto reads English words, not those of {language}: all sentences are neutral",)
    runs = [*text.runs]
    notes: list[str] = []
    styles = set(text.foreign_styles)
    at = 0
    for sentence in split_chunks(text.text, MAX_SENTENCE_CHARACTERS, language):
        start = text.text.index(sentence[:1], at) if sentence else at
        at = start + len(sentence)
        mood = sentence_mood(sentence)
        if mood.style is not None:
            runs = _painted(runs, (start, at), mood.style, len(text.text))
            styles.add(mood.style)
            notes.append(f"{' '.join(sentence.split())[:60]!r} is {mood.style}, by {mood.reason}")
    if len(notes) > MAX_NOTES:
        notes[MAX_NOTES:] = [f"{len(notes) - MAX_NOTES} further sentences have the style of their mood"]
    return replace(text, runs=tuple(runs), foreign_styles=frozenset(styles)), tuple(notes)


def _painted(runs: Sequence[StyleRun], span: tuple[int, int], style: str, length: int) -> list[StyleRun]:
    """Runs of a text of some characters, of which those without a style have one within a span."""
    start, end = span
    found: list[StyleRun] = []
    for run, following in zip(runs, [*(run.start for run in runs[1:]), length], strict=True):
        places = sorted({run.start, *(place for place in span if run.start < place < following)})
        for place in places:
            is_within = start <= place < end and not run.styles
            found.append(replace(run, start=place, styles=(style,) if is_within else run.styles))
    return [found[0], *(run for before, run in pairwise(found) if not before.is_spoken_as(run))]


@functools.cache
def _entries() -> tuple[Mapping[str, tuple[str, float]], Mapping[str, tuple[str, float]]]:
    """Mood and strength of words and phrases, and of beginnings of them."""
    whole: dict[str, tuple[str, float]] = {}
    begun: dict[str, tuple[str, float]] = {}
    for mood, strength, words in mood_rows():
        for written in words:
            table = begun if written.endswith("*") else whole
            table.setdefault(written.removesuffix("*"), (mood, strength))
    return whole, begun


def mood_rows() -> Iterator[tuple[str, float, tuple[str, ...]]]:
    """Rows of the table: mood, strength, words."""
    for key, cells in read_table("mood_words.tsv").items():
        mood, _, strength = key.partition(" ")
        yield mood, float(strength), tuple(word.strip() for word in cells[0].split(","))


def _words(sentence: str) -> list[str]:
    """Words with their marks, short forms in full."""
    sentence = _SHORT_NOT.sub(lambda found: f"{_FULL_VERBS.get(found[1].casefold(), found[1])} not", sentence)
    for short, full in _SHORT_BE:
        sentence = short.sub(full, sentence)
    return _WORD.findall(sentence.replace("cannot", "can not").replace("’", "'"))


def _weighted(words: Sequence[str], sentence: str) -> Iterator[_Found]:
    """Words and phrases of moods with their weights, the longest ones first at each place."""
    small = [word.casefold() for word in words]
    whole, begun = _entries()
    rest = sentence.rstrip("\"'”’)] ")
    of_sentence = ASKED if rest.endswith("?") else EXCLAIMED if rest.endswith("!") else 1.0
    last_but = max((at for at, word in enumerate(small) if word == "but"), default=-1)
    at = 0
    while at < len(words):
        n_words, entry = _entry_at(small, at, whole, begun)
        if entry is None or (n_words == 1 and _is_name(words, at)):
            at += 1
            continue
        mood, strength = entry
        asked = 1.0 if mood == "surprised" and of_sentence == ASKED else of_sentence  # What on earth is that?
        weight = strength * asked * (LEFT_BEHIND if at < last_but else 1.0) * _supposed(small, at)
        weight *= _degree(small, at)
        if n_words == 1 and _is_negated(small, at):
            mood, weight = ("sad", OPPOSITE * weight) if mood == "happy" else ("none", 0.0)
        if mood != "none":
            yield _Found(mood, strength, weight, " ".join(words[at : at + n_words]))
        at += n_words


def _entry_at(
    words: Sequence[str], at: int, whole: Mapping[str, tuple[str, float]], begun: Mapping[str, tuple[str, float]]
) -> tuple[int, tuple[str, float] | None]:
    for n_words in range(MAX_WORDS, 0, -1):
        phrase = " ".join(words[at : at + n_words])
        if phrase in whole:
            return n_words, whole[phrase]
    word = words[at]
    return 1, next((begun[word[:end]] for end in range(len(word), 2, -1) if word[:end] in begun), None)


def _is_name(words: Sequence[str], at: int) -> bool:
    """Whether a word is one of a name or a title: with a capital within a sentence."""
    is_first = at == 0 or words[at - 1] in ".!?:"
    return not is_first and words[at][:1].isupper() and not words[at].isupper()


def _clause(words: Sequence[str], at: int) -> Sequence[str]:
    """Words of the clause before a place, at most `CLAUSE_WORDS`."""
    first = max(at - CLAUSE_WORDS, 0)
    start = max((place + 1 for place in range(first, at) if not words[place][0].isalpha()), default=first)
    return words[start:at]


def _is_negated(words: Sequence[str], at: int) -> bool:
    near = _clause(words, at)[-NEGATION_WORDS:]
    return not NEGATIONS.isdisjoint(near) and near[-2:] != ["not", "only"]


def _supposed(words: Sequence[str], at: int) -> float:
    return SUPPOSED if not SUPPOSITIONS.isdisjoint(_clause(words, at)) else 1.0


def _degree(words: Sequence[str], at: int) -> float:
    """Factor of the word before."""
    at -= at > 1 and words[at - 1] in NEGATIONS  # really not happy
    before = words[at - 1] if at else ""
    return INTENSIFIED if before in INTENSIFIERS else WEAKENED if before in WEAKENERS else 1.0
