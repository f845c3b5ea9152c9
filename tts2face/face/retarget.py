"""Motion of a talker carried to a face, on the landmarks that both have.

Least squares within each shape's limits; Theobald et al. 2007, eq. 5 (inner products), is its case of an orthonormal
target without limits.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence
from tts2face.face.model import Face
from tts2face.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    UPPER_LIP_INNER_MID,
)
from tts2face.talker import Talker
from tts2face.types import Trajectory

FloatArray = NDArray[np.float64]

SPEECH_SHAPES = ("jaw", "mouth")  # how the names of the shapes that speech moves begin
CORNERS_LEFT, CORNERS_RIGHT = (OUTER_LIP_UPPER[-1], INNER_LIP_UPPER[-1]), (OUTER_LIP_UPPER[0], INNER_LIP_UPPER[0])
BILABIALS = frozenset({"p", "b", "m"})
SURE_CONTACT = 75  # percentile of the least gaps in bilabials: up to this gap the talker's lips touch
MOST_CONTACT_MM = 1.5  # a tracker that reads more than this on touching lips is not to be trusted
LIP_WEIGHT = 10.0  # a lip landmark against one of the jaw or cheek
DEPTH_WEIGHT = 0.1  # z against x and y: a single camera sees depth with some ten times their error
GAP_WEIGHT = 60.0  # the gap between facing lip points against a lip landmark: whether lips touch is what a viewer sees
WIDTH_WEIGHT = 60.0  # the mouth's width, likewise: rounding is the other thing that a viewer reads from lips
EFFORT = 0.005  # share of the mean curvature that draws every weight to 0: makes the answer unique and calm
STOP = 1e-5  # change of a weight at which the iteration ends
MOST_SWEEPS = 2000


@dataclass(frozen=True, slots=True, eq=False)
class Retargeter:
    """The prepared way from a talker's speech parameters to a face's weights.

    Parameters
    ----------
    moving : (k,)
        Numbers of the face's shapes that speech moves.
    curvature : (k, k)
        Normal matrix of the weighted least squares.
    pull : (k, S + 1)
        Linear term: ``pull[:, :S] @ parameters + pull[:, S]``, without the gaps.
    gap_basis, gap_rest : (P, S), (P,)
        The talker's lip gaps in the face's size, mm; contact is 0.
    gap_pull : (k, P)
        What a gap adds to the linear term. A face rests with its lips closed: its gaps are counted from there.
    """

    shape_names: tuple[str, ...]
    moving: NDArray[np.int64]
    limits: FloatArray
    curvature: FloatArray
    pull: FloatArray
    gap_basis: FloatArray
    gap_rest: FloatArray
    gap_pull: FloatArray

    def retarget(self, speech: Trajectory) -> Trajectory:
        """Weights of all shapes of the face, (T, K), for a trajectory of speech parameters, (T, S).

        Each frame is solved on its own: the answer does not depend on what came before.
        """
        parameters = speech.values.astype(np.float64)
        gaps = np.maximum(parameters @ self.gap_basis.T + self.gap_rest, 0.0)
        linear = parameters @ self.pull[:, :-1].T + self.pull[:, -1] + gaps @ self.gap_pull.T
        solved = bounded_least_squares(self.curvature, linear, self.limits)
        weights = np.zeros((len(parameters), len(self.shape_names)), np.float32)
        weights[:, self.moving] = solved
        return Trajectory(self.shape_names, weights, speech.fps)


def retargeter(talker: Talker, face: Face) -> Retargeter:
    """Prepare the way from a talker to a face.

    Raises
    ------
    DataError
        The face lacks the lips' landmarks, or has no shape that speech could move.
    """
    moving = np.array([i for i, name in enumerate(face.shape_names) if name.startswith(SPEECH_SHAPES)])
    known = {int(landmark): row for row, landmark in enumerate(face.landmarks)}
    lips = (*INNER_LIP_UPPER, *INNER_LIP_LOWER, *OUTER_LIP_UPPER, *OUTER_LIP_LOWER)
    missing = [landmark for landmark in lips if landmark not in known]
    if missing or not len(moving):
        what = f"landmark {missing[0]} of the lips" if missing else "shapes named jaw... or mouth..."
        raise DataError(f"the face lacks {what}, so no speech can move it; build it with its landmark table")
    common = [landmark for landmark in MOUTH_REGION if landmark in known]
    rows = [known[landmark] for landmark in common]
    rest, per_weight = _landmarks(face, moving)
    turn, scale = _onto_face(talker, face, rest)
    model = talker.model
    speech = model.basis[: model.n_speech].astype(np.float64)
    weights = _row_weights(common)
    wanted = scale * np.einsum("slc,dc->lds", speech[:, common], turn)
    at_rest = wanted @ model.rest[: model.n_speech].astype(np.float64)
    moved = per_weight[rows]
    plain = np.einsum("ldk,ld,ldj->kj", moved, weights, moved)
    from_rest = np.concatenate([wanted, -at_rest[..., None]], axis=2)
    pull = np.einsum("ldk,ld,lds->ks", moved, weights, from_rest)
    left, right = (np.array([common.index(corner) for corner in corners]) for corners in (CORNERS_LEFT, CORNERS_RIGHT))
    widened = moved[left, 0] - moved[right, 0]
    effort = EFFORT * np.trace(plain) / len(moving)
    curvature = plain + WIDTH_WEIGHT * widened.T @ widened
    pull += WIDTH_WEIGHT * widened.T @ (from_rest[left, 0] - from_rest[right, 0])
    gap_basis, gap_rest = _talker_gaps(talker, turn, scale)
    upper = [known[landmark] for landmark in INNER_LIP_UPPER]
    lower = [known[landmark] for landmark in INNER_LIP_LOWER]
    gap_per_weight = per_weight[upper, 1] - per_weight[lower, 1]
    curvature += GAP_WEIGHT * gap_per_weight.T @ gap_per_weight + effort * np.eye(len(moving))
    return Retargeter(
        face.shape_names,
        moving,
        face.limits[moving].astype(np.float64),
        curvature,
        pull,
        gap_basis,
        gap_rest,
        GAP_WEIGHT * gap_per_weight.T,
    )


def inner_product_map(source: NDArray[np.floating], target: NDArray[np.floating]) -> FloatArray:
    """R (q, r) that carries parameters of a source basis (r, D) to an orthonormal target basis (q, D).

    Notes
    -----
    Theobald et al. 2007, eq. 5: the inner products of the basis vectors. Signs look after themselves.
    """
    return np.asarray(target, np.float64) @ np.asarray(source, np.float64).T


def bounded_least_squares(curvature: FloatArray, linear: FloatArray, limits: FloatArray) -> FloatArray:
    """(T, k) minimisers of ``w' H w / 2 - f' w`` within limits, one for each row f of `linear`.

    Parameters
    ----------
    curvature : (k, k)
        H, symmetric and positive definite: the answer is unique.
    linear : (T, k)
    limits : (k, 2)

    Notes
    -----
    Cyclic coordinate descent from the unlimited solution, held within the limits (Wright 2015). O(T k^2) a sweep.
    """
    low, high = np.ascontiguousarray(limits[:, 0]), np.ascontiguousarray(limits[:, 1])
    start = np.ascontiguousarray(np.clip(np.linalg.solve(curvature, linear.T).T, low, high))
    solved: FloatArray = _descend(np.ascontiguousarray(curvature), np.ascontiguousarray(linear), low, high, start)
    return solved


@njit(cache=True, nogil=True)
def _descend(curvature, linear, low, high, weights):  # type: ignore[no-untyped-def]
    n_frames, k = linear.shape
    for t in range(n_frames):
        slope = linear[t] - curvature @ weights[t]
        for _ in range(MOST_SWEEPS):
            largest = 0.0
            for i in range(k):
                before = weights[t, i]
                after = min(max(before + slope[i] / curvature[i, i], low[i]), high[i])
                step = after - before
                if step != 0.0:
                    weights[t, i] = after
                    for j in range(k):
                        slope[j] -= curvature[j, i] * step
                    largest = max(largest, abs(step))
            if largest < STOP:
                break
    return weights


def _landmarks(face: Face, moving: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """(L, 3) landmarks of the face at rest, and (L, 3, k) their motion per weight, mm."""
    mixed = face.landmark_weights.astype(np.float64)[..., None]
    rest = (face.vertices[face.landmark_vertices] * mixed).sum(axis=1)
    per_weight = [(face.shapes[k][face.landmark_vertices] * mixed).sum(axis=1) for k in moving]
    return rest, np.stack(per_weight, axis=-1)


def _row_weights(common: list[int]) -> FloatArray:
    """(L, 3) weight of each landmark coordinate."""
    lips = {*INNER_LIP_UPPER, *INNER_LIP_LOWER, *OUTER_LIP_UPPER, *OUTER_LIP_LOWER}
    per_landmark = np.array([LIP_WEIGHT if landmark in lips else 1.0 for landmark in common])
    weights: FloatArray = per_landmark[:, None] * np.array([1.0, 1.0, DEPTH_WEIGHT])
    return weights


def _onto_face(talker: Talker, face: Face, rest: FloatArray) -> tuple[FloatArray, float]:
    """Rotation (3, 3) of the talker's axes into the face's, and the face's size over the talker's at the mouth."""
    model = talker.model
    own = (model.mean + np.tensordot(model.rest, model.basis, axes=1)).astype(np.float64)
    rows = {int(landmark): row for row, landmark in enumerate(face.landmarks)}
    of_talker, of_face = own[face.landmarks], rest
    inertia = (of_talker - of_talker.mean(axis=0)).T @ (of_face - of_face.mean(axis=0))
    left, _, right = np.linalg.svd(inertia)
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    width = np.linalg.norm(rest[rows[MOUTH_CORNER_LEFT]] - rest[rows[MOUTH_CORNER_RIGHT]])
    return (left @ mirror @ right).T, float(width / np.linalg.norm(own[MOUTH_CORNER_LEFT] - own[MOUTH_CORNER_RIGHT]))


def _talker_gaps(talker: Talker, turn: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """(P, S) and (P,): gaps of facing inner lip points over the talker's contact, in the face's size and axes."""
    model = talker.model
    upper, lower = list(INNER_LIP_UPPER), list(INNER_LIP_LOWER)
    up = turn[1] * scale
    basis = (model.basis[: model.n_speech, upper] - model.basis[: model.n_speech, lower]).astype(np.float64) @ up
    mean = (model.mean[upper] - model.mean[lower]).astype(np.float64) @ up
    return basis.T, mean - contact_gap(talker) * scale


def contact_gap(talker: Talker) -> float:
    """Gap in mm, mid lips, up to which the tracked lips of a talker touch: most bilabials come at least so near."""
    model = talker.model
    mid = model.basis[: model.n_speech, UPPER_LIP_INNER_MID, 1] - model.basis[: model.n_speech, LOWER_LIP_INNER_MID, 1]
    mean = float(model.mean[UPPER_LIP_INNER_MID, 1] - model.mean[LOWER_LIP_INNER_MID, 1])
    least: list[float] = []
    for utterance in talker.utterances:
        gaps = utterance.shape[:, : model.n_speech] @ mid + mean
        least += _least_in_bilabials(gaps, utterance.phones, talker.fps)
    return float(np.clip(np.percentile(least, SURE_CONTACT), 0.0, MOST_CONTACT_MM)) if least else 0.0


def _least_in_bilabials(gaps: NDArray[np.floating], phones: PhoneSequence, fps: float) -> list[float]:
    spans = zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True)
    frames = [
        (int(np.floor(start * fps)), int(np.ceil(end * fps)) + 1) for phone, start, end in spans if phone in BILABIALS
    ]
    return [float(gaps[first:last].min()) for first, last in frames if gaps[first:last].size]
