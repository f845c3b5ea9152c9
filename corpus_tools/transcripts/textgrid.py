"""Praat TextGrids, long or short: the intervals of the tier that holds the words."""

import re
from collections.abc import Iterator
from pathlib import Path

from corpus_tools.recordings.subtitles import Cue
from corpus_tools.transcripts.decoding import read_text
from lexicon.errors import DataError

SILENT_LABELS = frozenset({"", "sil", "sp", "spn", "<p:>", "<sil>", "pau", "#"})
# Outside quotes only numbers count; names, brackets and comments are for people (Praat manual, "TextGrid file format").
_TOKEN = re.compile(r'"(?P<label>(?:[^"]|"")*)"|\[[^\]\n]*\]|!.*|(?<![\w.])(?P<number>-?\d+(?:\.\d+)?)(?![\w.])')
_TIER_ENTRY_SIZES = {"IntervalTier": 3, "TextTier": 2}  # entries of one interval or point


def read_textgrid(path: Path) -> tuple[Cue, ...]:
    """The intervals of the tier of words: of a name that contains "word", else of the first tier of intervals.

    Raises
    ------
    DataError
        It is no TextGrid, is cut short, or holds no word.
    """
    items = _split_items(read_text(path))
    if list(items[:2]) != ["ooTextFile", "TextGrid"]:
        raise DataError(f"{path} is no TextGrid; save it with Praat as text")
    try:
        tiers = list(_read_tiers(iter(items[5:])))
    except (StopIteration, RuntimeError, TypeError, ValueError, OverflowError, KeyError) as broken:
        raise DataError(f"{path} is a damaged TextGrid; save it with Praat again") from broken
    named = [cues for name, cues in tiers if "word" in name.lower()]
    spoken = next(iter(named or [cues for _, cues in tiers]), ())
    found = tuple(cue for cue in spoken if cue.text.lower() not in SILENT_LABELS)
    if not found:
        raise DataError(f"{path} holds no interval with a word; check the file")
    return found


def _split_items(text: str) -> list[str | float]:
    """Labels and numbers in order."""
    items: list[str | float] = []
    for match in _TOKEN.finditer(text):
        if match["label"] is not None:
            items.append(match["label"].replace('""', '"'))
        elif match["number"] is not None:
            items.append(float(match["number"]))
    return items


def _read_tiers(items: Iterator[str | float]) -> Iterator[tuple[str, tuple[Cue, ...]]]:
    """Name and cues of each tier of intervals; tiers of points are read over."""
    for kind in items:
        name, _, _, size = (next(items) for _ in range(4))
        rows = [[next(items) for _ in range(_TIER_ENTRY_SIZES[str(kind)])] for _ in range(int(size))]
        if kind == "IntervalTier":
            yield str(name), tuple(_parse_cue(*row) for row in rows)


def _parse_cue(start: str | float, end: str | float, label: str | float) -> Cue:
    if not isinstance(label, str) or not 0 <= float(start) < float(end):
        raise ValueError(label)
    return Cue(float(start), float(end), label.strip())
