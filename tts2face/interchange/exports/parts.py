"""Consecutive parts of a clip on the frames of an export, and what a writer of a format is.

Phones and words of consecutive clips on the time axis of the whole.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TextIO

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import SILENCE
from tts2face.interchange.exports.table import sound_name
from tts2face.numeric.arrays import interpolate_rows
from tts2face.types import HEAD_CHANNELS, Clip, exact_rate, first_sample, frame_count

if TYPE_CHECKING:
    from tts2face.models.face import Face

Float32Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Frames of an export, and the clip that begins with them.

    Parameters
    ----------
    motion, head : (T, K), (T, 6)
        Values at the frames of the export; T may be 0.
    clip
        The source clip; None for frames after the last clip.
    begin_sample
        Index of the clip's first sample in the whole sound.
    text
        Written text of the clip; empty if unknown.
    """

    motion: Float32Array
    head: Float32Array
    clip: Clip | None = None
    begin_sample: int = 0
    text: str = ""

    @property
    def begin(self) -> float:
        """Start of the clip in seconds of the whole."""
        return 0.0 if self.clip is None else self.begin_sample / self.clip.speech.waveform.rate


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """File that a writer of a format fills.

    Parameters
    ----------
    path
        Temporary file to write to.
    name
        Name that the file receives when it is complete.
    fps, source_fps
        Frames per second of the export and of the clips.
    rate
        Sample rate in Hz.
    channels
        Names of the motion's channels.
    face
        Mesh whose first shapes are these channels; None if not given.
    lines
        Receives the text of formats that consist of lines, in place of `path`.
    """

    path: Path
    name: str
    fps: Fraction
    source_fps: Fraction
    rate: int
    channels: tuple[str, ...]
    face: "Face | None"
    lines: TextIO | None = None

    def open_lines(self) -> TextIO:
        """Text file to write lines to: `path`, or `lines` of an export that is sent while it is made."""
        return self.lines or self.path.open("w", encoding="utf-8", newline="\n")

    @property
    def sound_name(self) -> str:
        """Name of the sound file beside it."""
        return sound_name(self.name)


class FormatWriter(Protocol):
    """Writer of one format, made with a `Target`; memory does not grow with the number of frames."""

    def add(self, part: Part) -> None:
        """Append a part."""

    def finish(self) -> None:
        """Complete the file."""

    def close(self) -> None:
        """Release files that are still open, complete or not."""


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


@dataclass(frozen=True, slots=True)
class Label:
    """A phone or word from `start` to `end`, in seconds of the whole, and the probability that it is said there."""

    text: str
    start: float
    end: float
    confidence: float = 1.0


@dataclass(slots=True)
class PhoneLabels:
    """Contiguous phones of parts that arrive one after another; adjacent silences are merged."""

    _pending: Label | None = None

    def add(self, part: Part) -> Iterator[Label]:
        """Yield the phones that are complete after a part; its last one may still be continued by the next part."""
        if part.clip is None:
            return
        phones, shift = part.clip.speech.phones, part.begin
        half_sample = 0.5 / part.clip.speech.waveform.rate
        starts = [shift + float(edge) for edge in phones.edges]
        yield from self._reach(starts[0], half_sample)
        for text, start, end in zip(phones.phones, starts[:-1], starts[1:], strict=True):
            if self._pending is not None and text == SILENCE == self._pending.text:
                self._pending = Label(SILENCE, self._pending.start, end)
                continue
            if self._pending is not None:
                yield self._pending
            self._pending = Label(text, start, end)

    def finish(self) -> Iterator[Label]:
        """Yield the last phone."""
        if self._pending is not None:
            yield self._pending
        self._pending = None

    def _reach(self, start: float, half_sample: float) -> Iterator[Label]:
        """Extend the last phone to the next clip: by rounding, or by silence where a clip ended within a frame."""
        last = self._pending
        if last is None:
            return
        if last.text == SILENCE or abs(start - last.end) <= half_sample:
            self._pending = Label(last.text, last.start, start)
            return
        yield last
        self._pending = Label(SILENCE, last.end, start)


def part_words(part: Part) -> list[Label]:
    """Words of a part."""
    if part.clip is None:
        return []
    edges = part.clip.speech.phones.edges
    return [
        Label(word.text, part.begin + float(edges[word.first]), part.begin + float(edges[word.last]), word.confidence)
        for word in part.clip.speech.words
    ]


@dataclass(slots=True)
class AllLabels:
    """Phones and words of all parts, for formats that state their number or the duration first.

    They take about 10 MB for an hour of speech; motion and sound are not kept.
    """

    phones: list[Label] = field(default_factory=list)
    words: list[Label] = field(default_factory=list)
    _incoming: PhoneLabels = field(default_factory=PhoneLabels)

    def add(self, part: Part) -> None:
        """Append the labels of a part."""
        self.phones += self._incoming.add(part)
        self.words += part_words(part)

    def finish(self) -> None:
        """Append the last phone."""
        self.phones += self._incoming.finish()

    @property
    def duration(self) -> float:
        """End of the last phone in seconds."""
        return self.phones[-1].end if self.phones else 0.0
