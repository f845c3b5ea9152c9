"""The skeleton of a study's files: a page, a table, all figures and a picture, chosen by the suffix of a path.

A new study takes four steps:

1. Measure into a frozen dataclass, with a function that other code can call.
2. Make of it what the study shows: a page (`studies.pages`), rows of a table whose first row names the columns, a
   dictionary of all figures, a `Plot`.
3. List these by suffix in a `Report`: ``Report({".html": as_html(...), ".csv": as_csv(...)})``.
4. Call `Report.write` with the path and the measurement: the path is checked before anything is measured.
"""

import csv
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Generic, TypeVar

from corpus_tools.studies.plots import Plot, load_matplotlib
from lexicon.errors import InputError
from tts2face.storage.files import write_atomically
from tts2face.storage.output_paths import check_name

PLOT_SUFFIXES = (".html", ".png", ".svg")  # kinds of file that hold plots
Study = TypeVar("Study")
Rows = Iterable[Sequence[Any]]


@dataclass(frozen=True, slots=True)
class Report(Generic[Study]):
    """The files in which a study is written: by suffix, a function that makes the content of one."""

    formats: Mapping[str, Callable[[Study], bytes]]

    def writer(self, out: Path) -> Callable[[Study], bytes]:
        """The function for a file's suffix; checks the path before the analysis starts.

        Raises
        ------
        InputError
            There is no writer for the suffix; or as `check_name`.
        BackendError
            The format contains plots and matplotlib is not installed; or as `check_name`.
        """
        suffix = out.suffix.lower()
        if suffix not in self.formats:
            raise InputError(f"a report is written as {', '.join(self.formats)}, not {out.name}")
        check_name(out)
        if suffix in PLOT_SUFFIXES:
            load_matplotlib()
        return self.formats[suffix]

    def write(self, out: Path, measure: Callable[[], Study]) -> Study:
        """Measure, write the file, and return the study; errors as `writer` and `measure`, which leave no file."""
        writer = self.writer(out)
        study = measure()
        write_atomically(out, writer(study))
        return study


def as_html(page: Callable[[Study], str]) -> Callable[[Study], bytes]:
    """Content of an HTML file."""
    return lambda study: page(study).encode()


def as_csv(rows: Callable[[Study], Rows]) -> Callable[[Study], bytes]:
    """Content of a CSV file."""
    return lambda study: csv_text(rows(study)).encode()


def as_json(content: Callable[[Study], Any], *, is_ascii: bool = False) -> Callable[[Study], bytes]:
    """Content of a JSON file, as text that ends with a line break, or in ASCII without one."""

    def written(study: Study) -> bytes:
        return (json.dumps(content(study), ensure_ascii=is_ascii, indent=1) + ("" if is_ascii else "\n")).encode()

    return written


def as_png(plot: Callable[[Study], Plot]) -> Callable[[Study], bytes]:
    """Content of a PNG file."""
    return lambda study: plot(study).png()


def as_svg(plot: Callable[[Study], Plot]) -> Callable[[Study], bytes]:
    """Content of an SVG file."""
    return lambda study: plot(study).svg_file()


def csv_text(rows: Rows) -> str:
    """A table as CSV, whose lines end with a line feed."""
    file = StringIO()
    csv.writer(file, lineterminator="\n").writerows(rows)
    return file.getvalue()


def markdown_table(rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown; the first row is its heading."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "| --- |" + " --- |" * (len(rows[0]) - 1), *lines[1:]])
