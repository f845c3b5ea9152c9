"""Bounded reading of tables: CSV files and the numbers in their cells."""

import csv
import math
from collections.abc import Callable
from io import StringIO
from pathlib import Path

from lexicon.errors import DataError
from lexicon.values.files import read_text

IsHeading = Callable[[list[str]], bool]
MAX_HEADING_LINES = 20  # up to the heading
LARGEST_TABLE_BYTES = 200_000_000  # an hour of Live Link Face at 60 frames/s takes 180 MB


def read_table(
    path: Path, largest: int = LARGEST_TABLE_BYTES, delimiters: str = ",", is_heading: IsHeading | None = None
) -> list[list[str]]:
    """Rows of a CSV file, without empty ones, divided by the delimiter of its heading, or that its first row states.

    Parameters
    ----------
    is_heading
        Whether a row has the names of the columns, where lines may stand above them; else the first row has them.

    Raises
    ------
    DataError
        It cannot be read, contains more than `largest` bytes, or is not CSV in UTF-8.
    """
    try:
        return parse_table(read_text(path, largest), delimiters, is_heading)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    except csv.Error as broken:
        raise DataError(f"{path} is not a CSV file ({broken}); export it again") from broken


def parse_table(text: str, delimiters: str = ",", is_heading: IsHeading | None = None) -> list[list[str]]:
    """Rows of a table, as `read_table` divides them (csv.Error: it is none)."""
    heading, _, rest = text.partition("\n")
    # the first line in which Excel states the delimiter
    if (stated := heading.strip().strip('"').lower()).startswith("sep=") and len(stated) == 5:
        delimiters, text = stated[-1], rest
    delimiter = _find_delimiter(text.lstrip(), delimiters, is_heading)
    return [row for row in csv.reader(StringIO(text, newline=""), delimiter=delimiter) if row]


def _find_delimiter(text: str, delimiters: str, is_heading: IsHeading | None) -> str:
    """The delimiter that shows the heading among the first lines; without one, that which the first line has most."""
    lines = text.split("\n", MAX_HEADING_LINES)[:MAX_HEADING_LINES]
    most = sorted(delimiters, key=lines[0].count, reverse=True)
    if is_heading is not None and len(delimiters) > 1:
        for line in lines:
            for delimiter in most:
                if any(map(is_heading, csv.reader([line.rstrip("\r")], delimiter=delimiter))):
                    return delimiter
    return most[0]


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
