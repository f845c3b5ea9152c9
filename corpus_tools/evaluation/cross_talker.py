"""A talker speaks what somebody else said, with that person's phone edges; lips are compared in each one's own units.

Faces differ in size and people in how far they move, so opening and width are z-scored: the real curves by the mean and
spread of that person's speech, the made ones by those of the talker's recordings. The made motion itself sets no scale,
so that one that moves too little stays too small.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from corpus_tools.evaluation.measures import speech_frames
from corpus_tools.evaluation.reference import LipCurves, ReferenceUtterance
from corpus_tools.evaluation.scores import UtteranceComparison
from corpus_tools.recordings.observation import Observation
from tts2face.models.talker import ShapeModel


@dataclass(frozen=True, slots=True, eq=False)
class SpeakerScale:
    """Mean and spread (2,) of one person's opening and width while speaking."""

    mean: NDArray[np.float64]
    spread: NDArray[np.float64]

    @classmethod
    def of(cls, observations: Sequence[Observation]) -> "SpeakerScale":
        """Of one person's recordings, over the frames about speech."""
        parts = []
        for seen in observations:
            here = speech_frames(seen.phones, len(seen.landmarks), seen.fps)
            parts.append(LipCurves.of(seen.landmarks[here]).stacked())
        frames = np.concatenate(parts)
        return cls(frames.mean(axis=0), np.maximum(frames.std(axis=0), 1e-9))

    def z_score(self, curves: LipCurves) -> LipCurves:
        """Curves in this person's spreads from the mean."""
        opening, width = ((curves.stacked() - self.mean) / self.spread).T
        return LipCurves(opening, width)


def standardise_reference(real: ReferenceUtterance, scale: SpeakerScale) -> ReferenceUtterance:
    """A real utterance whose parameters are its z-scored curves."""
    curves = scale.z_score(real.curves)
    return replace(real, curves=curves, parameters=curves.stacked().astype(np.float32))


def compare_across_talkers(
    one: ReferenceUtterance, made: NDArray[np.float32], model: ShapeModel, scale: SpeakerScale
) -> UtteranceComparison:
    """What a method made (T, S) in the talker's units, beside somebody else's utterance in that person's."""
    curves = scale.z_score(LipCurves.of(model.shapes(made)))
    return UtteranceComparison(one, curves.stacked(), curves, np.ones(2))
