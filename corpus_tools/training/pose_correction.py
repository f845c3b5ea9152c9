"""Correction of landmarks for errors that depend on head pose.

Trackers assume another head shape: pose-free landmarks of a turning head move a little although the face does not. For
one person this error is a smooth function of the head's angles. It is estimated from means over seconds, in which
speech averages out, and subtracted from every frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.ridge import fit_ridge
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray

CHUNK_S = 3.0  # about a sentence, so that speech averages out
MIN_CHUNKS = 12  # with fewer there is no correction


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

    centre: FloatArray
    scale: FloatArray
    offsets: FloatArray

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


def _keep_lip_contact(offsets: FloatArray) -> FloatArray:
    """Offsets averaged over opposite points of the inner lips, so that lip contact does not depend on the pose."""
    # facing points have a common offset: separate ones lose 3 of 100 contacts (decision 012)
    kept = offsets.copy()
    upper, lower = list(INNER_LIP_UPPER), list(INNER_LIP_LOWER)
    kept[:, upper] = kept[:, lower] = (offsets[:, upper] + offsets[:, lower]) / 2
    return kept


def correct_pose(observations: Sequence[AnyPosedLandmarks]) -> tuple[AnyPosedLandmarks, ...]:
    """Observations of one person with the correction fitted to them applied."""
    leak = fit_pose_correction(observations) if observations else None
    return tuple(leak.apply(observation) for observation in observations) if leak else ()


def angle_terms(angles: NDArray[np.floating]) -> FloatArray:
    """(T, 9) angles (T, 3), their squares and their products."""
    pitch, yaw, roll = np.asarray(angles, np.float64).T
    return np.column_stack([pitch, yaw, roll, pitch**2, yaw**2, roll**2, pitch * yaw, pitch * roll, yaw * roll])


def _chunk_means(observations: Sequence[PosedLandmarks]) -> tuple[FloatArray, FloatArray]:
    """Mean angles (C, 3) and landmarks (C, L, 3) of every chunk."""
    angles, landmarks = [], []
    for observation in observations:
        n_chunks = max(1, round(len(observation.landmarks) / observation.fps / CHUNK_S))
        for rows in np.array_split(np.arange(len(observation.landmarks)), n_chunks):
            angles.append(observation.head[rows, :3].mean(axis=0, dtype=np.float64))
            landmarks.append(observation.landmarks[rows].mean(axis=0, dtype=np.float64))
    return np.array(angles), np.array(landmarks)
