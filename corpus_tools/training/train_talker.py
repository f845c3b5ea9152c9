"""Training of a talker: the shape model, and every utterance in its parameters.

Correction of landmarks for errors that depend on head pose.

Trackers assume another head shape: pose-free landmarks of a turning head move a little although the face does not. For
one person this error is a smooth function of the head's angles. It is estimated from means over seconds, in which
speech averages out, and subtracted from every frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.training.linear_audio_map import fit_ridge
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, MOUTH_REGION, N_LANDMARKS, lip_opening
from tts2face.models.talker import ShapeModel, Talker, Utterance
from tts2face.numeric.arrays import fix_signs, nearest_rotation, principal_axes
from tts2face.video.pose import head_angles

REST_MARGIN_S = 0.2  # lips start to move this long before the first sound
# Of the distance of the outer eye corners: the inner lips' gap below which the mouth counts as closed.
CLOSED_GAP = 0.01
CLOSED_SHARE = 0.05  # of the frames, with the smallest openings, where no resting frame is found


def learn_talker(
    observations: Sequence[Observation], *, n_speech: int = 20, n_other: int = 10, metadata: Mapping[str, Any]
) -> Talker:
    """The talker of the observed recordings.

    Parameters
    ----------
    n_speech, n_other
        Modes of the mouth region and of the rest of the face.
    metadata
        At least name, language, sources, licence, attribution, command, created.

    Raises
    ------
    InputError
        There is no observation, or too few for the numbers of modes.
    DataError
        Recordings differ in frames per second.
    """
    if not observations:
        raise InputError("no recording could be used; give at least one")
    fps = observations[0].fps
    for observation in observations:
        if observation.fps != fps:
            raise DataError(f"{observation.name} has {observation.fps:g} frames per second, others {fps:g}; convert it")
    model = learn_shapes(observations, n_speech, n_other)
    return Talker(fps, model, build_utterances(observations, model), dict(metadata))


def build_utterances(observations: Sequence[Observation], model: ShapeModel) -> tuple[Utterance, ...]:
    """The observations as utterances in the parameters of a model, with head angles relative to their mean."""
    turn = mean_rotation(observations)
    return tuple(_build_utterance(observation, model, turn) for observation in observations)


def learn_shapes(observations: Sequence[Observation], n_speech: int, n_other: int) -> ShapeModel:
    """The talker's shape model: principal components of the mouth region, then of the rest of the face.

    The two regions share no landmark, so that all modes together are orthonormal.

    Raises
    ------
    InputError
        A region has fewer modes.
    """
    mouth = np.isin(np.arange(N_LANDMARKS), MOUTH_REGION)
    n_frames = sum(len(observation.landmarks) for observation in observations)
    mean = sum(observation.landmarks.sum(axis=0, dtype=np.float64) for observation in observations) / n_frames
    rows, variances = [], []
    for region, n_modes in ((mouth, n_speech), (~mouth, n_other)):
        if not 0 < n_modes <= min(3 * int(region.sum()), n_frames):
            raise InputError(
                f"{n_frames} frames of {int(region.sum())} landmarks have no {n_modes} modes; request fewer"
            )
        components, variance = _principal_components(observations, mean, region, n_modes)
        basis = np.zeros((n_modes, N_LANDMARKS, 3))
        basis[:, region] = components
        rows.append(basis)
        variances.append(variance)
    spread = np.sqrt(np.concatenate(variances)).astype(np.float32)
    model = ShapeModel(
        mean.astype(np.float32), np.concatenate(rows).astype(np.float32), spread, n_speech, np.zeros_like(spread)
    )
    rest = resting_parameters(observations, model)
    return ShapeModel(model.mean, model.basis, model.spread, n_speech, rest)


def resting_parameters(observations: Sequence[Observation], model: ShapeModel) -> NDArray[np.float32]:
    """(M,) mean parameters of the silent frames with closed lips before speech.

    Lips of some people are tracked farther apart; without such frames, those of the person's smallest openings rest.
    """
    total = np.zeros(len(model.spread))
    n_frames = 0
    chosen = [resting_frames(observation) for observation in observations]
    if not any(still.any() for still in chosen):
        openings = [lip_opening(observation.landmarks) for observation in observations]
        closed = np.quantile(np.concatenate(openings), CLOSED_SHARE)
        chosen = [opening <= closed for opening in openings]
    for observation, still in zip(observations, chosen, strict=True):
        parameters = model.parameters(observation.landmarks[still])
        total += parameters.sum(axis=0)
        n_frames += len(parameters)
    return (total / max(n_frames, 1)).astype(np.float32)


def resting_frames(observation: Observation) -> NDArray[np.bool_]:
    """(T,) frames with closed lips before speech."""
    phones = observation.phones
    speech = phones.edges[1] if phones.phones[0] == SILENCE else phones.edges[0]
    times = np.arange(len(observation.landmarks)) / observation.fps
    still: NDArray[np.bool_] = (times < speech - REST_MARGIN_S) & (lip_opening(observation.landmarks) < CLOSED_GAP)
    return still


def mean_rotation(observations: Sequence[Observation]) -> NDArray[np.float64]:
    """(3, 3) mean rotation of the head: the rotation nearest to the mean of the matrices."""
    total = sum(_rotation_matrices(observation.head[:, :3]).sum(axis=0) for observation in observations)
    return nearest_rotation(np.asarray(total))


def _principal_components(
    observations: Sequence[Observation], mean: NDArray[np.float64], region: NDArray[np.bool_], n_modes: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n_modes, R, 3) principal components of a region and the (n_modes,) variances along them, largest first.

    Each component's largest entry is positive, so that the same recordings always give the same signs.
    """
    n_values = 3 * int(region.sum())
    scatter = np.zeros((n_values, n_values))
    n_frames = 0
    for observation in observations:
        offsets = (observation.landmarks - mean)[:, region].reshape(-1, n_values)
        scatter += offsets.T @ offsets
        n_frames += len(offsets)
    variances, components = principal_axes(scatter / n_frames, n_modes)
    return fix_signs(components).reshape(n_modes, -1, 3), variances


