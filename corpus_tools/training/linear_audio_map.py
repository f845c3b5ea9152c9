"""The linear audio map: features are mapped to shape parameters through canonical factors (T07 eqs 6-8)."""

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
        """Check that both are on the same frames."""
        if len(self.features) != len(self.parameters) or not len(self.features):
            raise InputError(
                f"a training utterance needs features and parameters of the same frames, not {len(self.features)} and "
                f"{len(self.parameters)}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class TrainingData:
    """Training data: standardised windows (N, W), parameters (N, S), mean and standard deviation of the features."""

    features: NDArray[np.float32]
    targets: NDArray[np.float32]
    mean: NDArray[np.float32]
    spread: NDArray[np.float32]


def learn_linear_map(
    utterances: Sequence[TrainingUtterance], *, feature: str, before: int = 0, after: int = 0
) -> AudioMap:
    """Linear audio map through canonical factors, by default without context as in the paper."""
    data = build_training_data(utterances, before, after)
    factors = canonical_correlation(data.features, data.targets)
    projected = (data.features - factors.mean_a) @ factors.weights_a  # eq. 6
    offsets = data.targets - factors.mean_b
    mapping = np.linalg.lstsq(projected, offsets, rcond=None)[0].T  # eq. 7
    inner = factors.weights_a.T
    return AudioMap(
        feature,
        before,
        after,
        data.mean,
        data.spread,
        (inner.astype(np.float32), mapping.astype(np.float32)),
        ((-inner @ factors.mean_a).astype(np.float32), factors.mean_b.astype(np.float32)),
        "linear",
    )


def build_training_data(utterances: Sequence[TrainingUtterance], before: int, after: int) -> TrainingData:
    """Standardised windows of all utterances, extended at both ends by the first and the last frame."""
    if not utterances:
        raise InputError("an audio map needs training utterances with sound; give some")
    every = np.concatenate([utterance.features for utterance in utterances])
    mean, spread = every.mean(axis=0, dtype=np.float64), every.std(axis=0, dtype=np.float64)
    mean32, spread32 = mean.astype(np.float32), np.where(spread > 0.0, spread, 1.0).astype(np.float32)
    windows = [standardised_windows(utterance.features, (mean32, spread32), before, after) for utterance in utterances]
    return TrainingData(
        np.concatenate(windows), np.concatenate([utterance.parameters for utterance in utterances]), mean32, spread32
    )


def standardised_windows(
    features: NDArray[np.floating], standard: tuple[NDArray[np.float32], NDArray[np.float32]], before: int, after: int
) -> NDArray[np.float32]:
    """(T, W) standardised windows of an utterance's (T, D) features."""
    mean, spread = standard
    padded = np.pad(features, ((before, after), (0, 0)), mode="edge")
    return context_windows((padded - mean) / spread, before, after).astype(np.float32)
