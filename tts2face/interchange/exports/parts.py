"""Base of the export formats: the parts of a clip that a writer receives, and the file that it fills.

How the next format is made:

1. Write a class with the methods of `FormatWriter` in a module of its own here; it is made with a `Target`, receives
   one `Part` after another, and keeps no frames in memory.
2. Add its row to `FORMATS` in `tts2face.interchange.exports.table`: name, endings, summary, module and class; HTTP
   sends it if it `has_lines`, as the `media_type` of the row.
3. Take frames from `Part.motion` and `Part.head`, phones and words from `tts2face.interchange.exports.labels`.
4. Say in docs/exports.md what the file holds, and read it back in a test.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TextIO

from tts2face.interchange.exports.table import sound_name
from tts2face.numeric.arrays import Float32Array
from tts2face.storage.marks import Mark
from tts2face.types import Clip

if TYPE_CHECKING:
    from tts2face.models.face import Face


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

    @property
    def end(self) -> float:
        """End of the clip's sound in seconds of the whole; 0 without a clip."""
        return 0.0 if self.clip is None else self.begin + self.clip.speech.waveform.duration


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
    mark, sound_mark
        What the file says of its making; of sound alone None for a recording.
    beside
        Path to write another file to, which appears beside this one under the given name; asked for before any frame.
    """

    path: Path
    name: str
    fps: Fraction
    source_fps: Fraction
    rate: int
    channels: tuple[str, ...]
    face: "Face | None"
    lines: TextIO | None = None
    mark: Mark | None = None
    sound_mark: Mark | None = None
    beside: Callable[[str], Path] = Path

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
