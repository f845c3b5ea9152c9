"""Networks from phones to speech parameters, trained on a talker's utterances with scikit-learn.

The input of the first is a one-hot code of phones. The inputs of the others are articulatory features
(`lexicon.phones.phone_features`), which generalise to unseen phone contexts; their first layer is multiplied by the
feature table, so that the talker's file holds all networks in the same form.
"""

import warnings
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from lexicon.errors import BackendError
from lexicon.phones import phone_features
from lexicon.sequence import SILENCE
from tts2face.models.phone_network import PhoneNetwork, window_features
from tts2face.models.talker import Talker
from tts2face.types import Progress

SILENCE_MARGIN_S = 0.2  # of silence around speech in the training data
HIDDEN_UNITS = (128, 128)
WEIGHT_DECAY = 1e-3
MAX_EPOCHS = 60
N_BY_LABEL, N_BY_FEATURES = 1, 3  # networks; features are better on unseen words, labels on seen ones (accuracy.md)
MIN_FRAMES = 3000  # two minutes; networks from less are no better than exemplars
Floats = NDArray[np.float32]


def add_phone_network(talker: Talker, *, on_progress: Progress | None = None) -> Talker:
    """The talker with networks trained on its utterances; unchanged if there are too few frames.

    Raises
    ------
    BackendError
        scikit-learn is missing.
    """
    if sum(len(utterance.shape) for utterance in talker.utterances) < MIN_FRAMES:
        return talker
    inventory = tuple(
        sorted({label for utterance in talker.utterances for label in utterance.phones.phones} | {SILENCE})
    )
    n_speech = talker.model.n_speech
    spread = np.maximum(talker.model.spread[:n_speech], 1e-6)
    shown, place, targets = [], [], []
    for utterance in talker.utterances:
        times = np.arange(len(utterance.shape)) / talker.fps
        near = (times >= utterance.phones.edges[1] - SILENCE_MARGIN_S) & (
            times <= utterance.phones.edges[-2] + SILENCE_MARGIN_S
        )
        labels, where = window_features(utterance.phones, times[near], inventory)
        shown.append(labels)
        place.append(where)
        targets.append(utterance.shape[near, :n_speech] / spread)
    windows = np.concatenate(shown), np.concatenate(place)
    tables = [np.eye(len(inventory), dtype=np.float32)] * N_BY_LABEL + [feature_table(inventory)] * N_BY_FEATURES
    networks = []
    for seed, table in enumerate(tables):
        networks.append(_train_network(*windows, np.concatenate(targets), table, seed))
        if on_progress:
            on_progress(seed + 1, len(tables))
    weights, biases = (_stack_layers(layers) for layers in zip(*networks, strict=True))
    weights[-1], biases[-1] = weights[-1] * spread, biases[-1] * spread
    return replace(talker, network=PhoneNetwork(inventory, tuple(weights), tuple(biases)))


def feature_table(inventory: Iterable[str]) -> Floats:
    """(P, K) articulatory features of P phones, for their first and their second half."""
    return np.array([[*first, *last] for first, last in map(phone_features, inventory)], np.float32)


def encode_windows(shown: NDArray[np.integer], place: Floats, table: Floats) -> Any:
    """Sparse inputs (T, C K + 4): for each of the phones (T, C) its row of the table (P, K), then its place (T, 4)."""
    lines = sparse.csr_matrix(table)
    return sparse.hstack([*(lines[column] for column in shown.T), sparse.csr_matrix(place)]).tocsr()


def expand_to_phones(weights: Floats, table: Floats, n_shown: int) -> Floats:
    """First-layer weights (C P + 4, H) for C one-hot phones that equal (C K + 4, H) for `encode_windows` inputs."""
    n_features = table.shape[1]
    phone_weights, place = weights[: n_shown * n_features], weights[n_shown * n_features :]
    return np.concatenate([*(table @ each for each in np.split(phone_weights, n_shown)), place])


def _stack_layers(members: Iterable[Iterable[Floats]]) -> list[Floats]:
    return [np.stack(layer).astype(np.float32) for layer in zip(*members, strict=True)]


def _train_network(
    shown: NDArray[np.integer], place: Floats, targets: Floats, table: Floats, seed: int
) -> tuple[list[Floats], list[Floats]]:
    """Weights and biases of one network for one-hot phones, trained on phones coded by the table."""
    fitted = _fit_regressor(encode_windows(shown, place, table), targets, seed)
    return [expand_to_phones(fitted.coefs_[0], table, shown.shape[1]), *fitted.coefs_[1:]], fitted.intercepts_


def _fit_regressor(inputs: Any, targets: Any, seed: int) -> Any:
    try:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.neural_network import MLPRegressor
    except ImportError as missing:
        raise BackendError("learning from recordings needs scikit-learn: pip install 'tts2face[capture]'") from missing
    network = MLPRegressor(
        hidden_layer_sizes=HIDDEN_UNITS,
        alpha=WEIGHT_DECAY,
        early_stopping=True,
        max_iter=MAX_EPOCHS,
        batch_size=256,
        random_state=seed,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # training ends after `MAX_EPOCHS`
        return network.fit(inputs, targets)
