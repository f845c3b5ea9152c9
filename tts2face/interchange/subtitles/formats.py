"""The formats of subtitle files: their names and endings, how their content shows them, and their readers."""

import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from tts2face.interchange.subtitles.blocks import read_subrip, read_webvtt
from tts2face.interchange.subtitles.clock import HAS_ARROW, TIMING, without_frames
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.frames import MICRODVD, MPL2, read_microdvd, read_mpl2
from tts2face.interchange.subtitles.lyrics import LINE, read_lyrics
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.pairs import PAIR, read_pairs
from tts2face.interchange.subtitles.sami import read_sami
from tts2face.interchange.subtitles.stamped import is_subviewer_1, is_tmplayer, read_subviewer_1, read_tmplayer
from tts2face.interchange.subtitles.substation import read_substation
from tts2face.interchange.subtitles.timed_lines import has_timed_lines, read_timed_lines
from tts2face.interchange.subtitles.timedtext import TIMED_TEXT, read_timed_text
from tts2face.interchange.subtitles.ttml import read_ttml

SUBRIP = "SubRip"
WEBVTT = "WebVTT"
SUBSTATION = "SubStation Alpha"
TTML = "TTML"
MICRODVD_NAME = "MicroDVD"
MPL2_NAME = "MPL2"
PAIRS = "SubViewer"
LRC = "LRC"
EBU_STL = "EBU STL"
SAMI = "SAMI"
YOUTUBE = "YouTube's timed text"
TMPLAYER = "TMPlayer"
SUBVIEWER_1 = "SubViewer 1"
TIMED_LINES = "lines with times"
SUFFIXES = MappingProxyType({
    ".srt": SUBRIP, ".vtt": WEBVTT, ".ass": SUBSTATION, ".ssa": SUBSTATION, ".ttml": TTML, ".dfxp": TTML, ".itt": TTML,
    ".xml": TTML, ".sbv": PAIRS, ".sub": MICRODVD_NAME, ".mpl": MPL2_NAME, ".lrc": LRC, ".stl": EBU_STL,
    ".smi": SAMI, ".sami": SAMI, ".srv1": YOUTUBE, ".srv2": YOUTUBE, ".srv3": YOUTUBE,
    ".json3": YOUTUBE,
})  # fmt: skip
NAMES = (
    *(SUBRIP, WEBVTT, SUBSTATION, TTML, YOUTUBE, MICRODVD_NAME, MPL2_NAME, "SBV", PAIRS, SUBVIEWER_1, TMPLAYER, LRC),
    *(SAMI, EBU_STL, TIMED_LINES),
)
FILM_SUFFIXES = (".mp4", ".m4v", ".mov", ".mkv", ".mks", ".webm")  # in which a track of subtitles may lie
MIN_SHARE = 0.8  # of the lines of a text that are those of a format
HEAD_LINES = 40  # within which a format shows itself
_XML = re.compile(r"\s*<(?:\?xml|!DOCTYPE|!--|(?:\w+:)?tt[\s>])")
_SAMI = re.compile(r"<SAMI\b|<SYNC\b", re.IGNORECASE)
_SECTION = re.compile(r"^\s*\[(?:Script Info|V4\+? Styles|Events)\]", re.IGNORECASE | re.MULTILINE)
_LRC_TAG = re.compile(r"\s*\[[a-z#]{2,8}:[^\]]*\]\s*", re.IGNORECASE)
_TTML = re.compile(r"\s*(?:<\?xml[^>]*>\s*)?(?:<!--.*?-->\s*)*<(?:\w+:)?tt[\s>]", re.DOTALL)
_BY_LINES = ((PAIRS, PAIR), (MICRODVD_NAME, MICRODVD), (MPL2_NAME, MPL2), (LRC, LINE))

