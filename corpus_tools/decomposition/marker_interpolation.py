"""Interpolation from a few markers to all landmarks of a person's face."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lexicon.errors import DataError
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_REGION,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.numeric.arrays import FloatArray
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

    rest: FloatArray
    shares: FloatArray
    rotation: FloatArray
    translation: FloatArray
    size: float

    def landmarks(self, displacements: FloatArray) -> FloatArray:
        """(T, 478, 3) landmarks for displacements (T, M, 3) of the markers in the head's axes, mm."""
        moved: FloatArray = np.einsum("lm,tmi->tli", self.shares, displacements @ self.rotation.T, optimize=True)
        return self.rest + moved


def build_marker_interpolator(markers: FloatArray, at: Sequence[int], common: FloatArray) -> MarkerInterpolator:
    """The interpolator from a person's markers to landmarks.

    Parameters
    ----------
    markers : (M, 3)
        At rest, mm, in the head's axes.
    at : (M,)
        Landmark at which each lies.
    common : (478, 3)
        The common face at rest.

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


def _query_points(rest: FloatArray) -> FloatArray:
    """(478, 3) positions at which the field is evaluated for each landmark: its own, or that of the outer lip line."""
    queries = rest.copy()
    for outer, lines in ((OUTER_LIP_UPPER, UPPER_LIP_LINES), (OUTER_LIP_LOWER, LOWER_LIP_LINES)):
        for line in lines:
            queries[list(line)] = rest[list(outer)]
    return queries


def _landmark_groups(common: FloatArray) -> list[tuple[list[int], set[int]]]:
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
    # lips and lids are apart though near: a side is moved without the markers of the opposite one
    return [(sorted(side), opposite) for side, opposite in sides] + [(others, set())]
