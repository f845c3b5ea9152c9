"""Gestures in a text: ``[nod 0.5]``, ``[brows up]``, ``[wink left]``, ``[look up 2s]``, ``[look at left 20 down 5]``.

Behind the name stand, in any order, the size as a number, the duration in seconds with its ``s``, and directions, each
with its degrees or without. ``[look left]`` is short for ``[look at left]``.
"""

import functools
import math
import re

from lexicon.errors import InputError
from lexicon.gesture_names import DIRECTIONS, GESTURES, SIDES, gesture_name
from lexicon.marked_text import GestureMark

FIRST_WORDS = tuple(dict.fromkeys([*(name.partition("_")[0] for name in GESTURES)]))
_NUMBER = r"(?:[0-9]{1,4}(?:\.[0-9]{0,4})?|\.[0-9]{1,4})"
_REST = re.compile(
    rf"\s*+(?:(?P<direction>{'|'.join(DIRECTIONS)})(?:\s+(?P<degrees>{_NUMBER})(?P<sign>°|\s*deg(?:rees)?)?)?"
    rf"|(?P<seconds>{_NUMBER})\s?s|(?P<size>{_NUMBER}))(?=[\s,]|$),?",
    re.IGNORECASE,
)
_MAX_NAME_WORDS = 2
_SEPARATORS = re.compile(r"[\s_:=-]+")
_WORD = re.compile(r"[^\W\d_]{2,}")


@functools.lru_cache(maxsize=1000)
def is_gesture(written: str) -> bool:
    """Whether words between brackets are written as a gesture, also one with values that cannot be read or used.

    Behind the name of one stand no other words than directions: ``[nod x]``, not ``[listen to the radio]``.
    """
    try:
        if parse_gesture(written, 0) is not None:
            return True
    except InputError:
        return True
    named = _split_name(written)
    return named is not None and all(word.casefold() in DIRECTIONS for word in _WORD.findall(named[1]))


def parse_gesture(written: str, at: int) -> GestureMark | None:
    """The gesture that is written between the brackets of a mark, for a character; None if it is none.

    Raises
    ------
    InputError
        A value is out of range, or a gesture without direction has one.
    """
    named = _split_name(written)
    return None if named is None else _parse_rest(*named, at)


def _split_name(written: str) -> tuple[str, str] | None:
    """The name of a gesture and what stands behind it; None where no gesture has that name."""
    words = _SEPARATORS.split(written.strip(), maxsplit=_MAX_NAME_WORDS)
    for n_words in range(min(_MAX_NAME_WORDS, len(words)), 0, -1):
        name = gesture_name("_".join(words[:n_words]))
        if name is not None:
            return name, " ".join(words[n_words:])
    return ("look_at", " ".join(words[1:])) if words[0].casefold() == "look" else None


def _parse_rest(name: str, rest: str, at: int) -> GestureMark | None:
    found: dict[str, float] = {}
    place = 0
    while rest[place:].strip():
        part = _REST.match(rest, place)
        values = None if part is None else _values(name, part)
        if part is None or values is None:
            return None
        found |= values
        place = part.end()
    return GestureMark(at, name, **found)


def _values(name: str, part: "re.Match[str]") -> dict[str, float] | None:
    """Values of a mark by their fields, behind the side of a wink its size; None for a direction that it has not."""
    if not part["direction"]:
        return {key: float(part[key]) for key in ("seconds", "size") if part[key]}
    direction, number = part["direction"].casefold(), part["degrees"]
    has_sides = GESTURES[name].directions == "side"
    if has_sides and (part["sign"] or direction not in SIDES):
        return None
    found = {"size": float(number)} if has_sides and number else {}
    for key, usual in zip(("down_deg", "left_deg"), DIRECTIONS[direction], strict=True):
        if usual:
            found[key] = math.copysign(float(number) if number and not has_sides else abs(usual), usual)
    return found
