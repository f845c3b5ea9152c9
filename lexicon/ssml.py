"""Parser of SSML 1.1 (W3C 2010) and ``express-as``; elements that are not followed are spoken around, with a note.

======================= ==============================================================================================
``speak p s w``         the text, its paragraphs, sentences and words; ``xml:lang`` of ``speak`` must be the request's
``break``               silence: ``time`` (``400ms``, ``0.4s``), or ``strength``; also ``mstts:silence`` at both ends
``emphasis``            F0, length and level of words, and a nod; ``level`` strong, moderate, none, reduced (no nod)
``prosody``             ``rate``, ``volume``, ``pitch``, ``range``, ``contour``, ``duration`` (`lexicon.ssml_prosody`)
``mark``                a ``name`` whose time is reported; ``gesture:wink left`` is a gesture, as in square brackets
``sub``                 ``alias`` is spoken instead of the text
``phoneme``             ``ph`` is spoken instead of the text: IPA, or ARPABET with ``alphabet="x-arpabet"``
``say-as``              the text is read as ``interpret-as`` (`lexicon.say_as`)
``voice lang``          another voice (``name``, ``gender``, ``language``), another language (``xml:lang``)
``express-as``          ``style`` of the gestures, as ``[style:...]``; also those of vendors
======================= ==============================================================================================
"""

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from xml.parsers import expat

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.gesture_marks import parse_gesture
from lexicon.inline_marks import read_words
from lexicon.mark_cues import PlacedCue, with_cues
from lexicon.mark_parts import Cue, Rules, Text
from lexicon.mark_table import MarkTable, shipped_marks
from lexicon.marked_text import MAX_NESTING, GestureMark, MarkedText, NameMark
from lexicon.marked_text_builder import MarkedTextBuilder
from lexicon.say_as import reads_kind, say_as
from lexicon.ssml_leniency import (
    LANGUAGE,
    RENAMED,
    TRANSPARENT,
    UNSPOKEN,
    is_touching,
    known_attributes,
    nearest_style,
    with_plain_entities,
)
from lexicon.ssml_prosody import look_up_value, parse_contour, parse_pitch, parse_range, parse_rate, parse_volume
from lexicon.ssml_values import (
    ALPHABETS,
    BREAKS_S,
    VoiceHz,
    add_phonemes,
    check_lengths,
    choose_voice,
    known_language,
    primary_subtag,
    typical_hz,
)
from lexicon.tones import Tone

_TIME = re.compile(r"\+?([0-9]{1,9}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})\s*(ms|s)", re.IGNORECASE)
# Emphasis (`Tone.emphasis`) and nod size of each level: nods are the visual cue of stress (Krahmer and Swerts 2007,
# J. Memory and Language 57).
EMPHASES = MappingProxyType({"strong": (1.0, 1.0), "moderate": (0.6, 0.6), "none": (0.0, 0.0), "reduced": (-1.0, 0.0)})
STRETCH_ENDS = MappingProxyType({"p": "\n\n", "s": "\u2028"})  # a blank line, and a line separator
SPAN_KINDS = frozenset({"emphasis", "prosody", "express-as", "voice", "lang"})
LEAF_KINDS = frozenset({"break", "mark", "sub", "phoneme", "say-as"})  # contain no elements
PASSED = ""  # in place of the name of an element that is not followed, whose text is spoken
REPLACED_KINDS = frozenset({"phoneme", "say-as"})  # speak other words than their text
Attributes = Mapping[str, str]


def parse_ssml(
    text: str, language: str = DEFAULT_LANGUAGE, voice_hz: VoiceHz = typical_hz, table: MarkTable | None = None
) -> MarkedText:
    """Parse an SSML document into a marked text.

    Parameters
    ----------
    language
        Language of the text, where no element sets another.
    voice_hz
        By which pitches in Hz become semitones.
    table
        Marks of people and language models, of which emoji and directions are read within SSML, too.
    """
    # The parser is expat; declarations in a document type are refused, and without them there are no entities to
    # expand or fetch. Attributes are short (`MAX_ATTRIBUTE_CHARACTERS`), so that parsing is linear in the length of the
    # document.
    reader = _SsmlReader(language, voice_hz, table or shipped_marks())
    try:
        return reader.read(text)
    except expat.ExpatError as broken:
        reason = expat.ErrorString(broken.code).removeprefix("not well-formed ").strip("()")
        is_open = reason == "mismatched tag" and reader.innermost
        remedy = f"close <{reader.innermost}>" if is_open else "correct that line"
        raise InputError(f"the SSML is not well-formed: {reason} in line {broken.lineno}; {remedy}") from broken
    except UnicodeEncodeError as broken:
        raise InputError(f"the SSML contains an unpaired surrogate (character {broken.start}); remove it") from broken
    except InputError as wrong:
        raise InputError(f"SSML, line {reader.line}: {wrong}") from wrong


