"""Appearance parameters from phones, blended from the same exemplars as the lip motion."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.exemplar import blending
from tts2face.exemplar.synthesis import ExemplarModel, TokenSelection, read_at_frames
from tts2face.exemplar.token_search import TokenRanking
from tts2face.exemplar.tokens import Tokens
from tts2face.models.talker import Talker, require_appearance
from tts2face.types import Trajectory

N_BLENDED_APPEARANCES = 3  # exemplars; more of them blur teeth and tongue (docs/decisions/032-own-face.md)


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceExemplars:
    """A talker's recorded appearance parameters, indexed for synthesis.

    Parameters
    ----------
    tokens
        Phone tokens whose `frames` (F, A) are appearance parameters.
    spread : (A,)
        Standard deviation of each parameter.
    rest : (A,)
        Median over silent frames.
    channels
        A names.
    """

    tokens: Tokens
    spread: NDArray[np.float32]
    rest: NDArray[np.float32]
    channels: tuple[str, ...]


def build_appearance_exemplars(talker: Talker, exemplars: ExemplarModel) -> AppearanceExemplars:
    """Index the appearance parameters of a talker.

    Raises
    ------
    InputError
        The talker has no appearance model.
    """
    appearance = require_appearance(talker)
    frames = np.concatenate(
        [
            utterance.appearance_parameters
            for utterance in talker.utterances
            if utterance.appearance_parameters is not None
        ]
    )
    spread = np.maximum(appearance.spread, 1e-6).astype(np.float32)
    silent = np.concatenate(
        [_silent_frames(utterance.phones, len(utterance.shape), talker.fps) for utterance in talker.utterances]
    )
    still = frames[silent] if silent.any() else frames
    rest = np.median(still, axis=0).astype(np.float32)
    return AppearanceExemplars(
        replace(exemplars.tokens, frames=frames.astype(np.float32)), spread, rest, appearance.channels
    )


def appearance_trajectory(
    selection: TokenSelection, appearance: AppearanceExemplars, *, fps: float, n_frames: int
) -> Trajectory:
    """(n_frames, A) appearance parameters from the tokens of the lip motion; arguments as `blend_trajectory`."""
    phones, targets = selection.phones, selection.targets
    options = replace(selection.options, k=min(selection.options.k, N_BLENDED_APPEARANCES), contacts=False)
    found = TokenRanking(selection.found.tokens[:, : options.k], selection.found.scores[:, : options.k])
    frame_times = np.arange(n_frames) / fps
    n_instants = int(np.ceil(max(phones.end, frame_times[-1]) * blending.CLOCK_HZ)) + 2
    weights = blending.exemplar_weights(found.scores, options.sharpness)
    pieces = blending.average_tokens(appearance.tokens, found.tokens, weights, appearance.spread, options)
    joined, is_covered = blending.join_averages(pieces, targets, n_instants, options)
    values = np.where(is_covered[:, None], joined * appearance.spread, appearance.rest)
    values = blending.gaussian_smooth(values, options.smoothing_s, blending.CLOCK_HZ)
    return Trajectory(appearance.channels, read_at_frames(values, phones, frame_times, appearance.rest), fps)


def _silent_frames(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.bool_]:
    """(T,) frames within silence."""
    at = np.searchsorted(phones.edges, np.arange(n_frames) / fps, side="right") - 1
    labels = np.array([label == SILENCE for label in phones.phones])
    return np.asarray(labels[np.clip(at, 0, len(labels) - 1)])
