"""Small networks that predict speech parameters from the phones in a window around each instant.

They reproduce articulation less precisely than recorded exemplars, but generalise to contexts that were not recorded;
blended with exemplars (`tts2face.lips`) they improve both. After Taylor et al. 2017.

Score map: what the face tracker reads in a mouth as a function of the parameters that move it.

The tracker's network scores shapes such as jawOpen from landmarks. A score map is a small network that gives the same
scores for the speech parameters of a talker, or for the shape weights of a face, without landmarks and without the
tracker. `corpus_tools.training.score_map` trains both kinds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.phones import nearest_phones
from lexicon.sequence import PhoneSequence
from tts2face.numeric.arrays import ordered_product
from tts2face.numeric.kernels import kernel
from tts2face.storage.schema import Contents, Tensor
from tts2face.types import Trajectory

PHONE_WINDOW_S = 0.28  # window on either side
STEP_S = 0.04
NEIGHBOURS = (-3, -2, -1, 1, 2, 3)  # phones relative to the present one
NETWORK_PREFIX = "network."
N_PHONES_SEEN = 2 * round(PHONE_WINDOW_S / STEP_S) + 1 + len(NEIGHBOURS)
N_PLACE = 4  # values that describe the position within the present phone


@dataclass(frozen=True, slots=True, eq=False)
class PhoneNetwork:
    """Ensemble of networks of the same size, whose outputs are averaged.

    Parameters
    ----------
    inventory
        Phone labels of the inputs.
    weights : (N, F, H), (N, H, H'), ..., (N, H', D)
        Weights of the layers of N networks; rectified linear units except in the last layer.
    biases : (N, H), ...
        Biases of the layers.
    """

    inventory: tuple[str, ...]
    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]

    def parameters(
        self, phones: PhoneSequence, times: NDArray[np.floating], members: slice = slice(None)
    ) -> NDArray[np.float32]:
        """Speech parameters (T, D) at instants `times` (T,) in seconds, averaged over the networks `members`.

        Raises
        ------
        InputError
            There are no phones, or a label is not in the phone table.
        """
        labels, position = window_features(phones, np.asarray(times, np.float64), self.inventory)
        rows = labels + len(self.inventory) * np.arange(labels.shape[1])
        output = np.zeros((len(times), self.weights[-1].shape[2]), np.float32)
        for member in range(len(self.weights[0]))[members]:
            weights, biases = (tuple(layer[member] for layer in layers) for layers in (self.weights, self.biases))
            used, values = _first_inputs(rows, position, len(weights[0]))
            counts = np.full(len(rows), used.shape[1])
            hidden = _layer(used, values, counts, weights[0], biases[0])
            for inner, bias in zip(weights[1:], biases[1:], strict=True):
                used = np.argsort(hidden <= 0, axis=1, kind="stable")  # rectified ones are left out
                values = np.take_along_axis(hidden, used, axis=1)
                hidden = _layer(used, values, (values > 0).sum(axis=1), inner, bias)
            output += hidden
        return output / np.float32(len(range(len(self.weights[0]))[members]))


def _first_inputs(
    rows: NDArray[np.int64], position: NDArray[np.floating], n_rows: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Rows (T, N) of the weights, of `n_rows`, and their factors: one-hot inputs (T, C), then the last rows' (T, 4)."""
    last = np.broadcast_to(np.arange(n_rows - position.shape[1], n_rows), position.shape)
    values = np.concatenate([np.ones(rows.shape, np.float32), position.astype(np.float32)], axis=1)
    return np.concatenate([rows, last], axis=1).astype(np.int64), values


def _layer(used: Any, values: Any, counts: Any, weights: Any, biases: Any) -> Any:
    """Layer (T, H) of the first `counts` (T,) of inputs `values` (T, N), of the rows `used` (T, N) of its weights."""
    output = np.zeros((len(used), weights.shape[1]), np.float32)
    _add_all_rows(weights, used, values, counts, biases, output)
    return output


@kernel
def _add_all_rows(weights: Any, used: Any, values: Any, counts: Any, biases: Any, output: Any) -> None:
    """Write the rows of a layer."""
    for t in range(len(used)):
        _add_rows(weights, used[t, : counts[t]], values[t, : counts[t]], biases, output[t])


