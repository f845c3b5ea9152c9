"""Parse the marks in a text, or SSML; any other bracket is text.

Marks: ``[pause 0.4]``, ``[nod]`` and other gestures (`lexicon.gesture_marks`), ``[style:delighted] ... [/style]``,
``[phoneme:təˈmɑtoʊ]tomato[/phoneme]``, and words that are typed with emphasis (`lexicon.emphasis`). A further markup of
texts: a function as those of `MARKUPS`, its row, and its name in `tts2face.request.MARKUPS`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from lexicon.emphasis import EmphasisedWords, find_emphases
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.gesture_marks import FIRST_WORDS, parse_gesture
from lexicon.marked_text import GestureMark, MarkedText, MarkedTextBuilder, PauseMark
from lexicon.ssml import VoiceHz, _add_phonemes, parse_ssml, typical_hz

# A bracket, one of the words, and the rest up to the closing bracket, which a mark must have; words with phones up to
# their end. Each part ends where the next begins, so that the scan is linear.
MARK_PATTERN = re.compile(
    r"\[phoneme:(?P<phones>[^\[\]]*)\](?P<words>[^\[\]]*)\[/phoneme\]"
    r"|\[(?P<name>/?(?:style|pause)\b|/nod\b|phoneme(?=:)|/phoneme(?=\]))(?P<rest>[^\[\]]*)(?P<end>\]?)"
    rf"|\[(?P<gesture>(?i:{'|'.join(FIRST_WORDS)})(?![^\W_])[^\[\]]*)(?P<gesture_end>\]?)"
)
MAX_QUOTED_CHARACTERS = 40
# without possessive repeats, which Python 3.11.2 loses within each other
_SSML = re.compile(r"\ufeff?\s*(?:<!--(?:[^-]|-(?!->))*-->\s*)*<(?:speak[\s>/]|\?xml\s|!DOCTYPE\s)")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")


def is_ssml(text: str) -> bool:
    """Whether a text is SSML: it begins with ``<speak``, an XML or a document type declaration, behind comments."""
    return _SSML.match(text) is not None


@dataclass(frozen=True, slots=True)
class Reading:
    """How a text is read.

    Parameters
    ----------
    language
        Of the text, by which SSML reads numbers and selects voices.
    has_emphasis
        Whether words that are typed with emphasis are said so; not those of a recording.
    voice_hz
        By which SSML's pitches in Hz become semitones.
    """

    language: str = DEFAULT_LANGUAGE
    has_emphasis: bool = True
    voice_hz: VoiceHz = typical_hz


def parse_marks(
    text: str,
    language: str = DEFAULT_LANGUAGE,
    markup: str = "auto",
    *,
    has_emphasis: bool = True,
    voice_hz: VoiceHz = typical_hz,
) -> MarkedText:
    """Separate a text from its marks.

    Parameters
    ----------
    markup
        One of `MARKUPS`: ``auto`` reads a text that begins with ``<speak`` as SSML (`lexicon.ssml`) and any other with
        its marks, ``plain`` reads no marks, and ``ssml`` reads SSML also without ``<speak>`` around it.
    language, has_emphasis, voice_hz
        As for `Reading`.

    Raises
    ------
    InputError
        A mark is malformed, not closed, unmatched, nested too deep, or has a number out of range; the message names it
        and its syntax. There is no such markup.
    """
    if markup not in MARKUPS:
        raise InputError(f"there is no markup {markup[:40]!r}; choose {', '.join(MARKUPS)}")
    return MARKUPS[markup](text, Reading(language, has_emphasis, voice_hz))


def _read_plain(text: str, _: Reading) -> MarkedText:
    return MarkedText(text)


def _read_ssml(text: str, reading: Reading) -> MarkedText:
    return parse_ssml(text if is_ssml(text) else f"<speak>{text}</speak>", reading.language, reading.voice_hz)


def _read_auto(text: str, reading: Reading) -> MarkedText:
    if is_ssml(text):
        return _read_ssml(text, reading)
    builder = MarkedTextBuilder()
    emphases = [*find_emphases(text, reading.language)] if reading.has_emphasis else []
    emphases.reverse()
    at = 0
    for match in MARK_PATTERN.finditer(text):
        _add_text(builder, text, (at, match.start()), emphases)
        at = match.end()
        _read_mark(builder, match)
    _add_text(builder, text, (at, len(text)), emphases)
    return builder.build()


MARKUPS: Mapping[str, Callable[[str, Reading], MarkedText]] = MappingProxyType(
    {"auto": _read_auto, "plain": _read_plain, "ssml": _read_ssml}
)


def _add_text(builder: MarkedTextBuilder, text: str, span: tuple[int, int], emphases: list[EmphasisedWords]) -> None:
    """Add a part of a text, with the emphases within it, which are taken from the end of the list."""
    at, end = span
    while emphases and emphases[-1].end <= end:
        words = emphases.pop()
        if words.start < at:  # a mark stands within it
            continue
        builder.add_text(text[at : words.start])
        builder.add_mark(GestureMark(builder.at, size=words.emphasis))
        builder.open_emphasis(words.text, words.emphasis)
        builder.add_text(words.text)
        builder.close("emphasis", words.text)
        at = words.end
    builder.add_text(text[at:end])


def _read_mark(builder: MarkedTextBuilder, match: "re.Match[str]") -> None:
    shown = " ".join(match.group()[:MAX_QUOTED_CHARACTERS].split())
    if match["gesture"] is not None:
        return _read_gesture(builder, match, shown)
    if match["name"] is None:
        return _add_phonemes(builder, match["words"], match["phones"], "ipa")
    name, rest = match["name"], match["rest"].strip()
    if not match["end"]:
        raise InputError(f"the mark {shown!r} has no closing bracket; write {_mark_syntax(name)}")
    if name == "pause":
        builder.add_mark(PauseMark(builder.at, _parse_number(rest.removesuffix("s").rstrip(), shown, name)))
    elif name == "style" and rest[:1] == ":" and rest[1:].strip():
        builder.open_style("style", shown, rest[1:].strip())
    elif name == "/style" and not rest:
        builder.close("style", shown)
    else:
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax(name)}")
    return None


def _read_gesture(builder: MarkedTextBuilder, match: "re.Match[str]", shown: str) -> None:
    """Add a gesture; other words in brackets that begin as one are text, but those of a nod."""
    gesture = parse_gesture(match["gesture"], builder.at) if match["gesture_end"] else None
    if gesture is not None:
        builder.add_mark(gesture)
    elif not match["gesture"].startswith("nod"):
        builder.add_text(match.group())
    elif not match["gesture_end"]:
        raise InputError(f"the mark {shown!r} has no closing bracket; write {_mark_syntax('nod')}")
    else:
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax('nod')}")


def _parse_number(written: str, shown: str, name: str) -> float:
    if not _NUMBER.fullmatch(written):
        raise InputError(f"cannot read the mark {shown}; write {_mark_syntax(name)}")
    return float(written)


def _mark_syntax(name: str) -> str:
    forms = {"pause": "[pause 0.4], in seconds", "nod": "[nod], or [nod 0.5] for a small one"}
    forms |= dict.fromkeys(("phoneme", "/phoneme"), "[phoneme:IPA]word[/phoneme]")
    syntax = forms.get(name, "[style:NAME] ... [/style]")
    return f"{syntax}, or use round brackets around words to be spoken"
