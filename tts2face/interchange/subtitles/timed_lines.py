"""Text with times in or above its lines: of Whisper on a terminal, of YouTube's list of words, of interviews.

``[00:00.000 --> 00:04.000] Hello``; ``0:05`` on a line of its own, or before the words of a line; ``Anna (0:05):``
above what she says.
"""

import re
from collections.abc import Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue

_CLOCK = r"(?:\d{1,3}:)?\d{1,2}:\d{2}(?:[.,]\d{1,6})?"
SPAN = re.compile(rf"\s*\[\s*({_CLOCK})\s*-->\s*({_CLOCK})\s*\]\s*(.*)")
_INSTANT = re.compile(rf"\s*[(\[]?(?P<at>{_CLOCK})[)\]]?(?:\s*[-–—|:]?\s+(.*)|\s*)")
_TURN = re.compile(rf"\s*(?P<name>[^\W\d_][^:()\[\]\d]{{0,40}}(?:\s\d{{1,2}})?)\s+[(\[]?(?P<at>{_CLOCK})[)\]]?:?\s*")
MIN_INSTANTS = 3  # of a text in which only their order shows that they are times
FIRST_S = 60.0  # before which speech begins; 9:00 begins a list of times of day
MIN_SHARE = 0.4  # of the lines; every second one, where instants stand alone
TURNS = (0.2, 0.6)  # share of the lines that name a speaker; below each are words


def has_timed_lines(lines: Sequence[str]) -> bool:
    """Whether a text begins with times in brackets, or with an instant that further lines have in order."""
    written = [line for line in lines if line.strip()]
    if not written:
        return False
    if SPAN.fullmatch(written[0]):
        return True
    instants, turns = _instants(_INSTANT, written), _instants(_TURN, written)
    if _TURN.fullmatch(written[0]):
        is_dense = TURNS[0] <= len(turns) / len(written) <= TURNS[1]
        return is_dense and len(turns) >= MIN_INSTANTS and turns[0] < FIRST_S and turns == sorted(turns)
    is_dense = len(instants) >= max(MIN_INSTANTS, MIN_SHARE * len(written))
    return (
        _INSTANT.fullmatch(written[0]) is not None
        and is_dense
        and instants[0] < FIRST_S
        and instants == sorted(set(instants))
    )


def _instants(form: re.Pattern[str], lines: Sequence[str]) -> list[float]:
    matches = (form.fullmatch(line) for line in lines)
    return [parse_clock(match["at"]) or 0.0 for match in matches if match]


def read_timed_lines(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of the lines; words after an instant last to the next one, and lines without a time belong to the cue."""
    first = next((line for line in lines if line.strip()), "")
    form = next((form for form in (SPAN, _TURN) if form.fullmatch(first)), _INSTANT)
    found: list[tuple[float, float | None, str, list[str], int]] = []
    for number, line in enumerate(lines, start=1):
        match = form.fullmatch(line)
        if match is None:
            if found:
                found[-1][3].append(line.strip())
        elif form is _TURN:
            found.append((parse_clock(match["at"]) or 0.0, None, " ".join(match["name"].split()), [], number))
        else:
            end = parse_clock(match[2]) if form is SPAN else None
            found.append((parse_clock(match[1]) or 0.0, end, "", [match[match.re.groups] or ""], number))
    ends = [end or (found[at + 1][0] if at + 1 < len(found) else None) for at, (_, end, *_) in enumerate(found)]
    cues = [
        WrittenCue(start, end, "\n".join(filter(None, texts)), number, speaker=name)
        for (start, _, name, texts, number), end in zip(found, ends, strict=True)
    ]
    return cues, []
