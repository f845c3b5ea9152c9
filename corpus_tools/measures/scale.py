"""Scale of a person's lips, by which curves of faces of different size and range of motion are compared."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corpus_tools.measures.reference import LipCurves
from corpus_tools.recordings.observation import Observation
from tts2face.lips.motion_measures import speech_frames
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class CurveScale:
    """Mean and standard deviation (2,) of a person's lip opening and width during speech."""

    mean: FloatArray
    spread: FloatArray

    @classmethod
    def of(cls, speech: Sequence[FloatArray]) -> "CurveScale":
        """Statistics of curves (T, 2) in speech."""
        frames = np.concatenate(speech)
        return cls(frames.mean(axis=0), np.maximum(frames.std(axis=0), 1e-9))

    @classmethod
    def of_observations(cls, observations: Sequence[Observation]) -> "CurveScale":
        """Statistics of one person's recordings over speech frames."""
        here = [speech_frames(seen.phones, len(seen.landmarks), seen.fps) for seen in observations]
        curves = (LipCurves.of(seen.landmarks[span]) for seen, span in zip(observations, here, strict=True))
        return cls.of([each.values() for each in curves])

    @classmethod
    def of_talker(cls, talker: Talker) -> "CurveScale":
        """Statistics of a talker's recorded utterances."""
        spans = (speech_frames(spoken.phones, len(spoken.shape), talker.fps) for spoken in talker.utterances)
        spoken_shapes = (spoken.shape[span] for spoken, span in zip(talker.utterances, spans, strict=True))
        return cls.of([LipCurves.of_parameters(talker.model, shape).values() for shape in spoken_shapes])

    def z_score(self, curves: FloatArray) -> FloatArray:
        """z-scored curves (T, 2)."""
        return (curves - self.mean) / self.spread

    def z_score_lips(self, curves: LipCurves) -> LipCurves:
        """z-scored curves of this person."""
        opening, width = self.z_score(curves.values()).T
        return LipCurves(opening, width)
