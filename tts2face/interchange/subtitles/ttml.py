"""Timed Text Markup Language (W3C TTML 2) and its profiles EBU-TT-D, IMSC and DFXP.

The parser is expat; a document type declaration is refused, and without one there are no entities to expand or fetch.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from xml.parsers import expat

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue

MAX_DEPTH = 64  # nested elements; real files have about six
MAX_CUES = 200_000
_OFFSET = re.compile(r"(-?\d{1,12}(?:\.\d{1,9})?)\s*(h|ms|m|s|f|t)")
_CLOCK = re.compile(r"(?:(\d{1,6}):)?(\d{1,2}):(\d{1,2})(?:[.,](\d{1,9})|:(\d{1,4})(?:\.\d{1,4})?)?")
_TIMED = frozenset({"body", "div", "p", "span"})
Attributes = Mapping[str, str]


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
    keeps_space: bool = False


@dataclass(slots=True)
class _Paragraph:
    """Text of an open paragraph; spans with times of their own become cues of their own."""

    line: int
    text: list[str] = field(default_factory=list)


def read_ttml(text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of a TTML document."""
    return _TtmlReader().read(text)


class _TtmlReader:
    """Handlers of the elements of one document."""

    def __init__(self) -> None:
        self._elements: list[_Element] = []
        self._paragraphs: list[_Paragraph] = []
        self._agents: dict[str, str] = {}
        self._agent = ""
        self._is_name = False
        # without ttp:frameRate and ttp:tickRate (TTML 2, 7.2)
        self._frame_rate, self._tick_rate = Fraction(30), Fraction(1)
        self._cues: list[WrittenCue] = []
        self._warnings: list[SubtitleWarning] = []
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        self._parser = parser

    def read(self, text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
        """Parse the whole document."""
        without_declaration = re.sub(r"^\s*<\?xml[^>]*\?>", lambda match: "\n" * match[0].count("\n"), text, count=1)
        try:
            self._parser.Parse(without_declaration.lstrip(" \t\r"), True)
        except expat.ExpatError as broken:
            reason = expat.ErrorString(broken.code)
            if not self._cues:
                raise DataError(
                    f"line {broken.lineno}: the XML is not well-formed ({reason}); export the file again"
                ) from broken
            self._warn(f"the XML is not well-formed ({reason}); what follows is left out", broken.lineno)
        except UnicodeEncodeError as broken:
            raise DataError(f"the XML contains an unpaired surrogate (character {broken.start}); remove it") from broken
        return self._cues, self._warnings

    def _warn(self, message: str, line: int | None = None) -> None:
        self._warnings.append(SubtitleWarning(line or self._parser.CurrentLineNumber, message))

    def _doctype(self, *_: object) -> None:
        raise DataError("a document type declaration is not supported; remove <!DOCTYPE ...>")

    def _start(self, tag: str, attributes: Attributes) -> None:
        if len(self._elements) >= MAX_DEPTH:
            raise DataError(f"line {self._parser.CurrentLineNumber}: elements are nested deeper than {MAX_DEPTH}")
        name = _local(tag)
        own = {_local(key): value for key, value in attributes.items()}
        if name == "tt":
            self._read_rates(own)
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

    def _open(self, name: str, own: Attributes, parent: _Element) -> _Element:
        start = parent.next_s if parent.is_sequence else parent.begin_s
        given, end = start, parent.end_s
        if name in _TIMED:
            offset = self._seconds(own.get("begin"))
            given = start + (offset or 0.0)
            length, until = self._seconds(own.get("dur")), self._seconds(own.get("end"))
            ends = [end, None if length is None else given + length, None if until is None else start + until]
            end = min((instant for instant in ends if instant is not None), default=None)
        speaker = own.get("agent") or own.get("role") or parent.speaker
        return _Element(
            name,
            given,
            end,
            own.get("timeContainer") == "seq",
            speaker,
            own.get("style") or parent.style,
            own.get("lang") or parent.language,
            given,
            own.get("space", "preserve" if parent.keeps_space else "") == "preserve",
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
        if not text:
            return
        if len(self._cues) >= MAX_CUES:
            raise DataError(f"the file has more than {MAX_CUES} cues; split it")
        speaker = self._agents.get(element.speaker.split()[0], element.speaker) if element.speaker else ""
        style = element.style.split()[0] if element.style else ""
        self._cues.append(
            WrittenCue(element.begin_s, element.end_s, text, paragraph.line, speaker, style, element.language)
        )

    def _characters(self, text: str) -> None:
        if self._is_name:
            self._agents[self._agent] = self._agents.get(self._agent, "") + text.strip()
        elif self._paragraphs:
            keeps_space = self._elements[-1].keeps_space
            self._paragraphs[-1].text.append(text if keeps_space else re.sub(r"\s+", " ", text))

    def _read_rates(self, own: Attributes) -> None:
        numbers = {key: own.get(key, "") for key in ("frameRate", "frameRateMultiplier", "tickRate")}
        if numbers["frameRate"].isdecimal() and int(numbers["frameRate"]) > 0:
            self._frame_rate = Fraction(int(numbers["frameRate"]))
        match = re.fullmatch(r"(\d{1,9})[\s:](\d{1,9})", numbers["frameRateMultiplier"].strip())
        if match and int(match[1]) and int(match[2]):
            self._frame_rate *= Fraction(int(match[1]), int(match[2]))
        self._tick_rate = self._frame_rate if numbers["frameRate"] else Fraction(1)
        if numbers["tickRate"].isdecimal() and int(numbers["tickRate"]) > 0:
            self._tick_rate = Fraction(int(numbers["tickRate"]))

    def _seconds(self, written: str | None) -> float | None:
        """Seconds of a time expression (TTML 2, 12.3.1); None if there is none or it cannot be read."""
        if written is None:
            return None
        offset, clock = _OFFSET.fullmatch(written.strip()), _CLOCK.fullmatch(written.strip())
        if offset:
            units = {"h": 3600.0, "m": 60.0, "s": 1.0, "ms": 0.001}
            units |= {"f": float(1 / self._frame_rate), "t": float(1 / self._tick_rate)}
            return float(offset[1]) * units[offset[2]]
        if clock:
            hours, minutes, seconds, fraction, frames = clock.groups()
            whole = int(hours or 0) * 3600 + int(minutes) * 60 + int(seconds)
            return whole + float(f"0.{fraction or 0}") + float(int(frames or 0) / self._frame_rate)
        self._warn(f"the time {written.strip()[:20]!r} cannot be read; it is not used")
        return None


def _local(name: str) -> str:
    """Name without its namespace."""
    return name.rpartition(" ")[2]
