"""Features of speech that enter the distance of equation 5.1 besides its loudness: place, weight and pitch.

The recorded style has them from its loudness and pitch, what is generated from its text or its sound.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.prosody import SpeechIntensity, prosody_features, speech_intensity
from tts2face.gestures.speech_plan import SoundFeatures, SpeechPlan, SpokenSentence, heard_sentences
from tts2face.models.palette import GESTURE_FPS, Style
from tts2face.numeric.arrays import Float32Array, FloatArray
from tts2face.storage.array_cache import computed_once, holds
from tts2face.types import Waveform

NEAR_S = 0.4  # about the beginning and the end of a sentence
PHRASE_SHARE = 0.5  # of an edge of a phrase within one
ACCENT_S = 0.12  # about an accent
LARGEST_PITCH = 6.0  # semitones
N_FEATURES = 4
CACHE_KIND, CACHE_VERSION = "speech-features", 1  # raised when the features of the same recordings change


def speech_features(times: FloatArray, sentences: Sequence[SpokenSentence], sound: SoundFeatures | None) -> FloatArray:
    """(T, 4) nearness to beginnings and to ends of speech, weight of accents, and pitch, at times (T,) in seconds.

    `sound` has the pitch, in seconds of the same clock; None for none.
    """
    found = np.zeros((len(times), N_FEATURES))
    for sentence in sentences:
        for phrase in sentence.phrases:
            is_first, is_last = phrase.start == sentence.span.start, phrase.end == sentence.span.end
            for column, (edge, share) in enumerate(
                (
                    (phrase.start, 1.0 if is_first else PHRASE_SHARE),
                    (phrase.end, 1.0 if is_last else PHRASE_SHARE),
                )
            ):
                near = share * np.exp(-np.abs(times - edge) / NEAR_S)
                found[:, column] = np.maximum(found[:, column], near)
        for accent in sentence.accents:
            weight = accent.prominence * np.exp(-0.5 * np.square((times - accent.time) / ACCENT_S))
            found[:, 2] = np.maximum(found[:, 2], weight)
    if sound is not None:
        pitch = np.clip(sound.pitch, -LARGEST_PITCH, LARGEST_PITCH)
        found[:, 3] = np.interp(times, sound.times, pitch, left=0.0, right=0.0)
    return found


def recorded_features(style: Style) -> Float32Array:
    """(T, 4) `speech_features` of the frames of a recorded style."""

    def compute() -> dict[str, Float32Array]:
        ends = np.cumsum(style.lengths)
        parts = [_of_recording(style, slice(end - n, end)) for end, n in zip(ends, style.lengths, strict=True)]
        return {"features": np.concatenate(parts).astype(np.float32)}

    def fits(kept: Mapping[str, NDArray[Any]]) -> bool:
        return holds(kept, {"features": ("<f4", (len(style.intensity), N_FEATURES))})

    inputs = [style.intensity, style.pitch, style.lengths]
    return np.array(computed_once(CACHE_KIND, CACHE_VERSION, inputs, compute, fits)["features"])


def _of_recording(style: Style, frames: slice) -> FloatArray:
    pitch = style.pitch[frames].astype(np.float64)
    times = np.arange(len(pitch)) / GESTURE_FPS
    sound = SoundFeatures.smoothed(
        times, style.intensity[frames].astype(np.float64), np.where(pitch == 0, np.nan, pitch)
    )
    return speech_features(times, list(heard_sentences(sound)), sound)


class FollowedSound:
    """Prosodic features of a sound that starts at `begin` seconds, cached by the times of the request."""

    def __init__(self, sound: Waveform, start: float, plan: SpeechPlan, *, with_pitch: bool) -> None:
        self._sound, self._plan = sound, plan
        self._start = start
        self._with_pitch = with_pitch
        self._found: dict[tuple[bytes, bool], Float32Array] = {}

    @cached_property
    def _intensity(self) -> SpeechIntensity | None:
        return speech_intensity(self._sound) if self._plan.sound is None else self._plan.sound.intensity

    def at(self, times: NDArray[np.float64], *, with_speech: bool) -> Float32Array:
        """(T, 1 or 2) as `prosody_features`, and (T, 4) as `speech_features`."""
        key = (times.tobytes(), with_speech)
        if key not in self._found:
            here = times - self._start
            found = prosody_features(self._sound, here, self._intensity, with_pitch=self._with_pitch)
            if with_speech:
                said = speech_features(here, self._plan.sentences, self._plan.sound)
                found = np.concatenate([found, said.astype(np.float32)], axis=1)
            self._found[key] = found
        return self._found[key]
