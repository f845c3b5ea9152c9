"""Instants of subtitle files in seconds."""

import re

# Hours may be missing; point, comma or colon before the fraction; spaces inside, as faulty converters write them.
_CLOCK = r"(?:(-)\s*)?(?:(\d{1,6})\s*:\s*)?(\d{1,2})\s*:\s*(\d{1,2})(?:\s*[.,:;]\s*(\d{1,9}))?"
CLOCK = re.compile(_CLOCK)
_ARROW = r"\s*(?:-{1,3}\s*>|–+\s*>|—+\s*>|→)\s*"
TIMING = re.compile(rf"^\s*{_CLOCK}{_ARROW}(?:{_CLOCK})?(.*)$")
HAS_ARROW = re.compile(r"-{1,2}\s?>|[–—]>|→")


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
