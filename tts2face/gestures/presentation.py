"""Presentation of derived styles: recorded gestures retimed and scaled for viewers (docs/gestures.md).

Recorded people blink and move as the recording situation demands: readers sit still and blink after each sentence.
Derived styles keep the form of the recorded motion (profiles of blinks, slow part of the head motion) and change how
often and how far; recorded styles and the style ``measured`` are unchanged.
"""

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.field_kernels import low_pass
from tts2face.gestures.phrase_motion import PhraseMotion
from tts2face.gestures.prosody import QUIET_DB
from tts2face.gestures.speech_plan import SpeechPlan
from tts2face.models.palette import EXPRESSIONS, GESTURE_FPS, FaceRegion, Style
from tts2face.numeric.arrays import Float32Array, FloatArray, ordered_product
from tts2face.storage.array_cache import computed_once, holds

SMOOTHING_STAGES = 4  # low-pass stages in series: 80 dB per decade, so that scaled motion adds nothing above 6 Hz
LOUD_DB = 0.0  # intensity relative to the mean level of speech at which the loudness is 1
# Emphasis of a mood's expression: share in silence, and gain with the smoothed loudness.
SILENT_EMPHASIS = 0.86
LOUDNESS_EMPHASIS = 0.21
LISTENING_LOUDNESS = 1.2  # a listener shows the mood as in loud speech: a friendly one smiles
EMPHASIS_HZ = 0.9
EMPHASIS_LIMITS = (0.6, 1.35)
# Expression, brows and cheeks change between phrases: the slow part of the recorded motion, scaled up to these standard
# deviations (weights, and mm of each mode) and within so many of them, is followed at the edges of phrases and nearly
# held within them.
PHRASE_HZ = 0.5
CHANGING = frozenset({"expression", "brows", "cheeks"})
EXPRESSION_SPREADS = (0.03, 0.05, 0.02, 0.03, 0.05)  # in the order of `EXPRESSIONS`
SMILE_SHARE = 2.5  # of what the face is less sad: corners of the mouth move along one axis
REGION_SPREAD_MM, PHRASE_LIMIT = 0.6, 2.0
MAX_SCALE = 20.0  # of a style that hardly moves: more would scale the noise of its tracking
CACHE_KIND, CACHE_VERSION = "slow-spread", 1  # raised when the spread of the same recordings changes
EDGE_S = 0.22  # about an edge, in which a change has its way
HELD_RATE, MOVING_RATE = 0.4, 8.0  # 1/s: within phrases, and at their edges
IDLE_RATE = 4.0  # in silence


@dataclass(frozen=True, slots=True, eq=False)
class FrameContext:
    """Frames for which gestures are presented.

    Parameters
    ----------
    times : (n,)
        Increasing seconds of the whole clip.
    intensity : (n,)
        Sound level in dB relative to the mean level of speech.
    plan
        What is said in the current piece, in seconds of the whole clip.
    is_presented : (n,)
        Whether the style of each frame is a derived one.
    is_listening : (n,)
        Whether the face listens.
    end
        Seconds of the last frame of the clip, if the current piece is its last one; else infinite.
    """

    times: FloatArray
    intensity: Float32Array
    plan: SpeechPlan
    is_presented: NDArray[np.bool_]
    is_listening: NDArray[np.bool_]
    end: float = np.inf


class Presentation(Protocol):
    """Change of a feature's sampled frames; keeps its state from piece to piece."""

    def copy(self) -> Self:
        """A presentation that continues as this one, independently of it."""

    def apply(self, values: Float32Array, frames: FrameContext) -> Float32Array:
        """Presented values (n, k) of sampled values (n, k)."""


class LowPass:
    """Causal low-pass filter of `SMOOTHING_STAGES` equal stages without overshoot, at `GESTURE_FPS`.

    Parameters
    ----------
    cutoff_hz
        Frequency at which each stage attenuates by 3 dB.
    first : (k,)
        Value before the first frame.
    """

    def __init__(self, cutoff_hz: float, first: FloatArray) -> None:
        self._share = 1.0 - np.exp(-2.0 * np.pi * cutoff_hz / GESTURE_FPS)
        self._stages = np.tile(np.asarray(first, np.float64), (SMOOTHING_STAGES, 1))

    def copy(self) -> "LowPass":
        """A filter that continues as this one, independently of it."""
        new = copy(self)
        new._stages = self._stages.copy()
        return new

    def filter(self, values: FloatArray) -> FloatArray:
        """Filtered values (n, k) of the next values (n, k)."""
        filtered = np.array(values, np.float64)
        low_pass(filtered, np.full(len(filtered), self._share), self._stages)
        return filtered


def filtered_spread(values: FloatArray, cutoff_hz: float) -> FloatArray:
    """(k,) standard deviations of values (n, k) of mean 0 after `LowPass`, from their spectrum."""
    share = 1.0 - np.exp(-2.0 * np.pi * cutoff_hz / GESTURE_FPS)
    turns = np.exp(-2j * np.pi * np.fft.fftfreq(len(values)))
    response = np.abs(share / (1.0 - (1.0 - share) * turns)) ** SMOOTHING_STAGES
    spectrum = np.abs(np.fft.fft(values, axis=0)) * response[:, None]
    return np.asarray(np.sqrt(np.square(spectrum).sum(axis=0)) / len(values))


def slow_spread(recorded: Float32Array, cutoff_hz: float) -> FloatArray:
    """(k,) standard deviations of the slow part of a feature's recorded motion (T, k)."""

    def compute() -> dict[str, FloatArray]:
        motion = recorded.astype(np.float64)
        return {"spread": filtered_spread(motion - np.median(motion, axis=0), cutoff_hz)}

    def fits(kept: Mapping[str, NDArray[Any]]) -> bool:
        return holds(kept, {"spread": ("<f8", (recorded.shape[1],))})

    return np.array(computed_once(CACHE_KIND, CACHE_VERSION, [recorded, str(cutoff_hz)], compute, fits)["spread"])


