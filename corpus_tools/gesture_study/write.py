"""The study of a palette written to a file: what its suffix says."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from corpus_tools.gesture_study.analysis import GesturesFound, Options, Progress, study
from corpus_tools.gesture_study.figure import brief
from corpus_tools.gesture_study.page import gestures_page
from corpus_tools.gesture_study.text import gestures_csv, gestures_json
from corpus_tools.report.panels import panels_png
from lexicon.errors import InputError
from tts2face.models.palette import load_palette
from tts2face.storage.files import write_whole
from tts2face.storage.output_names import check_name

COLUMNS = 3


def write_gestures(palette: str, out: Path, options: Options, *, on_progress: Progress | None = None) -> GesturesFound:
    """Study a palette (by name or path), write the file, and give what was found.

    ``.html`` is a page, ``.json`` everything, ``.csv`` distances, ``.png`` the main plots of the first style.

    Raises
    ------
    InputError
        A suffix that there is not; errors as `load_palette`. Nothing is written then.
    BackendError
        The file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in WRITERS:
        raise InputError(f"a report is written as {', '.join(WRITERS)}, not {out.name}")
    check_name(out)
    found = study(palette, load_palette(palette), options, on_progress)
    write_whole(out, WRITERS[suffix](found))
    return found


def _picture(found: GesturesFound) -> bytes:
    first = found.styles[0]
    return panels_png(f"Gestures of {first.name}: recorded, by its fields, by noise", brief(first), COLUMNS)


WRITERS: Mapping[str, Callable[[GesturesFound], bytes]] = MappingProxyType(
    {
        ".html": lambda found: gestures_page(found).encode(),
        ".csv": lambda found: gestures_csv(found).encode(),
        ".json": lambda found: gestures_json(found).encode(),
        ".png": _picture,
    }
)
