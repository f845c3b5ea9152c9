"""Interpolation from a few markers to all landmarks of a person's face.

Head pose from markers on the skull, and its removal from the markers of the face.

Gaps in marker tracks: short ones are interpolated and reported, long ones rejected.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_REGION,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.numeric.arrays import interpolate_columns, true_runs
from tts2face.numeric.splines import fit_interpolant
from tts2face.video.pose import similarity_transforms

FACE_WIDTH_LANDMARKS = (234, 454)  # landmarks as far apart as the face is wide
MIN_SIZE_RATIO, MAX_SIZE_RATIO = 0.6, 1.7  # of the common face over the person's; beyond these the unit is wrong
# Lines of each lip between the outer and the inner one, from the right corner to the left: entry k of each lies behind
# entry k of the outer line. Then the landmarks of upper lids and of lower lids.
UPPER_LIP_LINES = (
    (76, 184, 74, 73, 72, 11, 302, 303, 304, 408, 306),
    (62, 183, 42, 41, 38, 12, 268, 271, 272, 407, 292),
    INNER_LIP_UPPER,
)
LOWER_LIP_LINES = (
    (76, 77, 90, 180, 85, 16, 315, 404, 320, 307, 306),
    (62, 96, 89, 179, 86, 15, 316, 403, 319, 325, 292),
    INNER_LIP_LOWER,
)
UPPER_LIDS = (
    (246, 161, 160, 159, 158, 157, 173, 247, 30, 29, 27, 28, 56, 190),
    (466, 388, 387, 386, 385, 384, 398, 467, 260, 259, 257, 258, 286, 414),
)
LOWER_LIDS = (
    (7, 163, 144, 145, 153, 154, 155, 25, 110, 24, 23, 22, 26, 112),
    (249, 390, 373, 374, 380, 381, 382, 255, 339, 254, 253, 252, 256, 341),
)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MarkerInterpolator:
    """A person's face in the axes of the common one.

    Parameters
    ----------
    rest : (478, 3)
        Landmarks at rest in the person's own size, mm.
    shares : (478, M)
        Interpolation weight of each marker for each landmark.
    turn, shift, size
        ``common / size = turn @ head + shift``, from the head's axes: (3, 3), (3,), and common over own size.
    """

    rest: Floats
    shares: Floats
    rotation: Floats
    translation: Floats
    size: float

    def landmarks(self, displacements: Floats) -> Floats:
        """(T, 478, 3) landmarks for displacements (T, M, 3) of the markers in the head's axes, mm."""
        moved: Floats = np.einsum("lm,tmi->tli", self.shares, displacements @ self.rotation.T, optimize=True)
        return self.rest + moved


def build_marker_interpolator(markers: Floats, at: Sequence[int], common: Floats) -> MarkerInterpolator:
    """The interpolator from a person's markers to landmarks.

    Parameters
    ----------
    markers : (M, 3)
        At rest, mm, in the head's axes.
    at : (M,)
        Landmark at which each lies.
    common : (478, 3)
        The common face at rest.

    Raises
    ------
    DataError
        The implied size of the face is implausible.

    Notes
    -----
    The common face is aligned with the markers by a similarity (Umeyama 1991) and warped to them by radial basis
    functions (`tts2face.numeric.splines`). Landmarks of an upper lip or lid do not depend on markers of the lower
    one and vice versa, because they are close at rest and move apart.
    Inner landmarks of a lip move like its outer line, because
    marker sets rarely have markers further inside.
    """
    places = common[list(at)]
    weights = np.full(len(at), 1.0 / len(at))
    turns, sizes = similarity_transforms(markers[None], places, weights)
    turn, size = turns[0], float(sizes[0])
    if not MIN_SIZE_RATIO <= size <= MAX_SIZE_RATIO:
        raise DataError(f"the distances of the markers are {1 / size:.3g} times those on a face; check the file's unit")
    shift = weights @ places / size - turn @ (weights @ markers)
    own = common / size
    width = float(np.linalg.norm(own[FACE_WIDTH_LANDMARKS[0]] - own[FACE_WIDTH_LANDMARKS[1]]))
    bent = fit_interpolant(own[list(at)], markers @ turn.T + shift - own[list(at)], width)
    rest = own + bent(own)
    shares = np.zeros((len(common), len(at)))
    queries = _query_points(rest)
    for side, opposite in _landmark_groups(common):
        free = [marker for marker, landmark in enumerate(at) if landmark not in opposite]
        if free:
            follow = fit_interpolant(rest[[at[marker] for marker in free]], np.eye(len(free)), width)
            shares[np.ix_(side, free)] = follow(queries[side])
    return MarkerInterpolator(rest, shares, turn, shift, size)


