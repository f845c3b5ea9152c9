"""Timed Text Markup Language (W3C TTML 2) and its profiles EBU-TT-D, IMSC and DFXP."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType
from xml.parsers import expat

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import PLAIN_MARKUP
from tts2face.interchange.subtitles.timing import is_likely, is_possible
from tts2face.interchange.subtitles.unspoken import ANNOTATIONS, LYRICS, SIGNS
from tts2face.interchange.subtitles.xml_text import parse_xml

MAX_DEPTH = 64  # nested elements; real files have about six
MAX_CUES = 200_000
_OFFSET = re.compile(r"(-?\d{1,12}(?:\.\d{1,9})?)\s*(h|ms|m|s|f|t|)")
_CLOCK = re.compile(r"(?:(\d{1,6}):)?(\d{1,2}):(\d{1,2})(?:[.,](\d{1,9})|:(\d{1,4})(?:\.\d{1,4})?)?")
_ROOTS = frozenset({"tt", "body", "div"})  # also of a part of a document
_TIMED = frozenset({"body", "div", "p", "span"})
_UNSPOKEN = frozenset({"metadata", "desc", "title", "copyright"})
_RUBY_TEXT = frozenset({"text", "textContainer", "delimiter"})  # TTML 2, 10.2.38: readings, not what they stand above
Attributes = Mapping[str, str]
# Roles of TTML 2, 14.1.2, that are nobody's speech; other roles say how somebody speaks.
_KINDS = MappingProxyType({
    "kinesic": ANNOTATIONS, "music": ANNOTATIONS, "quality": ANNOTATIONS, "sound": ANNOTATIONS, "lyrics": LYRICS,
    "reproduction": SIGNS, "source": SIGNS, "suppressed": SIGNS, "title": SIGNS, "transcription": SIGNS,
})  # fmt: skip
_SPOKEN_ROLES = frozenset(["caption", "description", "dialog", "expletive", "narration", "thought"])
# Units of times without one, and of ticks whose rate is not stated; the first of each is that of the specification.
_BARE_UNITS_S = (1.0, 0.001)
_TICK_RATES = (10_000_000, 1000, 90_000, 48_000)


@dataclass(slots=True)
class _Element:
    """An open element: its name, its times, and what its children inherit."""

    name: str
    begin_s: float
    end_s: float | None
    is_sequence: bool
    speaker: str
    style: str
    language: str | None
    next_s: float = 0.0
    kind: str = ""
    is_damaged: bool = False
    keeps_space: bool = False
    is_unspoken: bool = False


@dataclass(slots=True)
class _Paragraph:
    """Text of an open paragraph; spans with times of their own become cues of their own."""

    line: int
    text: list[str] = field(default_factory=list)


def read_ttml(text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of a TTML document.

    Where neither the document nor the specification gives its times a unit in which they can be meant, they have the
    one in which they can.
    """
    stated = _TtmlReader()
    found = stated.read(text)
    if not (stated.has_ticks_alone or stated.has_bare_times) or is_possible(found[0]):
        return found
    others: list[tuple[float, int | None, str]] = []
    others += [(unit, None, f"{unit:g} s") for unit in _BARE_UNITS_S[1:]] if stated.has_bare_times else []
    others += [(1.0, rate, f"1/{rate:,} s") for rate in _TICK_RATES] if stated.has_ticks_alone else []
    for bare_s, rate, shown in others:
        cues, warnings = _TtmlReader(bare_s, rate).read(text)
        if is_likely(cues):
            message = f"the times have no unit (ttp:tickRate is missing); they are read in units of {shown}"
            return cues, [*warnings, SubtitleWarning(cues[0].line, message)]
    raise DataError(
        f"line {found[0][0].line}: the times have no unit in which they can be meant; state it as ttp:tickRate"
    )


