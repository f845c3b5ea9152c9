"""Instants of subtitle files in seconds."""

import re
from collections.abc import Sequence

# Hours may be missing; point, comma or colon before the fraction; spaces inside, as faulty converters write them.
_CLOCK = r"(?:(-)\s*)?(?:(\d{1,6})\s*:\s*)?(\d{1,2})\s*:\s*(\d{1,2})(?:\s*[.,:;]\s*(\d{1,9}))?"
CLOCK = re.compile(_CLOCK)
_ARROW = r"\s*(?:-{1,3}\s*>|–+\s*>|—+\s*>|→)\s*"
# The number of the cue may stand before its times.
_NUMBER = r"(?:#?\d{1,9}[.):]?\s+(?=-?\d{1,3}\s?:\s?\d{1,2}\s?:\s?\d))?"
TIMING = re.compile(rf"^\s*{_NUMBER}{_CLOCK}{_ARROW}(?:{_CLOCK})?(.*)$")
# A line of times, also a damaged one: a clock on one side of the arrow, or a number on both.
_ARROWS = r"(?:-{1,3}\s?>|[–—]\s?>|→)"
HAS_ARROW = re.compile(
    rf"^[^\S\n]{{0,20}}(?![\[{{])(?:\S{{0,20}}\d[^\S\n]{{0,3}}:[^\n]{{0,30}}?{_ARROWS}[^\S\n]{{0,9}}(?=[-\d]|$)"
    rf"|\S{{0,20}}[^\S\n]{{0,9}}{_ARROWS}[^\S\n]{{0,9}}-?\d{{1,6}}:\d"
    rf"|\d{{1,12}}[^\S\n]{{0,9}}{_ARROWS}[^\S\n]{{0,9}}\d{{1,12}}[^\S\n]{{0,9}}$)",
    re.MULTILINE,
)
# An instant whose last part counts frames: 00:00:01:12, and 00:00:01;12 of drop-frame counting.
_FRAMES = re.compile(r"(?<![\d:])(\d{1,3}):(\d\d):(\d\d)([:;])(\d\d)(?![\d:;])")


def clock_seconds(sign: str | None, hours: str | None, minutes: str, seconds: str, fraction: str | None) -> float:
    """Seconds of a clock reading; the fraction is decimal, whatever its number of digits."""
    # hours may be missing (WebVTT), and have any number of digits
    whole = int(hours or 0) * 3600 + int(minutes) * 60 + int(seconds)
    value = whole + float(f"0.{fraction or 0}")
    return -value if sign else value


def parse_clock(written: str) -> float | None:
    """Seconds of a clock reading such as ``0:01:02.50``; None if it cannot be read."""
    match = CLOCK.fullmatch(written.strip())
    return None if match is None else clock_seconds(*match.groups())


def without_frames(lines: Sequence[str], fps: float | None) -> tuple[list[str], float | None]:
    """Lines whose times have decimal seconds in place of frames, and the frames a second that were used.

    They are frames if all lines of times have such instants; the rate is None if none have. Without a rate it is 25 if
    no frame is above 24, else 30.
    """
    timed = [line for line in lines if HAS_ARROW.search(line) and ":" in line]
    numbers = [int(match[5]) for line in timed for match in _FRAMES.finditer(line)]
    if not numbers or len(numbers) < 2 * len(timed) or max(numbers) >= (fps or 60.0):
        return list(lines), None
    rate = fps or (25.0 if max(numbers) < 25 else 30.0 if max(numbers) < 30 else 60.0)
    return [
        _FRAMES.sub(lambda match: _decimal(match, rate), line) if HAS_ARROW.search(line) else line for line in lines
    ], rate


def _decimal(match: "re.Match[str]", fps: float) -> str:
    hours, minutes, seconds, separator, frames = match.groups()
    whole = int(hours) * 3600 + int(minutes) * 60 + int(seconds)
    # Drop-frame counting leaves out numbers so that its seconds are those of a clock.
    at = whole + int(frames) / fps if separator == ";" else (whole * round(fps) + int(frames)) / fps
    return f"{int(at // 3600)}:{int(at // 60 % 60):02d}:{at % 60:06.3f}"
