"""Head pose from markers on the skull, and its removal from the markers of the face."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.marker_gaps import describe_long_gaps, find_long_gaps
from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray, Mask, interpolate_columns
from tts2face.video.pose import similarity_transforms

MIN_VISIBLE_MARKERS = 3  # markers that show a pose
MAX_MISFIT_MM = 5.0  # root mean square deviation of the head's markers from a rigid head; caps slip by less
# Alternating estimates of reference and poses; the reference moves by less than 0.01 mm from the second on.
N_ROUNDS = 3
MAX_COLLINEAR_RATIO = 0.05  # second over first spread of markers that lie nearly on a line


@dataclass(frozen=True, slots=True, eq=False)
class HeadPoses:
    """Poses of T frames.

    Parameters
    ----------
    reference : (H, 3)
        The head's markers about their middle, mm.
    rotations, places : (T, 3, 3), (T, 3)
        ``world = rotations @ head + places``.
    left_out : (T,)
        Frames in gaps of the pose that are too long to be filled.
    """

    reference: FloatArray
    rotations: FloatArray
    places: FloatArray
    left_out: Mask

    def remove_from(self, points: FloatArray) -> FloatArray:
        """(T, M, 3) points in the head's own axes."""
        local: FloatArray = np.einsum("tij,tmi->tmj", self.rotations, points - self.places[:, None])
        return local


def fit_head_poses(
    points: FloatArray, names: Sequence[str], fps: float, *, reference: FloatArray | None = None
) -> tuple[HeadPoses, tuple[str, ...]]:
    """Poses of the head, and a note on filled gaps.

    Parameters
    ----------
    points : (T, H, 3)
        The head's markers, NaN in gaps; three in a frame suffice.
    reference : (H, 3)
        The head as other recordings of the session have it; the recording's own by default.

    Notes
    -----
    Kabsch 1976 on the visible markers, alternating between reference and poses. Missing poses are interpolated.
    """
    if len(names) < MIN_VISIBLE_MARKERS:
        raise DataError(f"the file has {len(names)} markers of the head; its pose needs at least {MIN_VISIBLE_MARKERS}")
    is_visible = np.asarray(np.isfinite(points).all(axis=2))
    posed = np.asarray(is_visible.sum(axis=1) >= MIN_VISIBLE_MARKERS)
    if not posed.any():
        raise DataError("no frame shows three markers of the head; capture it again")
    left_out = find_long_gaps(~posed, fps)
    head = _first_reference(points, is_visible) if reference is None else reference
    spreads = np.linalg.svd(head - head.mean(axis=0), compute_uv=False)
    if spreads[1] <= MAX_COLLINEAR_RATIO * spreads[0]:
        raise DataError("the head's markers are collinear and do not determine its pose; place them apart")
    shown, is_visible = points[posed], is_visible[posed]
    rotations, places = _fit_poses(shown, is_visible, head)
    for _ in range(N_ROUNDS if reference is None else 0):
        local = np.einsum("tij,tmi->tmj", rotations, np.nan_to_num(shown) - places[:, None])
        head = np.einsum("tm,tmi->mi", is_visible, local) / is_visible.sum(axis=0)[:, None]
        head = head - head.mean(axis=0)
        rotations, places = _fit_poses(shown, is_visible, head)
    off = np.einsum("tij,mj->tmi", rotations, head) + places[:, None] - shown
    misfit = float(np.sqrt(np.square(off[is_visible]).sum(axis=1).mean()))
    if misfit > MAX_MISFIT_MM:
        raise DataError(
            f"the head's markers do not move rigidly (deviation {misfit:.1f} mm); list only those on the skull as head"
        )
    notes = list[str]()
    if left_out.any():
        notes.append(describe_long_gaps("head's pose", left_out, fps))
    if n_filled := int((~posed & ~left_out).sum()):
        notes.append(f"the head's pose was interpolated in {n_filled} frames")
    return HeadPoses(head, *_interpolate_poses(rotations, places, posed), left_out), tuple(notes)


def _interpolate_poses(
    rotations: FloatArray, places: FloatArray, posed: NDArray[np.bool_]
) -> tuple[FloatArray, FloatArray]:
    """Poses of all frames, interpolated from known ones: spherical for rotations, linear for positions."""
    from scipy.spatial.transform import Rotation, Slerp

    there = np.flatnonzero(posed)
    if len(there) == 1:
        return rotations.repeat(len(posed), axis=0), places.repeat(len(posed), axis=0)
    frames = np.arange(len(posed))
    turned = Slerp(there, Rotation.from_matrix(rotations))(np.clip(frames, there[0], there[-1])).as_matrix()
    turned[there] = rotations
    return turned, interpolate_columns(places, there, frames)


def _first_reference(points: FloatArray, is_visible: NDArray[np.bool_]) -> FloatArray:
    whole = np.flatnonzero(is_visible.all(axis=1))
    if not len(whole):
        raise DataError("no frame shows all markers of the head; remove rarely visible ones from the set")
    head: FloatArray = points[whole[0]] - points[whole[0]].mean(axis=0)
    return head


def _fit_poses(points: FloatArray, is_visible: NDArray[np.bool_], head: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations (T, 3, 3) and positions (T, 3) of the head, fitted jointly for frames with the same visible markers."""
    rotations, places = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    patterns, which = np.unique(is_visible, axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns):
        here = which.ravel() == number
        weights = np.full(int(pattern.sum()), 1.0 / pattern.sum())
        there, known = points[here][:, pattern], head[pattern]
        into_head, _ = similarity_transforms(there, known, weights)
        rotations[here] = into_head.swapaxes(1, 2)
        places[here] = there.mean(axis=1) - rotations[here] @ known.mean(axis=0)
    return rotations, places
