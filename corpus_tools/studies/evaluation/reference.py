"""Reference motion of held-out utterances, and thresholds derived from it.

Measures of the similarity of synthesised and real lip motion, as functions of arrays.

Openings are those of `tts2face.models.landmarks.lip_opening`; frame i is the instant i / fps of the phones' clock.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from lexicon.phones import PHONES, look_up_phone, vowel_symbols
from lexicon.sequence import PhoneSequence
from tts2face.lips import explanation
from tts2face.models.landmarks import lip_opening, lip_width
from tts2face.models.talker import ShapeModel

CLOSURE_MARGIN_S = 0.03  # a closure may lie this far outside its phone: frames are 40 ms, edges accurate to 10 ms
CLOSURE_QUANTILE = 0.9  # quantile of the minimum openings of real closures that is the threshold of a closure
N_DTW_PARAMETERS = 6  # shape parameters that the warping cost compares: 95 % of the motion
PEAK_MARGIN_S = 0.06  # the maximum opening of a vowel may lie this far outside its edges
BILABIALS = ("p", "b", "m")
OPEN_HEIGHTS = ("open", "near-open", "open-mid")

Values = NDArray[np.floating]


def rmse_z(real: Values, synthesised: Values, spread: Values) -> float:
    """Root mean square difference of (T, D) parameters in units of their training spread (D,)."""
    return float(np.sqrt(np.mean(np.square((real - synthesised) / spread))))


def min_openings(
    opening: Values, phones: PhoneSequence, fps: float, labels: Collection[str] = BILABIALS
) -> NDArray[np.float64]:
    """Minimum opening within each phone with one of the labels, extended by `CLOSURE_MARGIN_S` on both sides."""
    times = np.arange(len(opening)) / fps
    least = []
    for at, label in enumerate(phones.phones):
        start, end = phones.edges[at] - CLOSURE_MARGIN_S, phones.edges[at + 1] + CLOSURE_MARGIN_S
        low, high = np.searchsorted(times, (start, end))
        if label in labels and low < high:
            least.append(float(opening[low:high].min()))
    return np.array(least, np.float64)


def midpoint_openings(opening: Values, phones: PhoneSequence, fps: float) -> NDArray[np.float64]:
    """Opening in the middle of each open vowel."""
    labels = open_vowels()
    middles = (phones.edges[:-1] + phones.edges[1:]) / 2
    wanted = np.array([label in labels for label in phones.phones])
    return np.asarray(np.interp(middles[wanted], np.arange(len(opening)) / fps, opening))


def open_vowels() -> frozenset[str]:
    """Open vowels, and diphthongs that begin with one."""
    first = {label: look_up_phone(label).parts[0] if look_up_phone(label).parts else label for label in vowel_symbols()}
    heights = {label: look_up_phone(start) for label, start in first.items()}
    return frozenset(label for label, phone in heights.items() if phone.height in OPEN_HEIGHTS and not phone.nasality)


def closure_threshold(real_least: Values) -> float:
    """Opening below which `CLOSURE_QUANTILE` of the real closures lie."""
    return float(np.quantile(real_least, CLOSURE_QUANTILE)) if len(real_least) else 0.0


def peak_times(opening: Values, phones: PhoneSequence, fps: float) -> NDArray[np.float64]:
    """Instant of the maximum opening in each open vowel, extended by `PEAK_MARGIN_S` on both sides, in seconds.

    Vertex of the parabola through the highest frame and its neighbours; NaN if the maximum is at the border.
    """
    wanted, peaks = open_vowels(), []
    for at, label in enumerate(phones.phones):
        if label in wanted:
            low = max(1, int(np.ceil((phones.edges[at] - PEAK_MARGIN_S) * fps)))
            high = min(len(opening) - 2, int(np.floor((phones.edges[at + 1] + PEAK_MARGIN_S) * fps)))
            peaks.append(_peak_position(opening, low, high) / fps if low < high else np.nan)
    return np.array(peaks, np.float64)


def _peak_position(curve: Values, low: int, high: int) -> float:
    top = low + int(np.argmax(curve[low : high + 1]))
    before, here, behind = (float(value) for value in curve[top - 1 : top + 2])
    if not (here >= before and here >= behind and here > min(before, behind)):
        return np.nan
    return top + 0.5 * (before - behind) / (before - 2 * here + behind)


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
            explanation.speech_frames(observation.phones, n_frames, observation.fps),
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
                min_openings(getattr(one.curves, curve), one.observation.phones, one.observation.fps, labels)
                for one in real
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
