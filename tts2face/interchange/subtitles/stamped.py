"""TMPlayer and SubViewer 1: words after the instants at which they begin, up to an instant without words."""

import re
from collections.abc import Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import BRACES_MARKUP

# 00:00:01:Hello|there, 00:00:01=Hello, 00:00:01,2=second line, 00:00:01 Hello; not a clock with frames before another.
TMPLAYER = re.compile(
    r"\s*(?P<at>\d{1,2}:\d\d:\d\d)(?:,(?P<row>\d))?(?:[:=]|\s(?!\s*-?\d{1,2}:\d\d))"
    r"(?!\d{1,3}[\s,;]+\d{1,2}:\d\d)(?P<text>.*)"
)
STAMP = re.compile(r"\s*\[(?P<at>\d{1,2}:\d\d:\d\d)\]\s*$")
_ENDED = re.compile(r"\s*(?:\[end\]|\*{4,}.*\*{4,})\s*$", re.IGNORECASE)
_DELAY = re.compile(r"\s*\[delay\]\s*(?P<value>.*)", re.IGNORECASE)
_DELAYED = re.compile(r"[+-]?0*[1-9]")  # a delay that is not 0
MIN_SHARE = 0.8  # of the lines with words
_Timed = tuple[float, str, int]  # start in seconds, text, line


def is_tmplayer(lines: Sequence[str]) -> bool:
    """Whether lines begin with instants, nearly all of them."""
    worded = [line for line in lines if line.strip()]
    n_timed = sum(TMPLAYER.match(line) is not None for line in worded)
    return n_timed > 1 and n_timed >= MIN_SHARE * len(worded)


def is_subviewer_1(lines: Sequence[str]) -> bool:
    """Whether instants stand on lines of their own."""
    return sum(STAMP.match(line) is not None for line in lines) > 1


def read_tmplayer(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of lines such as ``00:00:01:Hello|there``; rows of one instant (``,1=``, ``,2=``) are lines of one cue."""
    warnings: list[SubtitleWarning] = []
    found: list[_Timed] = []
    for number, line in enumerate(lines, start=1):
        match = TMPLAYER.match(line)
        if match is None:
            warnings += [SubtitleWarning(number, "this line has no times; it is left out")] if line.strip() else []
            continue
        start, text = parse_clock(match["at"]) or 0.0, match["text"].strip().replace("|", "\n")
        if match["row"] and int(match["row"]) > 1 and found and found[-1][0] == start:
            found[-1] = (start, f"{found[-1][1]}\n{text}".strip(), found[-1][2])
        else:
            found.append((start, text, number))
    return _cues(found, is_shown_on=False), warnings


def read_subviewer_1(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of the lines after ``[00:00:01]``, each up to the next instant; what stands before the first is a header."""
    warnings: list[SubtitleWarning] = []
    found: list[_Timed] = []
    delay = ""
    for number, line in enumerate(lines, start=1):
        stamp, stated = STAMP.match(line), _DELAY.match(line)
        if stamp:
            found.append((parse_clock(stamp["at"]) or 0.0, "", number))
        elif found and not _ENDED.match(line):
            start, text, at = found[-1]
            found[-1] = (start, f"{text}\n{line.replace('|', chr(10))}".strip(), at)
        elif stated:
            delay = stated["value"] or (lines[number] if number < len(lines) else "")
    if _DELAYED.match(delay.strip()):
        message = f"the header states a delay of {delay.strip()[:20]}, which is not used; --shift moves the times"
        warnings.append(SubtitleWarning(1, message))
    return _cues(found, is_shown_on=True), warnings


def _cues(found: Sequence[_Timed], *, is_shown_on: bool) -> list[WrittenCue]:
    """Cues of what has words; `is_shown_on` says that they stand until the next ones."""
    following = [*found[1:], None]
    cues = []
    for (start, text, number), after in zip(found, following, strict=True):
        is_ended = after is not None and (is_shown_on or not after[1]) and after[0] > start
        if text:
            cues.append(WrittenCue(start, after[0] if after and is_ended else None, text, number, markup=BRACES_MARKUP))
    return cues
