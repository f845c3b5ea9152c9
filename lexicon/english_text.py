"""Phones of the words of an English text in context: homographs, initialisms, reduced function words.

Words with several pronunciations: the reading that fits the part of speech and the words around it.

The readings and their evidence are in ``homographs.tsv``: tags of the Penn Treebank (``VB`` stands for all tags that
begin with it), words directly before and after, and words anywhere near. A word that is written with a capital in the
table is read so only where it is capitalised (Polish).

Reduced forms of function words in connected speech (to, the, of), by the sound that follows.

The forms of ``function_words.tsv`` are those of misaki's American dictionary, with which the neural voice was trained.

The forms of ``weak_forms.tsv`` are those that people may say in their place (Roach 2009, ch. 12; Wells 2008): a
recording has one or the other.

Tense of a verb whose past is spelled as its present (read): auxiliaries, the subject, times, and other verbs.
"""

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from itertools import pairwise

from lexicon.dictionary import Dictionary, arpabet_segments, word_key, word_set
from lexicon.english import CAPITALISED_WORDS, add_s, fold_to_arpabet, is_initialism, look_up_word
from lexicon.g2p import DEFAULT_LANGUAGE, segments_by_rules
from lexicon.ipa import IpaPhone, parse_ipa
from lexicon.part_of_speech import tag_words
from lexicon.sentence_ends import MARKS
from lexicon.written_forms import read_table

_DEMONSTRATIVE_BEFORE = word_set("of for with at like about after before in on by from than")
_DEMONSTRATIVE_AFTER = word_set("is was will would could may might must one sounds looks means makes")
_ALWAYS_REDUCED = frozenset({"a", "an", "am", "the", "to", "in"})  # also where they begin a sentence


@dataclass(frozen=True, slots=True)
class _Forms:
    before_consonant: tuple[IpaPhone, ...]
    before_vowel: tuple[IpaPhone, ...]
    before_pause: tuple[IpaPhone, ...]


@functools.cache
def _forms() -> dict[str, _Forms]:
    found = {}
    for word, written in read_table("function_words.tsv").items():
        plain, vowel, pause = (parse_ipa(cell) if cell else () for cell in written)
        found[word] = _Forms(plain, vowel or plain, pause or plain)
    return found


@functools.cache
def _weak_forms() -> dict[str, tuple[tuple[str, ...], ...]]:
    return {
        word: tuple(tuple(one.phone for one in parse_ipa(form)) for form in forms.split())
        for word, (forms,) in read_table("weak_forms.tsv").items()
    }


def weak_forms(word: str) -> tuple[tuple[str, ...], ...]:
    """Phones of each weak form of a function word; none of other words."""
    return _weak_forms().get(word_key(word), ())


def reduced_segments(
    word: str, before: str, after: str, following: tuple[IpaPhone, ...]
) -> tuple[IpaPhone, ...] | None:
    """Phones of a function word in its context; None for any other word.

    A capitalised one, as at the beginning of a sentence, has secondary stress.

    Parameters
    ----------
    before, after
        The words beside it; empty after and before a pause.
    following
        Phones of the word after it; empty before a pause.
    """
    key = word_key(word)
    forms = _forms().get(key)
    if forms is None:
        return None
    if not following or (key == "that" and _is_demonstrative(word_key(before), word_key(after))):
        segments = forms.before_pause
    else:
        segments = forms.before_vowel if following[0].is_syllabic else forms.before_consonant
    if word[:1].isupper() and key not in _ALWAYS_REDUCED and not any(segment.stress for segment in segments):
        return tuple(IpaPhone(s.phone, 2 if s.is_syllabic else 0, s.is_long, s.is_syllabic) for s in segments)
    return segments


def _is_demonstrative(before: str, after: str) -> bool:
    return not before or before in _DEMONSTRATIVE_BEFORE or after in _DEMONSTRATIVE_AFTER


