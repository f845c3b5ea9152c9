"""Marker sets: the regions of markers and their landmarks, as an editable table."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from tts2face.models.landmarks import N_LANDMARKS

# 68 markers of the face and 7 of the head, as many as Ju and Lee 2008, section 3, has. The paper shows its layout in a
# figure only (Fig. 2); names and positions here are this project's.
DEFAULT_MARKER_TABLE = Path(__file__).with_name("markers_68.tsv")
COLUMNS = ("marker", "region", "landmark")
HEAD_REGION = "head"  # region of the markers on the skull
MIN_HEAD_MARKERS = 3  # needed for head pose
MIN_FACE_MARKERS = 4  # needed to orient a face
# Regions of the face (Ju and Lee 2008, Fig. 5, by sides), and those that a feature of a palette is read from.
REGIONS = (
    "brow_left", "brow_right", "lid_left", "lid_right", "nose", "cheek_left", "cheek_right", "lips", "jaw", "forehead",
)  # fmt: skip
FEATURE_REGIONS: Mapping[str, tuple[str, ...]] = {
    "expression": ("brow_left", "brow_right", "lips"),
    "brows": ("brow_left", "brow_right"),
    "blink": ("lid_left", "lid_right"),
    "cheeks": ("cheek_left", "cheek_right"),
}


@dataclass(frozen=True, slots=True)
class MarkerSet:
    """Regions of all markers by name, and landmarks of those on the face."""

    regions: Mapping[str, str]
    landmarks: Mapping[str, int]

    @property
    def head(self) -> tuple[str, ...]:
        """Markers of the head."""
        return tuple(name for name, region in self.regions.items() if region == HEAD_REGION)

    @property
    def face(self) -> tuple[str, ...]:
        """Markers of the face."""
        return tuple(self.landmarks)

    @property
    def missing_features(self) -> frozenset[str]:
        """Features of a palette that these markers do not capture; gaze always, for lack of markers on eyeballs."""
        there = set(self.regions.values())
        return frozenset(
            {"gaze"} | {feature for feature, regions in FEATURE_REGIONS.items() if not there.issuperset(regions)}
        )


def read_marker_set(path: Path = DEFAULT_MARKER_TABLE) -> MarkerSet:
    """A marker set from a table of tab-separated columns marker, region, landmark; ``#`` begins a comment.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is not such a table, names a marker or a landmark twice, a region that is not one of `REGIONS` or head, or
        has too few markers of the head or the face.
    """
    if not path.is_file():
        raise InputError(f"there is no marker set {path}; check the path")
    try:
        lines = read_text(path).splitlines()
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    rows_text = [line for line in lines if line.strip() and not line.startswith("#")]
    rows = list(csv.reader(rows_text, delimiter="\t"))
    if not rows or tuple(rows[0]) != COLUMNS:
        raise DataError(f"{path} is not a marker set: its first line must be {', '.join(COLUMNS)}, between tabs")
    regions: dict[str, str] = {}
    landmarks: dict[str, int] = {}
    for row in rows[1:]:
        _add_row(path, row, regions, landmarks)
    n_head = len(regions) - len(landmarks)
    if n_head < MIN_HEAD_MARKERS:
        raise DataError(
            f"{path} has {n_head} markers of the region head; head pose needs at least {MIN_HEAD_MARKERS} "
            "on the skull, on a cap or a band"
        )
    if len(landmarks) < MIN_FACE_MARKERS:
        raise DataError(f"{path} has {len(landmarks)} markers of the face; it needs at least {MIN_FACE_MARKERS}")
    return MarkerSet(regions, landmarks)


def _add_row(path: Path, row: list[str], regions: dict[str, str], landmarks: dict[str, int]) -> None:
    """Write one row of the table into both."""
    if len(row) != len(COLUMNS) or not row[0]:
        raise DataError(f"{path} has the row {row}; it needs {', '.join(COLUMNS)}, between tabs")
    marker, region, landmark = row
    if marker in regions:
        raise DataError(f"{path} names the marker {marker} twice; give each one row")
    if region not in (*REGIONS, HEAD_REGION):
        raise DataError(
            f"{path} puts {marker} into the region {region!r}; regions are {', '.join(REGIONS)} and {HEAD_REGION}"
        )
    regions[marker] = region
    if region == HEAD_REGION:
        return
    if not landmark.isdecimal() or int(landmark) >= N_LANDMARKS:
        raise DataError(f"{path} puts {marker} at the landmark {landmark!r}; landmarks are 0 to {N_LANDMARKS - 1}")
    if int(landmark) in landmarks.values():
        raise DataError(f"{path} puts two markers at the landmark {landmark}; give each its own")
    landmarks[marker] = int(landmark)
