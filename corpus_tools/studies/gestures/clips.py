"""Gesture clips for the study: held-out recordings, and motion of fields built from the other recordings.

Clips of ten minutes: their coverage of the recordings and their autocorrelation.
"""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.gestures.measures import autocorrelation, coverage, split_recordings
from lexicon.errors import InputError
from tts2face.gestures.field import initial_state, sample_field_moments
from tts2face.gestures.field_kernels import MIN_MOMENT_GAP
from tts2face.gestures.noise import NoiseStream
from tts2face.gestures.prosody import SILENT_PROSODY
from tts2face.gestures.speech_features import recorded_features
from tts2face.gestures.stream import FIELD_OPTIONS, GestureFields
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import GESTURE_FPS, Palette, Style
from tts2face.numeric.arrays import Float32Array, FloatArray, interpolate_cubic, interpolate_linear
from tts2face.types import Waveform

NO_SOUND = Waveform(np.zeros(2, np.float32), 16000)
MINUTES = 10
VISITED_AFTER = (1, 3, MINUTES)  # minutes
LAGS_S = 300  # half of the clip, so that each lag is averaged over at least five minutes
FROM_S = 5  # shorter lags are within one gesture


@dataclass(frozen=True, slots=True, eq=False)
class FieldClip:
    """Motion (T, k), and the recorded moment (T',) of each frame of the field."""

    values: Float32Array
    moments: NDArray[np.int64]


def hold_out(style: Style, one_in: int, seed: int) -> tuple[Style, Style]:
    """A style of most recordings, and one of a random 1 / `one_in` of them.

    Raises
    ------
    InputError
        Either would have fewer than two recordings.
    """
    n = len(style.lengths)
    n_held = round(n / one_in)
    if one_in < 2 or n_held < 2 or n - n_held < 2:
        raise InputError(
            f"of {n} recordings one in {one_in} cannot be held out: at least 2 must be held out and 2 must remain"
        )
    order = np.random.default_rng([seed, 1]).permutation(n)
    return select_recordings(style, np.sort(order[n_held:])), select_recordings(style, np.sort(order[:n_held]))


def select_recordings(style: Style, chosen: NDArray[np.int64]) -> Style:
    """A style of some of its recordings, in that order."""

    def select(values: Float32Array) -> Float32Array:
        parts = split_recordings(values, style.lengths)
        return np.concatenate([parts[at] for at in chosen])

    return replace(
        style,
        lengths=style.lengths[chosen],
        intensity=select(style.intensity),
        pitch=select(style.pitch),
        motion={feature: select(values) for feature, values in style.motion.items()},
    )


def replace_style(palette: Palette, name: str, style: Style) -> Palette:
    """The palette with a measured style's recordings replaced."""
    return replace(palette, styles={**palette.styles, name: style})


def sound_of(style: Style) -> Float32Array:
    """(T, 5) loudness and `recorded_features` of a style's recordings."""
    return np.concatenate([style.intensity[:, None], recorded_features(style)], axis=1)


def field_clip(fields: GestureFields, style: str, feature: str, sound: Float32Array, seed: int) -> FieldClip:
    """A feature of a style, measured or derived, for a sound (T, 5) as `sound_of` at `GESTURE_FPS`."""
    source, tempo = fields.source(style, feature), fields.change(style, feature).tempo
    field, prosody = fields.of(source, feature), sound if fields.follows_speech(feature) else sound[:, :1]
    times = np.arange(0.0, len(sound) * tempo + 2)  # in frames of the field; two more for the cubic
    prosody = interpolate_linear(prosody, np.arange(len(sound), dtype=np.float64), times / tempo)
    generator = np.random.default_rng([seed, crc32(feature.encode())])  # as `tts2face.gestures.stream` draws
    start = initial_state(field, generator.random())
    sample = sample_field_moments(field, start, prosody, generator.random(len(prosody)))
    values = sample.values[: len(sound)]
    if tempo != 1.0:
        values = interpolate_cubic(sample.values, tempo * np.arange(len(sound), dtype=np.float64))
    return FieldClip(fields.apply_change(style, feature, values), sample.moments[: round(len(sound) * tempo)])


def published_clip(palette: Palette, style: str, sound: Float32Array, seed: int) -> Mapping[str, Float32Array]:
    """All features of a measured style by the published fields (`tts2face.gestures.stream`), each as `field_clip`."""
    fields = GestureFields(palette, FIELD_OPTIONS["ju2008"], has_presentation=False)
    features = tuple(palette.styles[style].motion)
    with ThreadPoolExecutor() as threads:  # an exact search at each frame takes ten times as long as the default
        clips = threads.map(lambda feature: field_clip(fields, style, feature, sound, seed).values, features)
        return dict(zip(features, clips, strict=True))


def noise_clip(fields: GestureFields, style: str, n_frames: int, seed: int) -> Mapping[str, Float32Array]:
    """All features of a style from noise, which does not depend on the sound."""
    stream = NoiseStream(fields, style=style, seed=seed, fps=GESTURE_FPS)
    return stream.next(NO_SOUND, n_frames, Timeline())


@dataclass(frozen=True, slots=True, eq=False)
class Repetition:
    """(L,) highest autocorrelation in each second of lag: recordings in random order, speech, silence."""

    real: FloatArray
    speech: FloatArray
    silence: FloatArray

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
    sound = _shuffle_recordings(sound_of(training), training.lengths, order, n_frames)
    silence = np.zeros((n_frames, sound.shape[1]), np.float32)
    silence[:, 0] = SILENT_PROSODY[0]
    coverages, repetitions = {}, {}
    for feature in held_out.motion:
        speech = field_clip(fields, name, feature, sound, seed)
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


def _highest_per_second(values: NDArray[np.float32]) -> FloatArray:
    a_second = round(GESTURE_FPS)
    found = autocorrelation(values, LAGS_S * a_second - 1)
    return np.asarray(found.reshape(LAGS_S, a_second).max(axis=1))
