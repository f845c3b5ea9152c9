"""The part of SSML 1.1 (W3C 2010) that a talking face can follow, and ``express-as``; anything else is refused by name.

======================= ==============================================================================================
``speak p s``           the text, its paragraphs and sentences; ``xml:lang`` of ``speak`` must be the request's language
``break``               silence: ``time`` (``400ms``, ``0.4s``), or ``strength``
``emphasis``            louder words and a nod; ``level`` strong, moderate (default), none, reduced (softer, no nod)
``prosody``             ``rate`` and ``volume``; ``pitch`` and the rest are refused, for no voice here can follow them
``mark``                a ``name`` whose time is reported
``sub``                 ``alias`` is said in place of the text
``phoneme``             ``ph`` is said in place of the text: IPA, or ARPABET with ``alphabet="x-arpabet"``
``say-as``              the text is read as ``interpret-as`` says (`lexicon.say_as`)
``voice lang``          another voice (``name``, ``gender``, ``language``), another language (``xml:lang``)
``express-as``          ``style`` of the gestures, as ``[style:...]``; also ``mstts:express-as``
======================= ==============================================================================================

The parser is expat; a document type declaration is refused, and without one there are no entities to expand or fetch.
Attributes have at most `lexicon.ssml_values.LONGEST_ATTRIBUTE` characters, so that reading takes time linear in the
document.
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
from lexicon.ssml_speech import named_voice, phoned_words
from lexicon.ssml_values import BREAKS_S, check_lengths, choice, loudness, only, primary_of, speed

_BEGINS = re.compile(r"\ufeff?\s*<(?:speak[\s>/]|\?xml\s|!DOCTYPE\s)")
_MARK = re.compile(r"\[/?(?:style|nod|pause)\b")
_TIME = re.compile(r"\+?([0-9]{1,9}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})\s*(ms|s)")
# Loudness and size of the nod of each level: accented words are some 2-5 dB louder than their neighbours, and nods are
# what viewers take for stress beside it (Krahmer and Swerts 2007, J. Memory and Language 57).
EMPHASES = MappingProxyType({"strong": (1.6, 1.0), "moderate": (1.25, 0.6), "none": (1.0, 0.0), "reduced": (0.7, 0.0)})
SPAN_KINDS = frozenset({"emphasis", "prosody", "express-as", "voice", "lang"})
CLOSED_KINDS = frozenset({"break", "mark", "sub", "phoneme", "say-as"})  # hold no elements
HELD_KINDS = frozenset({"phoneme", "say-as"})  # say something in place of their text
LANGUAGE = "xml:lang"
Attributes = Mapping[str, str]


def is_ssml(text: str) -> bool:
    """The text is meant as SSML: it begins with ``<speak``, an XML or a document type declaration."""
    return _BEGINS.match(text) is not None


def parse_ssml(text: str, language: str = DEFAULT_LANGUAGE) -> MarkedText:
    """What an SSML document says, and how.

    Parameters
    ----------
    language
        Of the text, where no element names another.

    Raises
    ------
    InputError
        It is not well-formed, has a document type, an element or attribute outside the subset, or a value out of range;
        the message names it and its line.
    """
    reader = _SsmlReader(language)
    try:
        return reader.read(text)
    except expat.ExpatError as broken:
        reason = expat.ErrorString(broken.code)
        raise InputError(f"the SSML is not well-formed: {reason} in line {broken.lineno}; mend it there") from broken
    except UnicodeEncodeError as broken:
        raise InputError(f"the SSML holds a half character (number {broken.start}); take it out") from broken
    except InputError as wrong:
        raise InputError(f"SSML, line {reader.line}: {wrong}") from wrong


class _SsmlReader:
    """Follows the elements of one document."""

    def __init__(self, language: str) -> None:
        self._gathering = MarkedTextBuilder()
        self._elements: list[str] = []
        self._spans: list[str] = []  # for each element the kind of span that it opened, or nothing
        self._held: list[str] = []  # text of a phoneme or say-as
        self._held_attributes: Attributes = {}
        self._base = language
        self._language: str | None = None
        parser = expat.ParserCreate()
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
            "phoneme": self._hold,
            "say-as": self._hold,
            "voice": self._voice,
            "lang": self._lang,
            "express-as": self._express_as,
        }

    @property
    def line(self) -> int:
        """Where the parser stands."""
        return self._parser.CurrentLineNumber

    def read(self, text: str) -> MarkedText:
        """The whole document."""
        self._parser.Parse(text.removeprefix("\ufeff").lstrip(), True)
        return self._gathering.done(self._language, spoken=self._base)

    def _doctype(self, *_: object) -> None:
        raise InputError("a document type declaration is not read; leave <!DOCTYPE ...> away")

    def _instruction(self, target: str, _: str) -> None:
        raise InputError(f"the instruction <?{target}?> is not read; leave it away")

    def _start(self, tag: str, attributes: Attributes) -> None:
        name = tag.removeprefix("mstts:") if tag == "mstts:express-as" else tag
        if name not in self._starts:
            raise InputError(f"there is no <{tag[:40]}> here; choose {', '.join(self._starts)}")
        if (name == "speak") != (not self._elements):
            raise InputError("<speak> holds all the rest, once; put everything into one")
        if len(self._elements) > 2 * MAX_NESTING:
            raise InputError(f"<{tag}> stands within {len(self._elements)} others; nest them less deep")
        if self._elements and self._elements[-1] in CLOSED_KINDS:
            raise InputError(f"<{self._elements[-1]}> holds no elements, and this one a <{tag}>; close it before")
        check_lengths(name, attributes)
        self._elements.append(name)
        self._spans.append(name if name in SPAN_KINDS else "")
        self._starts[name](attributes)

    def _end(self, tag: str) -> None:
        name, span = self._elements.pop(), self._spans.pop()
        if name in HELD_KINDS:
            self._say_held(name)
        if span:
            self._gathering.close(span, f"</{tag}>")
        if name in {"p", "s"}:
            self._gathering.add_text("\n\n")

    def _words(self, text: str) -> None:
        inside = self._elements[-1]
        if inside == "sub":
            return
        if inside in {"break", "mark"} and text.strip():
            raise InputError(f"<{inside}> holds no words; close it before {text.strip()[:20]!r}")
        if _MARK.search(text):
            raise InputError("marks in square brackets do not go with SSML; write <break>, <emphasis> or <express-as>")
        if inside in HELD_KINDS:
            self._held.append(text)
        else:
            self._gathering.add_text(text)

    def _speak(self, attributes: Attributes) -> None:
        known = {name: value for name, value in attributes.items() if not name.startswith("xmlns")}
        self._language = only("speak", known, "version", LANGUAGE, "xsi:schemaLocation").get(LANGUAGE)

    def _stretch(self, attributes: Attributes) -> None:
        tag = only(self._elements[-1], attributes, LANGUAGE).get(LANGUAGE)
        self._gathering.add_text("\n\n")  # a blank line ends what was said before
        if tag is not None and primary_of(tag) != primary_of(self._spoken):
            self._spans[-1] = "lang"
            self._gathering.open_voice("lang", f"<{self._elements[-1]}>", voice=None, language=language_code(tag))

    @property
    def _spoken(self) -> str:
        """The language at the present place."""
        return self._gathering.language or self._base

    def _lang(self, attributes: Attributes) -> None:
        tag = only("lang", attributes, LANGUAGE).get(LANGUAGE, "")
        self._gathering.open_voice("lang", "<lang>", voice=None, language=language_code(tag))

    def _voice(self, attributes: Attributes) -> None:
        given = only("voice", attributes, "name", "gender", "language", "languages", LANGUAGE, "required")
        voice, language = named_voice(given, self._spoken)
        self._gathering.open_voice("voice", "<voice>", voice=voice, language=language)

    def _hold(self, attributes: Attributes) -> None:
        kind = self._elements[-1]
        known = ("alphabet", "ph") if kind == "phoneme" else ("interpret-as", "format", "detail")
        self._held_attributes = only(kind, attributes, *known)
        needed = known[1] if kind == "phoneme" else known[0]
        if not attributes.get(needed, "").strip():
            raise InputError(f'a <{kind}> needs {needed}; write <{kind} {needed}="...">')
        self._held = []

    def _say_held(self, kind: str) -> None:
        given, text = self._held_attributes, "".join(self._held)
        if kind == "say-as":
            self._gathering.add_text(say_as(given["interpret-as"].strip(), text, given.get("format", ""), self._spoken))
            return
        for number, (word, segments) in enumerate(phoned_words(text, given["ph"], given.get("alphabet", "ipa"))):
            begin = self._gathering.at + (number > 0)
            self._gathering.mark(PhoneMark(begin, begin + len(word), segments))
            self._gathering.add_text(f" {word}" if number else word)

    def _break(self, attributes: Attributes) -> None:
        told = only("break", attributes, "time", "strength")
        seconds = choice("strength", told.get("strength", "medium"), BREAKS_S)
        if "time" in told:
            match = _TIME.fullmatch(told["time"].strip())
            if match is None:
                raise InputError(f'cannot read the time {told["time"][:40]!r} of a <break>; write "400ms" or "0.4s"')
            seconds = float(match[1]) / (1000 if match[2] == "ms" else 1)
        if seconds > 0:
            self._gathering.mark(PauseMark(self._gathering.at, seconds))

    def _emphasis(self, attributes: Attributes) -> None:
        level = only("emphasis", attributes, "level").get("level", "moderate")
        if level not in EMPHASES:
            raise InputError(f"there is no level {level[:40]!r} of <emphasis>; choose {', '.join(EMPHASES)}")
        volume, size = EMPHASES[level]
        if size:
            self._gathering.mark(NodMark(self._gathering.at, size))
        self._gathering.open("emphasis", "<emphasis>", volume=volume)

    def _prosody(self, attributes: Attributes) -> None:
        for name in ("pitch", "contour", "range", "duration"):
            if attributes.get(name, "default") not in {"medium", "default"}:
                raise InputError(f"no voice here can change its {name}; leave {name} away, and use rate and volume")
        told = only("prosody", attributes, "rate", "volume", "pitch", "contour", "range", "duration")
        rate, volume = speed(told.get("rate", "medium")), loudness(told.get("volume", "medium"))
        self._gathering.open("prosody", "<prosody>", rate=rate, volume=volume)

    def _mark(self, attributes: Attributes) -> None:
        name = only("mark", attributes, "name").get("name", "")
        if not name.strip():
            raise InputError('a <mark> needs a name; write <mark name="here"/>')
        self._gathering.mark(NameMark(self._gathering.at, name))

    def _sub(self, attributes: Attributes) -> None:
        alias = only("sub", attributes, "alias").get("alias", "")
        if not alias.strip():
            raise InputError('a <sub> needs what is said instead; write <sub alias="doctor">Dr</sub>')
        self._gathering.add_text(alias)

    def _express_as(self, attributes: Attributes) -> None:
        style = only("express-as", attributes, "style").get("style", "")
        if not style.strip():
            raise InputError('<express-as> needs a style; write <express-as style="delighted">')
        self._gathering.open("express-as", f'<express-as style="{style}">', style=style.strip())
