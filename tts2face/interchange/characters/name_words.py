"""Words of the names of shapes: without path, case, separators and leading zeros, the side last."""

import re
import unicodedata
from collections.abc import Iterator

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_a-zA-Z]+")
_SIDES = {"l": "left", "left": "left", "lf": "left", "r": "right", "right": "right", "rt": "right"}
_COPY = re.compile(r"\.\d{3}$")  # Blender's number of a copy
_PATH = re.compile(r"[.:|/]")
Words = tuple[str, ...]


def all_words(name: str) -> Words:
    """Words of a whole name with its path, as they stand: ``mesh|eyeBlink_L`` is mesh, eye, blink, left."""
    found = _WORD.findall(unicodedata.normalize("NFKC", name))
    return tuple(str(int(word)) if word.isdecimal() else _SIDES.get(word.lower(), word.lower()) for word in found)


def name_words(name: str) -> Words:
    """Words of a name without its path; a single side stands last."""
    parts = _PATH.split(_COPY.sub("", name))
    # "eye closed.L": the last part is the side, not the name
    own = " ".join(parts[-2:]) if len(parts) > 1 and parts[-1].lower() in _SIDES else parts[-1]
    words = all_words(own)
    sides = [word for word in words if word in ("left", "right")]
    return (*(word for word in words if word != sides[0]), sides[0]) if len(sides) == 1 else words


def key(words: Words) -> str:
    """Words without spaces: two spellings of a name have it in common."""
    return "".join(words)


def tails(name: str) -> Iterator[tuple[str, str]]:
    """Prefix and key of a name with fewer and fewer of its first words, the whole name first."""
    words = name_words(name)
    for first in range(len(words)):
        yield key(words[:first]), key(words[first:])


def is_firm(name: str, prefix: str) -> bool:
    """Whether what follows a prefix is long enough to be a name: two words, or one with its side."""
    words = name_words(name)
    left = next(first for first in range(len(words)) if key(words[:first]) == prefix)
    return len(words) - left > 1