_FORMS_OF_HAVE = word_set("have has had having i've you've we've they've haven't hasn't hadn't he's she's it's")
_BE = word_set("is are was were be been being isn't aren't wasn't weren't get gets got")
_HAD_OR_WOULD = word_set("i'd you'd he'd she'd we'd they'd")
_BEFORE_INFINITIVE = word_set(
    "do does did don't doesn't didn't will would can could shall should may might must cannot won't wouldn't can't "
    "couldn't shan't shouldn't mustn't needn't to let's i'll you'll he'll she'll it'll we'll they'll"
)
_BEFORE_OBJECT_AND_INFINITIVE = word_set(
    "let lets make makes made help helps helped hear heard see saw watch watched have"
)
_SKIPPED = word_set(
    "never always ever just not also still already often sometimes then first next now yet please only both"
)
_CONJUNCTIONS, _RELATIVES = word_set("and or but nor"), word_set("who which that")
_CONDITIONS = word_set("if when whenever before after until unless while as once")
_SINGULAR = word_set("he she it everyone everybody someone somebody anyone anybody nobody no-one none another one")
_PLURAL, _OBJECTS = word_set("i you we they"), word_set("me him her us them you it")
_PHRASE_TAGS = frozenset({"DT", "PDT", "PRP$", "POS", "JJ", "JJS", "CD", "NN", "NNS", "NNP", "NNPS", "PRP", "FW"})
_PAST_TIMES = word_set("yesterday ago")
_HABITS = word_set(
    "every each often usually always sometimes rarely seldom daily nowadays regularly mondays tuesdays wednesdays "
    "thursdays fridays saturdays sundays mornings evenings weekends"
)
_TIMES = word_set(
    "night week weekend month year summer winter spring autumn fall term time monday tuesday wednesday thursday friday "
    "saturday sunday january february march april may june july august september october november december"
)
_MAX_SUBJECT_WORDS, _MAX_WORDS = 6, 40  # of a subject; on each side of the verb, that are searched


def tense_tag(tags: Sequence[str], lower: Sequence[str], at: int) -> str:
    """Penn Treebank tag of a verb with equal present, past and participle (VB, VBP, VBD, VBN); empty if undecided.

    Parameters
    ----------
    tags, lower
        The tagger's tags, and the words and marks of the sentence in lower case.
    at
        Index of the verb.
    """
    begin = max(at - _MAX_WORDS, 0)
    tags, lower, at = tags[begin : at + _MAX_WORDS], lower[begin : at + _MAX_WORDS], at - begin
    place = at - 1
    while place >= 0 and (lower[place] in _SKIPPED or lower[place].endswith("ly")):
        place -= 1
    before = lower[place] if place >= 0 else "."
    if lower[at + 1 : at + 2] == ["by"] and before not in _PLURAL | _SINGULAR | _BEFORE_INFINITIVE:
        return "VBN"
    auxiliary = _after_auxiliary(before, lower)
    if auxiliary:
        return auxiliary
    if before in MARKS or before in _CONJUNCTIONS:
        return _beside_verb(tags, place, default="VB" if before in MARKS else "")
    if tags[place] in {"NN", "NNS", "NNP", "NNPS", "PRP"} or before in _SINGULAR | _PLURAL | _RELATIVES:
        return _after_subject(tags, lower, place, at)
    return ""


def _after_auxiliary(before: str, lower: Sequence[str]) -> str:
    if before in _HAD_OR_WOULD:
        return "VB" if {"if", "could", "would"} & set(lower) else "VBN"
    if before in _FORMS_OF_HAVE or before in _BE:
        return "VBN"
    return "VB" if before in _BEFORE_INFINITIVE else ""


def _beside_verb(tags: Sequence[str], place: int, default: str) -> str:
    """Tag of a verb without a subject of its own: that of a past before it (sat down and read), else a command's."""
    found = next((tag for tag in reversed(tags[:place]) if tag.startswith("VB")), default)
    if default:
        return found if found == "VBD" else default
    return found if found in {"VB", "VBP", "VBD", "VBN"} else ""


