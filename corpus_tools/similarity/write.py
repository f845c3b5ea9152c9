"""Write the analysis of a talker as HTML, JSON, CSV or PNG."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from corpus_tools.report.page import report_writer
from corpus_tools.similarity.analysis import Analysis, NamedTalker, Options, analyse
from corpus_tools.similarity.figure import difference_figure, similarity_figure, table_png
from corpus_tools.similarity.page import similarity_page
from corpus_tools.similarity.text import analysis_json, difference_csv, table_csv
from corpus_tools.similarity.tokens import check_labels
from tts2face.models.talker import load_talker
from tts2face.storage.files import write_atomically
from tts2face.types import Progress


def write_similarity(
    talker: str,
    out: Path,
    options: Options,
    *,
    other: str | None = None,
    labels: str = "both",
    on_progress: Progress | None = None,
) -> Analysis:
    """Analyse a talker (by name or path), write the file, and return the analysis.

    ``.html`` is a page, ``.json`` has every figure, ``.csv`` the matrix, ``.png`` the heat map; with `other` the last
    two hold the difference of the two talkers.

    Raises
    ------
    InputError
        The suffix or the labels are unknown; errors as `load_talker` and `analyse`. Nothing is written then.
    BackendError
        matplotlib or scikit-learn is not installed, or the file cannot be written.
    """
    writer = report_writer(out, WRITERS)
    check_labels(labels)
    against = None if other is None else NamedTalker(other, load_talker(other))
    found = analyse(NamedTalker(talker, load_talker(talker)), options, against, on_progress)
    write_atomically(out, writer(found, labels))
    return found


def _csv(found: Analysis, labels: str) -> bytes:
    if found.comparison is not None:
        return difference_csv(found.comparison, labels).encode()
    return table_csv(found.table, labels).encode()


def _png(found: Analysis, labels: str) -> bytes:
    if found.comparison is not None:
        return table_png(difference_figure(found, found.comparison, labels))
    return table_png(similarity_figure(found, labels))


WRITERS: Mapping[str, Callable[[Analysis, str], bytes]] = MappingProxyType(
    {
        ".html": lambda found, labels: similarity_page(found, labels).encode(),
        ".csv": _csv,
        ".json": lambda found, labels: analysis_json(found).encode(),
        ".png": _png,
    }
)
