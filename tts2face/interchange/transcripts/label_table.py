"""Tables of labels as Audacity exports them: start, end and label in columns, frequencies in lines of their own."""

import re
from dataclasses import replace
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

_NUMBER = r"-?\d+(?:[.,]\d+)?"
_ROW = re.compile(rf"\s*({_NUMBER})\t\s*({_NUMBER})(?:\t(.*))?")
_SPACED_ROW = re.compile(r"\s*(\d+\.\d+) +(\d+\.\d+)(?: +(.*))?")  # numbers of words have no decimals
_SCORED = re.compile(
    r"(.*\S)(?:\t\s*-?\d[\d.,eE+-]*|\s+-?\d+\.\d+(?:[eE][+-]?\d+)?|\s+-\d+)\s*"
)  # bin -201.5, bin 0.98
_FREQUENCIES = re.compile(rf"\\\s*{_NUMBER}\s+{_NUMBER}\s*")
_NAMES = re.compile(r"\s*(?:start|begin|from|tmin|xmin|onset|time)\b[^\t]*\t.*", re.IGNORECASE)


def is_label_table(text: str) -> bool:
    """Whether each line holds two instants and a label, or the frequencies of the label above."""
    return bool(_rows(text))


def read_label_table(path: Path) -> list[Tier]:
    """The labels of a table, in seconds; labels of points have no length."""
    rows = _rows(read_text(path))
    if not rows:
        raise DataError(f"{path} is no table of labels (start, end and label in seconds, divided by tabs); correct it")
    return [Tier("", tuple(rows), all(row.start == row.end for row in rows), is_speech=True)]


def _rows(text: str) -> list[SpokenCue]:
    lines = [line for line in text.splitlines() if line.strip() and not _FREQUENCIES.fullmatch(line.strip())]
    if lines and _NAMES.fullmatch(lines[0]):
        lines = lines[1:]
    rows = []
    for line in lines:
        match = _ROW.fullmatch(line) or _SPACED_ROW.fullmatch(line)
        if match is None:
            return []
        start, end = (float(number.replace(",", ".")) for number in match.group(1, 2))
        if start > end:
            return []
        rows.append(SpokenCue(start, end, (match[3] or "").strip()))
    return _without_scores(rows)


def _without_scores(rows: list[SpokenCue]) -> list[SpokenCue]:
    """Rows without a column of confidences or likelihoods behind all labels."""
    scored = [_SCORED.fullmatch(row.text) for row in rows if row.text]
    if not scored or not all(scored):
        return rows
    return [replace(row, text=match[1]) if (match := _SCORED.fullmatch(row.text)) else row for row in rows]
