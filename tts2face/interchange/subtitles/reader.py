"""Reading of subtitle files: SubRip, WebVTT, SubStation Alpha and TTML, with warnings in place of refusals.

How the next format is made:

1. Write a function from the lines of a file to `WrittenCue` objects and `SubtitleWarning` objects in a module of its
   own here, as `tts2face.interchange.subtitles.substation` does; a DataError only where nothing can be read.
2. Name the format below, with its endings in `SUFFIXES`, recognise its content in `subtitle_format`, and call the
   function in `_read`; order, missing ends and speakers are the same for all formats.
3. Say in docs/subtitles.md what is read of it, and add its file and its defects to tests/interchange/subtitles.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.blocks import read_subrip, read_webvtt
from tts2face.interchange.subtitles.clock import HAS_ARROW
from tts2face.interchange.subtitles.cues import Cue, Subtitles, SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.subtitles.spoken_text import spoken_text
from tts2face.interchange.subtitles.substation import read_substation
from tts2face.interchange.subtitles.ttml import read_ttml

SUBRIP = "SubRip"
WEBVTT = "WebVTT"
SUBSTATION = "SubStation Alpha"
TTML = "TTML"
SUFFIXES = {
    ".srt": SUBRIP,
    ".vtt": WEBVTT,
    ".ass": SUBSTATION,
    ".ssa": SUBSTATION,
    ".ttml": TTML,
    ".dfxp": TTML,
    ".itt": TTML,
    ".xml": TTML,
}
CHARACTERS_PER_S = 15.0  # of speech; for the end of a cue whose own end is missing
MIN_ESTIMATED_S = 1.0
MAX_S = 1e6  # 11 days; larger times are damaged
_XML = re.compile(r"\s*<(?:\?xml|!DOCTYPE|!--|(?:\w+:)?tt[\s>])")
_SECTION = re.compile(r"^\s*\[(?:Script Info|V4\+? Styles|Events)\]", re.IGNORECASE | re.MULTILINE)


def read_subtitles(path: Path | str, encoding: str | None = None) -> Subtitles:
    """Cues of a subtitle file in order of time, and warnings of its defects.

    The content decides the format where it is unmistakable, else the suffix. Defects are read as players do and
    reported with their lines: missing blank lines and numbers, unreadable times, cues out of order, ends before begins,
    overlaps, duplicates, missing headers.

    Parameters
    ----------
    encoding
        Encoding of text that is neither UTF-8 nor marked; None: Windows 1252.

    Raises
    ------
    InputError
        There is no such encoding.
    DataError
        The file cannot be read or contains no cue.
    """
    path = Path(path)
    text = read_text(path, encoding).replace("\r\n", "\n").replace("\r", "\n")
    try:
        written, warnings = _read(text, path)
    except DataError as wrong:
        raise DataError(f"{path}, {wrong}") from wrong
    cues = _timed(_ordered(written, warnings), warnings)
    if not cues:
        raise DataError(f"{path} contains no subtitles; export them again")
    return Subtitles(path, cues, tuple(sorted(warnings, key=lambda warning: warning.line)))


def subtitle_format(text: str, suffix: str) -> str:
    """Format of the text of a subtitle file: by its content where that is unmistakable, else by its suffix."""
    head = text.lstrip("\ufeff \t\n")
    if head.startswith("WEBVTT"):
        return WEBVTT
    if _XML.match(text):
        return TTML
    if _SECTION.search(text):
        return SUBSTATION
    named = SUFFIXES.get(suffix.lower(), SUBRIP)
    return SUBRIP if named in (SUBSTATION, TTML) and HAS_ARROW.search(text) else named


def _read(text: str, path: Path) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    kind = subtitle_format(text, path.suffix)
    if kind == TTML:
        return read_ttml(text)
    lines = text.split("\n")
    if kind == SUBSTATION:
        return read_substation(lines)
    return read_webvtt(lines) if kind == WEBVTT else read_subrip(lines)


def _ordered(written: Sequence[WrittenCue], warnings: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues in order of time, without duplicates and without times that no film has."""
    kept: list[WrittenCue] = []
    latest, seen = 0.0, set()
    for cue in written:
        if cue.begin_s > MAX_S:
            warnings.append(SubtitleWarning(cue.line, f"the start {cue.begin_s:.0f} s is damaged; the cue is left out"))
            continue
        if cue.begin_s < 0:
            warnings.append(SubtitleWarning(cue.line, "the start is negative; the cue begins at 0 s"))
            cue = replace(cue, begin_s=0.0)  # noqa: PLW2901 - the corrected cue
        if cue.begin_s < latest:
            warnings.append(SubtitleWarning(cue.line, "this cue begins before the one above it; cues are sorted"))
        # milliseconds, as files have them
        key = (round(cue.begin_s, 3), cue.text)
        if key in seen:
            warnings.append(SubtitleWarning(cue.line, "this cue repeats another one; it is left out"))
            continue
        seen.add(key)
        latest = max(latest, cue.begin_s)
        kept.append(cue)
    return sorted(kept, key=lambda cue: cue.begin_s)


def _timed(written: Sequence[WrittenCue], warnings: list[SubtitleWarning]) -> tuple[Cue, ...]:
    cues: list[Cue] = []
    for number, cue in enumerate(written, start=1):
        text = spoken_text(cue.text)
        following = written[number].begin_s if number < len(written) else None
        end = cue.end_s
        is_estimated = end is None or end <= cue.begin_s or end > MAX_S
        if is_estimated:
            if end is not None:
                warnings.append(SubtitleWarning(cue.line, "the cue ends before it begins; its end is estimated"))
            end = _estimated_end(cue.begin_s, following, text.spoken or text.shown)
        # an end that is the next start differs by rounding at most
        elif following is not None and end is not None and end > following + 1e-6:
            message = f"this cue overlaps the next one by {end - following:.2f} s"
            warnings.append(SubtitleWarning(cue.line, message))
        parts = text.parts if len(text.parts) > 1 else ()
        if parts and not parts[0].speaker:
            parts = (replace(parts[0], speaker=cue.speaker), *parts[1:])
        cues.append(
            Cue(number, cue.begin_s, end or 0.0, text.spoken, cue.line, text.shown, text.speaker or cue.speaker,
                cue.style, cue.language, is_estimated, parts)
        )  # fmt: skip
    return tuple(cues)


def _estimated_end(start: float, following: float | None, text: str) -> float:
    """End of a cue by the length of its text, but not after the start of the next one."""
    end = start + max(MIN_ESTIMATED_S, len(text) / CHARACTERS_PER_S)
    return min(end, following) if following is not None and following > start else end
