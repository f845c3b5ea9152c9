"""Facial marker capture as landmarks of the common face (Ju and Lee 2008, section 3)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.face_motion import rest_landmarks
from corpus_tools.decomposition.head_markers import HeadPoses, fit_head_poses
from corpus_tools.decomposition.marker_files import MarkerTake, read_markers
from corpus_tools.decomposition.marker_gaps import fill_marker_gaps
from corpus_tools.decomposition.marker_interpolation import MarkerInterpolator, build_marker_interpolator
from corpus_tools.decomposition.marker_set import MIN_FACE_MARKERS, MarkerSet
from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.video.pose import head_angles

MAX_QUOTED_MARKERS = 6  # markers in a sentence

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

    worn: MarkerSet
    names: tuple[str, ...]
    head_names: tuple[str, ...]
    head: Floats
    rest: Floats
    spread: MarkerInterpolator


def read_marker_recording(
    path: Path, face: Face, worn: MarkerSet, *, neutral: Path | None = None, sound: Path | None = None,
    fps: float | None = None,
) -> FaceRecording:  # fmt: skip
    """A recording of markers as landmarks in the person's own size; gaps are filled and told.

    Parameters
    ----------
    face
        Has the common landmarks; only where they lie at rest matters.
    neutral
        A recording of the person at rest; without it the median of the recording is taken for rest.
    sound
        As `read_capture_sound`, where the file itself holds none.
    fps
        Of a table that counts frames.

    Raises
    ------
    InputError
        A file is missing or of another kind.
    DataError
        A file is damaged, lacks a region that the set has, has a gap that is too long, or no rigid head.
    BackendError
        Reading C3D needs a package that is missing.
    """
    take = read_markers(path, fps)
    rest = read_marker_face(path if neutral is None else neutral, face, worn, fps=fps)
    points, poses, notes = _face_in_head_axes(path, take, rest.names, rest.head_names, rest.head)
    landmarks = rest.spread.landmarks(points - rest.rest)
    if neutral is None:
        notes = ("the recording's median stands for the face at rest", *notes)
    return FaceRecording(
        name=path.stem,
        fps=take.fps,
        landmarks=landmarks.astype(np.float32),
        head=_head_motion(poses, rest.spread, face).astype(np.float32),
        sound=take.sound or read_capture_sound(path, sound),
        rest=rest.spread.rest.astype(np.float32),
        missing_features=worn.missing_features,
        notes=(*_absent_markers(take, worn), *notes),
    )


def read_marker_face(path: Path, face: Face, worn: MarkerSet, *, fps: float | None = None) -> MarkerFace:
    """The person's face at rest: the median of a recording; errors as `read_marker_recording`."""
    take = read_markers(path, fps)
    check_regions(path, take, worn)
    there = set(take.names)
    names = tuple(name for name in worn.face if name in there)
    if len(names) < MIN_FACE_MARKERS:
        raise DataError(
            f"{path} has {len(names)} of the set's markers of the face; it takes at least {MIN_FACE_MARKERS}"
        )
    head_names = tuple(name for name in worn.head if name in there)
    points, poses, _ = _face_in_head_axes(path, take, names, head_names, None)
    rest = np.median(points, axis=0)
    spread = build_marker_interpolator(rest, [worn.landmarks[name] for name in names], rest_landmarks(face))
    return MarkerFace(worn, names, head_names, poses.reference, rest, spread)


def read_marker_still(path: Path, rest: MarkerFace) -> Floats:
    """(478, 3) landmarks of a static capture, the median of its frames; errors as `read_marker_recording`."""
    points, _, _ = _face_in_head_axes(path, read_markers(path), rest.names, rest.head_names, rest.head)
    found: Floats = rest.spread.landmarks(np.median(points, axis=0)[None] - rest.rest)[0]
    return found


def check_regions(path: Path, take: MarkerTake, worn: MarkerSet) -> None:
    """Refuse a file that has no marker of a region that the set has.

    Raises
    ------
    DataError
        It lacks a region, or all markers of the set.
    """
    there = set(take.names)
    if not there & set(worn.regions):
        shown = ", ".join(take.names[:MAX_QUOTED_MARKERS])
        raise DataError(f"{path} holds none of the set's markers; it has {shown}. Give its marker set with --markers")
    for region in dict.fromkeys(worn.regions.values()):
        names = [name for name, of in worn.regions.items() if of == region]
        if not there.intersection(names):
            shown = ", ".join(names[:MAX_QUOTED_MARKERS])
            raise DataError(
                f"{path} has no marker of the region {region} ({shown}); capture them, or give a marker set without "
                "this region with --markers"
            )


def _absent_markers(take: MarkerTake, worn: MarkerSet) -> tuple[str, ...]:
    gone = [name for name in worn.regions if name not in take.names]
    return (f"the file has no marker {', '.join(gone)}; its region goes by the others",) if gone else ()


def _face_in_head_axes(
    path: Path, take: MarkerTake, names: tuple[str, ...], head_names: tuple[str, ...], head: Floats | None
) -> tuple[Floats, HeadPoses, tuple[str, ...]]:
    """(T, M, 3) markers of the face in the head's axes without gaps, the head's poses, and what was filled."""
    at = {name: number for number, name in enumerate(take.names)}
    gone = [name for name in (*names, *head_names) if name not in at]
    if gone:
        raise DataError(f"{path} lacks the marker {gone[0]}, which the face at rest has; capture both with all markers")
    try:
        of_head = take.points[:, [at[name] for name in head_names]]
        poses, head_notes = fit_head_poses(of_head, head_names, take.fps, reference=head)
        local = poses.remove_from(take.points[:, [at[name] for name in names]])
        whole, notes = fill_marker_gaps(local, names, take.fps)
    except DataError as refused:
        raise DataError(f"{path}: {refused}") from refused
    return whole, poses, (*head_notes, *notes)


def _head_motion(poses: HeadPoses, spread: MarkerInterpolator, face: Face) -> Floats:
    """(T, 6) `HEAD_CHANNELS` in the face's axes: angles against the mean, place of the pivot against the median."""
    turn = spread.rotation
    left, _, right = np.linalg.svd(poses.rotations.mean(axis=0))
    mean = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    level = turn @ mean.T  # the world's axes, as the face has them when the head is as it mostly is
    pivot = (face.pivot / spread.size - spread.translation) @ turn
    places = (poses.rotations @ pivot + poses.places) @ level.T
    return np.column_stack([head_angles(level @ poses.rotations @ turn.T), places - np.median(places, axis=0)])
