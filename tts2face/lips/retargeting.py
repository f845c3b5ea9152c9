"""Retargeting of a talker's speech motion to a face by their common landmarks.

Bounded least squares within each shape's limits; Theobald et al. 2007, eq. 5 (inner products), is the special case of
an orthonormal target basis without limits.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence
from tts2face.face.landmarks import landmark_motion, landmark_positions, procrustes_rotation
from tts2face.face.lip_constraints import MIDDLE_PAIR, SPEECH_SHAPE_PREFIXES
from tts2face.face.mouth import (
    CHIN_LANDMARKS,
    CORNERS_LEFT,
    CORNERS_RIGHT,
    VISIBLE,
    MouthWeights,
    landmark_weights,
    mouth_curvature,
    require_lips,
)
from tts2face.face.stand_in import consonants_beside_vowels
from tts2face.lips.score_matching import FROWN, SIDEWAYS, ScoreMatching, build_score_matching
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
    inner_lip_gaps,
)
from tts2face.models.score_map import ScoreMap
from tts2face.models.talker import ShapeModel, Talker
from tts2face.numeric.arrays import FloatArray, ordered_product
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.types import Trajectory

BILABIALS = frozenset({"p", "b", "m"})
CONTACT_PERCENTILE = 90  # of the smallest gaps in bilabials: the tracked gap up to which lips touch
MAX_CONTACT_MM = 1.5  # upper limit of the tracked gap of touching lips; larger values are tracking errors
FULL_GAP_MM = 3.0  # gap beyond contact from which it is reproduced in full
GAP_WEIGHT = 300.0  # of a lip gap, relative to a landmark of the cheek: contact is the most visible
# With score rows, whose logits weigh as much: gaps, width and chin must hold against them.
SCORED_GAP_WEIGHT = 70_000.0
SCORED_GAP_GAIN = 1.06  # of target gaps: the ridge and the other rows make them smaller
SCORED_DEPTH_WEIGHT = 3000.0  # of the depth between facing lip points
SCORED_MOUTH = MouthWeights(width=800_000.0, chin=3000.0)


@dataclass(frozen=True, slots=True, eq=False)
class Retargeter:
    """Mapping from a talker's speech parameters to a face's shape weights; built by `build_retargeter`.

    Parameters
    ----------
    moving : (k,)
        Indices of the face's shapes that speech moves.
    limits : (k, 2)
        Least and greatest weight of these shapes.
    curvature : (k, k)
        Normal matrix of the weighted least squares.
    linear_term : (k, S + 1)
        Linear term of landmarks and width: ``linear_term[:, :S] @ parameters + linear_term[:, S]``.
    gaps : (P, S + 1)
        The talker's lip gaps at the face's scale minus `contact`: ``gaps[:, :S] @ parameters + gaps[:, S]``, mm.
    contact, gap_rest : (P,)
        Tracked gaps of touching lips, mm; `gaps` at the talker's rest, mm.
    gap_linear_term, lip_linear_term : (k, P)
        Linear term per mm of target gap, and of the two lip landmarks per mm by which the target gap exceeds the
        talker's.
    model
        The talker's shape model.
    scores
        Scores of the talker for speech parameters; None if they are given with the parameters.
    matching
        Rows of the scores; None for a face or a talker whose scores are unknown.
    """

    shape_names: tuple[str, ...]
    moving: NDArray[np.int64]
    limits: FloatArray
    curvature: FloatArray
    linear_term: FloatArray
    gaps: FloatArray
    contact: FloatArray
    gap_rest: FloatArray
    gap_linear_term: FloatArray
    lip_linear_term: FloatArray
    model: ShapeModel
    scores: ScoreMap | None = None
    matching: ScoreMatching | None = None

    def with_held_smile(self, scores: Mapping[str, float]) -> "Retargeter":
        """The retargeter of a person who smiles throughout: a face at rest smiles, and speech moves about that.

        Parameters
        ----------
        scores
            Scores of shapes at rest.
        """
        names = [self.shape_names[at] for at in self.moving]
        given = np.array([scores.get(name, 0.0) for name in names])
        held = given if self.matching is None else self.matching.weights_alone(given)
        linear = self.linear_term.copy()
        linear[:, -1] += ordered_product(self.curvature, held)
        return replace(self, linear_term=linear)

    def retarget(self, speech: Trajectory, scores: FloatArray | None = None) -> Trajectory:
        """Weights (T, K) of all shapes of the face for a trajectory of speech parameters (T, S).

        Frames are solved independently of each other.

        Parameters
        ----------
        scores : (T, n)
            Scores of the frames as of `mouth_scores`; by default those of the talker's score map.
        """
        parameters = speech.values.astype(np.float64)
        tracked_gaps = ordered_product(parameters, self.gaps[:, :-1].T) + self.gaps[:, -1]
        # with gaps relative to 0, 73 % of /p b m/ closed; relative to contact all (decision 022)
        beyond_contact = np.maximum(tracked_gaps, 0.0)  # gaps of the face are relative to its rest, where lips touch
        target_gaps = beyond_contact + self.contact * np.minimum(beyond_contact / FULL_GAP_MM, 1.0)
        if self.matching is not None:
            target_gaps = SCORED_GAP_GAIN * target_gaps
        linear = ordered_product(parameters, self.linear_term[:, :-1].T) + self.linear_term[:, -1]
        linear += ordered_product(target_gaps, self.gap_linear_term.T) + ordered_product(
            target_gaps - tracked_gaps + self.gap_rest, self.lip_linear_term.T
        )
        if scores is None and self.scores is not None:
            scores = self.scores.scores(parameters)
        if scores is None or self.matching is None:
            solved = bounded_least_squares(self.curvature, linear, self.limits)
        else:
            solved = self.matching.solve(linear, scores, target_gaps, distance_from_rest(parameters, self.model))
        weights = np.zeros((len(parameters), len(self.shape_names)), np.float32)
        weights[:, self.moving] = solved
        return Trajectory(self.shape_names, weights, speech.fps)


def build_retargeter(
    talker: Talker, face: Face, *, contact: FloatArray | None = None, rest_scores: FloatArray | None = None
) -> Retargeter:
    """Retargeter from a talker to a face.

    Parameters
    ----------
    contact : (P,)
        Gaps, in the talker's mm, up to which facing lip points touch; `contact_gaps` of the talker when None.
    rest_scores : (n,)
        Scores of the talker at rest as of `mouth_scores`, if scores will be given with the parameters.

    Raises
    ------
    DataError
        The face lacks landmarks of the lips, has no shape that speech moves, or a mouth has no width.
    """
    moving = np.array([i for i, name in enumerate(face.shape_names) if name.startswith(SPEECH_SHAPE_PREFIXES)])
    require_lips(face, moving)
    common = [landmark for landmark in MOUTH_REGION if landmark in set(face.landmarks.tolist())]
    at = {landmark: row for row, landmark in enumerate(common)}
    rest, per_weight = landmark_positions(face), landmark_motion(face, moving)
    turn, scale = _fit_face_axes(talker, face, rest)
    shape_motion = per_weight[[int(np.flatnonzero(face.landmarks == landmark)[0]) for landmark in common]]
    talker_motion = _displacements(talker, common, scale * turn)
    scores = talker.scores if talker.scores and len(talker.scores.inputs) == talker.model.n_speech else None
    if rest_scores is None and scores is not None:
        rest_scores = scores.scores(talker.model.rest[None, : talker.model.n_speech])[0]
    response = None if rest_scores is None else _response(face, moving)
    mouth, gap_weight = (VISIBLE, GAP_WEIGHT) if response is None else (SCORED_MOUTH, SCORED_GAP_WEIGHT)
    weighted = shape_motion * landmark_weights(common)[..., None]
    linear_term = np.einsum("ldk,lds->ks", weighted, talker_motion)
    left, right = ([at[corner] for corner in corners] for corners in (CORNERS_LEFT, CORNERS_RIGHT))
    upper, lower = ([at[lip] for lip in lips] for lips in (INNER_LIP_UPPER, INNER_LIP_LOWER))
    widened, opened = shape_motion[left, 0] - shape_motion[right, 0], shape_motion[upper, 1] - shape_motion[lower, 1]
    linear_term += mouth.width * ordered_product(widened.T, talker_motion[left, 0] - talker_motion[right, 0])
    chin = [at[landmark] for landmark in CHIN_LANDMARKS if landmark in at]
    dropped = shape_motion[chin, 1].mean(axis=0)
    linear_term += mouth.chin * np.outer(dropped, talker_motion[chin, 1].mean(axis=0))
    apart = shape_motion[upper, 2] - shape_motion[lower, 2]
    depth_weight = 0.0 if response is None else SCORED_DEPTH_WEIGHT
    linear_term += depth_weight * ordered_product(apart.T, talker_motion[upper, 2] - talker_motion[lower, 2])
    contact = scale * (contact_gaps(talker) if contact is None else contact)
    gaps = _talker_gaps(talker, scale * turn[1], contact)
    curvature = mouth_curvature(shape_motion, common, mouth) + gap_weight * ordered_product(opened.T, opened)
    curvature += depth_weight * ordered_product(apart.T, apart)
    limits = face.limits[moving].astype(np.float64)
    left_out = consonants_beside_vowels(face.shape_names)
    limits[[face.shape_names[at] in left_out for at in moving]] = 0.0
    return Retargeter(
        shape_names=face.shape_names,
        moving=moving,
        limits=limits,
        curvature=curvature,
        linear_term=linear_term,
        gaps=gaps,
        contact=contact,
        gap_rest=ordered_product(gaps[:, :-1], talker.model.rest[: talker.model.n_speech]) + gaps[:, -1],
        gap_linear_term=gap_weight * opened.T,
        lip_linear_term=(weighted[upper, 1] - weighted[lower, 1]).T / 2,
        model=talker.model,
        scores=scores,
        matching=None
        if response is None or rest_scores is None
        else build_score_matching(
            response,
            (curvature, limits, opened),
            rest_scores,
            # with the prior of shipped faces imported ones frown in every frame, .09 in the mean (decision 242)
            (*SIDEWAYS, *FROWN) if face.lip_tolerance_mm else SIDEWAYS,
        ),
    )


def distance_from_rest(parameters: FloatArray, model: ShapeModel) -> FloatArray:
    """Distance (T,) of speech parameters (T, S) from rest in standard deviations of the recorded speech."""
    n_speech = model.n_speech
    away = np.square(parameters - model.rest[:n_speech]).sum(axis=1)
    return np.asarray(np.sqrt(away / max(float(np.square(model.spread[:n_speech]).sum()), 1e-12)), np.float64)


def _response(face: Face, moving: NDArray[np.int64]) -> ScoreMap | None:
    """Score map of a face, if it has one of exactly the shapes that speech moves."""
    names = tuple(face.shape_names[at] for at in moving)
    return face.scores if face.scores is not None and face.scores.inputs == names else None


def inner_product_map(source: NDArray[np.floating], target: NDArray[np.floating]) -> FloatArray:
    """Matrix R (q, r) that maps parameters of a source basis (r, D) to an orthonormal target basis (q, D).

    Notes
    -----
    Theobald et al. 2007, eq. 5: the inner products of the basis vectors. A sign flip of a basis vector cancels out.
    """
    return np.asarray(target, np.float64) @ np.asarray(source, np.float64).T


def _displacements(talker: Talker, common: list[int], onto_face: FloatArray) -> FloatArray:
    """Motion (L, 3, S + 1) of the talker's landmarks per parameter, and from rest to parameters of 0, mm."""
    n_speech = talker.model.n_speech
    basis = talker.model.basis[:n_speech, common].astype(np.float64)
    talker_motion = np.einsum("slc,dc->lds", basis, onto_face)
    at_rest = ordered_product(talker_motion, talker.model.rest[:n_speech].astype(np.float64))
    return np.concatenate([talker_motion, -at_rest[..., None]], axis=2)


