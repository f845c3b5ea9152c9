"""Facial marker capture as landmarks of the common face (Ju and Lee 2008, section 3)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.marker_files import read_markers
from corpus_tools.decomposition.marker_gaps import FilledTracks, fill_marker_gaps
from corpus_tools.decomposition.marker_interpolation import MarkerInterpolator, build_marker_interpolator
from corpus_tools.decomposition.marker_poses import HeadPoses, fit_head_poses
from corpus_tools.decomposition.marker_sets import MIN_FACE_MARKERS, MarkerSet
from corpus_tools.decomposition.marker_take import MarkerTake
from lexicon.errors import DataError
from tts2face.face.landmarks import rest_landmarks
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, nearest_rotation
from tts2face.video.pose import head_angles

MAX_QUOTED_MARKERS = 6  # markers quoted in a message
LEAST_SEEN = 0.5  # share of frames in which a marker is seen: one that is seen less says little about its region


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
    head: FloatArray
    rest: FloatArray
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
        Frame rate of a table whose times do not show it.
    """
    take = read_markers(path, fps)
    check_regions(path, take, marker_set)
    rest = read_marker_face(
        path if neutral is None else neutral, face, marker_set, fps=fps, seen_in_take=seen_markers(take)
    )
    tracks, poses, notes = _face_in_head_axes(path, take, rest.names, rest.head_names, rest.head)
    landmarks = rest.spread.landmarks(tracks.points - rest.rest)
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
        left_out=tracks.left_out | poses.left_out,
        notes=(*take.notes, *_absent_markers(take, marker_set), *notes),
    )


def read_marker_face(
    path: Path,
    face: Face,
    marker_set: MarkerSet,
    *,
    fps: float | None = None,
    seen_in_take: frozenset[str] | None = None,
) -> MarkerFace:
    """The person's face at rest: the median of a recording; errors as `read_marker_recording`.

    Parameters
    ----------
    seen_in_take
        The markers that another recording has; all by default.
    """
    take = read_markers(path, fps)
    check_regions(path, take, marker_set)
    there = seen_markers(take) if seen_in_take is None else seen_markers(take) & seen_in_take
    names = tuple(name for name in marker_set.face if name in there)
    if len(names) < MIN_FACE_MARKERS:
        raise DataError(
            f"{path} has {len(names)} of the set's markers of the face; it needs at least {MIN_FACE_MARKERS}"
        )
    head_names = tuple(name for name in marker_set.head if name in there)
    tracks, poses, _ = _face_in_head_axes(path, take, names, head_names, None)
    rest = _median_place(tracks, poses)
    spread = build_marker_interpolator(rest, [marker_set.landmarks[name] for name in names], rest_landmarks(face))
    return MarkerFace(marker_set, names, head_names, poses.reference, rest, spread)


def read_marker_still(path: Path, rest: MarkerFace) -> FloatArray:
    """(478, 3) landmarks of a static capture, the median of its frames; errors as `read_marker_recording`."""
    tracks, poses, _ = _face_in_head_axes(path, read_markers(path), rest.names, rest.head_names, rest.head)
    found: FloatArray = rest.spread.landmarks(_median_place(tracks, poses)[None] - rest.rest)[0]
    return found


def seen_markers(take: MarkerTake) -> frozenset[str]:
    """Names of the markers that are seen in at least `LEAST_SEEN` of the frames."""
    seen = np.isfinite(take.points).all(axis=2).mean(axis=0)
    return frozenset(name for name, share in zip(take.names, seen, strict=True) if share >= LEAST_SEEN)


def _median_place(tracks: FilledTracks, poses: HeadPoses) -> FloatArray:
    """(M, 3) of the frames that are measured, or of all."""
    is_measured = ~(tracks.left_out | poses.left_out)
    return np.asarray(np.median(tracks.points[is_measured] if is_measured.any() else tracks.points, axis=0))


def check_regions(path: Path, take: MarkerTake, marker_set: MarkerSet) -> None:
    """Check that a file has a marker of every region of the set."""
    there = seen_markers(take)
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
    hidden = [name for name in marker_set.regions if name in set(take.names) - seen_markers(take)]
    notes = list[str]()
    if missing:
        notes.append(f"the file has no marker {', '.join(missing)}; its region is interpolated from the others")
    if hidden:
        notes.append(f"most frames hide the marker {', '.join(hidden)}; its region is interpolated from the others")
    return tuple(notes)


def _face_in_head_axes(
    path: Path, take: MarkerTake, names: tuple[str, ...], head_names: tuple[str, ...], head: FloatArray | None
) -> tuple[FilledTracks, HeadPoses, tuple[str, ...]]:
    """Markers of the face in the head's axes without gaps, the head's poses, and notes on gaps."""
    at = {name: number for number, name in enumerate(take.names)}
    shown = {name for name, number in at.items() if np.isfinite(take.points[:, number]).all(axis=1).any()}
    missing = [name for name in (*names, *head_names) if name not in shown]
    if missing:
        raise DataError(
            f"{path} lacks the marker {missing[0]}, which the face at rest has; capture both with the same markers"
        )
    try:
        of_head = take.points[:, [at[name] for name in head_names]]
        poses, head_notes = fit_head_poses(of_head, head_names, take.fps, reference=head)
        local = poses.remove_from(take.points[:, [at[name] for name in names]])
        tracks = fill_marker_gaps(local, names, take.fps)
    except DataError as refused:
        raise DataError(f"{path}: {refused}") from refused
    return tracks, poses, (*head_notes, *tracks.notes)


def _head_motion(poses: HeadPoses, spread: MarkerInterpolator, face: Face) -> FloatArray:
    """(T, 6) `HEAD_CHANNELS` in the face's axes: angles relative to the mean, pivot relative to the median."""
    turn = spread.rotation
    mean = nearest_rotation(poses.rotations.mean(axis=0))
    level = turn @ mean.T  # the world's axes in those of the face at its mean pose
    pivot = (face.pivot / spread.size - spread.translation) @ turn
    places = (poses.rotations @ pivot + poses.places) @ level.T
    return np.column_stack([head_angles(level @ poses.rotations @ turn.T), places - np.median(places, axis=0)])
