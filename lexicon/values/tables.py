"""Bounded reading of tables: CSV files and the numbers in their cells."""

import csv
import math
from io import StringIO
from pathlib import Path

from lexicon.errors import DataError
from lexicon.values.files import read_text

LARGEST_TABLE_BYTES = 200_000_000  # an hour of Live Link Face at 60 frames/s takes 180 MB


def read_table(path: Path, largest: int = LARGEST_TABLE_BYTES, delimiters: str = ",") -> list[list[str]]:
    """Rows of a CSV file, without empty ones, divided by the delimiter that its first row has most, or states.

    Raises
    ------
    DataError
        It cannot be read, contains more than `largest` bytes, or is not CSV in UTF-8.
    """
    try:
        return parse_table(read_text(path, largest), delimiters)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    except csv.Error as broken:
        raise DataError(f"{path} is not a CSV file ({broken}); export it again") from broken


def parse_table(text: str, delimiters: str = ",") -> list[list[str]]:
    """Rows of a table, as `read_table` divides them (csv.Error: it is none)."""
    heading, _, rest = text.partition("\n")
    # the first line in which Excel states the delimiter
    if (stated := heading.strip().strip('"').lower()).startswith("sep=") and len(stated) == 5:
        delimiters, text = stated[-1], rest
    delimiter = max(delimiters, key=text.lstrip().partition("\n")[0].count)
    return [row for row in csv.reader(StringIO(text, newline=""), delimiter=delimiter) if row]


def parse_cell(text: str, path: Path, line: int, unit: str = "") -> float:
    """Finite number in a cell of a table.

    Raises
    ------
    DataError
        It is none; the message names the line, and the unit if there is one.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"{path}, line {line}: {text!r} is not a number{unit and ' of ' + unit}; correct it")
    return value