def _fit_face_axes(talker: Talker, face: Face, rest: FloatArray) -> tuple[FloatArray, float]:
    """Rotation (3, 3) of the talker's axes into the face's, and the ratio of mouth widths, face to talker."""
    model = talker.model
    own = (model.mean + np.einsum("m,mld->ld", model.rest, model.basis)).astype(np.float64)
    rows = {int(landmark): row for row, landmark in enumerate(face.landmarks)}
    width = np.linalg.norm(rest[rows[MOUTH_CORNER_LEFT]] - rest[rows[MOUTH_CORNER_RIGHT]])
    own_width = np.linalg.norm(own[MOUTH_CORNER_LEFT] - own[MOUTH_CORNER_RIGHT])
    if not min(width, own_width) > 0:
        which = "face" if own_width > 0 else "talker"
        raise DataError(f"the corners of the {which}'s mouth coincide; build the {which} again")
    return procrustes_rotation(own[face.landmarks], rest), float(width / own_width)


def _talker_gaps(talker: Talker, up: FloatArray, contact: FloatArray) -> FloatArray:
    """Gaps (P, S + 1) of facing inner lip points minus `contact`, along the direction `up` (3,)."""
    model, n_speech = talker.model, talker.model.n_speech
    upper, lower = list(INNER_LIP_UPPER), list(INNER_LIP_LOWER)
    basis = ordered_product((model.basis[:n_speech, upper] - model.basis[:n_speech, lower]).astype(np.float64), up)
    mean = ordered_product((model.mean[upper] - model.mean[lower]).astype(np.float64), up)
    return np.column_stack([basis.T, mean - contact])


