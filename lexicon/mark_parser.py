"""Marks in a text: ``[pause 0.4]``, ``[nod]``, ``[style:delighted] ... [/style]``, or SSML.

Only these are marks; any other bracket is text.
"""

import re

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.marked_text import MarkedText, MarkedTextBuilder, NodMark, PauseMark
from lexicon.ssml import is_ssml, parse_ssml

# A bracket, one of the three words, and what follows up to the closing bracket, which a mark must have. Each part ends
# where the next begins, so that the scan is linear.
MARK_PATTERN = re.compile(r"\[(?P<name>/?(?:style|nod|pause)\b)(?P<rest>[^\[\]]*)(?P<end>\]?)")
MAX_QUOTED_CHARACTERS = 40
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")


def parse_marks(text: str, language: str = DEFAULT_LANGUAGE) -> MarkedText:
    """A text and the marks in it; one that begins with ``<speak`` is read as SSML (`lexicon.ssml`).

    Parameters
    ----------
    language
        Of the text, by which SSML reads numbers and chooses voices.

    Raises
    ------
    InputError
        A mark is written wrongly, not closed, closes nothing, is nested too deep, or holds a number out of range; the
        message names it and how it is written.
    """
    if is_ssml(text):
        return parse_ssml(text, language)
    gathering = MarkedTextBuilder()
    behind = 0
    for match in MARK_PATTERN.finditer(text):
        gathering.add_text(text[behind : match.start()])
        behind = match.end()
        _read_mark(gathering, match)
    gathering.add_text(text[behind:])
    return gathering.done()


def _read_mark(gathering: MarkedTextBuilder, match: "re.Match[str]") -> None:
    shown = " ".join(match.group()[:MAX_QUOTED_CHARACTERS].split())
    name, rest = match["name"], match["rest"].strip()
    if not match["end"]:
        raise InputError(f"the mark {shown!r} lacks its closing bracket; write {_mark_syntax(name)}")
    if name == "pause":
        gathering.mark(PauseMark(gathering.at, _parse_number(rest.removesuffix("s").rstrip(), shown, name)))
    elif name == "nod":
        gathering.mark(NodMark(gathering.at, _parse_number(rest, shown, name) if rest else 1.0))
    elif name == "style" and rest[:1] == ":" and rest[1:].strip():
        gathering.open("style", shown, style=rest[1:].strip())
    elif name == "/style" and not rest:
        gathering.close("style", shown)
    else:
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax(name)}")


def _parse_number(written: str, shown: str, name: str) -> float:
    if not _NUMBER.fullmatch(written):
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax(name)}")
    return float(written)


def _mark_syntax(name: str) -> str:
    forms = {"pause": "[pause 0.4] with seconds", "nod": "[nod], or [nod 0.5] for a small one"}
    told = forms.get(name, "[style:NAME] ... [/style]")
    return f"{told}, or round brackets around words that are to be spoken"
