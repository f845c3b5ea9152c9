"""Training of a talker: the shape model, and every utterance in its parameters."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE
from tts2face.models.landmarks import MOUTH_REGION, N_LANDMARKS, lip_opening
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
