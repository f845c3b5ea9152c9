"""Tables of labels: start, end and label in columns, as of Audacity, or in those that are named, as of Whisper."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from statistics import median

from lexicon.dictionary import word_set
from lexicon.errors import DataError
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.spoken import SpokenCue, Tier

MAX_WORD_S = 5.0  # of half of the words, in seconds; whole numbers above are milliseconds
_NUMBER = r"-?\d+(?:[.,]\d+)?"
_ROW = re.compile(rf"\s*({_NUMBER})\t\s*({_NUMBER})(?:\t(.*))?")
_SPACED_ROW = re.compile(r"\s*(\d+\.\d+) +(\d+\.\d+)(?: +(.*))?")  # numbers of words have no decimals
# a confidence or likelihood behind a label: bin -201.5
_SCORED = re.compile(r"(.*\S)(?:\t\s*-?\d[\d.,eE+-]*|\s+-?\d+\.\d+(?:[eE][+-]?\d+)?|\s+-\d+)\s*")
_FREQUENCIES = re.compile(rf"\\\s*{_NUMBER}\s+{_NUMBER}\s*")
# names of columns
_STARTS = word_set("start begin from tmin xmin onset time start_time starttime begin_time start_s start_ms")
_ENDS = word_set("end stop to tmax xmax offset end_time endtime stop_time end_s end_ms")
_WORDS = word_set("word words")
_TEXTS = word_set("text label labels transcript transcription utterance sentence value annotation content")
_PHONES = word_set("phone phones phoneme phonemes phon")
_TIERS = word_set("tier tiername")


def is_label_table(text: str) -> bool:
    """Whether each line holds two instants and a label, or the frequencies of the label above."""
    return bool(_rows(text))


def read_label_table(path: Path) -> list[Tier]:
    """The labels of a table, by the names of their tiers where it has them; labels of points have no length."""
    rows = _rows(read_text(path))
    if not rows:
        raise DataError(f"{path} is no table of labels (start, end and label in seconds, divided by tabs); correct it")
    tiers: dict[str, list[SpokenCue]] = {}
    for name, cue in rows:
        tiers.setdefault(name, []).append(cue)
    rate, notes = _unit(path, [cue for _, cue in rows])
    return [
        Tier(
            name,
            tuple(replace(cue, start=cue.start / rate, end=cue.end / rate) for cue in cues),
            all(cue.start == cue.end for cue in cues),
            is_speech=not name,
            notes=notes,
        )
        for name, cues in tiers.items()
    ]


def _unit(path: Path, cues: Sequence[SpokenCue]) -> tuple[float, tuple[str, ...]]:
    """Units a second of the times, and a note where they are no seconds."""
    lasting = [(cue.end - cue.start) / n_words for cue in cues if (n_words := len(cue.text.split()))]
    is_whole = all(time.is_integer() for cue in cues for time in (cue.start, cue.end))
    if not is_whole or not lasting or median(lasting) <= MAX_WORD_S:
        return 1.0, ()
    reason = f"as seconds half of its words last {median(lasting):g} s"
    return 1000.0, (f"times of {path.name} are read as milliseconds: {reason}",)


def _rows(text: str) -> list[tuple[str, SpokenCue]]:
    """Labels with the names of their tiers, which are empty without a column of them; none of another text."""
    lines = [line for line in text.splitlines() if line.strip() and not _FREQUENCIES.fullmatch(line.strip())]
    columns = _columns(lines[0]) if lines else None
    try:
        rows = list(_of_columns(lines[1:], columns) if columns else _unnamed(lines))
    except ValueError:
        return []
    return [] if any(cue.start > cue.end for _, cue in rows) else rows


def _columns(line: str) -> dict[str, int] | None:
    """Places of the columns of a line of names; None for another line."""
    names = [name.strip("\ufeff \"'").lower().replace(" ", "_") for name in line.split("\t")]
    kinds = {"start": _STARTS, "end": _ENDS, "word": _WORDS, "text": _TEXTS, "tier": _TIERS, "phone": _PHONES}
    found = {
        kind: next(at for at, name in enumerate(names) if name in of)
        for kind, of in kinds.items()
        if any(name in of for name in names)
    }
    text = found.get("word", found.get("text", found.get("phone")))
    return found | {"text": text} if {"start", "end"} <= set(found) and text is not None else None


def _of_columns(lines: Sequence[str], columns: dict[str, int]) -> Iterator[tuple[str, SpokenCue]]:
    rows = [line.split("\t") for line in lines]
    if any(len(row) <= max(columns["start"], columns["end"]) for row in rows):
        raise ValueError

    def field(row: Sequence[str], kind: str) -> str:
        at = columns.get(kind, len(row))
        return row[at].strip() if at < len(row) else ""

    cues = [SpokenCue(_number(field(row, "start")), _number(field(row, "end")), field(row, "text")) for row in rows]
    phones = [field(row, "phone") for row in rows]
    if "phone" not in columns:
        yield from ((field(row, "tier"), cue) for row, cue in zip(rows, cues, strict=True))
        return
    yield from (("phones", replace(cue, text=phone)) for cue, phone in zip(cues, phones, strict=True))
    if columns["text"] != columns["phone"]:
        yield from (("words", word) for word in _beside_phones(cues, phones))


def _beside_phones(cues: Sequence[SpokenCue], phones: Sequence[str]) -> Iterator[SpokenCue]:
    """Words that stand beside each of their phones, once; said twice, their phones recur."""
    for _, group in groupby(range(len(cues)), lambda at: cues[at].text):
        run = list(group)
        said = [phones[at] for at in run]
        n_times = next(n for n in range(len(run), 0, -1) if len(run) % n == 0 and said == said[: len(run) // n] * n)
        length = len(run) // (n_times if cues[run[0]].text else 1)
        for first in run[::length]:
            yield SpokenCue(cues[first].start, cues[first + length - 1].end, cues[first].text)


def _unnamed(lines: Sequence[str]) -> Iterator[tuple[str, SpokenCue]]:
    matches = [_ROW.fullmatch(line) or _SPACED_ROW.fullmatch(line) for line in lines]
    rows = [match.groups(default="") for match in matches if match]
    if len(rows) < len(lines):
        raise ValueError
    scored = [_SCORED.fullmatch(text) for _, _, text in rows if text.strip()]
    has_scores = bool(scored) and all(scored)
    for start, end, text in rows:
        match = _SCORED.fullmatch(text) if has_scores else None
        yield "", SpokenCue(_number(start), _number(end), (match[1] if match else text).strip())


def _number(written: str) -> float:
    if not re.fullmatch(_NUMBER, written.strip()):
        raise ValueError
    return float(written.strip().replace(",", "."))