class _TtmlReader:
    """Handlers of the elements of one document."""

    def __init__(self, bare_s: float = 1.0, tick_rate: int | None = None) -> None:
        self.has_ticks_alone = self.has_bare_times = False  # times whose unit is not stated
        self._bare_s = bare_s
        self._other_tick_rate = tick_rate
        self._is_rate_stated = False
        self._elements: list[_Element] = []
        self._paragraphs: list[_Paragraph] = []
        self._agents: dict[str, str] = {}
        self._agent = ""
        self._is_name = False
        # without ttp:frameRate and ttp:tickRate (TTML 2, 7.2)
        self._frame_rate, self._tick_rate = Fraction(30), Fraction(1)
        self._second = Fraction(1)  # of the time code, in seconds
        self._ruby_styles: set[str] = set()
        self._cues: list[WrittenCue] = []
        self._warnings: list[SubtitleWarning] = []
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        self._parser = parser

    def read(self, text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
        """Parse the whole document."""
        parse_xml(self._parser, text, self._cues, self._warnings)
        return self._cues, self._warnings

    def _warn(self, message: str, line: int | None = None) -> None:
        self._warnings.append(SubtitleWarning(line or self._parser.CurrentLineNumber, message))

    def _start(self, tag: str, attributes: Attributes) -> None:
        name = _local(tag)
        self._check_place(name)
        own = {_local(key): value for key, value in attributes.items()}
        if name == "tt":
            self._read_rates(own)
        elif name == "style" and own.get("ruby") in _RUBY_TEXT:
            self._ruby_styles.add(own.get("id", ""))
        elif name == "agent":
            self._agent = own.get("id", "")
        elif name == "name" and self._agent:
            self._is_name = True
        elif name == "br" and self._paragraphs:
            self._paragraphs[-1].text.append("\n")
        parent = self._elements[-1] if self._elements else _Element("", 0.0, None, False, "", "", None)
        element = self._open(name, own, parent)
        if name == "p" or (name == "span" and "begin" in own and self._paragraphs):
            self._paragraphs.append(_Paragraph(self._parser.CurrentLineNumber))
            element.name = "cue"
        self._elements.append(element)

    def _check_place(self, name: str) -> None:
        """Refuse the first element of another kind of document, and elements that are nested too deep."""
        if len(self._elements) >= MAX_DEPTH:
            raise DataError(f"line {self._parser.CurrentLineNumber}: elements are nested deeper than {MAX_DEPTH}")
        if not self._elements and name not in _ROOTS:
            raise DataError(
                f"line {self._parser.CurrentLineNumber}: the file is XML of <{name[:40]}>, of which no subtitles are "
                "read; export them as .srt or .ttml"
            )

    def _open(self, name: str, own: Attributes, parent: _Element) -> _Element:
        start = parent.next_s if parent.is_sequence else parent.begin_s
        given, end = start, parent.end_s
        is_damaged = parent.is_damaged
        if name in _TIMED:
            offset = self._seconds(own.get("begin"))
            is_damaged = parent.is_damaged or ("begin" in own and offset is None)
            given = start + (offset or 0.0)
            length, until = self._seconds(own.get("dur")), self._seconds(own.get("end"))
            ends = [end, None if length is None else given + length, None if until is None else start + until]
            end = min((instant for instant in ends if instant is not None), default=None)
        role = own.get("role", "")
        role_speaker = "" if role.split() and set(role.split()) <= _SPOKEN_ROLES | _KINDS.keys() else role
        speaker = own.get("agent") or role_speaker or parent.speaker
        return _Element(
            name,
            given,
            end,
            own.get("timeContainer") == "seq",
            speaker,
            own.get("style") or parent.style,
            own.get("lang") or parent.language,
            given,
            next((_KINDS[word] for word in role.split() if word in _KINDS), parent.kind),
            is_damaged,
            own.get("space", "preserve" if parent.keeps_space else "") == "preserve",
            parent.is_unspoken or name in _UNSPOKEN or self._is_ruby_text(own),
        )

    def _end(self, tag: str) -> None:
        element = self._elements.pop()
        name = _local(tag)
        if name == "agent":
            self._agent = ""
        elif name == "name":
            self._is_name = False
        if element.name == "cue":
            self._close_cue(element)
        if self._elements and name in _TIMED and element.end_s is not None:
            self._elements[-1].next_s = element.end_s

    def _close_cue(self, element: _Element) -> None:
        paragraph = self._paragraphs.pop()
        text = "\n".join(line.strip() for line in "".join(paragraph.text).split("\n")).strip()
        if element.is_damaged:
            self._warn("the start of this cue cannot be read; it is left out", paragraph.line)
        if not text or element.is_damaged:
            return
        if len(self._cues) >= MAX_CUES:
            raise DataError(f"the file has more than {MAX_CUES} cues; split it")
        speaker = self._agents.get(element.speaker.split()[0], element.speaker) if element.speaker else ""
        style = element.style.split()[0] if element.style else ""
        self._cues.append(
            WrittenCue(
                element.begin_s,
                element.end_s,
                text,
                paragraph.line,
                speaker,
                style,
                element.language,
                PLAIN_MARKUP,
                element.kind,
            )
        )

    def _characters(self, text: str) -> None:
        if self._is_name:
            self._agents[self._agent] = self._agents.get(self._agent, "") + text.strip()
        elif self._paragraphs and not self._elements[-1].is_unspoken:
            keeps_space = self._elements[-1].keeps_space
            self._paragraphs[-1].text.append(text if keeps_space else re.sub(r"\s+", " ", text))

    def _is_ruby_text(self, own: Attributes) -> bool:
        """Whether an element holds the reading of words, which those are spoken by."""
        return own.get("ruby") in _RUBY_TEXT or not self._ruby_styles.isdisjoint(own.get("style", "").split())

    def _read_rates(self, own: Attributes) -> None:
        is_smpte = own.get("timeBase") == "smpte" and own.get("dropMode", "nonDrop") == "nonDrop"
        numbers = {key: own.get(key, "") for key in ("frameRate", "frameRateMultiplier", "tickRate")}
        if numbers["frameRate"].isdecimal() and int(numbers["frameRate"]) > 0:
            self._frame_rate = Fraction(int(numbers["frameRate"]))
        match = re.fullmatch(r"(\d{1,9})[\s:](\d{1,9})", numbers["frameRateMultiplier"].strip())
        if match and int(match[1]) and int(match[2]):
            self._frame_rate *= Fraction(int(match[1]), int(match[2]))
        # SMPTE time code counts whole frames: its seconds are longer than those of a clock where the rate is 29.97
        self._second = round(self._frame_rate) / self._frame_rate if is_smpte else Fraction(1)
        self._tick_rate = self._frame_rate if numbers["frameRate"] else Fraction(1)
        if numbers["tickRate"].isdecimal() and int(numbers["tickRate"]) > 0:
            self._tick_rate, self._is_rate_stated = Fraction(int(numbers["tickRate"])), True

    def _seconds(self, written: str | None) -> float | None:
        """Seconds of a time expression (TTML 2, 12.3.1); None if there is none or it cannot be read."""
        if written is None:
            return None
        offset, clock = _OFFSET.fullmatch(written.strip()), _CLOCK.fullmatch(written.strip())
        if offset:
            units = {"h": 3600.0, "m": 60.0, "s": 1.0, "ms": 0.001}
            tick_rate = self._tick_rate if self._other_tick_rate is None else Fraction(self._other_tick_rate)
            units |= {"f": float(1 / self._frame_rate), "t": float(1 / tick_rate), "": self._bare_s}
            self.has_ticks_alone |= offset[2] == "t" and not self._is_rate_stated
            self.has_bare_times |= not offset[2] and float(offset[1]) != 0.0
            return float(offset[1]) * units[offset[2]]
        if clock:
            hours, minutes, seconds, fraction, frames = clock.groups()
            whole = int(hours or 0) * 3600 + int(minutes) * 60 + int(seconds)
            return (
                float(whole * self._second) + float(f"0.{fraction or 0}") + float(int(frames or 0) / self._frame_rate)
            )
        self._warn(f"the time {written.strip()[:20]!r} cannot be read; it is not used")
        return None


def _local(name: str) -> str:
    """Name without its namespace."""
    return name.rpartition(" ")[2]
