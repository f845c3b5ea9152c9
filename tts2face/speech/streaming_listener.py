"""Speech heard block by block: features and lips of each frame as soon as they can be known.

What comes out does not depend on where the blocks are cut; all blocks together give what the whole sound gives.
"""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.audio_map import AudioMap
from tts2face.speech.features import (
    FEATURE_RATE,
    HALF_WINDOW_SAMPLES,
    WINDOWS_AT_ONCE,
    analysis_windows,
    feature_measures,
    measure_windows,
)
from tts2face.types import frame_count

SampleBlock = NDArray[np.floating]


class StreamingFeatures:
    """Turns blocks of sound at `FEATURE_RATE` into features of frames at a rate; frame i is the instant i / fps."""

    def __init__(self, kind: str, fps: float) -> None:
        if not fps > 0:
            raise InputError(f"frames per second must be above 0, not {fps}")
        self._measures, self._fps = feature_measures(kind), fps
        self._kept: NDArray[np.float32] = np.zeros(0, np.float32)
        self._buffer_start = 0  # the sample with which `_kept` begins
        self._n_given = 0

    @property
    def n_samples(self) -> int:
        """Samples heard so far."""
        return self._buffer_start + len(self._kept)

    def hear(self, samples: SampleBlock) -> NDArray[np.float32]:
        """(n, D) features of the frames that can be measured now, 43 ms of sound behind each.

        Raises
        ------
        InputError
            The block is no row of finite samples.
        """
        if samples.ndim != 1 or not np.isfinite(samples).all():
            raise InputError(f"a block of sound is a row of finite samples, not an array of shape {samples.shape}")
        self._kept = np.concatenate([self._kept, samples.astype(np.float32)])
        last = max(int((self.n_samples - HALF_WINDOW_SAMPLES - 2) * self._fps / FEATURE_RATE), -1)
        return self._features_until(last + 1)

    def finish(self) -> NDArray[np.float32]:
        """(n, D) features of the frames that were left; the sound is followed by silence."""
        return self._features_until(frame_count(self.n_samples / FEATURE_RATE, self._fps))

    def _features_until(self, n_frames: int) -> NDArray[np.float32]:
        """Features of the frames from the last given to the `n_frames`-th."""
        found = [measure_windows(self._cells(range(0)), self._measures)] if n_frames <= self._n_given else []
        while self._n_given < n_frames:
            last = min(self._n_given + WINDOWS_AT_ONCE, n_frames)
            found.append(measure_windows(self._cells(range(self._n_given, last)), self._measures))
            self._n_given = last
        self._drop_samples()
        return np.concatenate(found)

    def _cells(self, frames: range) -> NDArray[np.float64]:
        centres = np.rint(np.arange(frames.start, frames.stop) / self._fps * FEATURE_RATE).astype(np.int64)
        return analysis_windows(self._kept, centres - self._buffer_start)

    def _drop_samples(self) -> None:
        """Drop what no frame to come needs."""
        needed = round(self._n_given / self._fps * FEATURE_RATE) - HALF_WINDOW_SAMPLES
        spare = min(max(needed - self._buffer_start, 0), len(self._kept))
        self._kept, self._buffer_start = self._kept[spare:].copy(), self._buffer_start + spare


class StreamingAudioMap:
    """Turns blocks of sound at `FEATURE_RATE` into a talker's speech parameters at her frame rate."""

    def __init__(self, audio_map: AudioMap, fps: float) -> None:
        self._audio_map = audio_map
        self._feature_stream = StreamingFeatures(audio_map.feature, fps)
        self._fps = fps
        self._features: NDArray[np.float32] = np.zeros((0, len(audio_map.mean)), np.float32)

    @property
    def look_ahead_s(self) -> float:
        """Seconds of sound that must be heard behind a frame before its lips are known."""
        return self._audio_map.after / self._fps + (HALF_WINDOW_SAMPLES + 2) / FEATURE_RATE

    def hear(self, samples: SampleBlock) -> NDArray[np.float32]:
        """(n, S) parameters of the frames that can be known now.

        Raises
        ------
        InputError
            The block is no row of finite samples.
        """
        return self._map_features(self._feature_stream.hear(samples))

    def finish(self) -> NDArray[np.float32]:
        """(n, S) parameters of the frames that were left; their last features go on behind the end."""
        rest = self._feature_stream.finish()
        known = np.concatenate([self._features, rest])
        tail = np.repeat(known[-1:], self._audio_map.after, axis=0)
        return self._map_features(np.concatenate([rest, tail]))

    def _map_features(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        audio_map = self._audio_map
        if not len(self._features) and len(features):
            features = np.concatenate([np.repeat(features[:1], audio_map.before, axis=0), features])
        self._features = np.concatenate([self._features, features])
        made = audio_map.inside(self._features)
        self._features = self._features[len(made) :]
        return made
