"""Outlines of lips, recorded or made, for drawing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.lips.explanation import UsedToken
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import interpolate_columns

OUTER = (*OUTER_LIP_UPPER, *reversed(OUTER_LIP_LOWER[1:-1]))  # from the person's right corner over the upper lip
INNER = (*INNER_LIP_UPPER, *reversed(INNER_LIP_LOWER[1:-1]))
N_INSTANTS = 5  # of a phone that are drawn


@dataclass(frozen=True, slots=True, eq=False)
class LipOutline:
    """Closed outlines (20, 2) of the lips at one instant, seen from the front: mm to the right and down."""

    outer: NDArray[np.float32]
    inner: NDArray[np.float32]


def lip_outlines(landmarks: NDArray[np.floating], rest: NDArray[np.floating]) -> tuple[LipOutline, ...]:
    """Outlines of landmarks (T, 478, 3) of one face, mm.

    The middle is that of the mouth's corners in `rest` (478, 3), so that outlines of several instants can be compared.
    """
    flip = np.array([1.0, -1.0])  # y is up in landmarks
    points, still = landmarks[..., :2] * flip, rest[:, :2] * flip
    middle = (still[OUTER[0]] + still[OUTER[len(OUTER_LIP_UPPER) - 1]]) / 2
    return tuple(
        LipOutline((face[list(OUTER)] - middle).astype(np.float32), (face[list(INNER)] - middle).astype(np.float32))
        for face in points
    )


def token_outlines(talker: Talker, token: UsedToken, n_instants: int = N_INSTANTS) -> tuple[LipOutline, ...]:
    """Outlines at equally spaced instants of a recorded token, from its beginning to its end, around its mean mouth.

    Raises
    ------
    InputError
        The talker has no such utterance.
    """
    utterance = next((spoken for spoken in talker.utterances if spoken.name == token.utterance), None)
    if utterance is None:
        raise InputError(f"the talker has no recording {token.utterance!r}; build the explanation with the same talker")
    times = np.linspace(token.start, token.end, n_instants)
    frames = np.arange(len(utterance.shape)) / talker.fps
    shape = interpolate_columns(utterance.shape, frames, np.clip(times, 0.0, frames[-1]))
    return lip_outlines(talker.model.shapes(shape), talker.model.mean)
