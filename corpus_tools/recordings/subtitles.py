"""Subtitles beside a video: what is said, and about when."""

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import BackendError, DataError
from lexicon.inputs import check_regular_file

SUBTITLE_FORMATS = {".srt": "srt", ".vtt": "vtt"}  # stated to the reader: it guesses wrongly for files without a header
# Blocks for people and for styling; the reader would take them for words of the cue before (W3C WebVTT, 4.1).
_UNSPOKEN = re.compile(r"(?:(?<=\n\n)|^)(?:NOTE|STYLE|REGION)\b(?:.+\n?)*")
# What subtitles for the deaf add: noises in brackets, sung lines between notes, who speaks, dashes between speakers.
_NOISE = re.compile(r"\[[^\]]*\]|\([^)]*\)|\{[^}]*\}|♪[^♪]*(?:♪|$)")
_SPEAKER = re.compile(r"(?m)^\s*(?:[-–—]\s*|>>\s*)?(?:[A-Z][A-Z0-9 .'’#-]*:(?=\s))?")
CUE_MARGIN_S = 0.3  # before and behind a cue; subtitles are rarely nearer to the speech


@dataclass(frozen=True, slots=True)
class Cue:
    """Words said between two instants in seconds."""

    begin: float
    end: float
    text: str


def find_subtitles(video: Path) -> Path | None:
    """The file of subtitles of a video, if there is one."""
    return next((path for suffix in SUBTITLE_FORMATS if (path := video.with_suffix(suffix)).is_file()), None)


def read_cues(path: Path) -> tuple[Cue, ...]:
    """Cues in the order of time, each widened by `CUE_MARGIN_S` but not beyond the middle to its neighbour.

    Raises
    ------
    DataError
        The file is no subtitles, or holds none.
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
        raise DataError(f"{path} holds no subtitles; export them again")
    cues = []
    for number, (begin, end, text) in enumerate(spoken):
        before = spoken[number - 1][1] if number else 0.0
        behind = spoken[number + 1][0] if number + 1 < len(spoken) else end + 2 * CUE_MARGIN_S
        earliest, latest = min((before + begin) / 2, begin), max((end + behind) / 2, end)
        cues.append(Cue(max(begin - CUE_MARGIN_S, earliest, 0.0), min(end + CUE_MARGIN_S, latest), text))
    return tuple(cues)


def _spoken_text(text: str) -> str:
    """What is said in a cue, on one line; nothing where it shows noises only."""
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
        It cannot be read, is too large, or is no text.
    """
    check_regular_file(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    if len(content) > MAX_BYTES:
        raise DataError(f"{path} is larger than {MAX_BYTES >> 20} MiB; a transcript holds words only")
    text = _decode(content, path)
    if "\0" in text:
        raise DataError(f"{path} is no text (it holds zero bytes); save it as UTF-8")
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
        raise DataError(f"{path} is no text in UTF-8, UTF-16, UTF-32 or Windows 1252; save it as UTF-8") from broken
