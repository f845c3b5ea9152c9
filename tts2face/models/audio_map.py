"""Drives: learnt maps from what a voice sounds like to how its talker's face moves (Theobald et al. 2007, section 3.2).

How they are learnt stands in `corpus_tools.training`: `linear_audio_map` and `network_audio_map`.
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
# Numbers a frame of each kind of feature (`tts2face.speech.features`, which measures them).
FEATURE_SIZES: Mapping[str, int] = MappingProxyType({"formants": 4, "mfcc": 13, "lpc": 16, "lsf": 16, "level": 1})
MOST_CONTEXT = 1000  # frames on either side
MAX_GAIN_DB = 40.0  # a recording that is fainter holds more noise than speech
Values = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class AudioMap:
    """A map of three layers: features of neighbouring frames -> factors or hidden units -> shape parameters.

    Parameters
    ----------
    feature
        Kind of feature, as in `tts2face.speech.features`.
    before, after
        Frames of context heard before and behind each frame.
    mean, spread : (D,)
        Of the features that it was learnt from.
    inner : (H, (before + 1 + after) D)
        Weights of the standardised features: canonical factors (T07 eq. 6), or a network's first layer.
    bias : (H,)
    outer : (S, H)
        Weights of factors or hidden units: T07 eq. 7, or a network's second layer.
    offset : (S,)
    bends
        Whether the hidden units bend (tanh); without it the map is linear.
    loudness
        Level of the speech that it was learnt from, dB of full scale; NaN where nobody measured it.
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
        """Refuse parts that do not fit each other."""
        n_inputs = (self.before + 1 + self.after) * len(self.mean)
        n_hidden, n_outputs = len(self.bias), len(self.offset)
        fits = self.inner.shape == (n_hidden, n_inputs) and self.outer.shape == (n_outputs, n_hidden)
        if not fits or self.spread.shape != self.mean.shape or min(self.before, self.after) < 0:
            raise DataError(f"the parts of the drive by {self.feature} do not fit each other; learn it again")

    def gain_for(self, loudness: float) -> float:
        """Factor on the samples of a recording whose speech has a level in dB, so that it is as loud as the learnt."""
        missing = self.loudness - loudness
        return 1.0 if math.isnan(missing) else float(10.0 ** (min(max(missing, -MAX_GAIN_DB), MAX_GAIN_DB) / 20.0))

    def parameters(self, features: Values) -> NDArray[np.float32]:
        """(T, S) shape parameters of (T, D) features; beyond the ends the first and the last frame go on.

        Raises
        ------
        InputError
            The features are of another number.
        """
        if features.ndim != 2 or features.shape[1] != len(self.mean):
            raise InputError(f"the drive hears {len(self.mean)} features a frame, not the shape {features.shape}")
        if not len(features):
            return np.zeros((0, len(self.offset)), np.float32)
        padded = np.concatenate(
            [np.repeat(features[:1], self.before, axis=0), features, np.repeat(features[-1:], self.after, axis=0)]
        )
        return self.inside(padded)

    def inside(self, features: Values) -> NDArray[np.float32]:
        """(T - before - after, S) shape parameters of the frames of (T, D) features that have all their context."""
        heard = context_windows((features - self.mean) / self.spread, self.before, self.after).astype(np.float32)
        units = np.zeros((len(heard), len(self.bias)), np.float32) + self.bias
        for unit, weights in enumerate(self.inner):  # one row at a time: the same bytes at any number of frames
            units[:, unit] += (heard * weights).sum(axis=1)
        if self.is_nonlinear:
            units = np.tanh(units)
        made = np.zeros((len(heard), len(self.offset)), np.float32) + self.offset
        for hidden in range(units.shape[1]):
            made += units[:, hidden, None] * self.outer[:, hidden]
        return made


def context_windows(features: Values, before: int, after: int) -> Values:
    """(T - before - after, (before + 1 + after) D) frames of (T, D) with their neighbours, earliest first."""
    width = before + 1 + after
    n_frames = max(len(features) - width + 1, 0)
    return np.concatenate([features[at : at + n_frames] for at in range(width)], axis=1)


def audio_map_arrays(drives: Mapping[str, AudioMap]) -> dict[str, NDArray[Any]]:
    """Drives as arrays of a talker's file; `audio_maps_from_arrays` reads them."""
    arrays: dict[str, NDArray[Any]] = {}
    for name, drive in drives.items():
        for part in ("mean", "spread", "inner", "bias", "outer", "offset"):
            arrays[f"{AUDIO_MAP_PREFIX}{name}.{part}"] = getattr(drive, part)
        arrays[f"{AUDIO_MAP_PREFIX}{name}.context"] = np.array(
            [drive.before, drive.after, drive.is_nonlinear], np.int32
        )
        arrays[f"{AUDIO_MAP_PREFIX}{name}.loudness"] = np.array([drive.loudness], np.float32)
        arrays[f"{AUDIO_MAP_PREFIX}{name}.feature"] = np.frombuffer(drive.feature.encode(), np.uint8)
    return arrays


def audio_maps_from_arrays(arrays: Mapping[str, NDArray[Any]]) -> dict[str, AudioMap]:
    """The drives in a talker's file by name; none in a file without.

    Raises
    ------
    KeyError
        A part is missing.
    """
    names = sorted({key.split(".")[1] for key in arrays if key.startswith(AUDIO_MAP_PREFIX)})
    found = {}
    for name in names:
        before, after, bends = (int(number) for number in arrays[f"{AUDIO_MAP_PREFIX}{name}.context"])
        parts = {
            part: arrays[f"{AUDIO_MAP_PREFIX}{name}.{part}"]
            for part in ("mean", "spread", "inner", "bias", "outer", "offset")
        }
        feature = arrays[f"{AUDIO_MAP_PREFIX}{name}.feature"].tobytes().decode()
        loudness = float(arrays[f"{AUDIO_MAP_PREFIX}{name}.loudness"][0])
        found[name] = AudioMap(feature, before, after, **parts, is_nonlinear=bool(bends), loudness=loudness)
    return found
