"""The table of lines: rate, voice and offset of single lines of subtitles, read from CSV and written with the plan.

A line is a cue, or one speaker's part of it. A table that was written is read back to the same plan.
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.marked_text import RATE_LIMITS
from lexicon.values.checks import check_limits
from lexicon.values.fields import check_fields
from lexicon.values.tables import parse_cell, read_table
from tts2face.sound.voice_urls import refuse_voice_url
from tts2face.storage.files import write_atomically

MAX_TABLE_BYTES = 16 << 20  # 100,000 lines have 10 MB
MAX_OFFSET_S = 60.0  # s; a larger one is a time of the film
SETTINGS = ("spoken", "rate", "voice", "offset_s")  # columns that are read; the others tell where a line is
COLUMNS = (
    "file", "cue", "part", "begin_s", "end_s", "speaker", "text", *SETTINGS, "face", "used_voice", "used_rate",
    "speech_s", "overflow_s", "overlap_s", "cut_s",
)  # fmt: skip
_SPOKEN = MappingProxyType({"": None, "yes": True, "no": False})
Place = tuple[Path, int]  # a table and a row of it
LineKey = tuple[str, int, int]  # name of the file, number of the cue, part of it: 0, or from 1


@dataclass(frozen=True, slots=True)
class LineSettings:
    """Settings of one line; None: those of its role.

    Parameters
    ----------
    is_spoken
        Whether it is spoken.
    rate
        Speaking rate, which is kept however long the line is.
    offset_s
        Seconds by which it begins and ends later than its cue.
    """

    is_spoken: bool | None = None
    rate: float | None = None
    voice: str | None = None
    offset_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)


NO_SETTINGS = LineSettings()


@dataclass(frozen=True, slots=True)
class Lines:
    """Settings of single lines; `name` is that of the table, in errors."""

    name: str = "the table of lines"
    settings: Mapping[LineKey, LineSettings] = field(default_factory=dict)

    def of(self, file: str, cue: int, part: int = 0) -> LineSettings:
        """Settings of a line."""
        return self.settings.get((file, cue, part), NO_SETTINGS)

    def check(self, known: Iterable[LineKey]) -> None:
        """Refuse settings of lines that the subtitles do not have.

        Raises
        ------
        DataError
            There is no such line; the message names it.
        """
        for file, cue, part in self.settings.keys() - set(known):
            where = f"part {part} of cue {cue}" if part else f"cue {cue}"
            raise DataError(f"{self.name}: {file} has no {where} with words; correct or remove the row")


def read_lines(path: Path, names: Sequence[str]) -> Lines:
    """Settings of the lines in a table: CSV with commas, semicolons or tabs, whose first row names the columns.

    Parameters
    ----------
    names
        Names of the subtitle files; of a single one the column ``file`` may be missing.

    Raises
    ------
    DataError
        It cannot be read, has no column ``cue``, a column that is not known or is there twice, more cells than columns,
        two rows of one line, or a value that cannot be used; the message names the row.
    """
    rows = read_table(path, MAX_TABLE_BYTES, delimiters=",;\t")
    columns = [name.strip().lower() for name in rows[0]] if rows else []
    _check_columns(path, columns)
    found: dict[LineKey, LineSettings] = {}
    for number, cells in enumerate(rows[1:], start=2):
        if any(map(str.strip, cells[len(columns) :])):
            raise DataError(
                f"{path}, line {number}: there are more cells than columns; put values with separators into quotes"
            )
        row = dict(zip(columns, (cell.strip() for cell in cells), strict=False))
        key = _key(row, names, (path, number))
        if key in found:
            raise DataError(f"{path}, line {number}: cue {key[1]} has a row already; remove one of them")
        found[key] = _settings(row, (path, number))
    return Lines(str(path), {key: settings for key, settings in found.items() if settings != NO_SETTINGS})


def _check_columns(path: Path, columns: Sequence[str]) -> None:
    named = [name for name in columns if name]
    if "cue" not in columns:
        raise DataError(f"{path}: there is no column cue; the first row names the columns: {', '.join(COLUMNS)}")
    unknown = next((name for name in named if name not in COLUMNS), None)
    if unknown is not None:
        raise DataError(f"{path}: there is no column {unknown[:40]}; a column is one of {', '.join(COLUMNS)}")
    twice = next((name for name in named if named.count(name) > 1), None)
    if twice is not None:
        raise DataError(f"{path}: the column {twice} is there twice; remove one of them")


def _key(row: Mapping[str, str], names: Sequence[str], place: Place) -> LineKey:
    written = row.get("file", "") or (names[0] if len(names) == 1 else "")
    file = written if written in names else Path(written).stem
    if file not in names:
        raise DataError(f"{_shown(place)}: there is no subtitle file {written!r}; it is one of {', '.join(names)}")
    cue, part = parse_cell(row.get("cue", ""), *place), parse_cell(row.get("part") or "0", *place)
    if cue < 1 or cue != int(cue) or part < 0 or part != int(part):
        raise DataError(f"{_shown(place)}: cue must be a whole number from 1, and part one from 0")
    return file, int(cue), int(part)


def _settings(row: Mapping[str, str], place: Place) -> LineSettings:
    spoken, rate, voice, offset = (row.get(name, "") for name in SETTINGS)
    if spoken.lower() not in _SPOKEN:
        raise DataError(f"{_shown(place)}: spoken must be yes, no or empty, not {spoken[:20]!r}")
    refuse_voice_url(voice, _shown(place))
    settings = LineSettings(
        _SPOKEN[spoken.lower()],
        parse_cell(rate.replace(",", "."), *place) if rate else None,  # as spreadsheets of many countries write it
        voice or None,
        parse_cell(offset.replace(",", "."), *place, "seconds") if offset else 0.0,
    )
    try:
        if settings.rate is not None:
            check_limits("rate", settings.rate, RATE_LIMITS)
        check_limits("offset_s", settings.offset_s, (-MAX_OFFSET_S, MAX_OFFSET_S))
    except InputError as wrong:
        raise DataError(f"{_shown(place)}: {wrong}") from wrong
    return settings


def _shown(place: Place) -> str:
    return f"{place[0]}, line {place[1]}"


def write_lines(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a table of lines, whose rows have `COLUMNS`; the file appears when it is complete."""
    table = StringIO(newline="")
    writer = csv.DictWriter(table, COLUMNS, restval="")
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, ("\ufeff" + table.getvalue()).encode())  # by this mark spreadsheets read it as UTF-8
