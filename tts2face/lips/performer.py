"""Retargeting of a performer to a face: lips, lids and brows by landmarks, gaze by blendshape scores."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.face.lip_constraints import MIDDLE_PAIR, SPEECH_SHAPE_PREFIXES
from tts2face.face.mouth import NO_VISEME, motion_products
from tts2face.face.shape_transfer import default_head, eye_distance
from tts2face.face.stand_in import stand_in
from tts2face.lips.retargeting import MAX_CONTACT_MM, Retargeter, build_retargeter
from tts2face.lips.score_matching import scaled_scores
from tts2face.lips.upper_face import READ_SHAPES, read_upper_face
from tts2face.models.face import Face
from tts2face.models.landmarks import EYELID_LANDMARKS, MOUTH_REGION, N_LANDMARKS, eye_aperture, inner_lip_gaps
from tts2face.models.score_map import SCORE_SHAPES, mouth_scores
from tts2face.models.talker import ShapeModel, Talker, speech_channels
from tts2face.numeric.arrays import FloatArray, principal_axes
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.types import Trajectory

# as a talker has (decisions 012 and 035)
N_MOUTH_MODES = 20
SMILE = "mouthSmile"
# Scores of happy at `SMILE_WEIGHTS`: medians over the shipped faces in films of two sentences (decision 276).
SMILE_SCORES, SMILE_WEIGHTS = (0.0, 0.27, 0.49, 0.63, 0.75), (0.0, 0.25, 0.5, 0.7, 1.0)
CARRIED_RIDGE = 0.02  # of each shape's own curvature: shapes that do nearly the same share what they carry
CLOSED_FRAME_SHARE = 0.15  # share of the frames that count as having closed lips
SCORE_DRIVEN_SHAPES = ("eye", "brow", "nose", "cheek")  # name prefixes of the shapes that follow scores
SCORE_DEAD_ZONE = 0.04  # amplitude of the noise of scores
BLINK_CLOSURE, MAX_BLINK_SHARE = (
    0.7,
    0.5,
)  # closure in a blink; share of frames above which eyes are closed, not blinking
READ_DEAD_ZONE = 0.12  # of weights from landmarks: most of what blinks and other motions give
OPEN_LID_QUANTILE, CLOSED_LID_SHARE = 0.9, 0.25  # aperture quantile of an open eye; share of it of a closed eye


@dataclass(frozen=True, slots=True, eq=False)
class PerformerRetargeter:
    """Mapping from a performer's landmarks and scores to the weights of a face; built by `build_performer_retargeter`.

    ``open_apertures`` holds the aperture of each open eye over its width, ``neutral_scores`` (B,) the median scores,
    ``rest_scores`` (n,) those of `mouth_scores` with closed lips, ``usual`` (478, 3) the median landmarks, and
    ``of_blinks`` (R,) what `read_upper_face` reads more where the person blinks. A smile that is held throughout is no
    rest: the face smiles, too.
    """

    model: ShapeModel
    lips: Retargeter
    face: Face
    open_apertures: dict[str, float]
    neutral_scores: NDArray[np.float32]
    usual: NDArray[np.float32]
    of_blinks: FloatArray
    rest_scores: FloatArray

    def weights(self, landmarks: NDArray[np.floating], scores: Trajectory, *, gain: float = 1.0) -> Trajectory:
        """Weights (T, K) of the face's shapes.

        Parameters
        ----------
        landmarks : (T, 478, 3)
            Millimetres, head pose removed.
        scores : (T, B)
            Blendshape scores by ARKit name.
        gain
            Factor on the motion of lips and brows; lids and gaze are not scaled.
        """
        speech = self.lip_motion(landmarks, scores.fps, gain=gain)
        mouth = scaled_scores(mouth_scores(scores), self.rest_scores, gain)
        weights = np.array(self.lips.retarget(speech, mouth).values)
        lids = {side: self._lid_closure(landmarks, side) for side in EYELID_LANDMARKS}
        closed = np.mean(list(lids.values()), axis=0)
        seen = read_upper_face(landmarks, self.usual) - closed[:, None] * self.of_blinks
        for column, name in enumerate(self.face.shape_names):
            if not name.startswith(SCORE_DRIVEN_SHAPES) or name not in scores.channels:
                continue
            at = scores.channels.index(name)
            weight = np.maximum(scores.values[:, at] - self.neutral_scores[at] - SCORE_DEAD_ZONE, 0.0)
            if name in READ_SHAPES:
                # scores of brows are full at rest or do not rise (decision 237)
                weight = np.maximum(seen[:, READ_SHAPES.index(name)] - READ_DEAD_ZONE, 0.0) / (1.0 - READ_DEAD_ZONE)
            if name.startswith("eyeBlink"):
                weight = lids[name.removeprefix("eyeBlink")]
            elif not name.startswith("eye"):
                weight = gain * weight
            weights[:, column] = np.clip(weight, *self.face.limits[column])
        return Trajectory(self.face.shape_names, weights, scores.fps)

    def lip_motion(self, landmarks: NDArray[np.floating], fps: float, *, gain: float = 1.0) -> Trajectory:
        """Speech parameters (T, S) of the performer's own shape model."""
        rest = self.model.rest
        values = rest + gain * (self.model.parameters(landmarks) - rest)
        return Trajectory(speech_channels(self.model), values, fps)

    def _lid_closure(self, landmarks: NDArray[np.floating], side: str) -> FloatArray:
        return _closure(landmarks, side, self.open_apertures[side])


