"""Lines of text with their times in plain text: of Whisper on a terminal, of YouTube's list of a video's words.

``[00:00.000 --> 00:04.000] Hello``; ``0:05`` on a line of its own, or before the words of a line.
"""

import re
from collections.abc import Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue

_CLOCK = r"(?:\d{1,3}:)?\d{1,2}:\d{2}(?:[.,]\d{1,6})?"
SPAN = re.compile(rf"\s*\[\s*({_CLOCK})\s*-->\s*({_CLOCK})\s*\]\s*(.*)")
_INSTANT = re.compile(rf"\s*[(\[]?({_CLOCK})[)\]]?(?:\s*[-–—|:]?\s+(.*)|\s*)")
MIN_INSTANTS = 3  # of a text in which only their order shows that they are times
FIRST_S = 60.0  # before which speech begins; 9:00 begins a list of times of day
MIN_SHARE = 0.4  # of the lines; every second one, where instants stand alone


def has_timed_lines(lines: Sequence[str]) -> bool:
    """Whether a text begins with times in brackets, or with an instant that further lines have in order."""
    written = [line for line in lines if line.strip()]
    if not written:
        return False
    if SPAN.fullmatch(written[0]):
        return True
    matches = [match for line in written if (match := _INSTANT.fullmatch(line))]
    instants = [parse_clock(match[1]) or 0.0 for match in matches]
    return (
        _INSTANT.fullmatch(written[0]) is not None
        and len(instants) >= max(MIN_INSTANTS, MIN_SHARE * len(written))
        and instants[0] < FIRST_S
        and instants == sorted(set(instants))
    )


def read_timed_lines(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of the lines; words after an instant last to the next one, and lines without a time belong to the cue."""
    is_spans = any(map(SPAN.fullmatch, lines))
    found: list[tuple[float, float | None, list[str], int]] = []
    for number, line in enumerate(lines, start=1):
        match = (SPAN if is_spans else _INSTANT).fullmatch(line)
        if match is None:
            if found:
                found[-1][2].append(line.strip())
            continue
        start, end = parse_clock(match[1]), parse_clock(match[2]) if is_spans else None
        found.append((start or 0.0, end, [match[match.re.groups] or ""], number))
    ends = [end or (found[at + 1][0] if at + 1 < len(found) else None) for at, (_, end, _, _) in enumerate(found)]
    cues = [
        WrittenCue(start, end, "\n".join(filter(None, texts)), number)
        for (start, _, texts, number), end in zip(found, ends, strict=True)
    ]
    return cues, []
