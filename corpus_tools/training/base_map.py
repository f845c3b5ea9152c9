"""Map from the speech of a base talker to that of a new person: linear in parameters and in the phones around.

A frame of the new person is ``matrix @ (base frame) + offset + sum_o window[o, phone at offset o]``. The map is fitted
on what the base synthesises for the person's own sentences; its ridge penalty is the prior that both articulate alike,
so that the person's own material takes over phone by phone and context by context as it grows. Being linear, it applies
to recorded frames, to phone networks and to audio maps alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import nearest_phones, phone_features
from lexicon.sequence import PhoneSequence
from tts2face.models.audio_map import AudioMap
from tts2face.models.phone_network import N_PLACE, PHONE_WINDOW_S, STEP_S, PhoneNetwork, window_features
from tts2face.numeric.arrays import FloatArray

N_OFFSETS = 2 * round(PHONE_WINDOW_S / STEP_S) + 1  # leading columns of `window_features`
KERNEL_CENTRES_S = (-0.08, 0.0, 0.08)  # of the Gaussian windows through which phones are seen
KERNEL_S = 0.06  # their standard deviation
# Scales of the terms before the ridge penalty; larger terms are penalised less (docs/decisions/131-base.md).
LABEL_SCALE, BASE_SCALE = 2.5, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class FrameTerms:
    """Frames of utterances: ``labels`` (T, `N_OFFSETS`) of the phones around, and the base's parameters (T, B).

    ``utterance`` (T,) numbers the utterances from 0.
    """

    labels: NDArray[np.int64]
    base: FloatArray
    utterance: NDArray[np.int64]

    @classmethod
    def joined(cls, parts: "Sequence[FrameTerms]") -> "FrameTerms":
        """The frames of several utterances."""
        return cls(
            np.concatenate([part.labels for part in parts]),
            np.concatenate([part.base for part in parts]),
            np.concatenate([np.full(len(part.base), at) for at, part in enumerate(parts)]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class BaseMap:
    """Map from B parameters of the base to D of the new person; `window` is (`N_OFFSETS`, P, D) for P phones."""

    inventory: tuple[str, ...]
    matrix: FloatArray
    offset: FloatArray
    window: FloatArray

    def parameters(self, terms: FrameTerms) -> FloatArray:
        """(T, D) parameters of the new person."""
        return np.asarray(terms.base @ self.matrix.T + self.offset + self.phone_part(terms))

    def phone_part(self, terms: FrameTerms) -> FloatArray:
        """(T, D) part of the parameters that depends on the phones."""
        part = np.zeros((len(terms.labels), len(self.offset)))
        for offset in range(N_OFFSETS):
            part += self.window[offset, terms.labels[:, offset]]
        return part

    def amplified(self, gain: FloatArray, about: FloatArray) -> "BaseMap":
        """The map with its motion about a pose (D,) multiplied by a matrix (D, D)."""
        offset = gain @ (self.offset - about) + about
        return BaseMap(self.inventory, gain @ self.matrix, offset, self.window @ gain.T)

    def before_amplification(self, amplitude: float, terms: FrameTerms) -> "BaseMap":
        """The map for motion that synthesis multiplies by `amplitude` later; same mean over the given frames.

        It was fitted on motion of the base that had been multiplied already, so that only the phones' part changes.
        """
        lost = (1.0 - 1.0 / amplitude) * self.phone_part(terms).mean(axis=0)
        return BaseMap(self.inventory, self.matrix, self.offset + lost, self.window / amplitude)

    def network(self, network: PhoneNetwork) -> PhoneNetwork:
        """The network of the new person.

        Its units also compute the window's part: rectified units with weights w and -w, whose difference is linear.
        """
        n_outputs = len(self.offset)
        known = {label: at for at, label in enumerate(network.inventory)}
        rows = np.array([known[nearest_phones(label, network.inventory)[0]] for label in self.inventory])
        first = network.weights[0]
        shown = first[:, : first.shape[1] - N_PLACE].reshape(len(first), -1, len(known), first.shape[2])
        linear = np.zeros((shown.shape[1], len(self.inventory), 2 * n_outputs))
        linear[:N_OFFSETS, :, :n_outputs] = self.window
        linear[:, :, n_outputs:] = -linear[:, :, :n_outputs]
        phones = np.concatenate([shown[:, :, rows], np.broadcast_to(linear, (len(first), *linear.shape))], axis=3)
        place = _pad_columns(first[:, first.shape[1] - N_PLACE :], 2 * n_outputs)
        weights = [np.concatenate([phones.reshape(len(first), -1, phones.shape[3]), place], axis=1)]
        weights += [_with_identity(inner, 2 * n_outputs) for inner in network.weights[1:-1]]
        signs = np.concatenate([np.eye(n_outputs), -np.eye(n_outputs)])
        last = network.weights[-1] @ self.matrix.T
        weights.append(np.concatenate([last, np.broadcast_to(signs, (len(last), *signs.shape))], axis=1))
        biases = [_pad_columns(bias, 2 * n_outputs) for bias in network.biases[:-1]]
        biases.append(network.biases[-1] @ self.matrix.T + self.offset)
        return PhoneNetwork(
            self.inventory,
            tuple(layer.astype(np.float32) for layer in weights),
            tuple(layer.astype(np.float32) for layer in biases),
        )

    def audio_map(self, audio_map: AudioMap) -> AudioMap:
        """The audio map of the new person; without the part of the phones, which a sound does not tell."""
        outer = (self.matrix @ audio_map.weights[-1]).astype(np.float32)
        offset = (self.matrix @ audio_map.biases[-1] + self.offset).astype(np.float32)
        weights, biases = (*audio_map.weights[:-1], outer), (*audio_map.biases[:-1], offset)
        return replace(audio_map, weights=weights, biases=biases)


def frame_terms(
    phones: PhoneSequence, times: FloatArray, inventory: Sequence[str], base: NDArray[np.floating]
) -> FrameTerms:
    """Terms of frames at `times` (T,) in seconds, for the base's parameters (T, B)."""
    labels = window_features(phones, times, inventory)[0][:, :N_OFFSETS]
    return FrameTerms(labels, base.astype(np.float64), np.zeros(len(times), np.int64))