def build_performer_retargeter(landmarks: NDArray[np.floating], scores: Trajectory, face: Face) -> PerformerRetargeter:
    """Retargeter from a performer, given some seconds of landmarks and scores, to a face.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed.

    Raises
    ------
    DataError
        There are fewer than 2 frames, or the face lacks landmarks of the lips or shapes that move them.
    """
    model = lip_model(landmarks)
    gaps = inner_lip_gaps(landmarks)
    closed = _closed_frames(gaps)
    contact = np.clip(np.percentile(gaps[closed], 50, axis=0), 0.0, MAX_CONTACT_MM)
    rest_scores = np.median(mouth_scores(scores)[closed], axis=0)
    smile = held_smile(scores)  # scores of other shapes at rest are due to the person's build
    is_smile = np.array(list(SCORE_SHAPES)) == SMILE
    talker = Talker(scores.fps, model, (), {"name": "performer"})
    lips = build_retargeter(
        talker, face, contact=contact, rest_scores=np.where(is_smile & bool(smile), 0.0, rest_scores)
    )
    opened = {side: float(np.quantile(eye_aperture(landmarks, side), OPEN_LID_QUANTILE)) for side in EYELID_LANDMARKS}
    usual = np.median(landmarks, axis=0).astype(np.float32)
    return PerformerRetargeter(
        model=model,
        lips=lips.with_held_smile(smile) if smile else lips,
        face=face,
        open_apertures=opened,
        neutral_scores=np.median(scores.values, axis=0),
        usual=usual,
        of_blinks=_read_in_blinks(landmarks, usual, opened),
        rest_scores=rest_scores,
    )


def _closure(landmarks: NDArray[np.floating], side: str, opened: float) -> FloatArray:
    """(T,) closures of an eye, 0 to 1, whose aperture over its width is `opened` when it is open."""
    return np.clip((opened - eye_aperture(landmarks, side)) / (opened * (1.0 - CLOSED_LID_SHARE)), 0.0, 1.0)


def _read_in_blinks(
    landmarks: NDArray[np.floating], usual: NDArray[np.floating], opened: dict[str, float]
) -> FloatArray:
    """(R,) weights that a blink adds to the reading of the upper face: a tracker moves brows with it."""
    closed = np.mean([_closure(landmarks, side, opened[side]) for side in EYELID_LANDMARKS], axis=0)
    seen = read_upper_face(landmarks, usual)
    blinks = closed > BLINK_CLOSURE
    if not blinks.any() or blinks.mean() > MAX_BLINK_SHARE:
        return np.zeros(seen.shape[1])
    added: FloatArray = np.maximum(np.median(seen[blinks], axis=0) - np.median(seen[~blinks], axis=0), 0.0)
    return added


def held_smile(scores: Trajectory) -> dict[str, float]:
    """Scores of a person's smile, by shape; empty for people who do not smile, whose are .00.

    They are medians of all frames: lips that are closed may be rounded, on which a smile is smaller (decision 276).
    """
    names = SCORE_SHAPES[SMILE]
    found = np.median(scores.columns(names), axis=0)
    return dict(zip(names, found.tolist(), strict=True)) if found.mean() > SCORE_DEAD_ZONE else {}


