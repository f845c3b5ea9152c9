"""Exclusion of single recorded tokens from synthesis, such as those that were tracked wrongly."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lexicon.errors import InputError
from tts2face.exemplar.options import ExcludedToken
from tts2face.exemplar.synthesis import ExemplarModel
from tts2face.exemplar.token_search import context_index

MAX_START_CHANGE_S = 0.001  # times of tokens are written with four decimals


def exclude_tokens(exemplars: ExemplarModel, excluded: Sequence[ExcludedToken]) -> ExemplarModel:
    """The exemplars without some tokens; their motion still serves the overlap of their neighbours.

    Raises
    ------
    InputError
        There is no such token, or a phone would have none left.
    """
    tokens = exemplars.tokens
    is_kept = np.ones(len(tokens), np.bool_)
    for one in excluded:
        if one.utterance not in exemplars.names:
            raise InputError(f"the talker has no recording {one.utterance!r} of which a phone could be excluded")
        is_here = tokens.utterance == exemplars.names.index(one.utterance)
        at = np.flatnonzero(is_here & (np.abs(tokens.spans[:, 1] - one.start) <= MAX_START_CHANGE_S))
        if not len(at):
            raise InputError(f"no phone of the recording {one.utterance} begins at {one.start:g} s; check the time")
        is_kept[at] = False
    for number in np.unique(tokens.phone[~is_kept]):
        if not is_kept[tokens.phone == number].any():
            label = tokens.inventory[number]
            raise InputError(f"all recorded examples of /{label}/ are excluded; keep at least one")
    return replace(exemplars, index=context_index(tokens, exemplars.similarity.matrix, is_kept))