def phrase_scales(style: Style, feature: str) -> tuple[FloatArray, FloatArray]:
    """Factors (k, k) by which the slow part of expression, brows or cheeks changes between phrases, and limits (k,)."""
    recorded, is_expression = style.motion[feature], feature == "expression"
    targets = np.array(EXPRESSION_SPREADS if is_expression else [REGION_SPREAD_MM] * recorded.shape[1])
    factors = np.diag(np.minimum(targets / np.maximum(slow_spread(recorded, PHRASE_HZ), 1e-9), MAX_SCALE))
    if is_expression:
        sad, happy = map(EXPRESSIONS.index, ("sad", "happy"))
        factors[sad, happy], targets[happy] = -SMILE_SHARE * factors[sad, sad], SMILE_SHARE * targets[sad]
    return factors, PHRASE_LIMIT * targets


class Emphasis:
    """Emphasis of the expression of a mood: it grows with the loudness."""

    def __init__(self) -> None:
        self._loudness = LowPass(EMPHASIS_HZ, np.zeros(1))

    def copy(self) -> "Emphasis":
        """An emphasis that continues as this one, independently of it."""
        new = copy(self)
        new._loudness = self._loudness.copy()
        return new

    def next(self, frames: FrameContext) -> FloatArray:
        """(n,) factors of a mood's expression at the next frames; 1 where the style is a recorded one."""
        loudness = np.clip((frames.intensity.astype(np.float64) - QUIET_DB) / (LOUD_DB - QUIET_DB), 0.0, 1.3)
        loudness = np.where(frames.is_listening, LISTENING_LOUDNESS, loudness)
        loud = self._loudness.filter(np.square(loudness)[:, None])[:, 0]
        emphasis = SILENT_EMPHASIS + LOUDNESS_EMPHASIS * loud
        return np.where(frames.is_presented, np.clip(emphasis, *EMPHASIS_LIMITS), 1.0)


class PhraseFollower:
    """Values that are followed at the edges of phrases and nearly held within them; freely in silence.

    Parameters
    ----------
    size
        Number of values.
    """

    def __init__(self, size: int) -> None:
        self._stages = np.zeros((2, size))

    def copy(self) -> "PhraseFollower":
        """A follower that continues as this one, independently of it."""
        new = copy(self)
        new._stages = self._stages.copy()
        return new

    def follow(self, values: FloatArray, frames: FrameContext) -> FloatArray:
        """Followed values (n, k) of the next values (n, k)."""
        followed = np.array(values, np.float64)
        low_pass(followed, 1.0 - np.exp(-phrase_rates(frames.times, frames.plan) / GESTURE_FPS), self._stages)
        return followed


def phrase_rates(times: FloatArray, plan: SpeechPlan) -> FloatArray:
    """(n,) rates in 1/s at which values that change between phrases are followed at times (n,)."""
    is_spoken = np.zeros(len(times), bool)
    for sentence in plan.sentences:
        is_spoken |= (times >= sentence.span.start) & (times < sentence.span.end)
    away = np.subtract.outer(times, np.array(plan.edges))
    nearness = np.exp(-0.5 * np.square(away / EDGE_S)).max(axis=1, initial=0.0)
    rest = np.where(is_spoken, HELD_RATE, IDLE_RATE)
    return np.asarray(rest + (MOVING_RATE - rest) * nearness)


class PhrasePresentation:
    """Expression, brows or cheeks of derived styles: the slow part of the sampled motion changes between phrases.

    Parameters
    ----------
    middle : (k,)
        Median of the recordings.
    scales
        Factors and limits of the slow part (`phrase_scales`).
    raising
        Movements of sentences and words, and the values (2, k) of a mm of the left and of the right brow; None: none.
    """

    def __init__(
        self,
        middle: Float32Array,
        scales: tuple[FloatArray, FloatArray],
        raising: tuple[PhraseMotion, FloatArray] | None = None,
    ) -> None:
        self._middle, self._scales = middle.astype(np.float64), scales
        self._raising = raising
        self._slow = LowPass(PHRASE_HZ, np.zeros(len(middle)))
        self._follower = PhraseFollower(len(middle))

    def copy(self) -> "PhrasePresentation":
        """A presentation that continues as this one, independently of it."""
        new = copy(self)
        new._slow, new._follower = self._slow.copy(), self._follower.copy()
        new._raising = None if self._raising is None else (self._raising[0].copy(), self._raising[1])
        return new

    def apply(self, values: Float32Array, frames: FrameContext) -> Float32Array:
        """Values (n, k) with slow changes between phrases, and brows that follow sentences and words."""
        slow = self._slow.filter(values.astype(np.float64) - self._middle)
        factors, limits = self._scales
        added = self._follower.follow(limits * np.tanh(ordered_product(slow, factors) / limits), frames)
        if self._raising is not None:
            motion, lifts = self._raising
            motion.add(frames.plan, float(frames.times[0]))
            added += ordered_product(motion.at(frames.times)[:, 3:], lifts)
        return np.asarray(values + frames.is_presented[:, None] * added, np.float32)


def brow_lifts(region: FaceRegion, neutral: Float32Array) -> FloatArray:
    """(2, k) values of the modes of the brows that lift the left, and the right one, by a mm and leave the other."""
    is_left = neutral[region.landmarks, 0] > 0
    shares = np.stack([side / max(int(side.sum()), 1) for side in (is_left, ~is_left)])
    heights = shares @ region.modes[:, :, 1].T.astype(np.float64)
    return np.asarray(np.linalg.pinv(heights).T, np.float64)