def smile_weight(smile: Mapping[str, float]) -> float:
    """Weight of the basis expression ``happy`` that has the scores of `held_smile`."""
    return float(np.interp(np.mean(list(smile.values())), SMILE_SCORES, SMILE_WEIGHTS))


def _closed_frames(gaps: NDArray[np.floating]) -> NDArray[np.int64]:
    """Frames with the smallest of the lips' gaps (T, P)."""
    return np.argsort(gaps[:, MIDDLE_PAIR], kind="stable")[: max(1, int(CLOSED_FRAME_SHARE * len(gaps)))]


def match_shapes(captured: Trajectory, face: Face, *, gain: float = 1.0) -> Trajectory:
    """Weights (T, K) of a face's shapes from captured weights of the same names, clipped to their limits.

    The gain does not apply to eye shapes; shapes that were not captured have weight 0. Of jaw and lips, what the face
    lacks is carried by its own shapes, as by the visemes of a character that has nothing else.
    """
    weights = np.zeros((len(captured), len(face.shape_names)), np.float32)
    for column, name in enumerate(face.shape_names):
        if name in captured.channels:
            size = 1.0 if name.startswith("eye") else gain
            weight = captured.values[:, captured.channels.index(name)]
            weights[:, column] = np.clip(size * weight, *face.limits[column])
    moved = [name for name, track in zip(captured.channels, captured.values.T, strict=True) if track.any()]
    head = default_head()
    lacking = [name for name in _of_mouth(moved) if name not in face.shape_names and name in head.shape_names]
    own = np.array([face.shape_names.index(name) for name in _of_mouth(face.shape_names)], np.int64)
    if lacking and len(own):
        curvature, cross = _carrying_products(stand_in(face), own, lacking)
        linear = weights[:, own].astype(np.float64) @ curvature + gain * captured.columns(lacking) @ cross.T
        weights[:, own] = bounded_least_squares(curvature, linear, face.limits[own].astype(np.float64))
    return Trajectory(face.shape_names, weights, captured.fps)


def _carrying_products(face: Face, own: NDArray[np.int64], lacking: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Inner products of a face's shapes (n,) with themselves, with a ridge, and with shapes of the default head."""
    head = default_head()
    others = np.array([head.shape_names.index(name) for name in lacking])
    motions = [scatter_landmarks(model, landmark_motion(model, at)) for model, at in ((face, own), (head, others))]
    motions[1] *= eye_distance(face) / eye_distance(head)
    products = motion_products(np.concatenate(motions, axis=-1))
    n = len(own)
    return products[:n, :n] * (1.0 + CARRIED_RIDGE * np.eye(n)), products[:n, n:]


def _of_mouth(names: Sequence[str]) -> list[str]:
    """Those of jaw and lips that visemes, too, may move."""
    return [name for name in names if name.startswith(SPEECH_SHAPE_PREFIXES) and name not in NO_VISEME]


def lip_model(landmarks: NDArray[np.floating]) -> ShapeModel:
    """Shape model of the mouth region of (T, 478, 3) landmarks by principal components; its rest has closed lips.

    Raises
    ------
    DataError
        There are fewer than 2 frames.
    """
    n_modes = min(N_MOUTH_MODES, len(landmarks) - 1)
    if n_modes < 1:
        raise DataError("a shape model needs at least 2 frames with a face; give a longer take")
    mean = landmarks.mean(axis=0, dtype=np.float64)
    region = np.isin(np.arange(N_LANDMARKS), MOUTH_REGION)
    offsets = (landmarks[:, region] - mean[region]).reshape(len(landmarks), -1)
    variances, axes = principal_axes(np.asarray(offsets.T @ offsets / len(offsets), np.float64), n_modes)
    basis = np.zeros((n_modes, N_LANDMARKS, 3))
    basis[:, region] = axes.reshape(n_modes, -1, 3)
    gap = inner_lip_gaps(landmarks)[:, MIDDLE_PAIR]
    closed = gap <= np.quantile(gap, CLOSED_FRAME_SHARE)
    flat = np.median(landmarks[closed], axis=0) - mean
    rest = basis.reshape(n_modes, -1) @ flat.ravel()
    spread = np.sqrt(np.maximum(variances, 1e-12))
    return ShapeModel(
        mean=mean.astype(np.float32),
        basis=basis.astype(np.float32),
        spread=spread.astype(np.float32),
        n_speech=n_modes,
        rest=rest.astype(np.float32),
    )