def fit_base_map(
    terms: FrameTerms,
    targets: FloatArray,
    prior: BaseMap,
    scales: tuple[FloatArray, FloatArray],
    *,
    trust: float,
    penalty: float,
) -> BaseMap:
    """Map fitted on frames of the new person.

    Parameters
    ----------
    targets : (T, D)
        The person's parameters.
    prior
        Map without own material.
    scales : (B,), (D,)
        Standard deviations of the base's and of the person's parameters.
    trust
        Share of the prior's motion that is kept without evidence.
    penalty
        Of the ridge regression of what the prior leaves, for terms of about unit variance.
    """
    base_spread, spread = scales
    codes = _window_codes(prior.inventory)
    seen = np.zeros((len(targets), codes.shape[2]))
    for offset in range(N_OFFSETS):
        seen += codes[offset, terms.labels[:, offset]]
    inputs = np.concatenate([seen, BASE_SCALE * terms.base / base_spread], axis=1)
    expected = trust * prior.parameters(terms)
    mean, residual = inputs.mean(axis=0), (targets - expected) / spread
    middle = residual.mean(axis=0)
    centred, wanted = (_without_means(values, terms.utterance) for values in (inputs, residual))
    weights = np.linalg.solve(centred.T @ centred + penalty * np.eye(centred.shape[1]), centred.T @ wanted) * spread
    n_codes = codes.shape[2]
    learnt = (BASE_SCALE / base_spread)[:, None] * weights[n_codes:]
    return BaseMap(
        prior.inventory,
        trust * prior.matrix + learnt.T,
        trust * prior.offset + middle * spread - mean @ weights,
        trust * prior.window + codes @ weights[:n_codes],
    )


def _without_means(values: FloatArray, utterance: NDArray[np.int64]) -> FloatArray:
    """Values (T, K) without the mean of their utterance: people begin sentences with the mouth in other positions."""
    sums = np.zeros((int(utterance.max()) + 1, values.shape[1]))
    np.add.at(sums, utterance, values)
    return np.asarray(values - (sums / np.bincount(utterance)[:, None])[utterance])


def _window_codes(inventory: Sequence[str]) -> FloatArray:
    """(`N_OFFSETS`, P, K) terms of each phone at each offset: its label, and its features in all Gaussian windows."""
    times = (np.arange(N_OFFSETS) - N_OFFSETS // 2) * STEP_S
    kernels = np.exp(-0.5 * ((times[:, None] - np.array(KERNEL_CENTRES_S)) / KERNEL_S) ** 2)
    kernels /= kernels.sum(axis=0)
    features = np.array([[*first, *last] for first, last in map(phone_features, inventory)], np.float64)
    features = (features - features.mean(axis=0))[:, features.std(axis=0) > 0]
    labels = LABEL_SCALE * kernels[:, len(KERNEL_CENTRES_S) // 2, None, None] * np.eye(len(inventory))
    around = np.einsum("ok,pf->opkf", kernels, features).reshape(N_OFFSETS, len(inventory), -1)
    return np.concatenate([labels, around], axis=2)


def _pad_columns(values: NDArray[np.floating], n_columns: int) -> NDArray[np.floating]:
    return np.concatenate([values, np.zeros((*values.shape[:-1], n_columns), values.dtype)], axis=-1)


def _with_identity(weights: NDArray[np.floating], n_added: int) -> NDArray[np.floating]:
    """Weights (N, H, H') of a layer with further units that repeat those added to the layer before."""
    below = np.zeros((len(weights), n_added, weights.shape[2] + n_added), weights.dtype)
    below[:, :, weights.shape[2] :] = np.eye(n_added)
    return np.concatenate([_pad_columns(weights, n_added), below], axis=1)
