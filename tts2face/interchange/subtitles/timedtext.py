"""YouTube's timed text (``.srv1`` to ``.srv3``, ``.xml``, ``.json3``): paragraphs with a start and a length."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from lexicon.errors import DataError
from lexicon.values.json_text import parse_json
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import WEBVTT_MARKUP
from tts2face.interchange.subtitles.xml_text import parse_xml

TIMED_TEXT = re.compile(
    r"\s*(?:(?:<\?xml[^>]*\?>\s*)?(?:<!--.*?-->\s*)*<(?:timedtext|transcript)[\s>]|\{(?=.{0,4000}\"tStartMs\"))",
    re.DOTALL,
)
_NUMBER = re.compile(r"-?\d{1,12}(?:\.\d{1,9})?")
_START = re.compile(r'"tStartMs"')
# Start and length of a paragraph: in milliseconds, in the first version in seconds.
_PARAGRAPHS = frozenset({"p", "text"})
_TIMES, _TIMES_1 = ("t", "d", 0.001), ("start", "dur", 1.0)
_LANGUAGES = ("lang", "xml:lang")


@dataclass(slots=True)
class _Paragraph:
    """Text with its start and length in seconds; `rolls` says that its window shows words one by one."""

    start_s: float | None
    length_s: float | None
    line: int
    rolls: bool = False
    text: list[str] = field(default_factory=list)


def read_timed_text(text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of a document; one of a window that rolls ends where the next one begins."""
    if text.lstrip("\ufeff \t\n").startswith("{"):
        return _cues(_json_paragraphs(text), None, [])
    return _XmlReader().read(text)


def _cues(
    paragraphs: Sequence[_Paragraph], language: str | None, warnings: list[SubtitleWarning]
) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    worded = [paragraph for paragraph in paragraphs if "".join(paragraph.text).strip()]
    cues = []
    for paragraph, after in zip(worded, [*worded[1:], None], strict=True):
        if paragraph.start_s is None:
            message = "the start of this cue cannot be read; it is left out"
            warnings.append(SubtitleWarning(paragraph.line, message))
            continue
        end = None if paragraph.length_s is None else paragraph.start_s + paragraph.length_s
        until = after.start_s if after else None
        if paragraph.rolls and end is not None and until is not None and paragraph.start_s < until < end:
            end = until
        text = "".join(paragraph.text).strip()
        cues.append(WrittenCue(paragraph.start_s, end, text, paragraph.line, language=language, markup=WEBVTT_MARKUP))
    return cues, warnings


def _json_paragraphs(text: str) -> list[_Paragraph]:
    """Paragraphs of the events of ``.json3``; the line of each is that of its start."""
    content = parse_json(text.lstrip("\ufeff"), "the JSON")
    events = content.get("events") if isinstance(content, Mapping) else None
    if not isinstance(events, list):
        raise DataError("the JSON has no list of events; export the captions again")
    paragraphs: list[_Paragraph] = []
    line, at = 1, 0
    starts = _START.finditer(text)
    for event in events:
        if not isinstance(event, Mapping):
            continue
        mark = next(starts, None) if "tStartMs" in event else None
        if mark is not None:
            line, at = line + text.count("\n", at, mark.start()), mark.start()
        segments = [segment for segment in _list(event.get("segs")) if isinstance(segment, Mapping)]
        rolls = any("tOffsetMs" in segment or "acAsrConf" in segment for segment in segments)
        words = [str(segment.get("utf8", "")) for segment in segments]
        start, length = (_milliseconds(event.get(key)) for key in ("tStartMs", "dDurationMs"))
        paragraphs.append(_Paragraph(start, length, line, rolls, words))
    return paragraphs


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _milliseconds(value: Any) -> float | None:
    return value / 1000.0 if isinstance(value, int | float) and not isinstance(value, bool) else None


class _XmlReader:
    """Handlers of the elements of one document."""

    def __init__(self) -> None:
        self._is_open = False
        self._language: str | None = None
        self._paragraphs: list[_Paragraph] = []
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters

    def read(self, text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
        """Parse the whole document."""
        warnings: list[SubtitleWarning] = []
        parse_xml(self._parser, text, self._paragraphs, warnings)
        # a paragraph that the damage cuts off has lost words
        return _cues(self._paragraphs[:-1] if self._is_open else self._paragraphs, self._language, warnings)

    def _start(self, name: str, attributes: Mapping[str, str]) -> None:
        if name in {"timedtext", "transcript"}:
            self._language = next((attributes[key] for key in _LANGUAGES if attributes.get(key)), None)
        elif name in _PARAGRAPHS:
            first, length, unit = _TIMES_1 if "start" in attributes else _TIMES
            start_s, length_s = (_seconds(attributes.get(key), unit) for key in (first, length))
            self._paragraphs.append(_Paragraph(start_s, length_s, self._parser.CurrentLineNumber))
            self._is_open = True
        elif self._is_open and name == "s":
            self._paragraphs[-1].rolls |= "t" in attributes or "ac" in attributes
        elif self._is_open and name == "br":
            self._paragraphs[-1].text.append("\n")

    def _end(self, name: str) -> None:
        self._is_open = self._is_open and name not in _PARAGRAPHS

    def _characters(self, text: str) -> None:
        if self._is_open:
            self._paragraphs[-1].text.append(text)


def _seconds(written: str | None, unit: float) -> float | None:
    return float(written) * unit if written is not None and _NUMBER.fullmatch(written.strip()) else None
