"""Parse the marks in a text, or SSML; any other bracket is text.

Marks: ``[pause 0.4]``, ``[nod]``, ``[style:delighted] ... [/style]``, ``[phoneme:təˈmɑtoʊ]tomato[/phoneme]``.
"""

import re

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.marked_text import MarkedText, MarkedTextBuilder, NodMark, PauseMark
from lexicon.ssml import _add_phonemes, parse_ssml

# A bracket, one of the words, and the rest up to the closing bracket, which a mark must have; words with phones up to
# their end. Each part ends where the next begins, so that the scan is linear.
MARK_PATTERN = re.compile(
    r"\[phoneme:(?P<phones>[^\[\]]*)\](?P<words>[^\[\]]*)\[/phoneme\]"
    r"|\[(?P<name>/?(?:style|nod|pause)\b|phoneme(?=:)|/phoneme(?=\]))(?P<rest>[^\[\]]*)(?P<end>\]?)"
)
MAX_QUOTED_CHARACTERS = 40
_SSML = re.compile(r"\ufeff?\s*<(?:speak[\s>/]|\?xml\s|!DOCTYPE\s)")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")


def is_ssml(text: str) -> bool:
    """Whether a text is SSML: it begins with ``<speak``, an XML or a document type declaration."""
    return _SSML.match(text) is not None


def parse_marks(text: str, language: str = DEFAULT_LANGUAGE) -> MarkedText:
    """Separate a text from its marks; a text that begins with ``<speak`` is parsed as SSML (`lexicon.ssml`).

    Parameters
    ----------
    language
        Language of the text, by which SSML reads numbers and selects voices.

    Raises
    ------
    InputError
        A mark is malformed, not closed, unmatched, nested too deep, or has a number out of range; the message names it
        and its syntax.
    """
    if is_ssml(text):
        return parse_ssml(text, language)
    builder = MarkedTextBuilder()
    at = 0
    for match in MARK_PATTERN.finditer(text):
        builder.add_text(text[at : match.start()])
        at = match.end()
        _read_mark(builder, match)
    builder.add_text(text[at:])
    return builder.build()


def _read_mark(builder: MarkedTextBuilder, match: "re.Match[str]") -> None:
    shown = " ".join(match.group()[:MAX_QUOTED_CHARACTERS].split())
    if match["name"] is None:
        return _add_phonemes(builder, match["words"], match["phones"], "ipa")
    name, rest = match["name"], match["rest"].strip()
    if not match["end"]:
        raise InputError(f"the mark {shown!r} has no closing bracket; write {_mark_syntax(name)}")
    if name == "pause":
        builder.add_mark(PauseMark(builder.at, _parse_number(rest.removesuffix("s").rstrip(), shown, name)))
    elif name == "nod":
        builder.add_mark(NodMark(builder.at, _parse_number(rest, shown, name) if rest else 1.0))
    elif name == "style" and rest[:1] == ":" and rest[1:].strip():
        builder.open("style", shown, style=rest[1:].strip())
    elif name == "/style" and not rest:
        builder.close("style", shown)
    else:
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax(name)}")
    return None


def _parse_number(written: str, shown: str, name: str) -> float:
    if not _NUMBER.fullmatch(written):
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax(name)}")
    return float(written)


def _mark_syntax(name: str) -> str:
    forms = {"pause": "[pause 0.4], in seconds", "nod": "[nod], or [nod 0.5] for a small one"}
    forms |= dict.fromkeys(("phoneme", "/phoneme"), "[phoneme:IPA]word[/phoneme]")
    syntax = forms.get(name, "[style:NAME] ... [/style]")
    return f"{syntax}, or use round brackets around words to be spoken"
