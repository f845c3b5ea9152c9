"""Audio maps: trained maps from acoustic features to speech shape parameters (Theobald et al. 2007, section 3.2).

`corpus_tools.training` trains them: `linear_audio_map` and `network_audio_map`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError

AUDIO_MAP_PREFIX = "drive."
# Number of values per frame of each kind of feature of `tts2face.sound.features`.
FEATURE_SIZES: Mapping[str, int] = MappingProxyType({"formants": 4, "mfcc": 13, "lpc": 16, "lsf": 16, "level": 1})
MAX_CONTEXT = 1000  # frames of context on either side
MAX_GAIN_DB = 40.0  # fainter recordings contain more noise than speech
Values = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class AudioMap:
    """Two-layer map from features of neighbouring frames through factors or hidden units to shape parameters.

    Parameters
    ----------
    feature
        Kind of feature, as in `tts2face.sound.features`.
    before, after
        Frames of context before and after each frame.
    mean, spread : (D,)
        Mean and standard deviation of the training features.
    inner : (H, (before + 1 + after) D)
        Weights of the standardised features: canonical factors (T07 eq. 6), or a network's first layer.
    bias : (H,)
        Of factors or hidden units.
    outer : (S, H)
        Weights of factors or hidden units: T07 eq. 7, or a network's second layer.
    offset : (S,)
        Of the shape parameters.
    is_nonlinear
        Whether hidden units apply tanh; otherwise the map is linear.
    loudness
        Level of the training speech, dB of full scale; NaN if unknown.
    """

    feature: str
    before: int
    after: int
    mean: NDArray[np.float32]
    spread: NDArray[np.float32]
    inner: NDArray[np.float32]
    bias: NDArray[np.float32]
    outer: NDArray[np.float32]
    offset: NDArray[np.float32]
    is_nonlinear: bool
    loudness: float = math.nan

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree."""
        n_inputs = (self.before + 1 + self.after) * len(self.mean)
        n_hidden, n_outputs = len(self.bias), len(self.offset)
        fits = self.inner.shape == (n_hidden, n_inputs) and self.outer.shape == (n_outputs, n_hidden)
        if not fits or self.spread.shape != self.mean.shape or min(self.before, self.after) < 0:
            raise DataError(f"the parts of the audio map of {self.feature} do not fit each other; train it again")

    def gain_for(self, loudness: float) -> float:
        """Factor on the samples of speech at `loudness` dB that gives the level of the training speech."""
        missing = self.loudness - loudness
        return 1.0 if math.isnan(missing) else float(10.0 ** (min(max(missing, -MAX_GAIN_DB), MAX_GAIN_DB) / 20.0))

    def parameters(self, features: Values) -> NDArray[np.float32]:
        """Shape parameters (T, S) of features (T, D); the first and the last frame are repeated beyond the ends.

        Raises
        ------
        InputError
            The features do not have D values per frame.
        """
        if features.ndim != 2 or features.shape[1] != len(self.mean):
            raise InputError(f"the audio map takes {len(self.mean)} features per frame, not the shape {features.shape}")
        if not len(features):
            return np.zeros((0, len(self.offset)), np.float32)
        padded = np.concatenate(
            [np.repeat(features[:1], self.before, axis=0), features, np.repeat(features[-1:], self.after, axis=0)]
        )
        return self.inside(padded)

    def inside(self, features: Values) -> NDArray[np.float32]:
        """Shape parameters (T - before - after, S) of the frames of features (T, D) that have full context."""
        windows = context_windows((features - self.mean) / self.spread, self.before, self.after).astype(np.float32)
        units = np.zeros((len(windows), len(self.bias)), np.float32) + self.bias
        # One row at a time: the result does not depend on the number of frames.
        for unit, weights in enumerate(self.inner):
            units[:, unit] += (windows * weights).sum(axis=1)
        if self.is_nonlinear:
            units = np.tanh(units)
        outputs = np.zeros((len(windows), len(self.offset)), np.float32) + self.offset
        for hidden in range(units.shape[1]):
            outputs += units[:, hidden, None] * self.outer[:, hidden]
        return outputs


def context_windows(features: Values, before: int, after: int) -> Values:
    """Frames of (T, D) with their neighbours, earliest first: (T - before - after, (before + 1 + after) D)."""
    width = before + 1 + after
    n_frames = max(len(features) - width + 1, 0)
    return np.concatenate([features[at : at + n_frames] for at in range(width)], axis=1)


def audio_map_arrays(audio_maps: Mapping[str, AudioMap]) -> dict[str, NDArray[Any]]:
    """Arrays of audio maps for a talker file; inverse of `audio_maps_from_arrays`."""
    arrays: dict[str, NDArray[Any]] = {}
    for name, audio_map in audio_maps.items():
        for part in ("mean", "spread", "inner", "bias", "outer", "offset"):
            arrays[f"{AUDIO_MAP_PREFIX}{name}.{part}"] = getattr(audio_map, part)
        arrays[f"{AUDIO_MAP_PREFIX}{name}.context"] = np.array(
            [audio_map.before, audio_map.after, audio_map.is_nonlinear], np.int32
        )
        arrays[f"{AUDIO_MAP_PREFIX}{name}.loudness"] = np.array([audio_map.loudness], np.float32)
        arrays[f"{AUDIO_MAP_PREFIX}{name}.feature"] = np.frombuffer(audio_map.feature.encode(), np.uint8)
    return arrays


def audio_maps_from_arrays(arrays: Mapping[str, NDArray[Any]]) -> dict[str, AudioMap]:
    """Audio maps by name in the arrays of a talker file.

    Raises
    ------
    KeyError
        A part is missing.
    """
    names = sorted({key.split(".")[1] for key in arrays if key.startswith(AUDIO_MAP_PREFIX)})
    audio_maps = {}
    for name in names:
        before, after, is_nonlinear = (int(number) for number in arrays[f"{AUDIO_MAP_PREFIX}{name}.context"])
        parts = {
            part: arrays[f"{AUDIO_MAP_PREFIX}{name}.{part}"]
            for part in ("mean", "spread", "inner", "bias", "outer", "offset")
        }
        feature = arrays[f"{AUDIO_MAP_PREFIX}{name}.feature"].tobytes().decode()
        loudness = float(arrays[f"{AUDIO_MAP_PREFIX}{name}.loudness"][0])
        audio_maps[name] = AudioMap(feature, before, after, **parts, is_nonlinear=bool(is_nonlinear), loudness=loudness)
    return audio_maps
