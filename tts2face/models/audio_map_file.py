"""Audio maps in the files of talkers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from tts2face.models.audio_map import ACTIVATIONS, FEATURE_SIZES, MAX_CONTEXT, AudioMap
from tts2face.models.codec import (
    Arrays,
    Numbered,
    Stored,
    StoredModel,
    check_model,
    model_of,
    stored_arrays,
    stored_tensors,
)
from tts2face.numeric.arrays import Float32Array
from tts2face.storage.schema import Contents, Tensor

DRIVE = "drive"  # name before those of the maps
FPS_LIMITS = (1.0, 1000.0)
MAX_WEIGHT = 1e6
FIRST = ("feature", "context", "loudness")  # arrays that say how large others must be
WEIGHTS = ("inner", "middle", "outer")  # names of the layers; those of two have no middle
BIASES = ("bias", "middle_bias", "offset")
INNER = Stored(Tensor("float32", ("{prefix} units {at}", "{prefix} units {last}"), -MAX_WEIGHT, MAX_WEIGHT))
OUTER = Stored(Tensor("float32", ("{prefix} units {at}",), -MAX_WEIGHT, MAX_WEIGHT))


def _n_layers(arrays: Arrays, prefix: str) -> int:
    # the middle layer may be absent
    return 3 if f"{prefix}.{WEIGHTS[1]}" in arrays else 2


def _named(names: Sequence[str], n_layers: int) -> Sequence[str]:
    return names if n_layers == len(names) else (names[0], names[-1])


def _weight_names(n_layers: int) -> Sequence[str]:
    return _named(WEIGHTS, n_layers)


def _bias_names(n_layers: int) -> Sequence[str]:
    return _named(BIASES, n_layers)


def _text_of(array: NDArray[np.uint8]) -> str:
    return array.tobytes().decode("ascii")


def _bytes_of(text: str) -> NDArray[np.uint8]:
    return np.frombuffer(text.encode(), np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class StoredAudioMap(StoredModel):
    """An audio map as a file holds it: its attributes, of which ``context`` (3,) is before, after and activation."""

    mean: Annotated[Float32Array, Tensor("float32", ("{prefix} features",), -MAX_WEIGHT, MAX_WEIGHT)]
    spread: Annotated[Float32Array, Tensor("float32", ("{prefix} features",), 0.0, MAX_WEIGHT)]
    fps: Annotated[NDArray[np.float64], Tensor("float64", (1,), *FPS_LIMITS)]
    weights: Annotated[tuple[Float32Array, ...], Numbered((INNER,), _n_layers, _weight_names)]
    biases: Annotated[tuple[Float32Array, ...], Numbered((OUTER,), _n_layers, _bias_names)]
    context: Annotated[NDArray[np.int32], Tensor("int32", (3,), 0, MAX_CONTEXT)]
    loudness: Annotated[Float32Array, Tensor("float32", (1,), -1000.0, 1000.0, may_be_nan=True)]
    feature: Annotated[str, Stored(Tensor("uint8", ("{prefix} text",), 43, 122), encode=_bytes_of, decode=_text_of)]

    @classmethod
    def of(cls, audio_map: AudioMap) -> "StoredAudioMap":
        """An audio map for a file."""
        context = [audio_map.before, audio_map.after, ACTIVATIONS.index(audio_map.activation)]
        return cls(
            mean=audio_map.mean,
            spread=audio_map.spread,
            fps=np.array([audio_map.fps]),
            weights=audio_map.weights,
            biases=audio_map.biases,
            context=np.array(context, np.int32),
            loudness=np.array([audio_map.loudness], np.float32),
            feature=audio_map.feature,
        )

    @classmethod
    def prepare_check(cls, contents: Contents, prefix: str) -> None:
        """Kinds of features and context determine the number of inputs; outputs are those of the talker."""
        tensors = stored_tensors(cls, prefix, contents.arrays)
        contents.tensors({name: tensors[name] for name in (f"{prefix}.{first}" for first in FIRST)})
        feature = _text_of(contents.arrays[f"{prefix}.feature"])
        kinds = feature.split("+")
        if any(kind not in FEATURE_SIZES for kind in kinds):
            contents.fail(f"{prefix}.feature is {feature!r}, not a sum of {', '.join(FEATURE_SIZES)}")
        before, after, activation = (int(number) for number in contents.arrays[f"{prefix}.context"])
        known = range(len(ACTIVATIONS))
        contents.require(activation in known, f"{prefix}.context ends with {activation}, not one of {[*known]}")
        n_features = sum(FEATURE_SIZES[kind] for kind in kinds)
        contents.sizes[f"{prefix} features"] = n_features
        contents.sizes[f"{prefix} units -1"] = (before + 1 + after) * n_features
        contents.sizes[f"{prefix} units {_n_layers(contents.arrays, prefix) - 1}"] = contents.header["n_speech"]

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse a spread by which nothing can be divided."""
        is_positive = bool((contents.arrays[f"{prefix}.spread"] > 0).all())
        contents.require(is_positive, f"{prefix}.spread holds 0; it must be above 0")

    def audio_map(self) -> AudioMap:
        """The audio map."""
        before, after, activation = (int(number) for number in self.context)
        return AudioMap(
            self.feature,
            before,
            after,
            self.mean,
            self.spread,
            self.weights,
            self.biases,
            ACTIVATIONS[activation],
            float(self.loudness[0]),
            float(self.fps[0]),
        )


def audio_map_arrays(audio_maps: Mapping[str, AudioMap]) -> dict[str, NDArray[np.generic]]:
    """Arrays of audio maps for a talker file."""
    found: dict[str, NDArray[np.generic]] = {}
    for name, audio_map in audio_maps.items():
        found |= stored_arrays(StoredAudioMap.of(audio_map), f"{DRIVE}.{name}")
    return found


def _names(contents: Contents) -> list[str]:
    return sorted({name.split(".")[1] for name in contents.arrays if name.startswith(f"{DRIVE}.")})


def check_audio_maps(contents: Contents) -> None:
    """Check the audio maps of a talker file; raises `DataError`."""
    for name in _names(contents):
        check_model(StoredAudioMap, contents, f"{DRIVE}.{name}")


def audio_maps_of(contents: Contents) -> dict[str, AudioMap]:
    """Audio maps of a checked talker file by name."""
    return {name: model_of(StoredAudioMap, contents, f"{DRIVE}.{name}").audio_map() for name in _names(contents)}
