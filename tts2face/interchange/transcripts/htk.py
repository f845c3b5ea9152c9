"""Label files ``.lab``: of HTK in units of 100 ns, in seconds, and of xlabel; plain words are text, as for the MFA."""

import re
from collections.abc import Sequence
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier
from tts2face.interchange.transcripts.tiers import has_phones

UNITS_PER_S = 10_000_000  # HTK Book, ch. 6: times are multiples of 100 ns
SHORTEST_S = 0.2  # of a file with words; shorter ones are in another unit
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_SCORE = re.compile(rf"{_NUMBER.pattern}|[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
MIN_ROWS = 2  # of a file that no ending names
MASTER_LABELS = "#!MLF!#"


def is_label_file(text: str) -> bool:
    """Whether a text has times, and is not the plain words of a recording."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if lines and (lines[0] == MASTER_LABELS or "#" in lines):
        return True
    return bool(lines) and all(len(_numbers(line)) >= 2 for line in lines)


def is_unnamed_label_file(text: str) -> bool:
    """Whether a text is a label file of HTK whatever its name: rows in order, in multiples of 100 us, and labels."""
    rows = [line.split() for line in text.splitlines() if line.strip()]
    if len(rows) < MIN_ROWS or not all(len(row) > 2 and row[0].isdecimal() and row[1].isdecimal() for row in rows):
        return False
    times = [int(number) for row in rows for number in row[:2]]
    return times == sorted(times) and times[-1] >= SHORTEST_S * UNITS_PER_S and not any(time % 1000 for time in times)


def read_lab(path: Path) -> list[Tier]:
    """Labels of a file, and in a tier of their own the words beside phones."""
    lines = [line.strip() for line in read_text(path).splitlines() if line.strip()]
    if lines and lines[0] == MASTER_LABELS:
        raise DataError(f"{path} is a master label file of many recordings; write a .lab for each of them")
    if "#" in lines:
        return [_xlabel(path, lines[lines.index("#") + 1 :])]
    times = [_numbers(line)[:2] for line in lines]
    is_seconds = any("." in number for pair in times for number in pair)
    scale = 1.0 if is_seconds else 1.0 / UNITS_PER_S
    spans = [(float(start) * scale, float(end) * scale) for start, end in times]
    if not is_seconds and max((end for _, end in spans), default=1.0) < SHORTEST_S:
        raise DataError(f"{path} has times that are neither seconds nor units of 100 ns; write seconds with decimals")
    notes = () if is_seconds else (f"times of {path.name} are read in units of 100 ns, as of HTK",)
    return _levels(spans, [line.split()[2:] for line in lines], notes)


def _levels(spans: Sequence[tuple[float, float]], rows: Sequence[Sequence[str]], notes: tuple[str, ...]) -> list[Tier]:
    """Tiers of labels, each with a score or without: phones, or states and phones, beside the words that they begin."""
    # numbers elsewhere are words: place red at f 2
    has_scores = all(_SCORE.fullmatch(row[1]) for row in rows if len(row) > 1) and max(map(len, rows), default=0) > 1
    scored = [_without_scores(row) if has_scores else list(row) for row in rows]
    n_levels = max(map(len, scored), default=0)
    first = Tier("phones", _begun(spans, scored, 0), notes=notes)
    if n_levels > 1 and (has_scores or has_phones(first)):
        words = Tier("words", _begun(spans, scored, n_levels - 1), notes=notes)
        between = [Tier(f"segments {at + 1}", _begun(spans, scored, at), notes=notes) for at in range(1, n_levels - 1)]
        return [words, *between, first]
    labels = (SpokenCue(*span, " ".join(text)) for span, text in zip(spans, scored, strict=True))
    return [Tier("", tuple(labels), notes=notes)]


def _without_scores(row: Sequence[str]) -> list[str]:
    """Labels of a row: its first field, and of the others those that are no numbers."""
    return [field for at, field in enumerate(row) if at == 0 or not _SCORE.fullmatch(field)]


def _begun(spans: Sequence[tuple[float, float]], rows: Sequence[Sequence[str]], level: int) -> tuple[SpokenCue, ...]:
    """Labels of a level, each up to the row in which the next one begins."""
    starts = [at for at, row in enumerate(rows) if len(row) > level]
    ends = [*starts[1:], len(rows)]
    return tuple(
        SpokenCue(spans[at][0], spans[end - 1][1], rows[at][level]) for at, end in zip(starts, ends, strict=True)
    )


def _numbers(line: str) -> list[str]:
    """The numbers with which a line begins."""
    fields = line.split()
    n_numbers = next((at for at, field in enumerate(fields) if not _NUMBER.fullmatch(field)), len(fields))
    return fields[:n_numbers]


def _xlabel(path: Path, lines: list[str]) -> Tier:
    """Labels of xlabel and Festival, each with its end and a colour."""
    start = 0.0
    labels = []
    for line in lines:
        fields = line.split(maxsplit=2)
        try:
            end = float(fields[0])
        except ValueError as wrong:
            raise DataError(f"{path}: {line[:60]!r} is not end, colour and label; correct it") from wrong
        labels.append(SpokenCue(start, end, fields[2].split(";")[0].strip() if len(fields) > 2 else ""))
        start = end
    return Tier("", tuple(labels))
