"""The linear drive: features are mapped to shape parameters through canonical factors (T07 eqs 6-8)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.canonical_correlation import canonical_correlation
from lexicon.errors import InputError
from tts2face.models.audio_map import AudioMap, context_windows


@dataclass(frozen=True, slots=True, eq=False)
class TrainingUtterance:
    """One utterance to learn from: features (T, D) and shape parameters (T, S) on the same frames."""

    features: NDArray[np.float32]
    parameters: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Refuse parts that are not on the same frames."""
        if len(self.features) != len(self.parameters) or not len(self.features):
            raise InputError(
                f"a lesson needs features and parameters of the same frames, not {len(self.features)} and "
                f"{len(self.parameters)}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class TrainingData:
    """Lessons as numbers: standardised windows (N, W), parameters (N, S), and the features' mean and spread."""

    features: NDArray[np.float32]
    targets: NDArray[np.float32]
    mean: NDArray[np.float32]
    spread: NDArray[np.float32]


def learn_linear_map(
    lessons: Sequence[TrainingUtterance], *, feature: str, before: int = 0, after: int = 0
) -> AudioMap:
    """The linear map through canonical factors; the paper's has no context.

    Raises
    ------
    InputError
        There are not more frames than numbers in a window, or nothing moves.
    """
    material = build_training_data(lessons, before, after)
    factors = canonical_correlation(material.features, material.targets)
    projected = (material.features - factors.mean_a) @ factors.weights_a  # eq. 6
    offsets = material.targets - factors.mean_b
    mapping = np.linalg.lstsq(projected, offsets, rcond=None)[0].T  # eq. 7
    inner = factors.weights_a.T
    return AudioMap(
        feature,
        before,
        after,
        material.mean,
        material.spread,
        inner.astype(np.float32),
        (-inner @ factors.mean_a).astype(np.float32),
        mapping.astype(np.float32),
        factors.mean_b.astype(np.float32),
        is_nonlinear=False,
    )


def build_training_data(lessons: Sequence[TrainingUtterance], before: int, after: int) -> TrainingData:
    """Lessons as one table of windows; an utterance's first and last frame go on beyond its ends.

    Raises
    ------
    InputError
        There is no lesson.
    """
    if not lessons:
        raise InputError("a drive needs utterances with sound to learn from; there is none")
    every = np.concatenate([lesson.features for lesson in lessons])
    mean, spread = every.mean(axis=0, dtype=np.float64), every.std(axis=0, dtype=np.float64)
    mean32, spread32 = mean.astype(np.float32), np.where(spread > 0.0, spread, 1.0).astype(np.float32)
    heard = [standardised_windows(lesson.features, (mean32, spread32), before, after) for lesson in lessons]
    return TrainingData(np.concatenate(heard), np.concatenate([one.parameters for one in lessons]), mean32, spread32)


def standardised_windows(
    features: NDArray[np.floating], standard: tuple[NDArray[np.float32], NDArray[np.float32]], before: int, after: int
) -> NDArray[np.float32]:
    """(T, W) standardised windows of an utterance's (T, D) features."""
    mean, spread = standard
    padded = np.pad(features, ((before, after), (0, 0)), mode="edge")
    return context_windows((padded - mean) / spread, before, after).astype(np.float32)
