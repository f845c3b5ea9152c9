"""Networks from phones to lips, trained on a talker's utterances with scikit-learn."""

import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from corpus_tools.effort import Progress
from lexicon.errors import BackendError
from lexicon.sequence import SILENCE
from tts2face.talker import Talker
from tts2face.window_network import WindowNetwork, one_of_each, window_features

MARGIN_S = 0.2  # of silence that is learnt from
UNITS = (128, 128)
DECAY = 1e-3
ROUNDS = 60
N_NETWORKS = 3  # averaged: r of opening .877 with one, .886 with three (docs/decisions.md)
LEAST_FRAMES = 3000  # two minutes; from less a network learns nothing that examples do not show


def with_network(talker: Talker, n_networks: int = N_NETWORKS, *, on_progress: Progress | None = None) -> Talker:
    """The talker with networks trained on what it holds; as it is where that is too little.

    Raises
    ------
    BackendError
        scikit-learn is missing.
    """
    if sum(len(spoken.shape) for spoken in talker.utterances) < LEAST_FRAMES:
        return talker
    inventory = tuple(sorted({label for spoken in talker.utterances for label in spoken.phones.phones} | {SILENCE}))
    n_speech = talker.model.n_speech
    spread = np.maximum(talker.model.spread[:n_speech], 1e-6)
    inputs, wanted = [], []
    for spoken in talker.utterances:
        times = np.arange(len(spoken.shape)) / talker.fps
        near = (times >= spoken.phones.edges[1] - MARGIN_S) & (times <= spoken.phones.edges[-2] + MARGIN_S)
        inputs.append(one_of_each(*window_features(spoken.phones, times[near], inventory), len(inventory)))
        wanted.append(spoken.shape[near, :n_speech] / spread)
    fitted = []
    for seed in range(n_networks):
        fitted.append(_fitted(np.concatenate(inputs), np.concatenate(wanted), seed))
        if on_progress:
            on_progress(seed + 1, n_networks)
    weights = [np.stack(layer).astype(np.float32) for layer in zip(*(one.coefs_ for one in fitted), strict=True)]
    biases = [np.stack(layer).astype(np.float32) for layer in zip(*(one.intercepts_ for one in fitted), strict=True)]
    weights[-1], biases[-1] = weights[-1] * spread, biases[-1] * spread
    return replace(talker, network=WindowNetwork(inventory, tuple(weights), tuple(biases)))


def _fitted(inputs: Any, wanted: Any, seed: int) -> Any:
    try:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.neural_network import MLPRegressor
    except ImportError as missing:
        raise BackendError("learning from recordings needs scikit-learn: pip install 'tts2face[capture]'") from missing
    network = MLPRegressor(
        hidden_layer_sizes=UNITS, alpha=DECAY, early_stopping=True, max_iter=ROUNDS, batch_size=256, random_state=seed
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # it stops after `ROUNDS`, converged or not
        return network.fit(inputs, wanted)
