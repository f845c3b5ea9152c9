"""Subtitles beside a video: what is said, and about when."""

import re
from dataclasses import dataclass
from pathlib import Path

from corpus_tools.transcripts.decoding import read_text
from lexicon.errors import BackendError, DataError

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