def _after_subject(tags: Sequence[str], lower: Sequence[str], last: int, at: int) -> str:
    """Tag of a verb after a noun or pronoun, which is its subject or stands between it and an auxiliary."""
    first, earliest = last, max(last - _MAX_SUBJECT_WORDS, 0)
    while first > earliest and lower[last] not in _RELATIVES and tags[first - 1] in _PHRASE_TAGS:
        first -= 1
    before = lower[first - 1] if first else "."
    if first == last and lower[last] in _OBJECTS and before in _BEFORE_OBJECT_AND_INFINITIVE - _FORMS_OF_HAVE:
        return "VB"
    auxiliary = "" if before in _HAD_OR_WOULD | _BE | {"to"} else _after_auxiliary(before, lower)
    if auxiliary:
        return auxiliary
    if lower[last] in _RELATIVES:
        return "VBP" if tags[max(last - 1, 0)] in {"NNS", "NNPS"} and not _is_past(tags, lower, at) else "VBD"
    if lower[last] in _SINGULAR or (tags[last] in {"NN", "NNP"} and before not in _CONJUNCTIONS):
        return "VBD"
    if _is_past(tags, lower, at):
        return "VBD"
    is_habit = _HABITS & set(lower) or ("these", "days") in pairwise(lower)
    return "VBP" if before in _CONDITIONS or is_habit else ""


def _is_past(tags: Sequence[str], lower: Sequence[str], at: int) -> bool:
    """Whether a time or another verb of the sentence is past."""
    if _PAST_TIMES & set(lower) or any(word == "last" and after in _TIMES for word, after in pairwise(lower)):
        return True
    return any(tag == "VBD" for number, tag in enumerate(tags) if number != at)


NEAR_WORDS = 9  # words on each side that are searched for evidence
# Weights of the evidence: a neighbour outweighs the tag, which outweighs the topic.
_TAG_WEIGHT, _NEIGHBOUR_WEIGHT, _NEAR_WEIGHT = 2.0, 3.0, 1.5
_MOST_NEAR = 2  # words of the topic that count
# Before a verb, whatever the tagger says: it takes many verbs of this list for nouns (to object).
_BEFORE_VERB = word_set(
    "i we they he she who will would can could should must may might shall cannot can't couldn't won't wouldn't "
    "shouldn't don't doesn't didn't i'll we'll you'll they'll he'll she'll it'll i'd we'd they'd he'd she'd let's "
    "please to"
)
_ADVERBS = word_set("never always ever just not also still already often sometimes")
_PRONOUNS, _HAVE = word_set("i you he she it we they"), word_set("have has had haven't hasn't hadn't")
_BEFORE_NOUN = word_set("the a an this these those my your his her its our their every each no any some")
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
            tag = tense or _likely_tag(tags[at], lower, at)
            readings = (max(readings, key=lambda reading: _evidence(reading, lower, at, tag, is_sure=tense != "")),)
        if readings:
            found[at] = readings[0].segments
    return found


def _likely_tag(tag: str, lower: Sequence[str], at: int) -> str:
    """The tagger's tag, corrected where the word before allows only a verb or only a noun."""
    place = at - 1
    first = max(at - NEAR_WORDS, 0)
    while place > first and (lower[place] in _ADVERBS or lower[place].endswith("ly")):
        place -= 1
    before, two_before = (lower[place] if place >= 0 else ""), (lower[place - 1] if place > 0 else "")
    if before in _HAVE or (before in _PRONOUNS and two_before in _HAVE):  # have never read, have you read
        return "VBN" if tag.startswith("VB") else tag
    is_infinitive = before != "to" or two_before not in _BEFORE_PREPOSITION
    if before in _BEFORE_VERB and is_infinitive and not tag.startswith("VB"):
        return "VB"
    return "NN" if before in _BEFORE_NOUN and tag in {"VB", "VBP", "VBZ"} else tag


def _is_past_like_present(readings: Sequence[Reading]) -> bool:
    """Whether the past of a verb is spelled as its present (read), unlike that of another verb (wound)."""
    return any({"VBD", "VBP"} <= set(reading.tags) for reading in readings)


def _evidence(reading: Reading, lower: Sequence[str], at: int, tag: str, *, is_sure: bool) -> float:
    score = _TAG_WEIGHT * any(_is_tag(tag, own) for own in reading.tags)
    if is_sure:
        return score
    before = lower[at - 1] if at else "."
    after = lower[at + 1] if at + 1 < len(lower) else "."
    score += _NEIGHBOUR_WEIGHT * (
        (before in reading.before) + ((after if after not in MARKS else ".") in reading.after)
    )
    around = [*lower[max(at - NEAR_WORDS, 0) : at], *lower[at + 1 : at + 1 + NEAR_WORDS]]
    return score + _NEAR_WEIGHT * min(sum(word in reading.near for word in around), _MOST_NEAR)


