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

WINDOW_S = 0.28  # either side
STEP_S = 0.04
NEIGHBOURS = (-3, -2, -1, 1, 2, 3)  # phones about the one that sounds
PREFIX = "network."


@dataclass(frozen=True, slots=True, eq=False)
class WindowNetwork:
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
        seen = window_features(phones, np.asarray(times, np.float64), self.inventory)[None]
        layers = list(zip(self.weights, self.biases, strict=True))
        for weights, biases in layers[:-1]:
            seen = np.maximum(seen @ weights[members] + biases[members][:, None], 0.0)
        last, bias = layers[-1]
        told = seen @ last[members] + bias[members][:, None]
        return np.asarray(told.mean(axis=0), np.float32)


def window_features(phones: PhoneSequence, times: NDArray[np.float64], inventory: Sequence[str]) -> NDArray[np.float32]:
    """(T, F) phones that sound about each instant and those about the present one (one of N each), and its times.

    Raises
    ------
    InputError
        A label is not in the phone table.
    """
    if not len(phones):
        raise InputError("a window needs phones to look at")
    n_phones, n_frames = len(inventory), len(times)
    number = {label: at for at, label in enumerate(inventory)}
    labels = np.array([number[nearest_phones(label, inventory)[0]] for label in phones.phones])
    offsets = np.arange(-round(WINDOW_S / STEP_S), round(WINDOW_S / STEP_S) + 1) * STEP_S
    starts, ends = phones.edges[:-1], phones.edges[1:]

    def sounding(at: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.clip(np.searchsorted(phones.edges, at, side="right") - 1, 0, len(labels) - 1)

    now = sounding(times)
    shown = [labels[sounding(times + offset)] for offset in offsets]
    shown += [labels[np.clip(now + step, 0, len(labels) - 1)] for step in NEIGHBOURS]
    one_of = np.zeros((n_frames, len(shown), n_phones), np.float32)
    for column, numbers in enumerate(shown):
        one_of[np.arange(n_frames), column, numbers] = 1.0
    since, until = times - starts[now], ends[now] - times
    place = np.column_stack([since / (ends - starts)[now], since, until, (ends - starts)[now]])
    return np.concatenate([one_of.reshape(n_frames, -1), place], axis=1).astype(np.float32)


def network_arrays(network: WindowNetwork) -> dict[str, NDArray[Any]]:
    """The networks as arrays of a talker's file, in 16 bits; `network_of` reads them."""
    arrays: dict[str, NDArray[Any]] = {}
    for at, (weights, biases) in enumerate(zip(network.weights, network.biases, strict=True)):
        arrays[f"{PREFIX}weights{at}"] = weights.astype(np.float16)
        arrays[f"{PREFIX}biases{at}"] = biases.astype(np.float32)
    return arrays


def network_of(arrays: Mapping[str, NDArray[Any]], inventory: Sequence[str]) -> WindowNetwork | None:
    """The networks in a talker's file, None where it has none.

    Raises
    ------
    KeyError
        A part is missing.
    """
    n_layers = sum(name.startswith(f"{PREFIX}weights") for name in arrays)
    if not n_layers:
        return None
    weights = tuple(arrays[f"{PREFIX}weights{at}"].astype(np.float32) for at in range(n_layers))
    return WindowNetwork(tuple(inventory), weights, tuple(arrays[f"{PREFIX}biases{at}"] for at in range(n_layers)))
