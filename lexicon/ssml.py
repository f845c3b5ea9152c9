"""The part of SSML 1.1 (W3C 2010) that a talking face can follow, and ``express-as``; anything else is refused by name.

======================= ==============================================================================================
``speak p s``           the text, its paragraphs and sentences; ``xml:lang`` must be the language of the whole
``break``               silence: ``time`` (``400ms``, ``0.4s``), or ``strength``
``emphasis``            louder words and a nod; ``level`` strong, moderate (default), none, reduced (softer, no nod)
``prosody``             ``rate`` and ``volume``; ``pitch`` and the rest are refused, for no voice here can follow them
``mark``                a ``name`` whose time is told
``sub``                 ``alias`` is said in place of the text
``express-as``          ``style`` of the gestures, as ``[style:...]``; also ``mstts:express-as``
======================= ==============================================================================================

The parser is expat; a document type declaration is refused, and without one there are no entities to expand or fetch.
"""

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType
from xml.parsers import expat

from lexicon.errors import InputError
from lexicon.languages import language_code
from lexicon.marked_text import DEEPEST, Gathering, MarkedText, NameMark, NodMark, PauseMark

_BEGINS = re.compile(r"\ufeff?\s*<(?:speak[\s>/]|\?xml\s|!DOCTYPE\s)")
_MARK = re.compile(r"\[/?(?:style|nod|pause)\b")
_TIME = re.compile(r"\+?([0-9]{1,9}(?:\.[0-9]{1,9})?|\.[0-9]{1,9})\s*(ms|s)")
_PERCENT = re.compile(r"([+-]?)([0-9]{1,6}(?:\.[0-9]{1,9})?)%")
_FACTOR = re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,9})?")
_DECIBEL = re.compile(r"([+-]?[0-9]{1,6}(?:\.[0-9]{1,9})?)\s*dB", re.IGNORECASE)
# Strengths in seconds: from a pause of read speech at a comma (0.2-0.4 s) to one between paragraphs (1 s).
BREAKS_S = MappingProxyType({"none": 0.0, "x-weak": 0.1, "weak": 0.2, "medium": 0.4, "strong": 0.7, "x-strong": 1.0})
SPEEDS = MappingProxyType({"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.3, "x-fast": 1.7})
LOUDNESSES = MappingProxyType(
    {"silent": 0.0, "x-soft": 0.35, "soft": 0.6, "medium": 1.0, "default": 1.0, "loud": 1.4, "x-loud": 2.0}
)
# Loudness and size of the nod of each level: accented words are some 2-5 dB louder than their neighbours, and nods are
# what viewers take for stress beside it (Krahmer and Swerts 2007, J. Memory and Language 57).
EMPHASES = MappingProxyType({"strong": (1.6, 1.0), "moderate": (1.25, 0.6), "none": (1.0, 0.0), "reduced": (0.7, 0.0)})
SPAN_KINDS = frozenset({"emphasis", "prosody", "express-as"})
LANGUAGE = "xml:lang"
Attributes = Mapping[str, str]


def is_ssml(text: str) -> bool:
    """The text is meant as SSML: it begins with ``<speak``, an XML or a document type declaration."""
    return _BEGINS.match(text) is not None


def spoken_by_ssml(text: str) -> MarkedText:
    """What an SSML document says, and how.

    Raises
    ------
    InputError
        It is not well-formed, has a document type, an element or attribute outside the subset, or a value out of range;
        the message names it and its line.
    """
    reader = _Reader()
    try:
        return reader.read(text)
    except expat.ExpatError as broken:
        reason = expat.ErrorString(broken.code)
        raise InputError(f"the SSML is not well-formed: {reason} in line {broken.lineno}; mend it there") from broken
    except UnicodeEncodeError as broken:
        raise InputError(f"the SSML holds a half character (number {broken.start}); take it out") from broken
    except InputError as wrong:
        raise InputError(f"SSML, line {reader.line}: {wrong}") from wrong


class _Reader:
    """Follows the elements of one document."""

    def __init__(self) -> None:
        self._gathering = Gathering()
        self._elements: list[str] = []
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
            "express-as": self._express_as,
        }

    @property
    def line(self) -> int:
        """Where the parser stands."""
        return self._parser.CurrentLineNumber

    def read(self, text: str) -> MarkedText:
        """The whole document."""
        self._parser.Parse(text.removeprefix("\ufeff").lstrip(), True)
        return self._gathering.done(self._language)

    def _doctype(self, *_: object) -> None:
        raise InputError("a document type declaration is not read; leave <!DOCTYPE ...> away")

    def _instruction(self, target: str, _: str) -> None:
        raise InputError(f"the instruction <?{target}?> is not read; leave it away")

    def _start(self, tag: str, attributes: Attributes) -> None:
        name = tag.removeprefix("mstts:") if tag == "mstts:express-as" else tag
        if name not in self._starts:
            raise InputError(f"there is no <{tag}> here; choose {', '.join(self._starts)}")
        if (name == "speak") != (not self._elements):
            raise InputError("<speak> holds all the rest, once; put everything into one")
        if len(self._elements) > 2 * DEEPEST:
            raise InputError(f"<{tag}> stands within {len(self._elements)} others; nest them less deep")
        if self._elements and self._elements[-1] in {"break", "mark", "sub"}:
            raise InputError(f"<{self._elements[-1]}> holds no elements, and this one a <{tag}>; close it before")
        self._elements.append(name)
        self._starts[name](attributes)

    def _end(self, tag: str) -> None:
        name = self._elements.pop()
        if name in SPAN_KINDS:
            self._gathering.close(name, f"</{tag}>")
        elif name in {"p", "s"}:
            self._gathering.say("\n\n")

    def _words(self, text: str) -> None:
        inside = self._elements[-1]
        if inside == "sub":
            return
        if inside in {"break", "mark"} and text.strip():
            raise InputError(f"<{inside}> holds no words; close it before {text.strip()[:20]!r}")
        if _MARK.search(text):
            raise InputError("marks in square brackets do not go with SSML; write <break>, <emphasis> or <express-as>")
        self._gathering.say(text)

    def _speak(self, attributes: Attributes) -> None:
        known = {name: value for name, value in attributes.items() if not name.startswith("xmlns")}
        self._speaks(_only("speak", known, "version", LANGUAGE, "xsi:schemaLocation"))

    def _stretch(self, attributes: Attributes) -> None:
        self._speaks(_only(self._elements[-1], attributes, LANGUAGE))
        self._gathering.say("\n\n")  # a blank line ends what was said before

    def _speaks(self, attributes: Attributes) -> None:
        language = attributes.get(LANGUAGE)
        if language is None:
            return
        if self._language is not None and language_code(language) != language_code(self._language):
            raise InputError(f"one voice speaks one language, {self._language} or {language}; give each its own clip")
        self._language = language

    def _break(self, attributes: Attributes) -> None:
        told = _only("break", attributes, "time", "strength")
        seconds = _choice("strength", told.get("strength", "medium"), BREAKS_S)
        if "time" in told:
            match = _TIME.fullmatch(told["time"].strip())
            if match is None:
                raise InputError(f'cannot read the time {told["time"]!r} of a <break>; write "400ms" or "0.4s"')
            seconds = float(match[1]) / (1000 if match[2] == "ms" else 1)
        if seconds > 0:
            self._gathering.mark(PauseMark(self._gathering.at, seconds))

    def _emphasis(self, attributes: Attributes) -> None:
        level = _only("emphasis", attributes, "level").get("level", "moderate")
        if level not in EMPHASES:
            raise InputError(f"there is no level {level!r} of <emphasis>; choose {', '.join(EMPHASES)}")
        volume, size = EMPHASES[level]
        if size:
            self._gathering.mark(NodMark(self._gathering.at, size))
        self._gathering.open("emphasis", "<emphasis>", volume=volume)

    def _prosody(self, attributes: Attributes) -> None:
        for name in ("pitch", "contour", "range", "duration"):
            if attributes.get(name, "default") not in {"medium", "default"}:
                raise InputError(f"no voice here can change its {name}; leave {name} away, and use rate and volume")
        told = _only("prosody", attributes, "rate", "volume", "pitch", "contour", "range", "duration")
        rate, volume = _speed(told.get("rate", "medium")), _loudness(told.get("volume", "medium"))
        self._gathering.open("prosody", "<prosody>", rate=rate, volume=volume)

    def _mark(self, attributes: Attributes) -> None:
        name = _only("mark", attributes, "name").get("name", "")
        if not name.strip():
            raise InputError('a <mark> needs a name; write <mark name="here"/>')
        self._gathering.mark(NameMark(self._gathering.at, name))

    def _sub(self, attributes: Attributes) -> None:
        alias = _only("sub", attributes, "alias").get("alias", "")
        if not alias.strip():
            raise InputError('a <sub> needs what is said instead; write <sub alias="doctor">Dr</sub>')
        self._gathering.say(alias)

    def _express_as(self, attributes: Attributes) -> None:
        style = _only("express-as", attributes, "style").get("style", "")
        if not style.strip():
            raise InputError('<express-as> needs a style; write <express-as style="delighted">')
        self._gathering.open("express-as", f'<express-as style="{style}">', style=style.strip())


def _only(element: str, attributes: Attributes, *known: str) -> Attributes:
    for name in attributes:
        if name not in known:
            raise InputError(f"<{element}> has no attribute {name!r} here; choose {', '.join(known)}")
    return attributes


def _choice(what: str, value: str, values: Mapping[str, float]) -> float:
    if value not in values:
        raise InputError(f"there is no {what} {value!r}; choose {', '.join(values)}")
    return values[value]


def _speed(written: str) -> float:
    """A factor of speed: a word, a share (80%), a change (-20%), or a number."""
    value = written.strip()
    if match := _PERCENT.fullmatch(value):
        share = float(match[2]) / 100
        return {"": share, "+": 1 + share, "-": 1 - share}[match[1]]
    if _FACTOR.fullmatch(value):
        return float(value)
    return _choice("rate", value, SPEEDS)


def _loudness(written: str) -> float:
    """A factor of loudness: a word, or decibels (+6dB)."""
    if match := _DECIBEL.fullmatch(written.strip()):
        return float(10.0 ** (min(float(match[1]), 1e3) / 20))
    if written.strip() not in LOUDNESSES:
        raise InputError(f"cannot read the volume {written!r}; write +6dB, or one of {', '.join(LOUDNESSES)}")
    return LOUDNESSES[written.strip()]
