"""A talker's own face driven by shape alone: which looks go with which lips, learnt from her recordings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.talker import Talker, require_appearance, speech_channels
from tts2face.types import Trajectory

RIDGE = 0.003  # of the mean variance of the terms


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceRegression:
    """Looks as linear functions of a talker's speech parameters; squares would fit the inner mouth worse (held out).

    ``scale`` (S,) divides the parameters before their ``terms``; ``weights`` (1 + S, A) carry the terms to the looks.
    """

    scale: NDArray[np.float32]
    weights: NDArray[np.float32]
    speech: tuple[str, ...]
    looks: tuple[str, ...]

    def motion(self, speech: Trajectory) -> Trajectory:
        """Channels of `tts2face.render.own_face.PlateStage`: the speech parameters (T, S), then their looks (T, A).

        Raises
        ------
        InputError
            The trajectory is not in the talker's speech parameters.
        """
        if speech.channels != self.speech:
            raise InputError("the motion is not in the speech parameters of this talker; clone it to her first")
        looks = _regression_terms(speech.values / self.scale) @ self.weights
        return Trajectory(self.speech + self.looks, np.concatenate([speech.values, looks], axis=1), speech.fps)


def fit_appearance_regression(talker: Talker) -> AppearanceRegression:
    """The looks that go with a talker's lips: ridge regression on her recorded frames.

    Raises
    ------
    InputError
        The talker has motion only.
    """
    appearance = require_appearance(talker)
    n_speech = talker.model.n_speech
    scale = np.maximum(talker.model.spread[:n_speech], 1e-6).astype(np.float32)
    n_looks = len(appearance.channels)
    first = _regression_terms(np.zeros((1, n_speech), np.float32)).shape[1]
    normal, right = np.zeros((first, first)), np.zeros((first, n_looks))
    for spoken in talker.utterances:
        if spoken.looks is not None:
            terms = _regression_terms(spoken.shape[:, :n_speech] / scale).astype(np.float64)
            normal += terms.T @ terms
            right += terms.T @ spoken.looks
    effort = RIDGE * np.trace(normal) / first
    weights = np.linalg.solve(normal + effort * np.eye(first), right)
    return AppearanceRegression(scale, weights.astype(np.float32), speech_channels(talker.model), appearance.channels)


def _regression_terms(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """(T, 1 + S) one, and every value held within four spreads."""
    held = np.clip(values, -4.0, 4.0).astype(np.float32)
    return np.concatenate([np.ones((len(held), 1), np.float32), held], axis=1)
