"""Subtitles of videos as cues, and decoding of text files."""

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import BackendError, DataError
from lexicon.inputs import check_regular_file

SUBTITLE_FORMATS = {
    ".srt": "srt",
    ".vtt": "vtt",
}  # passed to the reader, whose detection fails for files without a header
# Comments and style blocks, which the reader would append to the previous cue (W3C WebVTT, 4.1).
_UNSPOKEN = re.compile(r"(?:(?<=\n\n)|^)(?:NOTE|STYLE|REGION)\b(?:.+\n?)*")
# Additions of subtitles for the deaf: noises in brackets, lyrics between notes, speaker names, dashes between speakers.
_NOISE = re.compile(r"\[[^\]]*\]|\([^)]*\)|\{[^}]*\}|♪[^♪]*(?:♪|$)")
_SPEAKER = re.compile(r"(?m)^\s*(?:[-–—]\s*|>>\s*)?(?:[A-Z][A-Z0-9 .'’#-]*:(?=\s))?")
CUE_MARGIN_S = 0.3  # before and after a cue; subtitles are rarely closer to the speech


@dataclass(frozen=True, slots=True)
class Cue:
    """Words spoken between two instants in seconds."""

    begin: float
    end: float
    text: str


def find_subtitles(video: Path) -> Path | None:
    """The subtitle file of a video, or None."""
    return next((path for suffix in SUBTITLE_FORMATS if (path := video.with_suffix(suffix)).is_file()), None)


def read_cues(path: Path) -> tuple[Cue, ...]:
    """Cues in temporal order, each extended by `CUE_MARGIN_S` but not beyond the middle to its neighbour.

    Raises
    ------
    DataError
        The file is not a subtitle file, or contains no cue.
    BackendError
        The package pysubs2 is missing.
    """
    try:
        import pysubs2
    except ImportError as missing:
        raise BackendError("subtitles need the package pysubs2; pip install 'tts2face[capture]'") from missing
    text = read_text(path).replace("\r\n", "\n").replace("\r", "\n")
    if path.suffix.lower() == ".vtt":
        text = _UNSPOKEN.sub("", text)
    try:
        read = pysubs2.SSAFile.from_string(text, format_=SUBTITLE_FORMATS[path.suffix.lower()])
    except (pysubs2.exceptions.Pysubs2Error, ValueError, OverflowError) as broken:
        raise DataError(f"{path} cannot be read as subtitles ({broken}); export them again") from broken
    spoken = sorted((event.start / 1000, event.end / 1000, _spoken_text(event.plaintext)) for event in read)
    spoken = [(begin, end, text) for begin, end, text in spoken if text and end > begin]
    if not spoken:
        raise DataError(f"{path} contains no subtitles; export them again")
    cues = []
    for number, (begin, end, text) in enumerate(spoken):
        before = spoken[number - 1][1] if number else 0.0
        behind = spoken[number + 1][0] if number + 1 < len(spoken) else end + 2 * CUE_MARGIN_S
        earliest, latest = min((before + begin) / 2, begin), max((end + behind) / 2, end)
        cues.append(Cue(max(begin - CUE_MARGIN_S, earliest, 0.0), min(end + CUE_MARGIN_S, latest), text))
    return tuple(cues)


def _spoken_text(text: str) -> str:
    """The spoken words of a cue on one line; empty if it contains noises only."""
    return " ".join(_SPEAKER.sub(" ", _NOISE.sub(" ", text)).split())


MAX_BYTES = 8 << 20  # 8 MiB; the words of a whole day of speech are below 1 MiB
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)  # in this order: the mark of UTF-32-LE begins with that of UTF-16-LE


def read_text(path: Path) -> str:
    """Characters of a text file: by its byte order mark, else as UTF-8, else as Windows 1252.

    Raises
    ------
    DataError
        It cannot be read, is too large, or is not text.
    """
    check_regular_file(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    if len(content) > MAX_BYTES:
        raise DataError(f"{path} is larger than {MAX_BYTES >> 20} MiB; give the transcript only")
    text = _decode(content, path)
    if "\0" in text:
        raise DataError(f"{path} is not text (it contains zero bytes); save it as UTF-8")
    return text


def _decode(content: bytes, path: Path) -> str:
    try:
        for mark, encoding in _BYTE_ORDER_MARKS:
            if content.startswith(mark):
                return content[len(mark) :].decode(encoding)
        try:
            return content.decode("utf-8")
        except UnicodeDecodeError:
            return content.decode("cp1252")
    except UnicodeDecodeError as broken:
        raise DataError(f"{path} is not text in UTF-8, UTF-16, UTF-32 or Windows 1252; save it as UTF-8") from broken
