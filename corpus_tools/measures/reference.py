"""Reference motion of held-out utterances, and thresholds derived from it."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.lip_measures import BILABIALS, closure_threshold, min_openings, open_vowels
from corpus_tools.recordings.observation import Observation
from lexicon.phones import PHONES
from tts2face.lips import motion_measures
from tts2face.models.landmarks import lip_opening, lip_width
from tts2face.models.talker import ShapeModel

# Phone classes by lip articulation; a frame belongs to the first class that contains its phone.
PHONE_CLASSES: dict[str, frozenset[str]] = {
    "bilabial": frozenset(BILABIALS),
    "labiodental": frozenset({"f", "v"}),
    "rounded": frozenset(label for label, phone in PHONES.items() if phone.rounding == "rounded"),
    "open": open_vowels(),
}
OTHER_CLASS = "other"


@dataclass(frozen=True, slots=True, eq=False)
class LipCurves:
    """Opening and width (T,) of the lips over the eye distance."""

    opening: NDArray[np.float64]
    width: NDArray[np.float64]

    @classmethod
    def of(cls, landmarks: NDArray[np.floating]) -> "LipCurves":
        """Of (T, 478, 3) landmarks."""
        return cls(lip_opening(landmarks), lip_width(landmarks))

    @classmethod
    def of_parameters(cls, model: ShapeModel, parameters: NDArray[np.floating]) -> "LipCurves":
        """Of (T, S) parameters of a shape model, of which those of speech count."""
        return cls.of(model.shapes(parameters[:, : model.n_speech]))

    def values(self) -> NDArray[np.float64]:
        """(T, 2) opening and width."""
        return np.stack([self.opening, self.width], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceUtterance:
    """One held-out utterance: evaluated frames, speech parameters (T, S), curves, and the class of each frame (T,)."""

    observation: Observation
    evaluated: slice
    parameters: NDArray[np.float32]
    curves: LipCurves
    classes: NDArray[np.str_]

    @classmethod
    def of(cls, observation: Observation, model: ShapeModel) -> "ReferenceUtterance":
        """The utterance in the parameters of a model."""
        n_frames = len(observation.landmarks)
        return cls(
            observation,
            motion_measures.speech_frames(observation.phones, n_frames, observation.fps),
            model.parameters(observation.landmarks)[:, : model.n_speech],
            LipCurves.of(observation.landmarks),
            frame_classes(observation.phones.phones, observation.phones.edges, np.arange(n_frames) / observation.fps),
        )

    @property
    def seconds(self) -> float:
        """Duration of the picture."""
        return len(self.parameters) / self.observation.fps


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Upper bounds of nine tenths of real openings in bilabials and labiodentals, and of widths in rounded phones."""

    closed: float
    labiodental: float
    rounded: float

    @classmethod
    def of(cls, real: Sequence[ReferenceUtterance]) -> "Thresholds":
        """Of held-out utterances."""

        def threshold(curve: str, labels: Collection[str]) -> float:
            least = [
                min_openings(
                    getattr(reference.curves, curve), reference.observation.phones, reference.observation.fps, labels
                )
                for reference in real
            ]
            return closure_threshold(np.concatenate(least))

        return cls(
            threshold("opening", PHONE_CLASSES["bilabial"]),
            threshold("opening", PHONE_CLASSES["labiodental"]),
            threshold("width", PHONE_CLASSES["rounded"]),
        )


def frame_classes(labels: Sequence[str], edges: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.str_]:
    """(T,) class of the phone at each instant."""
    of_phone = np.array(
        [next((name for name, some in PHONE_CLASSES.items() if label in some), OTHER_CLASS) for label in labels]
    )
    at = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(labels) - 1)
    classes: NDArray[np.str_] = of_phone[at]
    return classes
