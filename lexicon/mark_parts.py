"""Parts into which a text with marks is divided, and the rules by which they are found."""

import re
from dataclasses import dataclass

from lexicon.mark_table import MarkTable, TextMark


@dataclass(frozen=True, slots=True)
class Text:
    """Characters that are spoken, as written or others in their place (`said`)."""

    start: int
    end: int
    said: str


@dataclass(frozen=True, slots=True)
class Silent:
    """Characters that are not spoken, with a note on them or without."""

    start: int
    end: int
    note: str = ""


@dataclass(frozen=True, slots=True)
class End:
    """Characters in whose place a sentence or a paragraph ends."""

    start: int
    end: int
    said: str


@dataclass(frozen=True, slots=True)
class Own:
    """A mark of this project in square brackets, matched by `OWN_MARK`."""

    start: int
    end: int
    match: "re.Match[str]"


@dataclass(frozen=True, slots=True)
class Cue:
    """A mark of the table, which shows something.

    Parameters
    ----------
    is_within
        It belongs to the sentence in which it stands or that it ends (emoji), not to what follows (tags).
    ends_style
        It is the end of a tag: what follows is said without its style.
    said
        What stands in its place: a space between two words, or a full stop where it ends a sentence.
    """

    start: int
    end: int
    marks: tuple[TextMark, ...]
    is_within: bool = False
    ends_style: bool = False
    said: str = ""


Part = Text | Silent | End | Own | Cue


@dataclass(frozen=True, slots=True)
class Rules:
    """How marks are found: the language, the table, and whether the text is known to be a language model's."""

    language: str
    table: MarkTable
    is_model: bool = False
