"""Small networks that predict speech parameters from the phones in a window around each instant.

They reproduce articulation less precisely than recorded exemplars, but generalise to contexts that were not recorded;
blended with exemplars (`tts2face.lips`) they improve both. After Taylor et al. 2017.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.phones import nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence
from lexicon.values.checks import list_of, text
from tts2face.models.codec import Arrays, InHeader, Numbered, Stored, StoredModel, half
from tts2face.numeric.kernels import kernel
from tts2face.storage.schema import Contents, Tensor

PHONE_WINDOW_S = 0.28  # window on either side
# between instants of the window: a frame of the recordings
STEP_S = 0.04
NEIGHBOURS = (-3, -2, -1, 1, 2, 3)  # phones relative to the present one
N_PHONES_SEEN = 2 * round(PHONE_WINDOW_S / STEP_S) + 1 + len(NEIGHBOURS)
N_PLACE = 4  # values that describe the position within the present phone
# a damaged file must not overflow
MAX_WEIGHT = 1e6
NETWORK = "network"  # name of the networks before those of their arrays
INVENTORY = "network_inventory"  # key of the metadata
WEIGHTS = half("networks", "units of layer {at}", "units of layer {next}")
BIASES = Stored(Tensor("float32", ("networks", "units of layer {next}"), -MAX_WEIGHT, MAX_WEIGHT))


def _n_layers(arrays: Arrays, prefix: str) -> int:
    return sum(name.startswith(f"{prefix}.weights") for name in arrays)


@dataclass(frozen=True, slots=True, eq=False)
class PhoneNetwork(StoredModel):
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

    inventory: Annotated[tuple[str, ...], InHeader(list_of(text), INVENTORY, encode=list, decode=tuple)]
    weights: Annotated[tuple[NDArray[np.float32], ...], Numbered((WEIGHTS,), _n_layers)]
    biases: Annotated[tuple[NDArray[np.float32], ...], Numbered((BIASES,), _n_layers)]

    @classmethod
    def prepare_check(cls, contents: Contents, prefix: str) -> None:
        """Inputs are those of the phones in the metadata, outputs the speech parameters of the talker."""
        contents.require(INVENTORY in contents.header, f"has a network, but its metadata lack {INVENTORY}")
        inventory = contents.header[INVENTORY]
        contents.require(bool(set(inventory) - {SILENCE}), f"{INVENTORY} holds no phone but silence")
        n_layers = _n_layers(contents.arrays, prefix)
        contents.require(n_layers >= 2, f"has a network of {n_layers} layers; it needs two or more")
        contents.sizes["units of layer 0"] = N_PHONES_SEEN * len(inventory) + N_PLACE
        contents.sizes[f"units of layer {n_layers}"] = contents.header["n_speech"]

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
    # four rows in each pass over the sums
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
