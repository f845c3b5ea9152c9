"""Facial captures by their kind: Live Link Face tables, and markers as C3D or tables."""

from dataclasses import dataclass
from pathlib import Path

from corpus_tools.decomposition.capture import FaceRecording
from corpus_tools.decomposition.livelink import read_livelink_recording
from corpus_tools.decomposition.marker_set import DEFAULT_MARKER_TABLE, read_marker_set
from corpus_tools.decomposition.markers import read_marker_recording
from lexicon.errors import InputError
from tts2face.models.face import Face

CAPTURE_SUFFIXES = frozenset({".c3d", ".csv"})
LIVELINK_FIRST_COLUMN = "timecode"  # first column of a Live Link Face table


@dataclass(frozen=True, slots=True)
class MarkerOptions:
    """How markers are read: the table of their set, a recording of the person at rest, frames a second of tables."""

    marker_table: Path = DEFAULT_MARKER_TABLE
    neutral: Path | None = None
    fps: float | None = None


def is_livelink(path: Path) -> bool:
    """Whether a file begins as a Live Link Face table does."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(64).decode("utf-8-sig", errors="replace").lower().startswith(LIVELINK_FIRST_COLUMN)


def read_capture_file(
    path: Path, face: Face, *, sound: Path | None = None, worn: MarkerOptions | None = None
) -> FaceRecording:
    """A capture of whichever kind, as landmarks; sound from the file, as given, or of the same name beside it.

    Raises
    ------
    InputError
        There is no such file, or it is of another kind.
    DataError
        It is damaged; or as `read_marker_recording` says.
    BackendError
        Reading C3D needs a package that is missing.
    """
    if path.suffix.lower() not in CAPTURE_SUFFIXES:
        raise InputError(f"{path.name} is no facial capture; they are read from {', '.join(sorted(CAPTURE_SUFFIXES))}")
    if is_livelink(path):
        return read_livelink_recording(path, face, sound=sound)
    how = worn or MarkerOptions()
    return read_marker_recording(
        path, face, read_marker_set(how.marker_table), neutral=how.neutral, sound=sound, fps=how.fps
    )
