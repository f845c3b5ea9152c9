"""Lip motion of speech that is still being spoken, by its sound alone."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.talker import speech_channels
from tts2face.session.recording import select_audio_map
from tts2face.session.shared_models import SessionModels
from tts2face.sound.features import FEATURE_RATE
from tts2face.sound.listener import StreamingAudioMap
from tts2face.types import Trajectory

RATE_LIMITS = (8_000, 192_000)  # Hz


class LiveLips:
    """Lip motion of a sound that arrives in blocks; independent of the blocks at 16 kHz. Not thread-safe.

    Parameters
    ----------
    rate
        Sample rate of the sound in Hz; rates other than 16 kHz are resampled.
    audio_map
        Name of an audio map of the talker; None for the default.
    """

    def __init__(self, models: SessionModels, rate: int = FEATURE_RATE, audio_map: str | None = None) -> None:
        low, high = RATE_LIMITS
        if not low <= rate <= high:
            raise InputError(f"the sample rate must lie between {low} and {high} Hz, not {rate}; convert the sound")
        talker = models.talker
        chosen = select_audio_map(audio_map, talker)
        self._stream = StreamingAudioMap(chosen)
        self._face = models.speech_face
        self._channels = speech_channels(talker.model)
        self.fps = chosen.fps
        self._resampler: Any = None
        if rate != FEATURE_RATE:
            import soxr

            self._resampler = soxr.ResampleStream(rate, FEATURE_RATE, 1, dtype="float32")

    @property
    def look_ahead_s(self) -> float:
        """Seconds of sound after a frame that are needed to compute it."""
        return self._stream.look_ahead_s

    def add_samples(self, samples: NDArray[np.floating]) -> Trajectory | None:
        """Motion of the frames that are known after samples (m,) in [-1, 1]; None if there are none.

        Raises
        ------
        InputError
            The block is not a vector of finite samples.
        """
        if self._resampler is not None:
            samples = self._resampler.resample_chunk(np.asarray(samples, np.float32))
        return self._motion(self._stream.add_samples(samples))

    def finish(self) -> Trajectory | None:
        """Motion of the remaining frames."""
        parts = []
        if self._resampler is not None:
            parts.append(self._stream.add_samples(self._resampler.resample_chunk(np.zeros(0, np.float32), last=True)))
        if not self._stream.n_samples:
            return None
        return self._motion(np.concatenate([*parts, self._stream.finish()]))

    def _motion(self, parameters: NDArray[np.float32]) -> Trajectory | None:
        if not len(parameters):
            return None
        return self._face.motion_of_parameters(Trajectory(self._channels, parameters, self.fps))
