"""Regression of a talker's appearance parameters on its speech parameters, fitted to its recordings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.talker import Talker, require_appearance, speech_channels
from tts2face.types import Trajectory

RIDGE = 0.003  # ridge term as a share of the mean variance of the terms


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceRegression:
    """Appearance parameters as linear functions of a talker's speech parameters.

    ``scale`` (S,) divides the parameters; ``weights`` (1 + S, A) map the constant and the scaled parameters to the
    appearance parameters. Quadratic terms fit the inner mouth worse on held-out frames. ``speech_channels`` and
    ``appearance_channels`` are the names of the speech and appearance parameters.
    """

    scale: NDArray[np.float32]
    weights: NDArray[np.float32]
    speech_channels: tuple[str, ...]
    appearance_channels: tuple[str, ...]

    def motion(self, speech: Trajectory) -> Trajectory:
        """Motion of `tts2face.picture.own_face.OwnFaceRenderer`: speech (T, S), then appearance parameters (T, A).

        Raises
        ------
        InputError
            The trajectory is not in the talker's speech parameters.
        """
        if speech.channels != self.speech_channels:
            raise InputError(
                "the motion is not in the speech parameters of this talker; transfer it to this talker first"
            )
        appearance = _regression_terms(speech.values / self.scale) @ self.weights
        return Trajectory(
            self.speech_channels + self.appearance_channels,
            np.concatenate([speech.values, appearance], axis=1),
            speech.fps,
        )


def fit_appearance_regression(talker: Talker) -> AppearanceRegression:
    """Ridge regression of a talker's appearance parameters on its speech parameters, over its recorded frames.

    Raises
    ------
    InputError
        The talker has no appearance model.
    """
    appearance = require_appearance(talker)
    n_speech = talker.model.n_speech
    scale = np.maximum(talker.model.spread[:n_speech], 1e-6).astype(np.float32)
    n_appearance = len(appearance.channels)
    n_terms = _regression_terms(np.zeros((1, n_speech), np.float32)).shape[1]
    normal, right = np.zeros((n_terms, n_terms)), np.zeros((n_terms, n_appearance))
    for utterance in talker.utterances:
        if utterance.appearance_parameters is not None:
            terms = _regression_terms(utterance.shape[:, :n_speech] / scale).astype(np.float64)
            normal += terms.T @ terms
            right += terms.T @ utterance.appearance_parameters
    ridge = RIDGE * np.trace(normal) / n_terms
    weights = np.linalg.solve(normal + ridge * np.eye(n_terms), right)
    return AppearanceRegression(scale, weights.astype(np.float32), speech_channels(talker.model), appearance.channels)


def _regression_terms(values: NDArray[np.floating]) -> NDArray[np.float32]:
    """Regression terms (T, 1 + S): 1, and the values (T, S) clipped to four standard deviations."""
    clipped = np.clip(values, -4.0, 4.0).astype(np.float32)
    return np.concatenate([np.ones((len(clipped), 1), np.float32), clipped], axis=1)
