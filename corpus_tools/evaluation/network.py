"""A baseline: a network that sees the phones in a window about each frame (after Taylor et al. 2017).

scikit-learn trains it: two layers of 128 units, Adam, early stopping on a tenth of the frames.
"""

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from corpus_tools.evaluation.methods import Method
from lexicon.errors import BackendError
from lexicon.phones import nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.talker import Talker

WINDOW_S = 0.28  # either side
STEP_S = 0.04
NEIGHBOURS = (-3, -2, -1, 1, 2, 3)  # phones about the one that sounds
MARGIN_S = 0.2  # of silence that is learnt from
UNITS = (128, 128)
DECAY = 1e-3
ROUNDS = 60


def window_network(talker: Talker) -> Method:
    """The network, trained on a talker's utterances.

    Raises
    ------
    BackendError
        scikit-learn is missing.
    """
    try:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.neural_network import MLPRegressor
    except ImportError as missing:
        raise BackendError(
            "the network to compare with needs scikit-learn: pip install 'tts2face[study]', or leave --network away"
        ) from missing
    inventory = tuple(sorted({label for spoken in talker.utterances for label in spoken.phones.phones} | {SILENCE}))
    n_speech = talker.model.n_speech
    spread = np.maximum(talker.model.spread[:n_speech], 1e-6)
    inputs, wanted = [], []
    for spoken in talker.utterances:
        times = np.arange(len(spoken.shape)) / talker.fps
        near = (times >= spoken.phones.edges[1] - MARGIN_S) & (times <= spoken.phones.edges[-2] + MARGIN_S)
        inputs.append(window_features(spoken.phones, times, inventory)[near])
        wanted.append(spoken.shape[near, :n_speech] / spread)
    network = MLPRegressor(
        hidden_layer_sizes=UNITS, alpha=DECAY, early_stopping=True, max_iter=ROUNDS, batch_size=256, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # it stops after `ROUNDS`, converged or not
        network.fit(np.concatenate(inputs), np.concatenate(wanted))

    def made(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.float32]:
        features = window_features(phones, np.arange(n_frames) / fps, inventory)
        return np.asarray(network.predict(features) * spread, np.float32)

    return made


def window_features(phones: PhoneSequence, times: NDArray[np.float64], inventory: Sequence[str]) -> NDArray[np.float32]:
    """(T, F) phones that sound about each instant and those about the present one (one of N each), and its times."""
    n_phones, n_frames = len(inventory), len(times)
    labels = np.array([inventory.index(nearest_phones(label, inventory)[0]) for label in phones.phones])
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
