"""Gesture clips for the study: held-out recordings, and motion of fields built from the other recordings."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from corpus_tools.gesture_study.measures import split_recordings
from lexicon.errors import InputError
from tts2face.gesture.field import initial_state, sample_field_moments
from tts2face.gesture.gesture_stream import GestureFields
from tts2face.gesture.ju2008 import FIELD_OPTIONS
from tts2face.gesture.perlin_noise import NoiseStream
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import GESTURE_FPS, Palette, Style
from tts2face.numeric import interpolate_cubic
from tts2face.types import Waveform

Floats = NDArray[np.float32]
NO_SOUND = Waveform(np.zeros(2, np.float32), 16000)


@dataclass(frozen=True, slots=True, eq=False)
class Clip:
    """Motion (T, k), and the recorded moment (T',) of each frame of the field."""

    values: Floats
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

    def select(values: Floats) -> Floats:
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


def field_clip(fields: GestureFields, style: str, feature: str, intensity: Floats, seed: int) -> Clip:
    """A feature of a style, measured or derived, for an intensity (T,) at `GESTURE_FPS`."""
    source, tempo = fields.source(style, feature), fields.change(style, feature).tempo
    field = fields.of(source, feature)
    times = np.arange(0.0, len(intensity) * tempo + 2)  # in frames of the field; two more for the cubic
    intensities = np.interp(times / tempo, np.arange(len(intensity)), intensity).astype(np.float32)[:, None]
    generator = np.random.default_rng([seed, crc32(feature.encode())])  # as `tts2face.gesture.gesture_stream` draws
    start = initial_state(field, generator.random())
    sample = sample_field_moments(field, start, intensities, generator.random(len(intensities)))
    values = sample.values[: len(intensity)]
    if tempo != 1.0:
        values = interpolate_cubic(sample.values, tempo * np.arange(len(intensity), dtype=np.float64))
    return Clip(fields.apply_change(style, feature, values), sample.moments[: round(len(intensity) * tempo)])


def published_clip(palette: Palette, style: str, intensity: Floats, seed: int) -> Mapping[str, Floats]:
    """All features of a measured style by the published fields (`tts2face.gesture.ju2008`), each as `field_clip`."""
    fields = GestureFields(palette, FIELD_OPTIONS["ju2008"])
    features = tuple(palette.styles[style].motion)
    with ThreadPoolExecutor() as threads:  # an exact search at each frame takes ten times as long as the default
        clips = threads.map(lambda feature: field_clip(fields, style, feature, intensity, seed).values, features)
        return dict(zip(features, clips, strict=True))


def noise_clip(fields: GestureFields, style: str, n_frames: int, seed: int) -> Mapping[str, Floats]:
    """All features of a style from noise, which does not depend on the sound."""
    stream = NoiseStream(fields, style=style, seed=seed, fps=GESTURE_FPS)
    return stream.next(NO_SOUND, n_frames, Timeline())