_BY_NAME: Mapping[str, Callable[[Sequence[str]], tuple[list[WrittenCue], list[SubtitleWarning]]]] = MappingProxyType({
    SUBSTATION: read_substation, PAIRS: read_pairs, MPL2_NAME: read_mpl2, LRC: read_lyrics,
    SUBVIEWER_1: read_subviewer_1, TMPLAYER: read_tmplayer, TIMED_LINES: read_timed_lines,
})  # fmt: skip


def is_subtitle_text(text: str) -> bool:
    """Whether a text of any name is unmistakably one of subtitles: by its head, its first lines, or most of all."""
    head = text.lstrip("\ufeff \t\r\n")
    if head.startswith("WEBVTT") or any(mark.match(head) for mark in (_SAMI, _TTML, TIMED_TEXT, _SECTION)):
        return True
    lines = [line for line in head.splitlines() if line.strip()]
    # a number, or an identifier, may stand before the first times
    if any(map(TIMING.match, lines[:2])) or any(map(PAIR.match, lines[:HEAD_LINES])) or has_timed_lines(lines):
        return True
    if is_tmplayer(lines) or is_subviewer_1(lines):
        return True
    return any(
        any(map(line.match, lines)) and sum(bool(line.match(row) or _LRC_TAG.fullmatch(row)) for row in lines) >= share
        for _, line in _BY_LINES[1:]
        if (share := max(MIN_SHARE * len(lines), 2))
    )


def subtitle_format(text: str, suffix: str) -> str:
    """Format of the text of a subtitle file: by its content where that is unmistakable, else by its suffix."""
    head = text.lstrip("\ufeff \t\n")
    if head.startswith("WEBVTT"):
        return WEBVTT
    if _SAMI.match(head) or (_SAMI.search(head[:4000]) and not HAS_ARROW.search(head[:4000])):
        return SAMI
    if TIMED_TEXT.match(head):
        return YOUTUBE
    if _XML.match(text) or _SECTION.search(text):
        return TTML if _XML.match(text) else SUBSTATION
    named = SUFFIXES.get(suffix.lower(), SUBRIP)
    named = SUBRIP if named == EBU_STL else named  # which is no text
    has_arrow = HAS_ARROW.search(text) is not None
    if has_arrow or named in {SUBSTATION, TTML, YOUTUBE}:
        return SUBRIP if has_arrow and named != WEBVTT else named
    shown = _format_of_lines(text.split("\n", HEAD_LINES)[:HEAD_LINES])
    return shown or (TIMED_LINES if has_timed_lines(text.split("\n")) else named)


def _format_of_lines(lines: Sequence[str]) -> str | None:
    """Format whose instants stand in the first lines of a file; None without one."""
    sung = [match for line in lines if (match := LINE.match(line))]
    # [00:00:01] alone on its line is no line of a song
    if is_subviewer_1(lines) and not any(match["text"].strip() for match in sung):
        return SUBVIEWER_1
    found = next((name for name, line in _BY_LINES if any(line.match(written) for written in lines)), None)
    return found or (TMPLAYER if is_tmplayer(lines) else None)


def read_format(text: str, suffix: str, options: SubtitleOptions) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of the text of a subtitle file as they are written, and its defects."""
    kind = subtitle_format(text, suffix)
    if kind == TTML:
        return read_ttml(text)
    if kind == YOUTUBE:
        return read_timed_text(text)
    if kind == SAMI:
        return read_sami(text, options.language, options.track)
    lines = text.split("\n")
    if kind in {SUBRIP, WEBVTT}:
        lines, rate = without_frames(lines, options.fps)
        cues, warnings = read_webvtt(lines) if kind == WEBVTT else read_subrip(lines)
        if rate is not None and options.fps is None and cues:
            message = f"the times end in frames, which are taken for {rate:g} a second (--subtitle-fps)"
            warnings.append(SubtitleWarning(cues[0].line, message))
        return cues, warnings
    if kind == MICRODVD_NAME:
        return read_microdvd(lines, options.fps)
    return _BY_NAME[kind](lines)