def _build_utterance(observation: Observation, model: ShapeModel, turn: NDArray[np.float64]) -> Utterance:
    relative = turn.T @ _rotation_matrices(observation.head[:, :3])
    head = np.column_stack([head_angles(relative), observation.head[:, 3:]]).astype(np.float32)
    shape = model.parameters(observation.landmarks)
    return Utterance(observation.name, observation.phones, observation.words, shape, head, observation.intensity)


def _rotation_matrices(angles: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T, 3, 3) rotations of (T, 3) pitch, yaw, roll; the inverse of `head_angles`."""
    from scipy.spatial.transform import Rotation

    rotations: NDArray[np.float64] = Rotation.from_euler("YXZ", angles[:, [1, 0, 2]]).as_matrix()
    return rotations


CHUNK_S = 3.0  # about a sentence, so that speech averages out
MIN_CHUNKS = 12  # with fewer there is no correction
Floats = NDArray[np.float64]


class PosedLandmarks(Protocol):
    """A recording with pose-free landmarks (T, L, 3) and head poses (T, 6)."""

    @property
    def fps(self) -> float:
        """Frames per second."""

    @property
    def landmarks(self) -> NDArray[np.float32]:
        """Millimetres."""

    @property
    def head(self) -> NDArray[np.float32]:
        """As `tts2face.types.HEAD_CHANNELS`."""


AnyPosedLandmarks = TypeVar("AnyPosedLandmarks", bound=PosedLandmarks)


@dataclass(frozen=True, slots=True, eq=False)
class PoseCorrection:
    """Displacements (K, L, 3) of landmarks in mm for terms of the head's angles about ``centre`` over ``scale``."""

    centre: Floats
    scale: Floats
    offsets: Floats

    def apply(self, observation: AnyPosedLandmarks) -> AnyPosedLandmarks:
        """The observation with landmarks corrected to the pose ``centre``."""
        if not self.offsets.any():
            return observation
        terms = angle_terms((observation.head[:, :3] - self.centre) / self.scale)
        leak = np.tensordot(terms, self.offsets, axes=1)
        landmarks = (observation.landmarks - leak).astype(np.float32)
        return replace(observation, landmarks=landmarks)  # type: ignore[type-var] # protocols cannot require a dataclass


def fit_pose_correction(observations: Sequence[PosedLandmarks]) -> PoseCorrection:
    """Correction for recordings of one person; zero if they are too few or if cross-validation finds no improvement."""
    angles, landmarks = _chunk_means(observations)
    centre, scale = angles.mean(axis=0), np.maximum(angles.std(axis=0), 1e-6)
    terms = angle_terms((angles - centre) / scale)
    centred = landmarks.reshape(len(landmarks), -1) - landmarks.reshape(len(landmarks), -1).mean(axis=0)
    offsets = np.zeros((terms.shape[1], centred.shape[1]))
    if len(angles) >= MIN_CHUNKS:
        fit = fit_ridge(terms, centred)
        if fit.left_out_error < float(np.square(centred).sum()):
            offsets = fit.weights
    return PoseCorrection(centre, scale, _keep_lip_contact(offsets.reshape(terms.shape[1], *landmarks.shape[1:])))


def _keep_lip_contact(offsets: Floats) -> Floats:
    """Offsets averaged over opposite points of the inner lips, so that lip contact does not depend on the pose."""
    kept = offsets.copy()
    upper, lower = list(INNER_LIP_UPPER), list(INNER_LIP_LOWER)
    kept[:, upper] = kept[:, lower] = (offsets[:, upper] + offsets[:, lower]) / 2
    return kept


def correct_pose(observations: Sequence[AnyPosedLandmarks]) -> tuple[AnyPosedLandmarks, ...]:
    """Observations of one person with the correction fitted to them applied."""
    leak = fit_pose_correction(observations) if observations else None
    return tuple(leak.apply(observation) for observation in observations) if leak else ()


def angle_terms(angles: NDArray[np.floating]) -> Floats:
    """(T, 9) angles (T, 3), their squares and their products."""
    pitch, yaw, roll = np.asarray(angles, np.float64).T
    return np.column_stack([pitch, yaw, roll, pitch**2, yaw**2, roll**2, pitch * yaw, pitch * roll, yaw * roll])


def _chunk_means(observations: Sequence[PosedLandmarks]) -> tuple[Floats, Floats]:
    """Mean angles (C, 3) and landmarks (C, L, 3) of every chunk."""
    angles, landmarks = [], []
    for observation in observations:
        n_chunks = max(1, round(len(observation.landmarks) / observation.fps / CHUNK_S))
        for rows in np.array_split(np.arange(len(observation.landmarks)), n_chunks):
            angles.append(observation.head[rows, :3].mean(axis=0, dtype=np.float64))
            landmarks.append(observation.landmarks[rows].mean(axis=0, dtype=np.float64))
    return np.array(angles), np.array(landmarks)
