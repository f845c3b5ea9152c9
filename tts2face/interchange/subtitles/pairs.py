"""YouTube's ``.sbv`` and SubViewer's ``.sub``: blocks of lines that start with two instants and a comma."""

import re
from collections.abc import Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import SUBRIP_MARKUP

_INSTANT = r"(-?\d{1,6}:\d{1,2}:\d{1,2}(?:[.,:]\d{1,3})?)"
PAIR = re.compile(rf"\s*{_INSTANT}\s*,\s*{_INSTANT}(?:\s+(?P<beside>[^\s,].*))?\s*$")
_BREAK = re.compile(r"\[br\]", re.IGNORECASE)


def read_pairs(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues between lines such as ``0:00:01.000,0:00:03.000``; what stands before the first one is a header."""
    warnings: list[SubtitleWarning] = []
    cues: list[WrittenCue] = []
    texts: list[str] = []
    at: tuple[float, float | None, int] | None = None
    for number, line in enumerate((*lines, ""), start=1):
        match = PAIR.match(line)
        if at is not None and (match or number > len(lines)):
            cues.append(WrittenCue(at[0], at[1], "\n".join(texts).strip(), at[2], markup=SUBRIP_MARKUP))
            at = None
        if match is None:
            texts.append(_BREAK.sub("\n", line))
            continue
        start, end = parse_clock(match[1]), parse_clock(match[2])
        if start is None:
            warnings.append(SubtitleWarning(number, f"the start {match[1]!r} cannot be read; the cue is left out"))
        else:
            at = start, end, number
        texts = [_BREAK.sub("\n", match["beside"])] if match["beside"] else []
    return cues, warnings
