"""Parser of the supported subset of SSML 1.1 (W3C 2010) and ``express-as``; other elements are refused by name.

======================= ==============================================================================================
``speak p s``           the text, its paragraphs and sentences; ``xml:lang`` of ``speak`` must be the request's language
``break``               silence: ``time`` (``400ms``, ``0.4s``), or ``strength``
``emphasis``            louder words and a nod; ``level`` strong, moderate (default), none, reduced (softer, no nod)
``prosody``             ``rate`` and ``volume``; ``pitch`` and the rest are refused, as no voice supports them
``mark``                a ``name`` whose time is reported
``sub``                 ``alias`` is spoken instead of the text
``phoneme``             ``ph`` is spoken instead of the text: IPA, or ARPABET with ``alphabet="x-arpabet"``
``say-as``              the text is read as ``interpret-as`` (`lexicon.say_as`)
``voice lang``          another voice (``name``, ``gender``, ``language``), another language (``xml:lang``)
``express-as``          ``style`` of the gestures, as ``[style:...]``; also ``mstts:express-as``
======================= ==============================================================================================
"""

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from xml.parsers import expat

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.languages import language_code
from lexicon.marked_text import MAX_NESTING, MarkedText, MarkedTextBuilder, NameMark, NodMark, PauseMark, PhoneMark
from lexicon.say_as import say_as
from lexicon.ssml_values import (
    BREAKS_S,
    check_attributes,
    check_lengths,
    choose_voice,
    look_up_value,
    parse_rate,
    parse_volume,
    phoneme_words,
    primary_subtag,
)

_MARK = re.compile(r"\[/?(?:style|nod|pause)\b")
_TIME = re.compile(r"\+?([0-9]{1,9}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})\s*(ms|s)")
# Volume factor and nod size of each level: accented words are 2-5 dB louder than their neighbours, and nods are the
# visual cue of stress (Krahmer and Swerts 2007, J. Memory and Language 57).
EMPHASES = MappingProxyType({"strong": (1.6, 1.0), "moderate": (1.25, 0.6), "none": (1.0, 0.0), "reduced": (0.7, 0.0)})
STRETCH_ENDS = MappingProxyType({"p": "\n\n", "s": "\u2028"})  # a blank line, and a line separator
SPAN_KINDS = frozenset({"emphasis", "prosody", "express-as", "voice", "lang"})
LEAF_KINDS = frozenset({"break", "mark", "sub", "phoneme", "say-as"})  # contain no elements
REPLACED_KINDS = frozenset({"phoneme", "say-as"})  # speak other words than their text
LANGUAGE = "xml:lang"
Attributes = Mapping[str, str]


def parse_ssml(text: str, language: str = DEFAULT_LANGUAGE) -> MarkedText:
    """Parse an SSML document into a marked text.

    Parameters
    ----------
    language
        Language of the text, where no element sets another.
    """
    # The parser is expat; a document type declaration is refused, and without one there are no entities to expand or
    # fetch. Attributes are short (`MAX_ATTRIBUTE_CHARACTERS`), so that parsing is linear in the length of the document.
    reader = _SsmlReader(language)
    try:
        return reader.read(text)
    except expat.ExpatError as broken:
        reason = expat.ErrorString(broken.code)
        raise InputError(
            f"the SSML is not well-formed: {reason} in line {broken.lineno}; correct that line"
        ) from broken
    except UnicodeEncodeError as broken:
        raise InputError(f"the SSML contains an unpaired surrogate (character {broken.start}); remove it") from broken
    except InputError as wrong:
        raise InputError(f"SSML, line {reader.line}: {wrong}") from wrong


