"""Read a text with its marks, or SSML.

Marks: ``[pause 0.4]``, ``[nod]`` and other gestures (`lexicon.gesture_marks`), ``[style:delighted] ... [/style]``,
``[phoneme:təˈmɑtoʊ]tomato[/phoneme]``; what people and language models write (`lexicon.inline_marks`), Markdown
(`lexicon.markdown`), and words that are typed with emphasis (`lexicon.emphasis`). A mark that is not understood costs
the mark, with a note, and no words. A further markup of texts: a function as those of `MARKUPS`, its row, and its name
in `tts2face.source_options.MARKUPS`.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from lexicon.emphasis import EmphasisedWords, find_emphases
from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.gesture_marks import parse_gesture
from lexicon.inline_marks import MAX_QUOTED_CHARACTERS, read_parts
from lexicon.mark_cues import PlacedCue, with_cues
from lexicon.mark_parts import Cue, End, Own, Part, Rules, Silent, Text
from lexicon.mark_table import MarkTable, shipped_marks
from lexicon.markdown import PARAGRAPH_END
from lexicon.marked_text import GestureMark, MarkedText
from lexicon.marked_text_builder import MarkedTextBuilder
from lexicon.ssml_values import VoiceHz, add_phonemes, typical_hz

USUAL_PAUSE_S = 0.7  # of [pause] without a number, as of a strong break in SSML
# without possessive repeats, which Python 3.11.2 loses within each other
_SSML = re.compile(r"\ufeff?\s*(?:<!--(?:[^-]|-(?!->))*-->\s*)*<(?:speak[\s>/]|\?xml\s|!DOCTYPE\s)")
_SECONDS = re.compile(r"s(?:ec(?:onds?)?)?\Z", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")


def is_ssml(text: str) -> bool:
    """Whether a text is SSML: it begins with ``<speak``, an XML or a document type declaration, behind comments."""
    return _SSML.match(text) is not None


def has_words(text: str) -> bool:
    """Whether a text with marks has a word that is spoken."""
    return any(map(str.isalnum, text)) and any(map(str.isalnum, _read_marks(text, Reading(has_emphasis=False)).text))


@dataclass(frozen=True, slots=True)
class Reading:
    """How a text is read.

    Parameters
    ----------
    language
        Of the text, by which SSML reads numbers and selects voices.
    has_emphasis
        Whether words that are typed with emphasis are said so, and directions make pauses; not those of a recording.
    voice_hz
        By which SSML's pitches in Hz become semitones.
    table
        Marks of people and language models.
    """

    language: str = DEFAULT_LANGUAGE
    has_emphasis: bool = True
    voice_hz: VoiceHz = typical_hz
    table: MarkTable = field(default_factory=shipped_marks)


def parse_marks(
    text: str,
    language: str = DEFAULT_LANGUAGE,
    markup: str = "auto",
    *,
    has_emphasis: bool = True,
    voice_hz: VoiceHz = typical_hz,
    table: MarkTable | None = None,
) -> MarkedText:
    """Separate a text from its marks.

    Parameters
    ----------
    markup
        One of `MARKUPS`: ``auto`` reads a text that begins with ``<speak`` as SSML (`lexicon.ssml`) and any other with
        its marks, ``plain`` reads no marks, ``ssml`` reads SSML also without ``<speak>`` around it, and ``llm`` is as
        ``auto`` for the text of a language model: unknown tags are silent, and directions in parentheses are such
        anywhere in a sentence.
    language, has_emphasis, voice_hz, table
        As for `Reading`.

    Raises
    ------
    InputError
        The SSML is not well-formed or has a value that is out of range. There is no such markup.
    """
    if markup not in MARKUPS:
        raise InputError(f"there is no markup {markup[:40]!r}; choose {', '.join(MARKUPS)}")
    return MARKUPS[markup](text, Reading(language, has_emphasis, voice_hz, table or shipped_marks()))


def _read_plain(text: str, _: Reading) -> MarkedText:
    return MarkedText(text)


def _read_ssml(text: str, reading: Reading) -> MarkedText:
    from lexicon.ssml import parse_ssml  # with its tables, of which other texts need none

    document = text if is_ssml(text) else f"<speak>{text}</speak>"
    return parse_ssml(document, reading.language, reading.voice_hz, reading.table)


def _read_auto(text: str, reading: Reading) -> MarkedText:
    return _read_ssml(text, reading) if is_ssml(text) else _read_marks(text, reading)


def _read_model(text: str, reading: Reading) -> MarkedText:
    return _read_ssml(text, reading) if is_ssml(text) else _read_marks(text, reading, is_model=True)


def _read_marks(text: str, reading: Reading, *, is_model: bool = False) -> MarkedText:
    builder = MarkedTextBuilder()
    rules = Rules(reading.language, reading.table, is_model)
    reader = PartReader(text, rules, builder, has_emphasis=reading.has_emphasis)
    for part in read_parts(text, rules):
        reader.read(part)
    while builder.open_span:
        builder.note(f"{builder.open_span} is not closed; it applies up to the end of the text")
        builder.close_open()
    return with_cues(builder.build(), reader.cues, reading.language)


class PartReader:
    """Adds the parts of a text to a marked text.

    Attributes
    ----------
    cues
        What the marks of the table show, with their places.
    """

    def __init__(self, text: str, rules: Rules, builder: MarkedTextBuilder, *, has_emphasis: bool = True) -> None:
        self._text, self._builder = text, builder
        self._has_pauses = has_emphasis
        self._emphases = [*find_emphases(text, rules.language)][::-1] if has_emphasis else []
        self.cues: list[PlacedCue] = []

    def read(self, part: Part) -> None:
        """Add a part."""
        builder = self._builder
        match part:
            case Text() if part.said == self._text[part.start : part.end]:
                _add_text(builder, self._text, (part.start, part.end), self._emphases)
            case Text():
                builder.add_text(part.said)
            case Silent():
                if part.note:
                    builder.note(part.note)
            case End():
                _end_sentence(builder, part.said)
            case Own():
                _read_mark(builder, part.match)
            case Cue():
                self.cues.append(PlacedCue(builder.at, part))
                builder.add_pause(sum(mark.pause_s for mark in part.marks) if self._has_pauses else 0.0)
                builder.add_text(part.said)


def _end_sentence(builder: MarkedTextBuilder, separator: str) -> None:
    """End the sentence that is open, with a full stop where it has no mark of its own."""
    last = builder.last_visible
    if not last or (builder.last_character == "\u2028" and separator != PARAGRAPH_END):
        return
    if builder.last_character not in "\n\u2028" and (last.isalnum() or last in "\"'”’»)%*_`"):
        builder.add_text(".")
    builder.add_text(separator)


MARKUPS: Mapping[str, Callable[[str, Reading], MarkedText]] = MappingProxyType(
    {"auto": _read_auto, "plain": _read_plain, "ssml": _read_ssml, "llm": _read_model}
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
    """Follow a mark of this project; what is wrong with it is noted, and costs no words."""
    shown = " ".join(match.group()[:MAX_QUOTED_CHARACTERS].split())
    try:
        if match["gesture"] is not None:
            gesture = parse_gesture(match["gesture"], builder.at)
            if gesture is None:
                raise InputError(f"write {_mark_syntax('nod')}")
            builder.add_mark(gesture)
        elif match["name"] is None:
            add_phonemes(builder, match["words"], match["phones"], "ipa")
        else:
            _read_named(builder, match["name"], match["rest"].strip(), shown)
    except InputError as wrong:
        builder.note(f"the mark {shown} is not followed: {wrong}")
        if match["gesture"] is None and match["name"] is None:
            builder.add_text(match["words"])


def _read_named(builder: MarkedTextBuilder, name: str, rest: str, shown: str) -> None:
    if name == "pause":
        builder.add_pause(_parse_seconds(rest.lstrip(":= ")))
    elif name == "style" and rest[:1] == ":" and rest[1:].strip():
        builder.open_style("style", shown, rest[1:].strip())
    elif name == "/style" and not rest:
        builder.close("style", shown)
    else:
        raise InputError(f"write {_mark_syntax(name)}")


def _parse_seconds(written: str) -> float:
    number = _SECONDS.sub("", written).strip()
    if number and not _NUMBER.fullmatch(number):
        raise InputError(f"write {_mark_syntax('pause')}")
    seconds = float(number) if number else USUAL_PAUSE_S
    if seconds < 0:
        raise InputError(f"a pause lasts 0 s or longer, not {seconds:g} s")
    return seconds


def _mark_syntax(name: str) -> str:
    forms = {"pause": "[pause 0.4], in seconds", "nod": "[nod], or [nod 0.5] for a small one"}
    forms |= dict.fromkeys(("phoneme", "/phoneme"), "[phoneme:IPA]word[/phoneme]")
    syntax = forms.get(name, "[style:NAME] ... [/style]")
    return f"{syntax}, or use round brackets around words to be spoken"
