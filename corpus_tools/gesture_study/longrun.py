"""Clips of ten minutes: their coverage of the recordings and their autocorrelation."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.gesture_study.clips import field_clip
from corpus_tools.gesture_study.measures import autocorrelation, coverage, split_recordings
from tts2face.gesture.field_kernels import MIN_MOMENT_GAP
from tts2face.gesture.gesture_stream import GestureFields
from tts2face.gesture.prosody import SILENT_PROSODY
from tts2face.models.palette import GESTURE_FPS, Style

MINUTES = 10
VISITED_AFTER = (1, 3, MINUTES)  # minutes
LAGS_S = 300  # half of the clip, so that each lag is averaged over at least five minutes
FROM_S = 5  # shorter lags are within one gesture

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Repetition:
    """(L,) highest autocorrelation in each second of lag: recordings in random order, speech, silence."""

    real: Doubles
    speech: Doubles
    silence: Doubles

    @property
    def highest(self) -> tuple[float, float, float]:
        """Maxima over the lags from `FROM_S`."""
        return (
            float(self.real[FROM_S:].max()),
            float(self.speech[FROM_S:].max()),
            float(self.silence[FROM_S:].max()),
        )


@dataclass(frozen=True, slots=True, eq=False)
class LongRun:
    """By feature: coverage of the recorded moments after `VISITED_AFTER` minutes of speech, and repetition."""

    coverage: Mapping[str, tuple[float, ...]]
    repetition: Mapping[str, Repetition]


def long_run(fields: GestureFields, name: str, training: Style, held_out: Style, seed: int) -> LongRun:
    """Measure clips of `MINUTES` of a style, with the recordings' sound in random order and with silence."""
    n_frames = round(MINUTES * 60 * GESTURE_FPS)
    order = np.random.default_rng([seed, 3]).permutation(len(training.lengths))
    intensity = _shuffle_recordings(training.intensity, training.lengths, order, n_frames)
    silence = np.full(n_frames, SILENT_PROSODY[0], np.float32)
    coverages, repetitions = {}, {}
    for feature in held_out.motion:
        speech = field_clip(fields, name, feature, intensity, seed)
        quiet = field_clip(fields, name, feature, silence, seed)
        coverages[feature] = tuple(
            coverage(speech.moments[: round(minutes * 60 * GESTURE_FPS)], training.lengths, MIN_MOMENT_GAP)
            for minutes in VISITED_AFTER
        )
        real = _shuffle_recordings(training.motion[feature], training.lengths, order, n_frames)
        repetitions[feature] = Repetition(
            *(_highest_per_second(values) for values in (real, speech.values, quiet.values))
        )
    return LongRun(coverages, repetitions)


def _shuffle_recordings(
    values: NDArray[np.float32], lengths: NDArray[np.int32], order: NDArray[np.int64], n_frames: int
) -> NDArray[np.float32]:
    """The first `n_frames` frames of the recordings in an order, repeated from the first if too short."""
    parts = split_recordings(values, lengths)
    whole = np.concatenate([parts[at] for at in order])
    return np.resize(whole, (n_frames, *whole.shape[1:])) if len(whole) < n_frames else whole[:n_frames]


def _highest_per_second(values: NDArray[np.float32]) -> Doubles:
    a_second = round(GESTURE_FPS)
    found = autocorrelation(values, LAGS_S * a_second - 1)
    return np.asarray(found.reshape(LAGS_S, a_second).max(axis=1))
