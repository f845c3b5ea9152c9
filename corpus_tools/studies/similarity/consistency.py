"""Variation of mouth movements within phones: which movements each phone constrains."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.similarity.tables import (
    SpokenTokens,
)
from lexicon.sequence import SILENCE
from tts2face.models.landmarks import (
    CHIN,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.talker import ShapeModel

UPPER_LIP, LOWER_LIP = 0, 17  # middle of the outer lip lines
X, Y, Z = range(3)
# A movement is a sum of landmark coordinates times factors, in mm: (landmark, axis, factor).
MOVEMENTS: Mapping[str, tuple[tuple[int, int, float], ...]] = MappingProxyType({
    "opening": ((UPPER_LIP_INNER_MID, Y, 1.0), (LOWER_LIP_INNER_MID, Y, -1.0)),
    "width": ((MOUTH_CORNER_LEFT, X, 1.0), (MOUTH_CORNER_RIGHT, X, -1.0)),
    "protrusion": (
        (UPPER_LIP, Z, 0.5), (LOWER_LIP, Z, 0.5), (MOUTH_CORNER_LEFT, Z, -0.5), (MOUTH_CORNER_RIGHT, Z, -0.5),
    ),
    "jaw lowering": ((CHIN, Y, -1.0),),
    "upper lip raise": ((UPPER_LIP, Y, 1.0),),
    "lower lip raise": ((LOWER_LIP, Y, 1.0), (CHIN, Y, -1.0)),
    "corner raise": ((MOUTH_CORNER_LEFT, Y, 0.5), (MOUTH_CORNER_RIGHT, Y, 0.5)),
    "sideways": ((MOUTH_CORNER_LEFT, X, 0.5), (MOUTH_CORNER_RIGHT, X, 0.5)),
})  # fmt: skip
LEAST_MM = 0.1  # modes with smaller movements at one standard deviation are named fine detail
N_NAMED = 2  # movements in a mode's name


@dataclass(frozen=True, slots=True, eq=False)
class Consistency:
    """Variation of K movements (or modes) within P phones.

    Parameters
    ----------
    names : K
    spread : (K,)
        Standard deviation over all tokens, mm (modes: mm over all landmarks together).
    free : (P, K)
        Standard deviation within the phone over that of all tokens: 0 constant, 1 as varied as all speech.
    free_share : (K,)
        Share of the variance that the phones do not explain: that of context and chance.
    """

    names: tuple[str, ...]
    spread: NDArray[np.float64]
    free: NDArray[np.float64]
    free_share: NDArray[np.float64]


def movement_weights(model: ShapeModel) -> NDArray[np.float64]:
    """(K, D) mm of each movement for one unit of each speech parameter."""
    basis = model.basis[: model.n_speech].astype(np.float64)
    return np.array(
        [sum(factor * basis[:, landmark, axis] for landmark, axis, factor in terms) for terms in MOVEMENTS.values()]
    )


def movement_consistency(tokens: SpokenTokens, phones: tuple[str, ...], model: ShapeModel) -> Consistency:
    """Variation of each of the `MOVEMENTS` within the phones."""
    return _consistency(tokens, phones, tokens.samples @ movement_weights(model).T, tuple(MOVEMENTS))


def mode_consistency(tokens: SpokenTokens, phones: tuple[str, ...], model: ShapeModel) -> Consistency:
    """Variation of each speech parameter within the phones, named by its largest movements."""
    return _consistency(tokens, phones, tokens.samples.astype(np.float64), mode_names(model))


def mode_names(model: ShapeModel) -> tuple[str, ...]:
    """Largest movements (mm) of each parameter at one standard deviation, as ``opening -4.6, jaw lowering -2.6``."""
    amounts = movement_weights(model) * model.spread[: model.n_speech]
    names, kinds = [], tuple(MOVEMENTS)
    for column in amounts.T:
        largest = [at for at in np.argsort(-np.abs(column), kind="stable")[:N_NAMED] if abs(column[at]) >= LEAST_MM]
        names.append(", ".join(f"{kinds[at]} {column[at]:+.1f}" for at in largest) or "fine detail")
    return tuple(names)


def _consistency(
    tokens: SpokenTokens, phones: tuple[str, ...], values: NDArray[np.floating], names: tuple[str, ...]
) -> Consistency:
    """Standard deviations within and over phones of (N, S, K) values, averaged over the samples."""
    sounding = tokens.phone != tokens.inventory.index(SILENCE)
    total = values[sounding].var(axis=0).mean(axis=0)
    within = np.zeros((len(phones), values.shape[2]))
    share = np.zeros(len(phones))
    for row, label in enumerate(phones):
        own = values[tokens.phone == tokens.inventory.index(label)]
        within[row] = own.var(axis=0).mean(axis=0)
        share[row] = len(own) / sounding.sum()
    whole = np.where(total > 0, total, 1.0)
    return Consistency(names, np.sqrt(total), np.sqrt(within / whole), share @ within / whole)