class _SsmlReader:
    """Handlers of the elements of one document."""

    def __init__(self, language: str) -> None:
        self._builder = MarkedTextBuilder()
        self._elements: list[str] = []
        self._spans: list[str] = []  # for each element the kind of its span, or empty
        self._replaced_text: list[str] = []  # text of a phoneme or say-as
        self._replaced_attributes: Attributes = {}
        self._base = language
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
            "break": self._break,
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

    def read(self, text: str) -> MarkedText:
        """Parse the whole document."""
        # XML allows nothing before its declaration
        self._parser.Parse(text.removeprefix("\ufeff").lstrip(), True)
        return self._builder.build(self._language, base_language=self._base)

    def _doctype(self, *_: object) -> None:
        raise InputError("a document type declaration is not supported; remove <!DOCTYPE ...>")

    def _instruction(self, target: str, _: str) -> None:
        raise InputError(f"the instruction <?{target}?> is not supported; remove it")

    def _start(self, tag: str, attributes: Attributes) -> None:
        name = tag.removeprefix("mstts:") if tag == "mstts:express-as" else tag
        if name not in self._starts:
            raise InputError(f"the element <{tag[:40]}> is not supported; use {', '.join(self._starts)}")
        if (name == "speak") != (not self._elements):
            raise InputError("<speak> must be the only root element; put everything into one")
        if len(self._elements) > 2 * MAX_NESTING:
            raise InputError(f"<{tag}> is nested in {len(self._elements)} others; reduce the nesting")
        if self._elements and self._elements[-1] in LEAF_KINDS:
            raise InputError(f"<{self._elements[-1]}> cannot contain elements; close it before <{tag}>")
        check_lengths(name, attributes)
        self._elements.append(name)
        self._spans.append(name if name in SPAN_KINDS else "")
        self._starts[name](attributes)

    def _end(self, tag: str) -> None:
        name, span = self._elements.pop(), self._spans.pop()
        if name in REPLACED_KINDS:
            self._speak_replacement(name)
        if span:
            self._builder.close(span, f"</{tag}>")
        if name in {"p", "s"}:
            self._builder.add_text(STRETCH_ENDS[name])

    def _words(self, text: str) -> None:
        inside = self._elements[-1]
        if inside == "sub":
            return
        if inside in {"break", "mark"} and text.strip():
            raise InputError(f"<{inside}> cannot contain text; close it before {text.strip()[:20]!r}")
        if _MARK.search(text):
            raise InputError(
                "marks in square brackets cannot be combined with SSML; use <break>, <emphasis> or <express-as>"
            )
        if inside in REPLACED_KINDS:
            self._replaced_text.append(text)
        else:
            self._builder.add_text(text)

    def _speak(self, attributes: Attributes) -> None:
        known = {name: value for name, value in attributes.items() if not name.startswith("xmlns")}
        self._language = check_attributes("speak", known, "version", LANGUAGE, "xsi:schemaLocation").get(LANGUAGE)

    def _stretch(self, attributes: Attributes) -> None:
        tag = check_attributes(self._elements[-1], attributes, LANGUAGE).get(LANGUAGE)
        self._builder.add_text(STRETCH_ENDS[self._elements[-1]])
        if tag is not None and primary_subtag(tag) != primary_subtag(self._current_language):
            self._spans[-1] = "lang"
            self._builder.open_voice("lang", f"<{self._elements[-1]}>", voice=None, language=language_code(tag))

    @property
    def _current_language(self) -> str:
        """Language at the current position."""
        return self._builder.language or self._base

    def _lang(self, attributes: Attributes) -> None:
        tag = check_attributes("lang", attributes, LANGUAGE).get(LANGUAGE, "")
        self._builder.open_voice("lang", "<lang>", voice=None, language=language_code(tag))

    def _voice(self, attributes: Attributes) -> None:
        known = check_attributes("voice", attributes, "name", "gender", "language", "languages", LANGUAGE, "required")
        voice, language = choose_voice(known, self._current_language)
        self._builder.open_voice("voice", "<voice>", voice=voice, language=language)

    def _open_replaced(self, attributes: Attributes) -> None:
        kind = self._elements[-1]
        known = ("alphabet", "ph") if kind == "phoneme" else ("interpret-as", "format", "detail")
        self._replaced_attributes = check_attributes(kind, attributes, *known)
        needed = known[1] if kind == "phoneme" else known[0]
        if not attributes.get(needed, "").strip():
            raise InputError(f'a <{kind}> needs {needed}; write <{kind} {needed}="...">')
        self._replaced_text = []

    def _speak_replacement(self, kind: str) -> None:
        attributes, text = self._replaced_attributes, "".join(self._replaced_text)
        if kind == "say-as":
            self._builder.add_text(
                say_as(attributes["interpret-as"].strip(), text, attributes.get("format", ""), self._current_language)
            )
            return
        _add_phonemes(self._builder, text, attributes["ph"], attributes.get("alphabet", "ipa"))

    def _break(self, attributes: Attributes) -> None:
        known = check_attributes("break", attributes, "time", "strength")
        seconds = look_up_value("strength", known.get("strength", "medium"), BREAKS_S)
        if "time" in known:
            match = _TIME.fullmatch(known["time"].strip())
            if match is None:
                raise InputError(f'cannot read the time {known["time"][:40]!r} of a <break>; write "400ms" or "0.4s"')
            seconds = float(match[1]) / (1000 if match[2] == "ms" else 1)
        if seconds > 0:
            self._builder.add_mark(PauseMark(self._builder.at, seconds))

    def _emphasis(self, attributes: Attributes) -> None:
        level = check_attributes("emphasis", attributes, "level").get("level", "moderate")
        if level not in EMPHASES:
            raise InputError(f"<emphasis> has no level {level[:40]!r}; use {', '.join(EMPHASES)}")
        volume, size = EMPHASES[level]
        if size:
            self._builder.add_mark(NodMark(self._builder.at, size))
        self._builder.open("emphasis", "<emphasis>", volume=volume)

    def _prosody(self, attributes: Attributes) -> None:
        for name in ("pitch", "contour", "range", "duration"):
            if attributes.get(name, "default") not in {"medium", "default"}:
                raise InputError(f"no voice supports {name}; remove it, and use rate and volume")
        known = check_attributes("prosody", attributes, "rate", "volume", "pitch", "contour", "range", "duration")
        rate, volume = parse_rate(known.get("rate", "medium")), parse_volume(known.get("volume", "medium"))
        self._builder.open("prosody", "<prosody>", rate=rate, volume=volume)

    def _mark(self, attributes: Attributes) -> None:
        name = check_attributes("mark", attributes, "name").get("name", "")
        if not name.strip():
            raise InputError('a <mark> needs a name; write <mark name="here"/>')
        self._builder.add_mark(NameMark(self._builder.at, name))

    def _sub(self, attributes: Attributes) -> None:
        alias = check_attributes("sub", attributes, "alias").get("alias", "")
        if not alias.strip():
            raise InputError('a <sub> needs an alias; write <sub alias="doctor">Dr</sub>')
        self._builder.add_text(alias)

    def _express_as(self, attributes: Attributes) -> None:
        style = check_attributes("express-as", attributes, "style").get("style", "")
        if not style.strip():
            raise InputError('<express-as> needs a style; write <express-as style="delighted">')
        self._builder.open("express-as", f'<express-as style="{style}">', style=style.strip())


def _add_phonemes(builder: MarkedTextBuilder, text: str, phones: str, alphabet: str) -> None:
    """Add words with given phones."""
    for number, (word, segments) in enumerate(phoneme_words(text, phones, alphabet)):
        start = builder.at + (number > 0)
        builder.add_mark(PhoneMark(start, start + len(word), segments))
        builder.add_text(f" {word}" if number else word)
