"""MicroDVD (``.sub``), whose times are frames, and MPL2, whose times are tenths of a second."""

import re
from collections.abc import Sequence

from lexicon.errors import DataError
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import BRACES_MARKUP
from tts2face.interchange.subtitles.timing import is_likely, is_possible

MICRODVD = re.compile(r"\s*\{(\d{1,9})\}\{(\d{0,9})\}(.*)")
MPL2 = re.compile(r"\s*\[(\d{1,9})\]\[(\d{0,9})\](.*)")
_RATE = re.compile(r"\s*(\d{1,3}(?:[.,]\d{1,6})?)\s*$")
USUAL_FPS = 25.0
RATE_LIMITS = (1.0, 240.0)  # frames a second
TENTHS = 10.0


def read_microdvd(lines: Sequence[str], fps: float | None) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of lines such as ``{25}{75}Hello.|Bye.``; where neither rate nor file states it, at 25 frames a second."""
    warnings: list[SubtitleWarning] = []
    first = next((match for line in lines if (match := MICRODVD.match(line))), None)
    stated = _RATE.match(first[3]) if first is not None and int(first[1]) <= 1 else None
    rate = fps
    if rate is None and stated is not None:
        rate = float(stated[1].replace(",", "."))
        rate = rate if RATE_LIMITS[0] <= rate <= RATE_LIMITS[1] else None
    cues = _cues(lines, MICRODVD, rate or USUAL_FPS, warnings, skips_rate=stated is not None)
    if not cues or (rate is not None and is_possible(cues)):
        return cues, warnings
    line = cues[0].line
    if is_possible(cues):
        message = "the times are frames of a film whose rate is not stated; 25 a second are taken (--subtitle-fps)"
        return cues, [*warnings, SubtitleWarning(line, message)]
    in_milliseconds = _cues(lines, MICRODVD, 1000.0, [], skips_rate=stated is not None)
    if is_likely(in_milliseconds):
        message = "the times would stand for minutes as frames; they are read as milliseconds"
        return in_milliseconds, [*warnings, SubtitleWarning(line, message)]
    raise DataError(
        f"line {line}: at {rate or USUAL_FPS:g} frames a second the times cannot be meant; give the film's rate "
        "as --subtitle-fps"
    )


def read_mpl2(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of lines such as ``[10][30]Hello.|Bye.``."""
    warnings: list[SubtitleWarning] = []
    return _cues(lines, MPL2, TENTHS, warnings, skips_rate=False), warnings


def _cues(
    lines: Sequence[str],
    pattern: "re.Pattern[str]",
    rate: float,
    warnings: list[SubtitleWarning],
    *,
    skips_rate: bool,
) -> list[WrittenCue]:
    cues: list[WrittenCue] = []
    for number, line in enumerate(lines, start=1):
        match = pattern.match(line)
        if match is None:
            if line.strip():
                warnings.append(SubtitleWarning(number, "this line has no times; it is left out"))
            continue
        if skips_rate and not cues and int(match[1]) <= 1 and _RATE.match(match[3]):
            continue
        # A slash at the start of a line makes it italic.
        text = "\n".join(part.removeprefix("/") for part in match[3].split("|"))
        end = float(match[2]) / rate if match[2] else None
        cues.append(WrittenCue(float(match[1]) / rate, end, text, number, markup=BRACES_MARKUP))
    return cues
