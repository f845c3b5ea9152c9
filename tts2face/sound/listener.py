"""Block-wise computation of acoustic features and speech parameters with the least possible delay.

The output is independent of the block boundaries and equals that of the whole sound.
"""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.audio_map import AudioMap
from tts2face.sound.features import (
    FEATURE_RATE,
    HALF_WINDOW_SAMPLES,
    WINDOWS_AT_ONCE,
    analysis_windows,
    channel_adaptation,
    feature_measures,
    measure_windows,
)
from tts2face.types import frame_count

SampleBlock = NDArray[np.floating]


def checked_block(samples: SampleBlock) -> NDArray[np.float32]:
    """A copy of samples (m,), which are finite; errors as of `StreamingFeatures.add_samples`."""
    found = np.array(samples, np.float32)
    if found.ndim != 1 or not np.isfinite(found).all():
        raise InputError(f"a block of sound must be a vector of finite samples; its shape is {found.shape}")
    return found


class StreamingFeatures:
    """Converts blocks of sound at `FEATURE_RATE` to features of frames; frame i belongs to the time i / fps."""

    def __init__(self, kind: str, fps: float) -> None:
        if not fps > 0:
            raise InputError(f"frames per second must be above 0, not {fps}")
        self._measures, self._fps = feature_measures(kind), fps
        self._adapt = channel_adaptation(kind)
        self._buffer: NDArray[np.float32] = np.zeros(0, np.float32)
        self._buffer_start = 0  # index of the first sample of the buffer
        self._n_returned = 0

    @property
    def n_samples(self) -> int:
        """Number of samples added so far."""
        return self._buffer_start + len(self._buffer)

    def add_samples(self, samples: SampleBlock) -> NDArray[np.float32]:
        """Add samples (m,); returns (n, D) features of all frames with at least 43 ms of sound after them.

        Raises
        ------
        InputError
            The block is not a vector of finite samples.
        """
        self._buffer = np.concatenate([self._buffer, checked_block(samples)])
        last = max(int((self.n_samples - HALF_WINDOW_SAMPLES - 2) * self._fps / FEATURE_RATE), -1)
        return self._features_until(last + 1)

    def finish(self) -> NDArray[np.float32]:
        """(n, D) features of the remaining frames, with silence after the end of the sound."""
        return self._features_until(frame_count(self.n_samples / FEATURE_RATE, self._fps))

    def _features_until(self, n_frames: int) -> NDArray[np.float32]:
        """Features of the frames from the first one not yet returned up to frame `n_frames`, exclusive."""
        found = [measure_windows(self._windows(range(0)), self._measures)] if n_frames <= self._n_returned else []
        while self._n_returned < n_frames:
            last = min(self._n_returned + WINDOWS_AT_ONCE, n_frames)
            found.append(measure_windows(self._windows(range(self._n_returned, last)), self._measures))
            self._n_returned = last
        self._drop_samples()
        return self._adapt(np.concatenate(found))

    def _windows(self, frames: range) -> NDArray[np.float64]:
        centres = np.rint(np.arange(frames.start, frames.stop) / self._fps * FEATURE_RATE).astype(np.int64)
        return analysis_windows(self._buffer, centres - self._buffer_start)

    def _drop_samples(self) -> None:
        """Remove samples that no later frame needs."""
        needed = round(self._n_returned / self._fps * FEATURE_RATE) - HALF_WINDOW_SAMPLES
        spare = min(max(needed - self._buffer_start, 0), len(self._buffer))
        self._buffer, self._buffer_start = self._buffer[spare:].copy(), self._buffer_start + spare


class StreamingAudioMap:
    """Converts blocks of sound at `FEATURE_RATE` to speech parameters at the frame rate of an audio map."""

    def __init__(self, audio_map: AudioMap) -> None:
        self._audio_map = audio_map
        self._feature_stream = StreamingFeatures(audio_map.feature, audio_map.fps)
        self._features: NDArray[np.float32] = np.zeros((0, len(audio_map.mean)), np.float32)

    @property
    def n_samples(self) -> int:
        """Number of samples added so far."""
        return self._feature_stream.n_samples

    @property
    def look_ahead_s(self) -> float:
        """Seconds of sound after a frame that are needed to compute its parameters."""
        return self._audio_map.after / self._audio_map.fps + (HALF_WINDOW_SAMPLES + 2) / FEATURE_RATE

    def add_samples(self, samples: SampleBlock) -> NDArray[np.float32]:
        """Add samples (m,); returns (n, S) parameters of all frames with enough sound after them.

        Raises
        ------
        InputError
            The block is not a vector of finite samples.
        """
        return self._map_features(self._feature_stream.add_samples(samples))

    def finish(self) -> NDArray[np.float32]:
        """(n, S) parameters of the remaining frames; the last features are held after the end."""
        rest = self._feature_stream.finish()
        known = np.concatenate([self._features, rest])
        tail = np.repeat(known[-1:], self._audio_map.after, axis=0)
        return self._map_features(np.concatenate([rest, tail]))

    def _map_features(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        audio_map = self._audio_map
        if not len(self._features) and len(features):
            features = np.concatenate([np.repeat(features[:1], audio_map.before, axis=0), features])
        self._features = np.concatenate([self._features, features])
        motion = audio_map.inside(self._features)
        self._features = self._features[len(motion) :]
        return motion
