"""Networks from phones to speech parameters, trained on a talker's utterances, with or without other lips.

The inputs of some are one-hot codes of phones, those of the others articulatory features
(`lexicon.phones.phone_features`), which generalise to unseen phones; their first layer is multiplied by the feature
table, so that the talker's file holds all networks in the same form. With pooled speech, which is that of another
speaker or of a base talker's networks, they have further outputs, the lip features of `corpus_tools.training.pooling`,
z-scored per speaker. Both speakers share all weights but the biases of the first layer; the talker's parameters are
learnt from the talker only, and then corrected to show the talker's opening and width as the network predicts them.
What remains of the other speaker is his influence on the weights: his features and biases are not stored.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.network_training import TrainingOptions, Weights, WindowSamples, phone_layer, train_network
from corpus_tools.training.phone_codes import feature_table
from corpus_tools.training.pooling.speech import PooledSpeech, pooled_inventory, talker_features
from lexicon.sequence import SILENCE
from tts2face.lips.motion_measures import speech_frames
from tts2face.models.phone_network import PhoneNetwork, window_features
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import Float32Array
from tts2face.types import Progress, ignore_progress

SILENCE_MARGIN_S = 0.2  # of silence around speech in the training data
TRAINING = TrainingOptions(hidden=(96, 96), n_epochs=10, weight_decay=1e-4)
N_BY_LABEL, N_BY_FEATURES = 1, 3  # networks of one speaker; features are better on unseen words (decision 124)
N_POOLED_BY_LABEL, N_POOLED_BY_FEATURES = 4, 4  # with pooled speech, which holds every phone (decision 124)
N_FOLLOWED = 2  # features that the parameters follow: opening and width; all eight cost more on held-out words
FEATURE_NOISE = 0.1  # variance of the error of a predicted feature, of z-scored ones; .03 and 1 are similar
LEAST_VARIANCE = 1e-9  # of the largest; a parameter that hardly varies explains no feature
MIN_FRAMES = 3000  # two minutes; networks from less are no better than exemplars


def add_phone_network(
    talker: Talker, pooled: Sequence[PooledSpeech] = (), *, on_progress: Progress = ignore_progress
) -> Talker:
    """The talker with networks trained on its utterances and on pooled speech; unchanged if it has too few frames."""
    if sum(len(utterance.shape) for utterance in talker.utterances) < MIN_FRAMES:
        return talker
    labels = {label for utterance in talker.utterances for label in utterance.phones.phones} | {SILENCE}
    labels |= {label for track in pooled for label in track.phones.phones}
    inventory = pooled_inventory(labels) if pooled else tuple(sorted(labels))
    n_speech = talker.model.n_speech
    spread = np.maximum(talker.model.spread[:n_speech], 1e-6)
    own = _talker_samples(talker, inventory, spread, with_features=bool(pooled))
    samples, importance = _join(own, _pooled_samples(pooled, inventory, n_speech), n_speech)
    ones = np.eye(len(inventory), dtype=np.float32)
    by_label, by_features = (N_POOLED_BY_LABEL, N_POOLED_BY_FEATURES) if pooled else (N_BY_LABEL, N_BY_FEATURES)
    tables = [ones] * by_label + [feature_table(inventory)] * by_features
    networks = []
    for seed, table in enumerate(tables):
        weights = train_network(samples, table, importance, options=TRAINING, seed=seed)
        if pooled:
            weights = follow_features(weights, own[2], n_speech)
        networks.append(expand_to_phones(weights, table, n_speech, spread))
        on_progress(seed + 1, len(tables))
    layers, biases = (tuple(map(np.stack, zip(*some, strict=True))) for some in zip(*networks, strict=True))
    return replace(talker, network=PhoneNetwork(inventory, layers, biases))


def _talker_samples(
    talker: Talker, inventory: Sequence[str], spread: Float32Array, *, with_features: bool
) -> tuple[NDArray[np.int64], Float32Array, Float32Array]:
    """Phones (N, C), positions (N, Q) and targets (N, D): parameters in units of the spread, then lip features."""
    n_speech, parts = talker.model.n_speech, []
    features = [talker_features(talker, at) for at in range(len(talker.utterances))] if with_features else []
    mean, deviation = _speech_statistics(talker, features) if features else (0.0, 1.0)
    for at, utterance in enumerate(talker.utterances):
        times = np.arange(len(utterance.shape)) / talker.fps
        near = (times >= utterance.phones.edges[1] - SILENCE_MARGIN_S) & (
            times <= utterance.phones.edges[-2] + SILENCE_MARGIN_S
        )
        values = [utterance.shape[near, :n_speech] / spread]
        values += [(features[at][near] - mean) / deviation] if features else []
        parts.append((*window_features(utterance.phones, times[near], inventory), np.concatenate(values, axis=1)))
    shown, position, targets = (np.concatenate(column) for column in zip(*parts, strict=True))
    return shown, position, targets.astype(np.float32)


def _speech_statistics(
    talker: Talker, features: Sequence[NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    here = [speech_frames(utterance.phones, len(utterance.shape), talker.fps) for utterance in talker.utterances]
    speech = np.concatenate([values[span] for values, span in zip(features, here, strict=True)])
    return speech.mean(axis=0), np.maximum(speech.std(axis=0), 1e-9)


def _pooled_samples(
    pooled: Sequence[PooledSpeech], inventory: Sequence[str], n_speech: int
) -> tuple[NDArray[np.int64], Float32Array, Float32Array] | None:
    if not pooled:
        return None
    parts = []
    for track in pooled:
        times = np.arange(len(track.features))[track.is_used] / track.fps
        values = track.features[track.is_used]
        targets = np.concatenate([np.zeros((len(values), n_speech)), values], axis=1)
        parts.append((*window_features(track.phones, times, inventory), targets))
    shown, position, values = (np.concatenate(column) for column in zip(*parts, strict=True))
    return shown, position, values.astype(np.float32)


def _join(
    own: tuple[NDArray[np.int64], Float32Array, Float32Array],
    pooled: tuple[NDArray[np.int64], Float32Array, Float32Array] | None,
    n_speech: int,
) -> tuple[WindowSamples, Float32Array]:
    """Samples of both speakers, and the importance (G, D) of each output."""
    groups = [own] if pooled is None else [own, pooled]
    importance = np.ones((len(groups), own[2].shape[1]), np.float32)
    importance[1:, :n_speech] = 0.0
    shown, position, targets = (np.concatenate(column) for column in zip(*groups, strict=True))
    speaker = np.repeat(np.arange(len(groups)), [len(group[0]) for group in groups])
    return WindowSamples(shown.astype(np.int32), position, targets, speaker), importance


def follow_features(weights: Weights, targets: Float32Array, n_speech: int) -> Weights:
    """Weights of a network whose speech parameters show the opening and width that it predicts for the talker.

    Parameters
    ----------
    targets : (N, D)
        The talker's parameters in units of the spread, then the lip features.

    Notes
    -----
    Both speakers teach the features, the talker alone the parameters: in contexts that the talker lacks, the features
    are the better prediction. They are linear in the parameters (regression on the targets), so that the difference of
    the two predictions is linear in the last hidden layer. The regression of the parameters on the features turns it
    into a correction of the parameters' weights. Where both predictions agree, nothing changes.
    """
    lips = slice(n_speech, n_speech + N_FOLLOWED)
    covariance = np.cov(targets.T.astype(np.float64))
    own, mixed = covariance[:n_speech, :n_speech], covariance[:n_speech, lips]
    to_features = np.linalg.pinv(own, rcond=LEAST_VARIANCE, hermitian=True) @ mixed
    to_parameters = np.linalg.solve(covariance[lips, lips] + FEATURE_NOISE * np.eye(N_FOLLOWED), mixed.T)
    outputs = np.vstack([weights[5], weights[6] - targets.mean(axis=0, dtype=np.float64)])
    correction = (outputs[:, lips] - outputs[:, :n_speech] @ to_features) @ to_parameters
    outer, biases = weights[5].copy(), weights[6].copy()
    outer[:, :n_speech] += correction[:-1].astype(np.float32)
    biases[:n_speech] += correction[-1].astype(np.float32)
    return (*weights[:5], outer, biases)


def expand_to_phones(
    weights: Weights, table: Float32Array, n_speech: int, spread: Float32Array
) -> tuple[list[Float32Array], list[Float32Array]]:
    """Layers and biases of the talker's network for one-hot phones, with its parameters in mm."""
    _, place, biases, inner, inner_biases, outer, outer_biases = weights
    first = np.concatenate([*phone_layer(weights, table), place])
    layers = [first, inner, outer[:, :n_speech] * spread]
    every = [layers, [biases[0], inner_biases, outer_biases[:n_speech] * spread]]
    return [item.astype(np.float32) for item in every[0]], [item.astype(np.float32) for item in every[1]]
