"""Label files ``.lab``: of HTK in units of 100 ns, in seconds, and of xlabel; plain words are text, as for the MFA."""

import re
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

UNITS_PER_S = 10_000_000  # HTK Book, ch. 6: times are multiples of 100 ns
SHORTEST_S = 0.2  # of a file with words; shorter ones are in another unit
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
MASTER_LABELS = "#!MLF!#"


def is_label_file(text: str) -> bool:
    """Whether a text has times, and is not the plain words of a recording."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if lines and (lines[0] == MASTER_LABELS or "#" in lines):
        return True
    return bool(lines) and all(len(_numbers(line)) >= 2 for line in lines)


def read_lab(path: Path) -> list[Tier]:
    """Labels of a file, and in a tier of their own the words beside phones."""
    lines = [line.strip() for line in read_text(path).splitlines() if line.strip()]
    if lines and lines[0] == MASTER_LABELS:
        raise DataError(f"{path} is a master label file of many recordings; write a .lab for each of them")
    if "#" in lines:
        return [_xlabel(path, lines[lines.index("#") + 1 :])]
    rows = [line.split() for line in lines]
    times = [_numbers(line)[:2] for line in lines]
    is_seconds = any("." in number for pair in times for number in pair)
    scale = 1.0 if is_seconds else 1.0 / UNITS_PER_S
    spans = [(float(start) * scale, float(end) * scale) for start, end in times]
    if not is_seconds and max((end for _, end in spans), default=1.0) < SHORTEST_S:
        raise DataError(f"{path} has times that are neither seconds nor units of 100 ns; write seconds with decimals")
    notes = () if is_seconds else (f"times of {path.name} are read in units of 100 ns, as of HTK",)
    labels = [SpokenCue(start, end, " ".join(_text(row))) for (start, end), row in zip(spans, rows, strict=True)]
    tiers = [Tier("", tuple(labels), notes=notes)]
    # start, end, phone, score, word: the word stands beside its first phone
    words = [(at, row[4]) for at, row in enumerate(rows) if len(row) > 4 and _NUMBER.fullmatch(row[3])]
    if words:
        ends = [at for at, _ in words[1:]] + [len(rows)]
        spoken = [SpokenCue(spans[at][0], spans[end - 1][1], word) for (at, word), end in zip(words, ends, strict=True)]
        tiers = [Tier("words", tuple(spoken), notes=notes), Tier("phones", tuple(labels), notes=notes)]
    return tiers


def _numbers(line: str) -> list[str]:
    """The numbers with which a line begins."""
    fields = line.split()
    n_numbers = next((at for at, field in enumerate(fields) if not _NUMBER.fullmatch(field)), len(fields))
    return fields[:n_numbers]


def _text(row: list[str]) -> list[str]:
    """Words of a row without its score."""
    return row[2:3] if len(row) > 3 and _NUMBER.fullmatch(row[3]) else row[2:]


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
