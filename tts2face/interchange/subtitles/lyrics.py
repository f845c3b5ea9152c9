"""LRC: lines of a song or speech after their instants, ``[00:12.30]Hello``; extended files have those of words."""

import re
from bisect import bisect_right
from collections.abc import Sequence

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import PLAIN_MARKUP

LINE = re.compile(r"\s*(?P<instants>(?:\[\d{1,4}:\d{1,2}(?:[.:]\d{1,3})?\]\s*)+)(?P<text>.*)")
_INSTANT = re.compile(r"\[(\d{1,4}:\d{1,2}(?:[.:]\d{1,3})?)\]")
_WORD = re.compile(r"<(\d{1,4}:\d{1,2}(?:[.:]\d{1,3})?)>")
_OFFSET = re.compile(r"\s*\[offset:\s*([+-]?\d{1,7})\s*\]", re.IGNORECASE)
_LANGUAGE = re.compile(r"\s*\[la(?:ng)?:\s*([A-Za-z]{2,3}(?:-[A-Za-z0-9]+)*)\s*\]", re.IGNORECASE)


def read_lyrics(lines: Sequence[str]) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of the lines, each up to an empty line after it or the instant that ends its words, where there is one.

    A positive offset, in milliseconds, shows the lines earlier.
    """
    offset, language = 0.0, None
    found: list[tuple[float, float | None, str, int]] = []
    for number, line in enumerate(lines, start=1):
        stated = _OFFSET.match(line)
        if stated:
            offset = int(stated[1]) / 1000.0
        named = _LANGUAGE.match(line)
        language = named[1] if named else language
        match = LINE.match(line)
        if match is None:
            continue
        words = match["text"].strip()
        last = _WORD.search(words, words.rfind("<")) if words.endswith(">") else None
        end = parse_clock(last[1]) if last else None
        text = " ".join(_WORD.sub("", words).split())
        starts = [parse_clock(instant) for instant in _INSTANT.findall(match["instants"])]
        found += [(start, end if len(starts) == 1 else None, text, number) for start in starts if start is not None]
    found.sort(key=lambda line: line[0])
    empty = [at for at, _, text, _ in found if not text]
    worded = [at for at, _, text, _ in found if text]
    cues = []
    for start, end, text, number in found:
        if text:
            until = end if end is not None else _next(empty, start)
            following = _next(worded, start)
            is_next = until is not None and (following is None or following >= until)
            cues.append(
                WrittenCue(
                    start - offset,
                    until - offset if until is not None and (is_next or end is not None) else None,
                    text,
                    number,
                    language=language,
                    markup=PLAIN_MARKUP,
                )
            )
    return cues, []


def _next(instants: Sequence[float], start: float) -> float | None:
    """The first of instants in order that is after `start`."""
    at = bisect_right(instants, start)
    return instants[at] if at < len(instants) else None
