"""Small networks that see the phones in a window about each instant and tell the lips' parameters.

They know less about articulation than recorded examples do, and more about contexts that were never recorded: blended
with examples (`tts2face.exemplar`) they make both better. After Taylor et al. 2017.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.phones import nearest_phones
from lexicon.sequence import PhoneSequence
from tts2face.compilation import kernel

PHONE_WINDOW_S = 0.28  # either side
STEP_S = 0.04
NEIGHBOURS = (-3, -2, -1, 1, 2, 3)  # phones about the one that sounds
NETWORK_PREFIX = "network."
N_PHONES_SEEN = 2 * round(PHONE_WINDOW_S / STEP_S) + 1 + len(NEIGHBOURS)
N_PLACE = 4  # numbers of the place within the present phone


@dataclass(frozen=True, slots=True, eq=False)
class PhoneNetwork:
    """Networks of the same size, whose answers are averaged.

    Parameters
    ----------
    inventory
        Phones that they know.
    weights : (N, F, H), (N, H, H'), ..., (N, H', D)
        Of the layers, for each of N networks; rectified linear units but for the last.
    biases : (N, H), ...
    """

    inventory: tuple[str, ...]
    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]

    def parameters(
        self, phones: PhoneSequence, times: NDArray[np.floating], members: slice = slice(None)
    ) -> NDArray[np.float32]:
        """(T, D) speech parameters at instants in seconds (T,); of some of the networks where `members` says so."""
        shown, place = window_features(phones, np.asarray(times, np.float64), self.inventory)
        rows = shown + len(self.inventory) * np.arange(shown.shape[1])
        told = np.zeros((len(times), self.weights[-1].shape[2]), np.float32)
        for member in range(len(self.weights[0]))[members]:
            weights, biases = (tuple(layer[member] for layer in layers) for layers in (self.weights, self.biases))
            hidden = np.maximum(_first_layer(rows, place, weights[0], biases[0]), np.float32(0.0))
            for inner, bias in zip(weights[1:-1], biases[1:-1], strict=True):
                hidden = np.maximum(_hidden_layer(hidden, inner, bias), np.float32(0.0))
            told += _hidden_layer(hidden, weights[-1], biases[-1])
        return told / np.float32(len(range(len(self.weights[0]))[members]))


@kernel
def _first_layer(rows, place, weights, biases):  # type: ignore[no-untyped-def]
    """(T, H) of inputs that are ones in some rows of the weights (T, C), and numbers (T, 4) for the last rows.

    Sums run in one order, so that every machine and number of threads gives the same bits.
    """
    first = len(weights) - place.shape[1]
    told = np.zeros((len(rows), weights.shape[1]), np.float32)
    for t in range(len(rows)):
        told[t] = biases
        for row in rows[t]:
            told[t] += weights[row]
        for k in range(place.shape[1]):
            told[t] += place[t, k] * weights[first + k]
    return told


@kernel
def _hidden_layer(seen, weights, biases):  # type: ignore[no-untyped-def]
    """(T, H') of inputs (T, H), summed in one order."""
    told = np.zeros((len(seen), weights.shape[1]), np.float32)
    for t in range(len(seen)):
        told[t] = biases
        for k in range(len(weights)):
            if seen[t, k] != 0.0:
                told[t] += seen[t, k] * weights[k]
    return told


def window_features(
    phones: PhoneSequence, times: NDArray[np.float64], inventory: Sequence[str]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """(T, C) numbers of the phones that sound about each instant and of those about the present one; its place (T, 4).

    The place: part of the phone that has passed, seconds since it began, until it ends, and that it takes.

    Raises
    ------
    InputError
        A label is not in the phone table.
    """
    if not len(phones):
        raise InputError("a window needs phones to look at")
    number = {label: at for at, label in enumerate(inventory)}
    labels = np.array([number[nearest_phones(label, inventory)[0]] for label in phones.phones])
    offsets = np.arange(-round(PHONE_WINDOW_S / STEP_S), round(PHONE_WINDOW_S / STEP_S) + 1) * STEP_S
    starts, ends = phones.edges[:-1], phones.edges[1:]

    def sounding(at: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.clip(np.searchsorted(phones.edges, at, side="right") - 1, 0, len(labels) - 1)

    now = sounding(times)
    shown = [labels[sounding(times + offset)] for offset in offsets]
    shown += [labels[np.clip(now + step, 0, len(labels) - 1)] for step in NEIGHBOURS]
    since, until = times - starts[now], ends[now] - times
    place = np.column_stack([since / (ends - starts)[now], since, until, (ends - starts)[now]])
    return np.stack(shown, axis=1), place.astype(np.float32)


def network_arrays(network: PhoneNetwork) -> dict[str, NDArray[Any]]:
    """The networks as arrays of a talker's file, in 16 bits; `network_from_arrays` reads them."""
    arrays: dict[str, NDArray[Any]] = {}
    for at, (weights, biases) in enumerate(zip(network.weights, network.biases, strict=True)):
        arrays[f"{NETWORK_PREFIX}weights{at}"] = weights.astype(np.float16)
        arrays[f"{NETWORK_PREFIX}biases{at}"] = biases.astype(np.float32)
    return arrays


def network_from_arrays(arrays: Mapping[str, NDArray[Any]], inventory: Sequence[str]) -> PhoneNetwork | None:
    """The networks in a talker's file, None where it has none.

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