@kernel
def _add_rows(weights: Any, used: Any, values: Any, biases: Any, total: Any) -> None:
    """Write the biases (H,) plus the sum of `values` (N,) times the rows `used` (N,) of the weights (K, H).

    The order of the sum is fixed, so that results do not depend on the machine or the number of threads; four rows at
    a time keep a part of the total in a register.
    """
    n_outputs, n_used = len(total), len(used)
    for h in range(n_outputs):
        total[h] = biases[h]
    whole = n_used - n_used % 4
    for at in range(0, whole, 4):
        first, second, third, fourth = used[at], used[at + 1], used[at + 2], used[at + 3]
        a, b, c, d = values[at], values[at + 1], values[at + 2], values[at + 3]
        for h in range(n_outputs):
            part = total[h] + a * weights[first, h] + b * weights[second, h]
            total[h] = part + c * weights[third, h] + d * weights[fourth, h]
    for at in range(whole, n_used):
        for h in range(n_outputs):
            total[h] += values[at] * weights[used[at], h]


def window_features(
    phones: PhoneSequence, times: NDArray[np.float64], inventory: Sequence[str]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Phone indices (T, C) in the window around each instant, and the position (T, 4) within the present phone.

    Columns of the indices: phones at `STEP_S` intervals, then the neighbours of the present phone. Columns of the
    position: elapsed share of the phone, seconds since its start, seconds until its end, and its duration in seconds.

    Raises
    ------
    InputError
        There are no phones, or a label is not in the phone table.
    """
    if not len(phones):
        raise InputError("the phone sequence is empty; pass at least one phone")
    number = {label: at for at, label in enumerate(inventory)}
    labels = np.array([number[nearest_phones(label, inventory)[0]] for label in phones.phones])
    offsets = np.arange(-round(PHONE_WINDOW_S / STEP_S), round(PHONE_WINDOW_S / STEP_S) + 1) * STEP_S
    starts, ends = phones.edges[:-1], phones.edges[1:]

    def phone_index(at: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.clip(np.searchsorted(phones.edges, at, side="right") - 1, 0, len(labels) - 1)

    present = phone_index(times)
    columns = [labels[phone_index(times + offset)] for offset in offsets]
    columns += [labels[np.clip(present + step, 0, len(labels) - 1)] for step in NEIGHBOURS]
    since, until = times - starts[present], ends[present] - times
    position = np.column_stack([since / (ends - starts)[present], since, until, (ends - starts)[present]])
    return np.stack(columns, axis=1), position.astype(np.float32)


def network_arrays(network: PhoneNetwork) -> dict[str, NDArray[Any]]:
    """Arrays of the networks for a talker file, weights in 16 bits; inverse of `network_from_arrays`."""
    arrays: dict[str, NDArray[Any]] = {}
    for at, (weights, biases) in enumerate(zip(network.weights, network.biases, strict=True)):
        arrays[f"{NETWORK_PREFIX}weights{at}"] = weights.astype(np.float16)
        arrays[f"{NETWORK_PREFIX}biases{at}"] = biases.astype(np.float32)
    return arrays


def network_from_arrays(arrays: Mapping[str, NDArray[Any]], inventory: Sequence[str]) -> PhoneNetwork | None:
    """Networks in the arrays of a talker file, or None.

    Raises
    ------
    KeyError
        A part is missing.
    """
    n_layers = sum(name.startswith(f"{NETWORK_PREFIX}weights") for name in arrays)
    if not n_layers:
        return None
    weights = tuple(arrays[f"{NETWORK_PREFIX}weights{at}"].astype(np.float32) for at in range(n_layers))
    return PhoneNetwork(
        tuple(inventory), weights, tuple(arrays[f"{NETWORK_PREFIX}biases{at}"] for at in range(n_layers))
    )


# Scores that retargeting matches, and the shapes whose scores each of them averages.
SCORE_SHAPES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "jawOpen": ("jawOpen",),
        "mouthPucker": ("mouthPucker",),
        "mouthFunnel": ("mouthFunnel",),
        "mouthUpperUp": ("mouthUpperUpLeft", "mouthUpperUpRight"),
        "mouthLowerDown": ("mouthLowerDownLeft", "mouthLowerDownRight"),
        "mouthStretch": ("mouthStretchLeft", "mouthStretchRight"),
        "mouthSmile": ("mouthSmileLeft", "mouthSmileRight"),
    }
)
N_SCORES = len(SCORE_SHAPES)
SCORE_MAP_PREFIX = "scores."
MAX_WEIGHT = 1e6
FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ScoreMap:
    """Map ``output tanh(hidden x + hidden_bias) + direct x + bias`` from K inputs to the logits of `SCORE_SHAPES`.

    Parameters
    ----------
    inputs : (K,)
        Names of speech parameters or of shapes.
    hidden, hidden_bias : (H, K), (H,)
        Layer of tanh units.
    output, direct, bias : (S, H), (S, K), (S,)
        Layer of logits, which the inputs reach directly as well.
    """

    inputs: tuple[str, ...]
    hidden: NDArray[np.float32]
    hidden_bias: NDArray[np.float32]
    output: NDArray[np.float32]
    direct: NDArray[np.float32]
    bias: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check that the shapes of all arrays agree, then make them read-only."""
        n_units, n_inputs = len(self.hidden_bias), len(self.inputs)
        if (
            self.hidden.shape != (n_units, n_inputs)
            or self.output.shape != (N_SCORES, n_units)
            or self.direct.shape != (N_SCORES, n_inputs)
            or self.bias.shape != (N_SCORES,)
        ):
            raise DataError("the arrays of the score map do not fit each other; train it again")
        for array in (self.hidden, self.hidden_bias, self.output, self.direct, self.bias):
            array.setflags(write=False)

    def logits(self, values: NDArray[np.floating]) -> FloatArray:
        """Logits (T, S) of the scores for inputs (T, K)."""
        return ordered_product(self._units(values), self.output.T) + ordered_product(values, self.direct.T) + self.bias

    def scores(self, values: NDArray[np.floating]) -> FloatArray:
        """Scores (T, S), 0 to 1, for inputs (T, K)."""
        return logistic(self.logits(values))

    def slopes(self, values: NDArray[np.floating]) -> FloatArray:
        """Derivatives (T, S, K) of the logits by the inputs (T, K)."""
        steep = 1.0 - np.square(self._units(values))
        return ordered_product(self.output * steep[:, None, :], self.hidden) + self.direct

    def _units(self, values: NDArray[np.floating]) -> FloatArray:
        units: FloatArray = np.tanh(ordered_product(values, self.hidden.T) + self.hidden_bias)
        return units


def logistic(logits: FloatArray) -> FloatArray:
    """Scores of logits."""
    scores: FloatArray = 1.0 / (1.0 + np.exp(-logits))
    return scores


def mouth_scores(scores: Trajectory) -> FloatArray:
    """Scores (T, S) of `SCORE_SHAPES` among blendshape scores (T, B) by name."""
    means = [scores.columns(names).mean(axis=1, dtype=np.float64) for names in SCORE_SHAPES.values()]
    return np.stack(means, axis=1)


def score_map_arrays(score_map: ScoreMap | None) -> dict[str, NDArray[Any]]:
    """Arrays of a score map for a file; none without one. Inverse of `score_map_from_arrays`."""
    if score_map is None:
        return {}
    names = ("hidden", "hidden_bias", "output", "direct", "bias")
    return {f"{SCORE_MAP_PREFIX}{name}": getattr(score_map, name).astype(np.float32) for name in names}


def score_map_from_arrays(arrays: Mapping[str, NDArray[Any]], inputs: tuple[str, ...]) -> ScoreMap | None:
    """The score map among the arrays of a file; None without one."""
    parts = {
        name.removeprefix(SCORE_MAP_PREFIX): np.array(array)
        for name, array in arrays.items()
        if name.startswith(SCORE_MAP_PREFIX)
    }
    return ScoreMap(inputs, **parts) if parts else None


def check_score_map(contents: Contents, inputs: str | int) -> None:
    """Check the arrays of a score map, if there is one; `inputs` is their number, or the name of its dimension."""
    if any(name.startswith(SCORE_MAP_PREFIX) for name in contents.arrays):
        shapes: dict[str, tuple[str | int, ...]] = {
            "hidden": ("units of scores", inputs),
            "hidden_bias": ("units of scores",),
            "output": (N_SCORES, "units of scores"),
            "direct": (N_SCORES, inputs),
            "bias": (N_SCORES,),
        }
        contents.tensors(
            {
                f"{SCORE_MAP_PREFIX}{name}": Tensor("float32", shape, -MAX_WEIGHT, MAX_WEIGHT)
                for name, shape in shapes.items()
            }
        )
