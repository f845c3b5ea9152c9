"""Lip opening that a shipped talker shows for the phones of a recording, to which its tracked lips are compared."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import PhoneSequence
from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model, speech_trajectory
from tts2face.models.landmarks import lip_opening
from tts2face.models.talker import ShapeModel
from tts2face.models.talker_file import load_talker

EXPECTED_RATE_HZ = 100.0  # of the curves below
SHIPPED_TALKER = "grid_s1"
ExpectedOpening = Callable[[PhoneSequence], NDArray[np.float64]]


def shipped_talker_opening(phones: PhoneSequence) -> NDArray[np.float64]:
    """Opening (T,) of the inner lips at `EXPECTED_RATE_HZ` from 0 s to the end of the phones, by the shipped talker."""
    model, exemplars = _shipped_exemplars()
    n_frames = int(phones.end * EXPECTED_RATE_HZ) + 2
    lips = speech_trajectory(phones, exemplars, fps=EXPECTED_RATE_HZ, n_frames=n_frames)
    return lip_opening(model.shapes(lips.values)).astype(np.float64)


@lru_cache(maxsize=1)
def _shipped_exemplars() -> tuple[ShapeModel, ExemplarModel]:
    talker = load_talker(SHIPPED_TALKER)
    return talker.model, build_exemplar_model(talker)