def _is_tag(tag: str, pattern: str) -> bool:
    return tag == pattern[:-1] if pattern.endswith(".") else tag.startswith(pattern)


_SENTENCE_MARKS = frozenset(".!?")


def english_segments(texts: Sequence[str], marks: Sequence[str], own: Dictionary) -> list[tuple[IpaPhone, ...]]:
    """Phones of each word of a normalised text; empty for a word that cannot be read.

    Parameters
    ----------
    texts, marks
        Words, and the punctuation after each.
    own
        The user's entries, which take precedence.
    """
    spoken: list[tuple[IpaPhone, ...] | None] = []
    forms = _lookup_forms(texts)
    ends = [at + 1 for at, mark in enumerate(marks) if mark in _SENTENCE_MARKS]
    for begin, end in pairwise(sorted({0, *ends, len(texts)})):
        spoken += _sentence_segments(forms[begin:end], marks[begin:end], own)
    missing = [at for at, segments in enumerate(spoken) if segments is None]
    by_rules = segments_by_rules([texts[at] for at in missing], DEFAULT_LANGUAGE)
    for at, segments in zip(missing, by_rules, strict=True):
        spoken[at] = fold_to_arpabet(segments)
    return _reduce_function_words(texts, forms, marks, [segments or () for segments in spoken], own)


def _sentence_segments(
    forms: Sequence[str], marks: Sequence[str], own: Dictionary
) -> list[tuple[IpaPhone, ...] | None]:
    """Phones of the words of one sentence; None where spelling rules are needed."""
    tokens: list[str] = []
    places: list[int] = []
    for form, mark in zip(forms, marks, strict=True):
        places.append(len(tokens))
        tokens += [form, mark] if mark else [form]
    several = {
        places[at]
        for at, form in enumerate(forms)
        if own.lookup(form) is None and is_homograph(form) and not is_initialism(form)
    }
    by_context = homograph_segments(tokens, several)
    return [
        by_context[place]
        if place in several
        else look_up_word(form, is_letter=_is_letter(forms, marks, at), own=own.lookup)
        for at, (form, place) in enumerate(zip(forms, places, strict=True))
    ]


def _is_letter(forms: Sequence[str], marks: Sequence[str], at: int) -> bool:
    """Whether a single capital is the name of a letter (plan A) rather than the article."""
    following = forms[at + 1] if at + 1 < len(forms) else ""
    is_before_word = following[:1].islower() or (len(following) > 1 and is_initialism(following))  # a UFO
    return forms[at].isupper() and not (forms[at] == "A" and not marks[at] and is_before_word)


def _reduce_function_words(
    texts: Sequence[str],
    forms: Sequence[str],
    marks: Sequence[str],
    spoken: list[tuple[IpaPhone, ...]],
    own: Dictionary,
) -> list[tuple[IpaPhone, ...]]:
    """Replace the citation forms of function words, from the last word to the first."""
    for at in reversed(range(len(texts))):
        is_letter = forms[at] == "A" and _is_letter(forms, marks, at)
        is_spelled = is_letter or (len(forms[at]) > 1 and is_initialism(forms[at]))
        if is_spelled or own.lookup(texts[at]) is not None:
            continue
        following = () if marks[at] or at + 1 == len(texts) else spoken[at + 1]
        before = "" if at == 0 or marks[at - 1] else texts[at - 1]
        reduced = reduced_segments(texts[at], before, texts[at + 1] if following else "", following)
        spoken[at] = reduced or spoken[at]
    return spoken


def _lookup_forms(texts: Sequence[str]) -> list[str]:
    """Lookup forms of words: words in capitals that are not initialisms become lower case."""
    padded = ["", *texts, ""]
    return [
        text.lower() if len(text) > 1 and CAPITALISED_WORDS & {before, text, after} and text.isupper() else text
        for before, text, after in zip(padded, padded[1:], padded[2:], strict=False)
    ]
