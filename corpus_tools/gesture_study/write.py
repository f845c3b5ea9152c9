"""Write the study of a palette as HTML, JSON, CSV or PNG."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from corpus_tools.gesture_study.analysis import GestureStudy, Options, study_gestures
from corpus_tools.gesture_study.figure import panels_png, summary_panels
from corpus_tools.gesture_study.page import gestures_page
from corpus_tools.gesture_study.text import gestures_csv, gestures_json
from corpus_tools.report.page import report_writer
from tts2face.models.palette import load_palette
from tts2face.storage.files import write_atomically
from tts2face.types import Progress


def write_gestures(palette: str, out: Path, options: Options, *, on_progress: Progress | None = None) -> GestureStudy:
    """Study a palette (by name or path), write the file, and return the study.

    ``.html`` is a page, ``.json`` has every figure, ``.csv`` the distances, ``.png`` the main plots of the first style.

    Raises
    ------
    InputError
        The suffix is unknown; errors as `load_palette`. Nothing is written then.
    BackendError
        matplotlib is not installed, or the file cannot be written.
    """
    writer = report_writer(out, WRITERS)
    found = study_gestures(palette, load_palette(palette), options, on_progress)
    write_atomically(out, writer(found))
    return found


def _summary_png(found: GestureStudy) -> bytes:
    first = found.styles[0]
    return panels_png(f"Gestures of {first.name}: recordings, fields, noise, published fields", summary_panels(first))


WRITERS: Mapping[str, Callable[[GestureStudy], bytes]] = MappingProxyType(
    {
        ".html": lambda found: gestures_page(found).encode(),
        ".csv": lambda found: gestures_csv(found).encode(),
        ".json": lambda found: gestures_json(found).encode(),
        ".png": _summary_png,
    }
)
