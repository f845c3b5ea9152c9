"""Consecutive clips of any frame rate on the frames of an export."""

from collections.abc import Iterator

import numpy as np

from lexicon.errors import InputError
from tts2face.interchange.exports.parts import Part
from tts2face.numeric.arrays import Float32Array, interpolate_rows
from tts2face.types import HEAD_CHANNELS, Clip, exact_rate, first_sample, frame_count


class FrameGrid:
    """Places consecutive clips on the frames of an export, by linear interpolation where rates differ."""

    def __init__(self, clip: Clip, fps: float | None) -> None:
        self.source_fps = exact_rate(clip.fps)
        self.fps = self.source_fps if fps is None else exact_rate(fps)
        self._rate, self._channels = clip.speech.waveform.rate, clip.motion.channels
        self._n_source = self._n_frames = self._end_sample = 0
        self._last = np.zeros((0, len(self._channels) + len(HEAD_CHANNELS)), np.float32)

    def place(self, clip: Clip, text: str) -> Part:
        """Part of the next clip.

        Raises
        ------
        InputError
            Its frame rate, sample rate or channels differ from those of the first clip.
        """
        given = (exact_rate(clip.fps), clip.speech.waveform.rate, clip.motion.channels)
        if given != (self.source_fps, self._rate, self._channels):
            raise InputError(
                f"clips of one file must share fps, sound rate and channels; this one has {clip.fps:g} frames/s, "
                f"{clip.speech.waveform.rate} Hz and {len(clip.motion.channels)} channels"
            )
        shift = first_sample(self._n_source, self._rate, self.source_fps)
        values = np.concatenate([clip.motion.values, clip.head.values], axis=1)
        rows = values if self.fps == self.source_fps else self._resample(values)
        self._n_source += len(values)
        self._n_frames += len(rows)
        self._end_sample = shift + len(clip.speech.waveform.samples)
        self._last = values[-1:]
        return self._part(rows, clip, shift, text)

    def remainder(self) -> Part:
        """Frames after the last source frame, which repeat it up to the end of the sound."""
        if self.fps == self.source_fps:
            return self._part(self._last[:0])
        expected = frame_count(self._end_sample / self._rate, float(self.fps))
        return self._part(np.repeat(self._last, max(expected - self._n_frames, 0), axis=0))

    def _resample(self, values: Float32Array) -> Float32Array:
        """Rows at the export's frames up to the last of `values`, which follow the rows before."""
        rows = np.concatenate([self._last, values])
        first = self._n_source - len(self._last)
        ratio = self.source_fps / self.fps
        until = int((self._n_source + len(values) - 1) / ratio) + 1
        at = np.arange(self._n_frames, until, dtype=np.float64) * float(ratio) - first
        return interpolate_rows(rows, at)

    def _part(self, rows: Float32Array, clip: Clip | None = None, shift: int = 0, text: str = "") -> Part:
        k = len(self._channels)
        return Part(rows[:, :k], rows[:, k:], clip, shift, text)


def frame_rows(values: Float32Array, decimals: str) -> Iterator[str]:
    """Yield the rows (T, D) as text, numbers separated by commas in the given format such as ``%.6f``."""
    pattern = ",".join([decimals] * values.shape[1])
    for row in values.tolist():
        yield pattern % tuple(row)
