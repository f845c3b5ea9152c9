"""Facial marker capture as landmarks of the common face (Ju and Lee 2008, section 3).

Marker sets: the regions of markers and their landmarks, as an editable table.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.marker_face import (
    HeadPoses,
    MarkerInterpolator,
    build_marker_interpolator,
    fill_marker_gaps,
    fit_head_poses,
)
from corpus_tools.decomposition.marker_files import MarkerTake, read_markers
from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from tts2face.face.deformation import rest_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.numeric.arrays import nearest_rotation
from tts2face.video.pose import head_angles

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


MAX_QUOTED_MARKERS = 6  # markers quoted in a message

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MarkerFace:
    """A person's markers at rest, ready to read recordings of the same session.

    Parameters
    ----------
    head : (H, 3)
        Reference of the head's markers.
    rest : (M, 3)
        The face's markers at rest in the head's axes.
    spread
        From markers to landmarks.
    """

    marker_set: MarkerSet
    names: tuple[str, ...]
    head_names: tuple[str, ...]
    head: Floats
    rest: Floats
    spread: MarkerInterpolator


def read_marker_recording(
    path: Path, face: Face, marker_set: MarkerSet, *, neutral: Path | None = None, fps: float | None = None
) -> FaceRecording:
    """A marker recording as landmarks in the person's own size; filled gaps are reported in its notes.

    Its sound is that of the file, or else as `read_capture_sound` finds it.

    Parameters
    ----------
    face
        Provides the common landmarks at rest.
    neutral
        A recording of the person at rest; by default the median of the recording.
    fps
        Frame rate of a table with frame numbers.

    Raises
    ------
    InputError
        A file is missing or of another kind.
    DataError
        A file is damaged, lacks a region that the set has, has a gap that is too long, or no rigid head.
    """
    take = read_markers(path, fps)
    rest = read_marker_face(path if neutral is None else neutral, face, marker_set, fps=fps)
    points, poses, notes = _face_in_head_axes(path, take, rest.names, rest.head_names, rest.head)
    landmarks = rest.spread.landmarks(points - rest.rest)
    if neutral is None:
        notes = ("the median of the recording is used as the face at rest", *notes)
    return FaceRecording(
        name=path.stem,
        fps=take.fps,
        landmarks=landmarks.astype(np.float32),
        head=_head_motion(poses, rest.spread, face).astype(np.float32),
        sound=take.sound or read_capture_sound(path),
        rest=rest.spread.rest.astype(np.float32),
        missing_features=marker_set.missing_features,
        notes=(*_absent_markers(take, marker_set), *notes),
    )


def read_marker_face(path: Path, face: Face, marker_set: MarkerSet, *, fps: float | None = None) -> MarkerFace:
    """The person's face at rest: the median of a recording; errors as `read_marker_recording`."""
    take = read_markers(path, fps)
    check_regions(path, take, marker_set)
    there = set(take.names)
    names = tuple(name for name in marker_set.face if name in there)
    if len(names) < MIN_FACE_MARKERS:
        raise DataError(
            f"{path} has {len(names)} of the set's markers of the face; it needs at least {MIN_FACE_MARKERS}"
        )
    head_names = tuple(name for name in marker_set.head if name in there)
    points, poses, _ = _face_in_head_axes(path, take, names, head_names, None)
    rest = np.median(points, axis=0)
    spread = build_marker_interpolator(rest, [marker_set.landmarks[name] for name in names], rest_landmarks(face))
    return MarkerFace(marker_set, names, head_names, poses.reference, rest, spread)


def read_marker_still(path: Path, rest: MarkerFace) -> Floats:
    """(478, 3) landmarks of a static capture, the median of its frames; errors as `read_marker_recording`."""
    points, _, _ = _face_in_head_axes(path, read_markers(path), rest.names, rest.head_names, rest.head)
    found: Floats = rest.spread.landmarks(np.median(points, axis=0)[None] - rest.rest)[0]
    return found


def check_regions(path: Path, take: MarkerTake, marker_set: MarkerSet) -> None:
    """Check that a file has a marker of every region of the set.

    Raises
    ------
    DataError
        It lacks a region, or all markers of the set.
    """
    there = set(take.names)
    if not there & set(marker_set.regions):
        shown = ", ".join(take.names[:MAX_QUOTED_MARKERS])
        raise DataError(f"{path} has none of the set's markers but {shown}; give its marker set with --markers")
    for region in dict.fromkeys(marker_set.regions.values()):
        names = [name for name, of in marker_set.regions.items() if of == region]
        if not there.intersection(names):
            shown = ", ".join(names[:MAX_QUOTED_MARKERS])
            raise DataError(
                f"{path} has no marker of the region {region} ({shown}); capture them, or give a marker set without "
                "this region with --markers"
            )


def _absent_markers(take: MarkerTake, marker_set: MarkerSet) -> tuple[str, ...]:
    missing = [name for name in marker_set.regions if name not in take.names]
    return (
        (f"the file has no marker {', '.join(missing)}; its region is interpolated from the others",) if missing else ()
    )


def _face_in_head_axes(
    path: Path, take: MarkerTake, names: tuple[str, ...], head_names: tuple[str, ...], head: Floats | None
) -> tuple[Floats, HeadPoses, tuple[str, ...]]:
    """(T, M, 3) markers of the face in the head's axes without gaps, the head's poses, and notes on filled gaps."""
    at = {name: number for number, name in enumerate(take.names)}
    missing = [name for name in (*names, *head_names) if name not in at]
    if missing:
        raise DataError(
            f"{path} lacks the marker {missing[0]}, which the face at rest has; capture both with the same markers"
        )
    try:
        of_head = take.points[:, [at[name] for name in head_names]]
        poses, head_notes = fit_head_poses(of_head, head_names, take.fps, reference=head)
        local = poses.remove_from(take.points[:, [at[name] for name in names]])
        whole, notes = fill_marker_gaps(local, names, take.fps)
    except DataError as refused:
        raise DataError(f"{path}: {refused}") from refused
    return whole, poses, (*head_notes, *notes)


def _head_motion(poses: HeadPoses, spread: MarkerInterpolator, face: Face) -> Floats:
    """(T, 6) `HEAD_CHANNELS` in the face's axes: angles relative to the mean, pivot relative to the median."""
    turn = spread.rotation
    mean = nearest_rotation(poses.rotations.mean(axis=0))
    level = turn @ mean.T  # the world's axes in those of the face at its mean pose
    pivot = (face.pivot / spread.size - spread.translation) @ turn
    places = (poses.rotations @ pivot + poses.places) @ level.T
    return np.column_stack([head_angles(level @ poses.rotations @ turn.T), places - np.median(places, axis=0)])