def _query_points(rest: Floats) -> Floats:
    """(478, 3) positions at which the field is evaluated for each landmark: its own, or that of the outer lip line."""
    queries = rest.copy()
    for outer, lines in ((OUTER_LIP_UPPER, UPPER_LIP_LINES), (OUTER_LIP_LOWER, LOWER_LIP_LINES)):
        for line in lines:
            queries[list(line)] = rest[list(outer)]
    return queries


def _landmark_groups(common: Floats) -> list[tuple[list[int], set[int]]]:
    """Groups of landmarks that depend on the same markers, each with the landmarks of the excluded markers."""
    corners = {landmark for line in (OUTER_LIP_UPPER, *UPPER_LIP_LINES) for landmark in (line[0], line[-1])}
    upper = {*OUTER_LIP_UPPER, *(landmark for line in UPPER_LIP_LINES for landmark in line)} - corners
    height = common[[OUTER_LIP_UPPER[0], OUTER_LIP_UPPER[-1]], 1].mean()
    low = {landmark for landmark in MOUTH_REGION if common[landmark, 1] < height}
    lower = (low | {landmark for line in LOWER_LIP_LINES for landmark in line}) - upper - corners
    pairs = [(upper, lower), *((set(up), set(down)) for up, down in zip(UPPER_LIDS, LOWER_LIDS, strict=True))]
    sides = [*pairs, *((down, up) for up, down in pairs)]
    apart = set().union(*(side for side, _ in sides))
    others = [landmark for landmark in range(N_MESH_LANDMARKS) if landmark not in apart]
    return [(sorted(side), opposite) for side, opposite in sides] + [(others, set())]


MAX_MARKER_GAP_S = 0.2  # motion in longer gaps cannot be interpolated reliably
MARKER_SET_ADVICE = "give a marker set without it"
MAX_QUOTED_MARKERS = 4  # markers quoted in a message


def fill_marker_gaps(tracks: Floats, names: Sequence[str], fps: float) -> tuple[Floats, tuple[str, ...]]:
    """Tracks without gaps, and a note on the filled gaps.

    Parameters
    ----------
    tracks : (T, M, 3)
        NaN in gaps.

    Raises
    ------
    DataError
        A gap is longer than `MAX_MARKER_GAP_S`; the message names the marker and the time.

    Notes
    -----
    Inner gaps by monotone cubic interpolation (PCHIP, Fritsch and Carlson 1980); gaps at the ends by the nearest value.
    """
    whole, counts = tracks.copy(), {}
    for marker, name in enumerate(names):
        is_missing = np.asarray(np.isnan(tracks[:, marker]).any(axis=1))
        if not is_missing.any():
            continue
        check_gap(f"marker {name}", is_missing, fps)
        whole[is_missing, marker] = _interpolate_gaps(tracks[:, marker], is_missing)
        counts[name] = int(is_missing.sum())
    if not counts:
        return whole, ()
    named = ", ".join(f"{name} ({count} frames)" for name, count in list(counts.items())[:MAX_QUOTED_MARKERS])
    more = f" and {len(counts) - MAX_QUOTED_MARKERS} more" if len(counts) > MAX_QUOTED_MARKERS else ""
    return whole, (f"gaps were filled in {named}{more}",)


