"""Tense of a verb whose past is spelled as its present (read): auxiliaries, the subject, times, and other verbs."""

from collections.abc import Sequence
from itertools import pairwise

from lexicon.dictionary import word_set
from lexicon.pauses import MARKS

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
    start = max(at - _MAX_WORDS, 0)
    tags = tags[start : at + _MAX_WORDS]
    lower = lower[start : at + _MAX_WORDS]
    at = at - start
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
        # I'd is I had (read it before), or I would (if I could)
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
