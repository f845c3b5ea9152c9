"""Words with several pronunciations: the reading that fits the part of speech and the words around it.

The readings and their evidence are in ``homographs.tsv``: tags of the Penn Treebank (``VB`` stands for all tags that
begin with it), words directly before and after, and words anywhere near. A word that is written with a capital in the
table is read so only where it is capitalised (Polish).
"""

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from importlib import resources

from lexicon.dictionary import arpabet_segments, word_set
from lexicon.ipa import IpaPhone
from lexicon.part_of_speech import tag_words
from lexicon.pauses import MARKS
from lexicon.verb_tense import tense_tag
from lexicon.word_class import CLASSES, class_of_tag, class_probabilities
from lexicon.word_parts import add_s

NEAR_WORDS = 9  # words on each side that are searched for evidence
# Weights of the evidence: a neighbour outweighs the tag, which outweighs the topic.
# these weights read 118 of 118 known homographs, and 52 of 60 new ones (decision 120)
_TAG_WEIGHT = 2.0
_NEIGHBOUR_WEIGHT = 3.0
_NEAR_WEIGHT = 1.5
_MOST_NEAR = 2  # words of the topic that count
# Before a verb, whatever the tagger says: it takes many verbs of this list for nouns (to object).
_BEFORE_VERB = word_set(
    "i we they he she who will would can could should must may might shall cannot can't couldn't won't wouldn't "
    "shouldn't don't doesn't didn't i'll we'll you'll they'll he'll she'll it'll i'd we'd they'd he'd she'd let's "
    "please to"
)
_ADVERBS = word_set("never always ever just not also still already often sometimes")
_PRONOUNS, _HAVE = word_set("i you he she it we they"), word_set("have has had haven't hasn't hadn't")
_BEFORE_NOUN = word_set("the a an my your his its our their every no")
_BEFORE_PREPOSITION = word_set("from due thanks according access addition next close back of")  # to is no infinitive's


@dataclass(frozen=True, slots=True)
class Reading:
    """One pronunciation of a spelling, and the evidence for it."""

    segments: tuple[IpaPhone, ...]
    tags: tuple[str, ...]
    before: frozenset[str]
    after: frozenset[str]
    near: frozenset[str]


@functools.cache
def _readings() -> dict[str, tuple[Reading, ...]]:
    found: dict[str, list[Reading]] = {}
    lines = resources.files("lexicon").joinpath("homographs.tsv").read_text(encoding="utf-8").splitlines()[1:]
    for line in lines:
        word, names, tags, *evidence = line.split("\t")
        before, after, near = (frozenset(cell.split()) for cell in evidence)
        found.setdefault(word, []).append(Reading(arpabet_segments(names), tuple(tags.split()), before, after, near))
    return {word: tuple(readings) for word, readings in found.items()}


def is_homograph(word: str) -> bool:
    """Whether the table has readings of a word in this spelling or in lower case."""
    return bool(_readings_of(word))


def _readings_of(word: str) -> tuple[Reading, ...]:
    """Readings of a spelling, or of its stem with the ending -s, which no past takes."""
    table = _readings()
    own = table.get(word) or table.get(word.lower())
    if own or not word.endswith("s") or word.endswith("ss"):
        return own or ()
    stem = table.get(word[:-1]) or table.get(word[:-1].lower()) or ()
    return tuple(replace(reading, segments=add_s(reading.segments)) for reading in stem if "VBD" not in reading.tags)


def homograph_segments(words: Sequence[str], places: Iterable[int]) -> dict[int, tuple[IpaPhone, ...]]:
    """Phones of words of a sentence by their context, by index; none for a spelling without readings.

    Parameters
    ----------
    words
        Words and punctuation marks of the sentence.
    places
        Indices of the words.
    """
    found: dict[int, tuple[IpaPhone, ...]] = {}
    lower = [word.lower() for word in words]
    tags: Sequence[str] = ()
    for at in places:
        readings = _readings_of(words[at])
        if len(readings) > 1:
            tags = tags or tag_words(tuple(words))
            tense = tense_tag(tags, lower, at) if _is_past_like_present(readings) else ""
            tag = tense or _likely_tag(tags, lower, at, _classes(readings))
            readings = (max(readings, key=lambda reading: _evidence(reading, lower, at, tag, is_sure=tense != "")),)
        if readings:
            found[at] = readings[0].segments
    return found


def _classes(readings: Sequence[Reading]) -> frozenset[str]:
    """Classes to which the readings of a word belong; all if a reading has no tag."""
    if not all(reading.tags for reading in readings):
        return frozenset(CLASSES)
    return frozenset(class_of_tag(tag) for reading in readings for tag in reading.tags)


def _likely_tag(tags: Sequence[str], lower: Sequence[str], at: int, classes: frozenset[str]) -> str:
    """The tagger's tag, or that of the class of the word that the words around it make likelier."""
    tag = tags[at]
    place = at - 1
    while place > max(at - NEAR_WORDS, 0) and (lower[place] in _ADVERBS or lower[place].endswith("ly")):
        place -= 1
    before, two_before = (lower[place] if place >= 0 else ""), (lower[place - 1] if place > 0 else "")
    if before in _HAVE or (before in _PRONOUNS and two_before in _HAVE):  # have never read, have you read
        return "VBN" if tag.startswith("VB") else tag
    is_infinitive = before != "to" or two_before not in _BEFORE_PREPOSITION
    if before in _BEFORE_VERB and is_infinitive:
        return tag if tag.startswith("VB") else "VB"
    probabilities = class_probabilities(lower, tags, at)
    if before in _BEFORE_NOUN:
        classes = classes - {"VB"} or classes
    probabilities *= [name in classes for name in CLASSES]
    likeliest = CLASSES[int(probabilities.argmax())]
    if likeliest == class_of_tag(tag):
        return tag
    return likeliest


def _is_past_like_present(readings: Sequence[Reading]) -> bool:
    """Whether the past of a verb is spelled as its present (read), unlike that of another verb (wound)."""
    return any({"VBD", "VBP"} <= set(reading.tags) for reading in readings)


def _evidence(reading: Reading, lower: Sequence[str], at: int, tag: str, *, is_sure: bool) -> float:
    score = _TAG_WEIGHT * any(_is_tag(tag, own) for own in reading.tags)
    if is_sure:
        return score
    before = lower[at - 1] if at else "."
    after = lower[at + 1].removesuffix("'s") if at + 1 < len(lower) else "."
    score += _NEIGHBOUR_WEIGHT * (
        (before in reading.before) + ((after if after not in MARKS else ".") in reading.after)
    )
    around = [*lower[max(at - NEAR_WORDS, 0) : at], *lower[at + 1 : at + 1 + NEAR_WORDS]]
    return score + _NEAR_WEIGHT * min(sum(word in reading.near for word in around), _MOST_NEAR)


def _is_tag(tag: str, pattern: str) -> bool:
    return tag == pattern[:-1] if pattern.endswith(".") else tag.startswith(pattern)
