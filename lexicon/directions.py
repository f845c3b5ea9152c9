"""Directions: words in brackets, asterisks or tags that say how something is said, or what somebody does.

``[happy]``, ``(laughs)``, ``*smiles warmly*`` and ``[EMOTION: angry]`` are directions, ``(about two hours)`` and
``*really*`` are not: all words must be of the table of marks (a mood, a sound, a manner), or the first one a verb of it
in the third person or a participle.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from lexicon.dictionary import word_set
from lexicon.mark_table import MarkTable, TextMark

MAX_DIRECTION_CHARACTERS = 80
MAX_DIRECTION_WORDS = 8
_WORD = re.compile(r"[^\W\d_]+(?:['’-][^\W\d_]+)*")
_LABEL = re.compile(
    r"\s*(?:emotions?|moods?|tones?|expressions?|styles?|feelings?|voice|gestures?|actions?|sounds?|sfx|face|emotes?)"
    r"\s*[:=]\s*(?=\S)",
    re.IGNORECASE,
)
_STYLE = re.compile(r"[\w-]{1,40}(?:=[\w-]{1,40}(?:,\s?[\w-]{1,40}=[\w-]{1,40})*)?")
# Words that may stand beside others of a direction: in a sad voice, very happy.
_BESIDE = word_set(
    "a an the in with very slightly somewhat bit little really so more of at and to for then feeling feels sounding "
    "sounds being tone voice mood emotion expression face style manner way speaking speaks voiced long short soft loud "
    "deep small big "
)
_COMPARED = frozenset(("like", "good", "great", "fine", "better", "nice", "right"))  # behind a verb: looks good


@dataclass(frozen=True, slots=True)
class Direction:
    """The marks of a direction; none where it is one without an effect here."""

    marks: tuple[TextMark, ...] = ()
    is_verb: bool = False  # it begins with one


def find_direction(words: str, table: MarkTable, *, is_first: bool, is_strict: bool) -> Direction | None:
    """The direction that words in brackets are; None for other words.

    Parameters
    ----------
    words
        Without their brackets.
    is_first
        They begin a sentence, where also verbs are directions that are often emphasised elsewhere: takes, walks.
    is_strict
        The brackets are those of ordinary parentheses: only the third person and words of the table count.
    """
    if len(words) > MAX_DIRECTION_CHARACTERS:
        return None
    label = _LABEL.match(words)
    found = _WORD.findall(words[label.end() :] if label else words)
    folded = [word.casefold() for word in found]
    if not folded or len(folded) > MAX_DIRECTION_WORDS or any(map(str.isdigit, words)):
        return None
    direction = _of_verb(found, folded, table, is_first=is_first, is_strict=is_strict)
    if direction is None and not ("." in words or "?" in words):
        direction = _of_words(folded, table, is_strict=is_strict and label is None)
    if direction is None and label:
        return Direction((TextMark(words, "tag", style),) if (style := _style_of(words[label.end() :])) else ())
    return direction


def _style_of(value: str) -> str:
    """The style that a label names; empty where it is none."""
    name = value.strip()
    return name if _STYLE.fullmatch(name) else ""


def _of_verb(
    found: Sequence[str], folded: Sequence[str], table: MarkTable, *, is_first: bool, is_strict: bool
) -> Direction | None:
    rows = table.verbs.get(folded[0], ())
    if is_strict and folded[0].endswith("ing") and len(folded) > 1:
        return None  # (looking for more)
    if not rows or (folded[1:2] and folded[1] in _COMPARED):
        return None
    if all(row.kind == "stage" for row in rows) and not (is_first and found[0].islower() and not is_strict):
        return None
    rest = {form for word in folded[1:] for form in (word, word.removesuffix("s"))}
    marks = [row for row in rows if row.kind == "action" and {*row.mark.split()[1:]} <= rest][:1]
    marks += [mark for word in folded[1:] if (mark := table.tag(word)) is not None and mark.style]
    return Direction(tuple(marks), is_verb=True)


def _of_words(folded: Sequence[str], table: MarkTable, *, is_strict: bool) -> Direction | None:
    marks: list[TextMark] = []
    for word in folded:
        mark = table.tag(word)
        if mark is None and word in table.verbs and not is_strict:
            mark = next((row for row in table.verbs[word] if row.kind == "action" and " " not in row.mark), None)
        if mark is not None:
            marks.append(mark)
        elif is_strict or word not in _BESIDE:
            return None
    return Direction(tuple(marks)) if marks else None
