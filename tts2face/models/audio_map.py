"""Audio maps: trained maps from acoustic features to speech shape parameters (Theobald et al. 2007, section 3.2).

`corpus_tools.training` trains them: `linear_audio_map`, `network_audio_map`, and `voices_audio_map` for any voice.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.numeric.arrays import Float32Array, RealArray

# Number of values per frame of each kind of feature of `tts2face.sound.features`.
FEATURE_SIZES: Mapping[str, int] = MappingProxyType(
    {"formants": 4, "mfcc": 13, "lpc": 16, "lsf": 16, "level": 1, "mel": 72}
)
MAX_CONTEXT = 1000  # frames of context on either side
MAX_GAIN_DB = 40.0  # fainter recordings contain more noise than speech
ACTIVATIONS = ("linear", "tanh", "rectified")  # by their numbers in a file
N_AT_ONCE = 1000  # frames, whose windows take 5 MB


@dataclass(frozen=True, slots=True, eq=False)
class AudioMap:
    """Map of two or three layers from features of neighbouring frames through units to shape parameters.

    Parameters
    ----------
    feature
        Kind of feature, as in `tts2face.sound.features`.
    before, after
        Frames of context before and after each frame.
    mean, spread : (D,)
        Mean and standard deviation of the training features.
    weights : (H, (before + 1 + after) D), ..., (S, H)
        Of the standardised features in the first layer, canonical factors (T07 eq. 6) or units; of the shape
        parameters in the last (eq. 7).
    biases : (H,), ..., (S,)
        Of all layers.
    activation
        Of units, one of `ACTIVATIONS`.
    loudness
        Level of the training speech, dB of full scale; NaN if unknown.
    fps
        Rate of the frames in Hz; that of the talker may be another where the map is that of its base.
    """

    feature: str
    before: int
    after: int
    mean: Float32Array
    spread: Float32Array
    weights: tuple[Float32Array, ...]
    biases: tuple[Float32Array, ...]
    activation: str
    loudness: float = math.nan
    fps: float = 25.0

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree."""
        sizes = [(self.before + 1 + self.after) * len(self.mean), *map(len, self.biases)]
        fits = [layer.shape for layer in self.weights] == [(outer, inner) for inner, outer in pairwise(sizes)]
        fits = fits and len(self.weights) in (2, 3)
        if not fits or self.spread.shape != self.mean.shape or min(self.before, self.after) < 0:
            raise DataError(f"the parts of the audio map of {self.feature} do not fit each other; train it again")

    def gain_for(self, loudness: float) -> float:
        """Factor on the samples of speech at `loudness` dB that gives the level of the training speech."""
        missing = self.loudness - loudness
        # a map without a level takes sound as it is
        return 1.0 if math.isnan(missing) else float(10.0 ** (min(max(missing, -MAX_GAIN_DB), MAX_GAIN_DB) / 20.0))

    def parameters(self, features: RealArray) -> NDArray[np.float32]:
        """Shape parameters (T, S) of features (T, D); the first and the last frame are repeated beyond the ends.

        Raises
        ------
        InputError
            The features do not have D values per frame.
        """
        if features.ndim != 2 or features.shape[1] != len(self.mean):
            raise InputError(f"the audio map takes {len(self.mean)} features per frame, not the shape {features.shape}")
        padded = np.concatenate(
            [np.repeat(features[:1], self.before, axis=0), features, np.repeat(features[-1:], self.after, axis=0)]
        )
        context = self.before + self.after
        return np.concatenate(
            [self.inside(padded[at : at + N_AT_ONCE + context]) for at in range(0, max(len(features), 1), N_AT_ONCE)]
        )

    def inside(self, features: RealArray) -> NDArray[np.float32]:
        """Shape parameters (T - before - after, S) of the frames of features (T, D) that have full context."""
        values = context_windows((features - self.mean) / self.spread, self.before, self.after).astype(np.float32)
        for weights, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = self._activated(_layer(values, weights, bias))
        return _layer(values, self.weights[-1], self.biases[-1])

    def _activated(self, units: Float32Array) -> Float32Array:
        if self.activation == "linear":
            return units
        return np.tanh(units) if self.activation == "tanh" else np.maximum(units, np.float32(0.0))


def _layer(values: Float32Array, weights: Float32Array, bias: Float32Array) -> Float32Array:
    """Units (T, H) of values (T, K); one at a time, so that they do not depend on the number of frames."""
    units = np.zeros((len(values), len(bias)), np.float32) + bias
    for unit, row in enumerate(weights):
        units[:, unit] += (values * row).sum(axis=1)
    return units


def context_windows(features: RealArray, before: int, after: int) -> RealArray:
    """Frames of (T, D) with their neighbours, earliest first: (T - before - after, (before + 1 + after) D)."""
    width = before + 1 + after
    n_frames = max(len(features) - width + 1, 0)
    return np.concatenate([features[at : at + n_frames] for at in range(width)], axis=1)