def check_gap(what: str, is_missing: NDArray[np.bool_], fps: float) -> None:
    """Check that gaps, True in (T,), are short enough to be filled; errors as `fill_marker_gaps`."""
    if is_missing.all():
        raise DataError(f"the {what} is never visible; {MARKER_SET_ADVICE}, or capture it again")
    begin, end = max(true_runs(is_missing).tolist(), key=lambda gap: gap[1] - gap[0], default=(0, 0))
    if (end - begin) / fps > MAX_MARKER_GAP_S:
        raise DataError(
            f"the {what} is hidden for {(end - begin) / fps:.2f} s from {begin / fps:.2f} s on, and gaps up to "
            f"{MAX_MARKER_GAP_S:g} s can be filled; fill it in the capture software, or {MARKER_SET_ADVICE}"
        )


def _interpolate_gaps(track: Floats, is_missing: NDArray[np.bool_]) -> Floats:
    """(G, 3) positions in the frames of gaps."""
    from scipy.interpolate import PchipInterpolator

    there = np.flatnonzero(~is_missing)
    if len(there) == 1:
        return np.repeat(track[there], is_missing.sum(), axis=0)
    at = np.clip(np.flatnonzero(is_missing), there[0], there[-1])
    return np.asarray(PchipInterpolator(there, track[there])(at))


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
    """

    reference: Floats
    rotations: Floats
    places: Floats

    def remove_from(self, points: Floats) -> Floats:
        """(T, M, 3) points in the head's own axes."""
        local: Floats = np.einsum("tij,tmi->tmj", self.rotations, points - self.places[:, None])
        return local


def fit_head_poses(
    points: Floats, names: Sequence[str], fps: float, *, reference: Floats | None = None
) -> tuple[HeadPoses, tuple[str, ...]]:
    """Poses of the head, and a note on filled gaps.

    Parameters
    ----------
    points : (T, H, 3)
        The head's markers, NaN in gaps; three in a frame suffice.
    reference : (H, 3)
        The head as other recordings of the session have it; the recording's own by default.

    Raises
    ------
    DataError
        There are fewer than three, they are collinear, hidden for too long, or do not move rigidly.

    Notes
    -----
    Kabsch 1976 on the visible markers, alternating between reference and poses. Missing poses are interpolated.
    """
    if len(names) < MIN_VISIBLE_MARKERS:
        raise DataError(f"the file has {len(names)} markers of the head; its pose needs at least {MIN_VISIBLE_MARKERS}")
    is_visible = np.asarray(np.isfinite(points).all(axis=2))
    posed = np.asarray(is_visible.sum(axis=1) >= MIN_VISIBLE_MARKERS)
    check_gap("head's pose", ~posed, fps)
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
    notes = () if posed.all() else (f"the head's pose was interpolated in {int((~posed).sum())} frames",)
    return HeadPoses(head, *_interpolate_poses(rotations, places, posed)), notes


def _interpolate_poses(rotations: Floats, places: Floats, posed: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Poses of all frames, interpolated from known ones: spherical for rotations, linear for positions."""
    from scipy.spatial.transform import Rotation, Slerp

    there = np.flatnonzero(posed)
    if len(there) == 1:
        return rotations.repeat(len(posed), axis=0), places.repeat(len(posed), axis=0)
    frames = np.arange(len(posed))
    turned = Slerp(there, Rotation.from_matrix(rotations))(np.clip(frames, there[0], there[-1])).as_matrix()
    turned[there] = rotations
    return turned, interpolate_columns(places, there, frames)


def _first_reference(points: Floats, is_visible: NDArray[np.bool_]) -> Floats:
    whole = np.flatnonzero(is_visible.all(axis=1))
    if not len(whole):
        raise DataError("no frame shows all markers of the head; remove rarely visible ones from the set")
    head: Floats = points[whole[0]] - points[whole[0]].mean(axis=0)
    return head


def _fit_poses(points: Floats, is_visible: NDArray[np.bool_], head: Floats) -> tuple[Floats, Floats]:
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