class _SsmlReader:
    """Handlers of the elements of one document."""

    def __init__(self, language: str, voice_hz: VoiceHz, table: MarkTable) -> None:
        self._table, self._cues = table, list[PlacedCue]()
        self._builder = MarkedTextBuilder()
        self._elements: list[str] = []
        self._spans: list[str] = []  # for each element the kind of its span, or empty
        self._final_pauses_s: list[float] = []  # of each element
        self._n_unspoken = 0  # elements around whose text is not spoken
        self._tag = ""  # the last one that is followed, as it is written
        self._n_tags, self._is_apart = 0, False  # since the last text; whether one of them divides words
        self._replaced_text: list[str] = []  # text of a phoneme or say-as
        self._replaced_attributes: Attributes = {}
        self._base, self._voice_hz = language, voice_hz
        self._language: str | None = None
        parser = expat.ParserCreate()
        # else expat gives the words between two tags in several parts, and a mark may be cut
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = self._doctype
        parser.ProcessingInstructionHandler = self._instruction
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._words
        self._parser = parser
        self._starts: Mapping[str, Callable[[Attributes], None]] = {
            "speak": self._speak,
            "p": self._stretch,
            "s": self._stretch,
            "w": self._open_language,
            "break": self._break,
            "mstts:silence": self._silence,
            "emphasis": self._emphasis,
            "prosody": self._prosody,
            "mark": self._mark,
            "sub": self._sub,
            "phoneme": self._open_replaced,
            "say-as": self._open_replaced,
            "voice": self._voice,
            "lang": self._lang,
            "express-as": self._express_as,
        }

    @property
    def line(self) -> int:
        """Current line of the parser."""
        return self._parser.CurrentLineNumber

    @property
    def innermost(self) -> str:
        """Name of the innermost element that is open; empty without one."""
        return self._elements[-1][:40] if self._elements else ""

    def read(self, text: str) -> MarkedText:
        """Parse the whole document."""
        # XML allows nothing before its declaration
        self._parser.Parse(with_plain_entities(text.removeprefix("\ufeff").lstrip()), True)
        return with_cues(self._builder.build(self._language, base_language=self._base), self._cues, self._base)

    def _note(self, text: str) -> None:
        self._builder.note(text, self.line)

    def _doctype(self, _: str, __: str | None, ___: str | None, has_declarations: int) -> None:
        if has_declarations:
            raise InputError("declarations in a document type are not supported; remove [...] from <!DOCTYPE ...>")

    def _instruction(self, target: str, _: str) -> None:
        self._note(f"the instruction <?{target[:40]}?> is not followed")

    def _start(self, tag: str, attributes: Attributes) -> None:
        name, renamed = RENAMED.get(tag, (tag, {}))
        if name != "speak" and not self._elements:
            raise InputError("<speak> must be the only root element; put everything into one")
        if len(self._elements) > 2 * MAX_NESTING:
            raise InputError(f"<{tag[:40]}> is nested in {len(self._elements)} others; reduce the nesting")
        check_lengths(tag, attributes)
        if self._inside in LEAF_KINDS:
            self._note(f"<{tag[:40]}> within <{self._inside}> is not followed; its text is that of <{self._inside}>")
            name = PASSED
        self._stand_apart(name)
        self._elements.append(name)
        self._spans.append("")
        self._final_pauses_s.append(0.0)
        self._n_unspoken += self._n_unspoken > 0 or name in UNSPOKEN
        if self._n_unspoken > 1 or name == PASSED:
            return
        if name not in self._starts or (name == "speak" and len(self._elements) > 1):
            shown = f"<{tag[:40]}> is not supported; its text is spoken"
            self._note(UNSPOKEN.get(name) or TRANSPARENT.get(name, shown))
            return
        read, unread = known_attributes(name, {renamed.get(key, key): value for key, value in attributes.items()})
        for attribute in unread:
            self._note(f"the attribute {attribute[:40]} of <{tag}> is not followed")
        self._spans[-1], self._tag = name if name in SPAN_KINDS else "", tag
        try:
            self._starts[name](read)
        except InputError as wrong:
            self._elements[-1], self._spans[-1] = PASSED, ""
            self._note(f"<{tag}> is not followed: {wrong}")

    def _end(self, tag: str) -> None:
        name, span = self._elements.pop(), self._spans.pop()
        pause_s = self._final_pauses_s.pop()
        if self._n_unspoken:
            self._n_unspoken -= 1
            return
        if name in REPLACED_KINDS:
            self._speak_replacement(name)
        self._stand_apart(name)
        self._builder.add_pause(pause_s, self.line)
        if span:
            try:
                self._builder.close(span, f"</{tag}>")
            except InputError as wrong:
                self._note(f"<{tag}> is not followed: {wrong}")
        if name in {"p", "s"}:
            self._builder.add_text(STRETCH_ENDS[name])

    @property
    def _inside(self) -> str:
        """The innermost element that is followed."""
        return next((name for name in reversed(self._elements) if name), "")

    def _words(self, text: str) -> None:
        inside = self._inside
        if inside == "sub" or self._n_unspoken:
            return
        if inside in {"break", "mark"} and text.strip():
            self._note(f"<{inside}> cannot contain text; {text.strip()[:20]!r} is spoken behind it")
        if inside in REPLACED_KINDS:
            self._replaced_text.append(text)
        else:
            self._add_words(text)

    def _add_words(self, text: str) -> None:
        """Add text with the emoji and directions in it; marks of this project are left out."""
        for part in read_words(text, Rules(self._base, self._table), self._builder.last_character):
            if isinstance(part, Cue):
                self._cues.append(PlacedCue(self._builder.at, part))
                self._builder.add_pause(sum(mark.pause_s for mark in part.marks), self.line)
                self._builder.add_text(part.said)
            elif isinstance(part, Text):
                self._add_text(part.said)
            else:
                self._note("marks in square brackets are left out of SSML; use <break>, <emphasis> or <express-as>")

    def _speak(self, attributes: Attributes) -> None:
        self._language = attributes.get(LANGUAGE)

    def _stretch(self, attributes: Attributes) -> None:
        self._builder.add_text(STRETCH_ENDS[self._elements[-1]])
        self._open_language(attributes)

    def _stand_apart(self, name: str) -> None:
        """Divide words at a tag (SSML 1.1, 1.2), but within ``<w>`` and where ``<emphasis>`` has a part of a word."""
        self._n_tags += 1
        divides = name != "emphasis" or self._n_tags > 1
        self._is_apart = "w" not in self._elements and (self._is_apart or divides)

    def _add_text(self, text: str) -> None:
        """Add text, behind a space if it would be one word, or one sentence, with what stands before a tag."""
        if self._is_apart and is_touching(self._builder.last_character, text):
            self._builder.add_text(" ")
        self._builder.add_text(text)
        if text:
            self._n_tags, self._is_apart = 0, False

    def _open_language(self, attributes: Attributes) -> None:
        """Begin a span of another language, if an element names one."""
        tag = attributes.get(LANGUAGE)
        if tag is not None and primary_subtag(tag) != primary_subtag(self._current_language):
            self._spans[-1] = "lang"
            language = known_language(tag, self._note)
            self._builder.open_voice("lang", f"<{self._elements[-1]}>", voice=None, language=language)

    @property
    def _current_language(self) -> str:
        """Language at the current position."""
        return self._builder.run.language or self._base

    def _lang(self, attributes: Attributes) -> None:
        if not attributes.get(LANGUAGE, "").strip():
            raise InputError(f'a <lang> needs {LANGUAGE}; write <lang {LANGUAGE}="de-DE">')
        language = known_language(attributes[LANGUAGE], self._note)
        self._builder.open_voice("lang", "<lang>", voice=None, language=language)

    def _voice(self, attributes: Attributes) -> None:
        voice, language = choose_voice(attributes, self._current_language, self._note)
        self._builder.open_voice("voice", "<voice>", voice=voice, language=language)

    def _open_replaced(self, attributes: Attributes) -> None:
        kind = self._elements[-1]
        needed = "ph" if kind == "phoneme" else "interpret-as"
        if not attributes.get(needed, "").strip():
            raise InputError(f'a <{kind}> needs {needed}; write <{kind} {needed}="...">')
        self._replaced_attributes, self._replaced_text = attributes, []

    def _speak_replacement(self, kind: str) -> None:
        attributes, text = self._replaced_attributes, "".join(self._replaced_text)
        alphabet, wanted = attributes.get("alphabet", "ipa"), attributes.get("interpret-as", "").strip()
        if kind == "phoneme" and alphabet in ALPHABETS:
            self._add_text(" " if self._is_apart and self._builder.last_character.isalnum() else "")
            try:
                add_phonemes(self._builder, text, attributes["ph"], alphabet)
            except InputError as wrong:
                self._note(f"<phoneme> is not followed: {wrong}")
                self._add_text(text)
        elif kind == "say-as" and reads_kind(wanted, self._current_language):
            self._add_text(self._said_as(wanted, text, attributes.get("format", "")))
        else:
            what = f"alphabet {alphabet[:40]!r}" if kind == "phoneme" else f"kind {wanted[:40]!r}"
            self._note(f"the {what} of <{kind}> is not read in {self._current_language}; its text is spoken as written")
            self._add_text(text)

    def _said_as(self, kind: str, text: str, written_format: str) -> str:
        """Words of a ``<say-as>``; as written, with a note, if they are not of its kind (SSML 1.1, 3.1.9)."""
        try:
            return say_as(kind, text, written_format, self._current_language)
        except InputError as wrong:
            self._note(f"{wrong}; it is spoken as written")
            return text

    def _break(self, attributes: Attributes) -> None:
        seconds = look_up_value("strength", attributes.get("strength", "medium"), BREAKS_S)
        if "time" in attributes:
            seconds = _parse_time(attributes["time"], "<break>")
        self._builder.add_pause(seconds, self.line)

    def _silence(self, attributes: Attributes) -> None:
        kind = attributes.get("type", "").strip().casefold().removesuffix("-exact")
        if kind not in {"leading", "tailing"}:
            self._note(f"<mstts:silence> of the type {attributes.get('type', '')[:40]!r} is not followed; use <break>")
            return
        seconds = _parse_time(attributes.get("value", ""), "<mstts:silence>")
        if kind == "tailing":
            self._final_pauses_s[-2] += seconds
        else:
            self._builder.add_pause(seconds, self.line)

    def _emphasis(self, attributes: Attributes) -> None:
        level = attributes.get("level", "moderate")
        if level not in EMPHASES:
            raise InputError(f"<emphasis> has no level {level[:40]!r}; use {', '.join(EMPHASES)}")
        emphasis, size = EMPHASES[level]
        if size:
            self._builder.add_mark(GestureMark(self._builder.at, size=size))
        self._builder.open_emphasis("<emphasis>", emphasis)

    def _prosody(self, attributes: Attributes) -> None:
        now = self._builder.run
        hz = self._voice_hz(now.voice, self._current_language)
        pitch = parse_pitch(attributes.get("pitch", "medium"), hz, now.tone.pitch)
        contour = attributes.get("contour", "").strip()
        self._builder.open_prosody(
            "<prosody>",
            self.line,
            rate=parse_rate(attributes.get("rate", "medium")),
            volume=parse_volume(attributes.get("volume", "medium")),
            tone=Tone(
                pitch=pitch,
                range=parse_range(attributes.get("range", "medium"), hz),
                contour=parse_contour(contour, hz, now.tone.pitch + pitch) if contour else (),
            ),
            seconds=_parse_time(attributes["duration"], "<prosody>") or None if "duration" in attributes else None,
        )

    def _mark(self, attributes: Attributes) -> None:
        name = attributes.get("name", "")
        if not name.strip():
            raise InputError('a <mark> needs a name; write <mark name="here"/>')
        kind, _, written = name.partition(":")
        gesture = parse_gesture(written, self._builder.at) if kind.strip() == "gesture" else None
        self._builder.add_mark(gesture or NameMark(self._builder.at, name))

    def _sub(self, attributes: Attributes) -> None:
        alias = attributes.get("alias", "")
        if not alias.strip():
            raise InputError('a <sub> needs an alias; write <sub alias="doctor">Dr</sub>')
        self._add_text(alias)

    def _express_as(self, attributes: Attributes) -> None:
        style = (attributes.get("style") or attributes.get("type", "")).strip()
        if not style:
            raise InputError('<express-as> needs a style; write <express-as style="delighted">')
        nearest = nearest_style(style)
        if nearest is not None:
            self._note(f"the style {style[:40]} is {nearest} here, unless the palette has one of its own")
        is_foreign = nearest is None and ":" in self._tag
        if is_foreign:
            self._note(
                f"the style {style[:40]} of <{self._tag}> is not followed, unless the palette has one of its name"
            )
        self._builder.open_style("express-as", f'<express-as style="{style}">', style, is_foreign=is_foreign)


def _parse_time(written: str, element: str) -> float:
    """Seconds of a time such as 400ms."""
    match = _TIME.fullmatch(written.strip())
    if match is None:
        raise InputError(f'cannot read the time {written[:40]!r} of a {element}; write "400ms" or "0.4s"')
    return float(match[1]) / (1000 if match[2].lower() == "ms" else 1)
