"""Transcripts of videos: Praat TextGrids, word alignments of the GRID corpus, subtitles and plain text.

The next format:

1. a function from the path of a file to its `SpokenCue` objects, with a DataError where it has no word;
2. its row in `READERS`, by its ending; files are found beside videos in the order of the rows;
3. its name in docs/recordings.md, and its file in ``tests/corpus_tools/test_transcripts.py``.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from corpus_tools.recordings.subtitle_cues import SUBTITLE_SUFFIXES, SpokenCue, read_cues
from lexicon.errors import DataError
from tts2face.interchange.subtitles.decoding import read_text

SILENT_LABELS = frozenset({"", "sil", "sp", "spn", "<p:>", "<sil>", "pau", "#"})
# Outside quotes only numbers have a meaning (Praat manual, "TextGrid file format").
_TOKEN = re.compile(r'"(?P<label>(?:[^"]|"")*)"|\[[^\]\n]*\]|!.*|(?<![\w.])(?P<number>-?\d+(?:\.\d+)?)(?![\w.])')
_TIER_ENTRY_SIZES = {"IntervalTier": 3, "TextTier": 2}  # entries of one interval or point
UNITS_PER_S = 25_000  # Cooke et al. 2006: samples of the 25 kHz sound
TEXT_SUFFIX = ".txt"


def read_textgrid(path: Path) -> tuple[SpokenCue, ...]:
    """The intervals of the first tier whose name contains "word", or else of the first interval tier."""
    items = _split_items(read_text(path))
    # also of the short form, which has the same items without names
    if list(items[:2]) != ["ooTextFile", "TextGrid"]:
        raise DataError(f"{path} is not a TextGrid; save it with Praat as text")
    try:
        tiers = list(_read_tiers(iter(items[5:])))
    except (StopIteration, RuntimeError, TypeError, ValueError, OverflowError, KeyError) as broken:
        raise DataError(f"{path} is a damaged TextGrid; save it with Praat again") from broken
    named = [cues for name, cues in tiers if "word" in name.lower()]
    spoken = next(iter(named or [cues for _, cues in tiers]), ())
    found = tuple(cue for cue in spoken if cue.text.lower() not in SILENT_LABELS)
    if not found:
        raise DataError(f"{path} has no interval with a word; check the file")
    return found


def _split_items(text: str) -> list[str | float]:
    """Labels and numbers in order."""
    items: list[str | float] = []
    for match in _TOKEN.finditer(text):
        if match["label"] is not None:
            # Praat doubles quotes within texts
            items.append(match["label"].replace('""', '"'))
        elif match["number"] is not None:
            items.append(float(match["number"]))
    return items


def _read_tiers(items: Iterator[str | float]) -> Iterator[tuple[str, tuple[SpokenCue, ...]]]:
    """Name and cues of each interval tier; point tiers are skipped."""
    for kind in items:
        name, _, _, size = (next(items) for _ in range(4))
        rows = [[next(items) for _ in range(_TIER_ENTRY_SIZES[str(kind)])] for _ in range(int(size))]
        if kind == "IntervalTier":
            yield str(name), tuple(_parse_cue(*row) for row in rows)


def _parse_cue(start: str | float, end: str | float, label: str | float) -> SpokenCue:
    if not isinstance(label, str) or not 0 <= float(start) < float(end):
        raise ValueError(label)
    return SpokenCue(float(start), float(end), label.strip())


def read_word_times(path: Path) -> tuple[SpokenCue, ...]:
    """Words and times of an .align file (start, end and word per line, in units of 1/25000 s), without silences.

    Raises
    ------
    DataError
        A line is malformed, or there is no word.
    """
    cues = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields:
            continue
        if len(fields) != 3 or not (fields[0].isdecimal() and fields[1].isdecimal()):
            raise DataError(f"{path}, line {number}: {line[:60]!r} is not start, end and word; correct it")
        # GRID's transcripts list silences as words
        if fields[2].lower() not in SILENT_LABELS:
            cues.append(SpokenCue(int(fields[0]) / UNITS_PER_S, int(fields[1]) / UNITS_PER_S, fields[2]))
    if not cues:
        raise DataError(f"{path} contains no word; check the file")
    return tuple(cues)


READERS = {".textgrid": read_textgrid, ".align": read_word_times, **dict.fromkeys(SUBTITLE_SUFFIXES, read_cues)}


def find_transcript(video: Path) -> Path | None:
    """The transcript beside a video, in order of preference text, TextGrid, word times, subtitles; None without one."""
    beside = {path.suffix.lower(): path for path in sorted(video.parent.iterdir()) if path.stem == video.stem}
    return next((beside[suffix] for suffix in (TEXT_SUFFIX, *READERS) if suffix in beside), None)


def read_transcript(transcript: Path) -> str:
    """All words of a transcript, in order."""
    suffix = transcript.suffix.lower()
    if suffix == TEXT_SUFFIX:
        return read_text(transcript)
    return " ".join(cue.text for cue in READERS[suffix](transcript))