def contact_gaps(talker: Talker) -> FloatArray:
    """Tracked gaps (P,), in the talker's mm, up to which facing lip points touch.

    A percentile over bilabials, each at the frame where its middle pair is closest; 0 without bilabials in the corpus.
    """
    model, n_speech = talker.model, talker.model.n_speech
    apart, mean = inner_lip_gaps(model.basis[:n_speech]), inner_lip_gaps(model.mean)
    spoken = [utterance for utterance in talker.utterances if not BILABIALS.isdisjoint(utterance.phones.phones)]
    frames = np.concatenate([np.zeros((0, n_speech)), *(utterance.shape[:, :n_speech] for utterance in spoken)])
    gaps, ends = ordered_product(frames, apart) + mean, np.cumsum([len(utterance.shape) for utterance in spoken])
    minima = [
        _bilabial_minima(gaps[end - len(utterance.shape) : end], utterance.phones, talker.fps)
        for utterance, end in zip(spoken, ends, strict=True)
    ]
    bilabial_gaps = np.concatenate([np.zeros((0, len(mean))), *minima])
    return (
        np.clip(np.percentile(bilabial_gaps, CONTACT_PERCENTILE, axis=0), 0.0, MAX_CONTACT_MM)
        if len(bilabial_gaps)
        else np.zeros(len(mean))
    )


def _bilabial_minima(gaps: FloatArray, phones: PhoneSequence, fps: float) -> FloatArray:
    """Rows (B, P) of gaps (T, P): the frame of each bilabial at which the middle pair is closest."""
    rows = []
    for phone, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        if phone not in BILABIALS:
            continue
        first, last = math.floor(start * fps), math.ceil(end * fps) + 1
        if len(gaps[first:last]):
            rows.append(first + int(gaps[first:last, MIDDLE_PAIR].argmin()))
    return gaps[rows]
