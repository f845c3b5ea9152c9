"""The analysis written to a file: what its suffix says."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from corpus_tools.similarity.analysis import Analysis, Named, Options, Progress, analyse
from corpus_tools.similarity.figure import difference_figure, similarity_figure
from corpus_tools.similarity.labels import check_labels
from corpus_tools.similarity.page import similarity_page
from corpus_tools.similarity.picture import ipa_font_name, table_png
from corpus_tools.similarity.text import analysis_json, difference_csv, table_csv
from lexicon.errors import InputError
from tts2face.models.talker import load_talker
from tts2face.storage.files import write_whole
from tts2face.storage.output_names import check_name


def write_similarity(
    talker: str,
    out: Path,
    options: Options,
    *,
    other: str | None = None,
    labels: str = "both",
    on_progress: Progress | None = None,
) -> Analysis:
    """Analyse a talker (by name or path), write the file, and give the analysis.

    ``.html`` is a page, ``.json`` everything, ``.csv`` the matrix, ``.png`` the heat map; with `other` the last two
    hold the difference of the two talkers.

    Raises
    ------
    InputError
        A suffix or labels that there are not, letters that this machine cannot draw; errors as `load_talker` and
        `analyse`. Nothing is written then.
    BackendError
        The file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in WRITERS:
        raise InputError(f"a report is written as {', '.join(WRITERS)}, not {out.name}")
    check_labels(labels)
    check_name(out)
    against = None if other is None else Named(other, load_talker(other))
    found = analyse(Named(talker, load_talker(talker)), options, against, on_progress)
    write_whole(out, WRITERS[suffix](found, labels))
    return found


def _page(found: Analysis, labels: str) -> bytes:
    return similarity_page(found, labels).encode()


def _json(found: Analysis, labels: str) -> bytes:
    return analysis_json(found).encode()


def _csv(found: Analysis, labels: str) -> bytes:
    if found.comparison is not None:
        return difference_csv(found.comparison, labels).encode()
    return table_csv(found.table, labels).encode()


def _png(found: Analysis, labels: str) -> bytes:
    if ipa_font_name() is None:
        if labels == "ipa":
            raise InputError("no font of this machine shows IPA letters; use --labels arpabet, or write .html")
        labels = "arpabet"
    if found.comparison is not None:
        return table_png(difference_figure(found, found.comparison, labels))
    return table_png(similarity_figure(found, labels))


WRITERS: Mapping[str, Callable[[Analysis, str], bytes]] = MappingProxyType(
    {".html": _page, ".csv": _csv, ".json": _json, ".png": _png}
)
