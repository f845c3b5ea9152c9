"""YouTube's timed text (``.srv1``, ``.srv2``, ``.srv3``, ``.xml``): paragraphs with a start and a length."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from xml.parsers import expat

from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import WEBVTT_MARKUP
from tts2face.interchange.subtitles.xml_text import parse_xml

TIMED_TEXT = re.compile(r"\s*(?:<\?xml[^>]*\?>\s*)?(?:<!--.*?-->\s*)*<(?:timedtext|transcript)[\s>]", re.DOTALL)
_NUMBER = re.compile(r"-?\d{1,12}(?:\.\d{1,9})?")
# Start and length of a paragraph: in milliseconds, in the first version in seconds.
_TIMES = {"p": ("t", "d", 0.001), "text": ("t", "d", 0.001)}
_TIMES_1 = ("start", "dur", 1.0)
_LANGUAGES = ("lang", "xml:lang")


@dataclass(slots=True)
class _Paragraph:
    """An open paragraph; `rolls` says that it is of a window in which words appear one by one."""

    begin_s: float | None
    end_s: float | None
    line: int
    rolls: bool = False
    text: list[str] = field(default_factory=list)


def read_timed_text(text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of a document; one of a window that rolls ends where the next one begins."""
    return _Reader().read(text)


class _Reader:
    """Handlers of the elements of one document."""

    def __init__(self) -> None:
        self._paragraph: _Paragraph | None = None
        self._language: str | None = None
        self._cues: list[WrittenCue] = []
        self._rolling: list[bool] = []
        self._warnings: list[SubtitleWarning] = []
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters

    def read(self, text: str) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
        """Parse the whole document."""
        parse_xml(self._parser, text, self._cues, self._warnings)
        following = [*(cue.begin_s for cue in self._cues[1:]), None]
        cues = [
            replace(cue, end_s=until)
            if rolls and until is not None and cue.end_s is not None and cue.begin_s < until < cue.end_s
            else cue
            for cue, rolls, until in zip(self._cues, self._rolling, following, strict=True)
        ]
        return cues, self._warnings

    def _start(self, name: str, attributes: Mapping[str, str]) -> None:
        if name in {"timedtext", "transcript"}:
            self._language = next((attributes[key] for key in _LANGUAGES if attributes.get(key)), None)
        elif name in _TIMES:
            first, length, unit = _TIMES_1 if "start" in attributes else _TIMES[name]
            begin, lasts = (_seconds(attributes.get(key), unit) for key in (first, length))
            end = None if begin is None or lasts is None else begin + lasts
            self._paragraph = _Paragraph(begin, end, self._parser.CurrentLineNumber)
        elif name == "s" and self._paragraph is not None:
            self._paragraph.rolls |= "t" in attributes or "ac" in attributes
        elif name == "br" and self._paragraph is not None:
            self._paragraph.text.append("\n")

    def _end(self, name: str) -> None:
        paragraph = self._paragraph
        if paragraph is None or name not in _TIMES:
            return
        self._paragraph = None
        text = "".join(paragraph.text).strip()
        if not text:
            return
        if paragraph.begin_s is None:
            self._warnings.append(
                SubtitleWarning(paragraph.line, "the start of this cue cannot be read; it is left out")
            )
            return
        self._cues.append(
            WrittenCue(
                paragraph.begin_s,
                paragraph.end_s,
                text,
                paragraph.line,
                language=self._language,
                markup=WEBVTT_MARKUP,
            )
        )
        self._rolling.append(paragraph.rolls)

    def _characters(self, text: str) -> None:
        if self._paragraph is not None:
            self._paragraph.text.append(text)


def _seconds(written: str | None, unit: float) -> float | None:
    return float(written) * unit if written is not None and _NUMBER.fullmatch(written.strip()) else None
