"""Where the tune of an English sentence rises: yes/no questions, alternatives, items of lists; tags that fall.

Decided by words and punctuation alone, after Wells, English Intonation (2006), chapters 2 and 4.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Literal, NamedTuple

# Kinds of words, by name.
WORDS = MappingProxyType({name: frozenset(words.split()) for name, words in {
    "question": "who whom whose what which when where why how",
    "auxiliary": "am is are was were do does did have has had can could will would shall should may might must need "
    "ought dare cannot innit isn't aren't wasn't weren't don't doesn't didn't haven't hasn't hadn't can't couldn't "
    "won't wouldn't shan't shouldn't mightn't mustn't needn't oughtn't ain't",
    "preposition": "in at on to for from with by of about since until till through under over after before into near "
    "like",
    "pronoun": "i you he she it we they there this that these those one",
    "negative": "not no never nobody nothing none neither nowhere hardly scarcely seldom rarely barely cannot",
    # before a question, without a part in it
    "opener": "and but so or well oh ah hey then now okay ok right please sorry excuse hi hello look listen anyway "
    "actually honestly seriously tell say yes no yeah um uh er because still also pardon wait however guess",
    # after a statement, asking for consent; they rise
    "consent": "right okay ok yes no yeah huh eh hm hmm correct agreed understood really seriously",
    # behind "or": no other answer
    "extender": "something anything someone anyone somebody anybody somewhere anywhere so whatever whatnot such "
    "thereabouts more less later other else",
    "number": "one two three four five six seven eight nine ten eleven twelve twenty thirty hundred once twice",
    "unstressed": "it me him her them us you he she they we i one ones there then please for to with of at about from "
    "anyway though again here today tonight and but or so the a an",
    "open choice": "whether either any anyone anybody anything ever",  # any brothers or sisters: yes or no
    "no item": "but so because which who when where while",  # of a list
    "opinion": "think say suppose reckon believe imagine guess",  # what is that, would you say
    "determiner": "a the these those my your his her our their first last next past",
}.items()})  # fmt: skip
SENTENCE_MARKS = frozenset(".!?")
LONGEST_ITEM = 4  # words of an item of a list
LONGEST_TAIL = 3  # words behind the stressed one
TAG = 2  # words of a tag: isn't it
Tune = Literal["rise", "fall", "item"]


@dataclass(frozen=True, slots=True)
class Movement:
    """F0 over words of a sentence.

    Parameters
    ----------
    tune
        A question's rise, a fall where a rise could be expected, or the small rise of an item of a list.
    at, until
        Indices of the word on whose stress it begins, and of the last word that has it.
    """

    tune: Tune
    at: int
    until: int

    def shift(self, n_words: int) -> "Movement":
        """The same movement, later by a number of words."""
        return replace(self, at=self.at + n_words, until=self.until + n_words)


class _Clause(NamedTuple):
    """Words between marks: indices of the first and after the last."""

    first: int
    end: int


def movements(words: Sequence[str], marks: Sequence[str]) -> tuple[Movement, ...]:
    """Movements of the sentences of a text, in the order of its words.

    Parameters
    ----------
    words, marks : N
        Spoken words, and the punctuation after each (empty for none).
    """
    said = [_plain(word) for word in words]
    found: list[Movement] = []
    first = 0
    for at, mark in enumerate(marks):
        if mark in SENTENCE_MARKS or at + 1 == len(marks):
            found += _of_sentence(said, marks, first, at + 1)
            first = at + 1
    return tuple(found)


def _plain(word: str) -> str:
    return "".join(letter for letter in word.lower().replace("’", "'") if letter.isalpha() or letter == "'").strip("'")


def _of_sentence(said: Sequence[str], marks: Sequence[str], first: int, end: int) -> list[Movement]:
    starts = [first, *(at + 1 for at in range(first, end - 1) if marks[at])]
    clauses = [_Clause(*pair) for pair in zip(starts, [*starts[1:], end], strict=True)]
    if marks[end - 1] != "?":
        return list(_list_items(said, clauses))
    return _of_question(said, clauses)


def _of_question(said: Sequence[str], clauses: Sequence[_Clause]) -> list[Movement]:
    last = clauses[-1]
    tag = _tag(said, clauses)
    if tag is not None:
        return [tag]
    if len(clauses) > 1 and {*said[last.first : last.end]} <= WORDS["consent"]:
        return [_movement(said, "rise", last)]
    head = _head(said, clauses)
    is_open = _asks_for_word(said, clauses[head])
    choices = _choices(said, clauses[head + 1 :] if is_open else clauses[head:])
    if choices:
        return choices
    if is_open:
        return []
    return [*_list_items(said, clauses[head:]), _movement(said, "rise", last)]


def _tag(said: Sequence[str], clauses: Sequence[_Clause]) -> Movement | None:
    """The movement of a tag: it falls if it contradicts the statement before it, which is what it asks to confirm."""
    first, end = clauses[0].first, clauses[-1].end
    words = said[first:end]
    size = TAG + (words[-1:] == ["not"])  # is it not
    if words[-1:] == ["innit"]:
        return Movement("fall", end - 1, end - 1)
    at = end - size
    is_verb = at > first and said[at] in WORDS["auxiliary"] and said[at + 1] in WORDS["pronoun"]
    has_mark = clauses[-1].first == at
    before = said[first:at]
    # without a comma only a negative verb makes a tag: did you see who she is
    if not is_verb or not (has_mark or said[at].endswith("n't")) or _is_inverted(said, first, at):
        return None
    is_negative = said[at].endswith("n't") or size > TAG
    was_negative = any(
        word.removesuffix("'s") in WORDS["negative"] or word.endswith("n't") for word in before
    ) or _has_few(before)
    return Movement("fall" if is_negative != was_negative else "rise", at, end - 1)


def _has_few(words: Sequence[str]) -> bool:
    """Whether "few" denies: few people know that, but not: a few people know that."""
    return any(word == "few" and last not in WORDS["determiner"] for last, word in pairwise(["", *words]))


def _is_inverted(said: Sequence[str], first: int, end: int) -> bool:
    """Whether words begin as a question does; "what a view" is an exclamation."""
    at = _behind_openers(said, first, end)
    if said[at : at + 2] in (["what", "a"], ["what", "an"]):
        return False
    return at < end and (said[at] in WORDS["auxiliary"] or said[at] in WORDS["question"]) and end - at > 1


def _behind_openers(said: Sequence[str], first: int, end: int) -> int:
    """Index of the first word that is not before a sentence, or of the last word."""
    while first + 1 < end and said[first] in WORDS["opener"]:
        first += 1 + (said[first + 1] == "me" and first + 2 < end)  # excuse me
    return first


def _is_opener(said: Sequence[str], clause: _Clause) -> bool:
    return said[clause.first] in WORDS["opener"] and {*said[clause.first : clause.end]} <= WORDS["opener"] | {"me"}


def _head(said: Sequence[str], clauses: Sequence[_Clause]) -> int:
    """Index of the clause that asks: the last one in the order of a question, or the first behind the openers."""
    asking = [at for at, clause in enumerate(clauses) if _asks(said, clause) and not _is_opinion(said, clause)]
    if asking:
        # a choice or a list goes on: are you coming, or are you staying
        first_of_choice = [at for at in asking if not _is_joined(said, clauses[at])]
        return (first_of_choice or asking)[-1]
    kept = [at for at, clause in enumerate(clauses) if not _is_opener(said, clause)]
    # in the end, who won? if not now, when?
    asked = _question_word(said, clauses[-1])
    if len(kept) > 1 and asked is not None and (_size(clauses[-1]) > 1 or said[clauses[0].first] == "if"):
        return kept[-1]
    # what, now?
    kept = [at for at in kept if said[clauses[at].first] not in WORDS["question"] or _size(clauses[at]) > 1] or kept
    return kept[0] if kept else 0


def _is_opinion(said: Sequence[str], clause: _Clause) -> bool:
    """Whether a clause only asks whose opinion is asked for, as in "how old is it, would you say"."""
    return _size(clause) == 3 and said[clause.first + 1] == "you" and said[clause.end - 1] in WORDS["opinion"]


def _size(clause: _Clause) -> int:
    return clause.end - clause.first


def _is_joined(said: Sequence[str], clause: _Clause) -> bool:
    return said[clause.first] == "or"


def _asks(said: Sequence[str], clause: _Clause) -> bool:
    """Whether a clause has the order of a question: a verb before its subject, perhaps behind a question word."""
    at = _behind_openers(said, *clause)
    if said[at] in WORDS["auxiliary"]:
        return _size(clause) > 1
    asked = _question_word(said, clause)
    return asked is not None and any(
        word in WORDS["auxiliary"] for word in said[asked + 1 : min(asked + 5, clause.end)]
    )


def _question_word(said: Sequence[str], clause: _Clause) -> int | None:
    """Index of the question word with which a clause begins, perhaps behind a preposition."""
    at = _behind_openers(said, *clause)
    if said[at] in WORDS["preposition"] and at + 1 < clause.end:
        at += 1
    found = said[at].removesuffix("'s").removesuffix("'re").removesuffix("'d").removesuffix("'ll").removesuffix("'ve")
    return at if found in WORDS["question"] else None


def _asks_for_word(said: Sequence[str], clause: _Clause) -> bool:
    asked = _question_word(said, clause)
    # sorry, what? asks for the words again
    return asked is not None and not (asked + 1 == clause.end and said[max(asked - 1, 0)] in {"sorry", "pardon"})


def _choices(said: Sequence[str], clauses: Sequence[_Clause]) -> list[Movement]:
    """Movements of alternatives: each rises but the last, which falls."""
    if not clauses:
        return []
    first, end = clauses[0].first, clauses[-1].end
    joints = [at for at in range(first + 1, end - 1) if said[at] == "or" and _is_choice(said, first, at, end)]
    if not joints:
        return []
    if said[end - 1] == "what" and joints[-1] == end - 2:
        return [Movement("fall", end - 1, end - 1)]
    ends = sorted({*joints, *(clause.end for clause in clauses if clause.end <= joints[-1])})
    starts = [first, *ends[:-1]]
    rising = [_movement(said, "rise", _Clause(start, at)) for start, at in zip(starts, ends, strict=True) if at > start]
    return [*rising, _movement(said, "fall", _Clause(joints[-1] + 1, end))]


def _is_choice(said: Sequence[str], first: int, at: int, end: int) -> bool:
    """Whether an ``or`` stands between answers of which one is expected."""
    is_open = any(word == "or" and after in WORDS["extender"] for word, after in pairwise(said[at:end]))
    if is_open or WORDS["open choice"] & {*said[first:at]}:
        return False
    is_amount = (
        said[at - 1] in WORDS["number"] and said[at + 1] in WORDS["number"] and at + 2 < end
    )  # two or three people
    is_about = said[at + 1] == "two" and said[max(at - 2, 0)] in {"a", "an"}  # a day or two
    return not (is_amount or is_about) and said[at - 1 : at + 3] != ["way", "or", "the", "other"]


def _list_items(said: Sequence[str], clauses: Sequence[_Clause]) -> Iterator[Movement]:
    """Movements of the items before the last one of a list: apples, pears and plums."""
    clauses = clauses[_is_opener(said, clauses[0]) :]
    joints = [at for at in range(*clauses[-1]) if said[at] in {"and", "or"}] if clauses else []
    if len(clauses) < 2 or not joints or said[clauses[-1].first] in WORDS["no item"]:
        return
    joint = joints[-1]
    # the part before the joint is empty behind a comma: pears, and plums
    last = [part for part in (_Clause(clauses[-1].first, joint), _Clause(joint + 1, clauses[-1].end)) if _size(part)]
    inner = [*clauses[1:-1], *last[:-1]]
    if not inner or any(_size(item) > LONGEST_ITEM for item in [*inner, *last]):
        return
    for item in [clauses[0], *inner]:
        yield _movement(said, "item", item)


def _movement(said: Sequence[str], tune: Tune, clause: _Clause) -> Movement:
    """A movement that begins on the last stressed word of a clause and ends with it."""
    is_extended = _size(clause) > 2 and said[clause.end - 2] == "or" and said[clause.end - 1] in WORDS["extender"]
    last = clause.end - 1 - (2 if is_extended else 0)  # ill or something
    tail = range(last, max(clause.first - 1, last - LONGEST_TAIL), -1)
    stressed = next((at for at in tail if said[at] not in WORDS["unstressed"]), None)
    if stressed is None:
        stressed = last
    return Movement(tune, stressed, clause.end - 1)
