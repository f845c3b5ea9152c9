"""Outputs of a batch: clips made of segments, and the plan of all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from lexicon.errors import InputError
from tts2face.serving.batch.content_address import content_address
from tts2face.serving.batch.lines import LineSettings
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.speakers import Casting


@dataclass(frozen=True, slots=True)
class PlannedCue:
    """A cue of an output; `segment` is the index of its segment, None for a silent one."""

    number: int
    line: int
    speaker: str
    text: str
    begin_s: float
    end_s: float
    segment: int | None


@dataclass(frozen=True, slots=True)
class Sound:
    """Sound in place of that of a segment: a recording, and its frame at frame 0 of the output."""

    path: str
    hash: str
    offset: int


@dataclass(frozen=True)
class Output:
    """A clip: segments in order of time.

    Parameters
    ----------
    stem
        Name of its files in the folder of outputs, without their endings.
    source
        Subtitle files.
    begin_s
        Instant of its first frame in the film.
    sounds
        For each segment, what replaces its sound; empty: nothing.
    suffix, exports
        Endings of the video, empty without one, and of the exports.
    """

    stem: str
    source: tuple[str, ...]
    begin_s: float
    fps: float
    cues: tuple[PlannedCue, ...]
    segments: tuple[Segment, ...]
    sounds: tuple[Sound | None, ...] = ()
    suffix: str = ".mp4"
    exports: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its files: the video, if there is one, and the exports."""
        return tuple(f"{self.stem}{suffix}" for suffix in (self.suffix, *self.exports) if suffix)

    @property
    def name(self) -> str:
        """Name of its first file."""
        return self.names[0]

    @cached_property
    def tracks(self) -> tuple[Segment, ...]:
        """Tracks of its segments; empty without exports."""
        return tuple(segment.as_track() for segment in self.segments) if self.exports else ()

    @property
    def needed(self) -> tuple[Segment, ...]:
        """Segments that must be stored to make it."""
        return (*(self.segments if self.suffix else ()), *self.tracks)

    @cached_property
    def address(self) -> str:
        """Content address: equal for equal files."""
        content: dict[str, Any] = {
            "segments": [segment.address for segment in self.segments],
            "suffix": self.suffix,
        }
        if self.exports:
            content["exports"] = list(self.exports)
        if any(self.sounds):
            content["sounds"] = [(sound.hash, sound.offset) if sound else None for sound in self.sounds]
        return content_address(content)


@dataclass(frozen=True, slots=True)
class PlanWarning:
    """A defect of a subtitle file or its text, and what is done about it; `line` is 0 for other files."""

    file: str
    line: int
    message: str


@dataclass(frozen=True, slots=True)
class PlannedLine:
    """A cue with words, or one speaker's part of it, in the order of the subtitles.

    Parameters
    ----------
    file
        Name of its subtitle file, without the ending.
    number, part
        Its cue, and which of several speakers of it, from 1; 0 for a whole cue.
    begin_s, end_s
        Instants in its file.
    settings
        Its row of the table of lines.
    casting
        Who speaks.
    segment
        What is rendered; None for a line that is not spoken.
    """

    file: str
    number: int
    part: int
    begin_s: float
    end_s: float
    speaker: str
    text: str
    settings: LineSettings
    casting: Casting
    segment: Segment | None


@dataclass(frozen=True, slots=True)
class Plan:
    """Outputs of a batch, warnings, and notes of what is left out; equal segments occur once in `segments`."""

    outputs: tuple[Output, ...]
    warnings: tuple[PlanWarning, ...]
    n_cues: int
    n_silent: int
    lines: tuple[PlannedLine, ...] = ()
    notes: tuple[PlanWarning, ...] = ()

    @property
    def segments(self) -> dict[str, Segment]:
        """Different segments by their content address, in order of first use."""
        return {segment.address: segment for output in self.outputs for segment in output.needed}


def join_outputs(name: str, outputs: Sequence[Output]) -> Output:
    """One output of several in order; the times of its cues are those of the whole film."""
    cues: list[PlannedCue] = []
    segments: list[Segment] = []
    sounds: list[Sound | None] = []
    offset_frames = 0
    for output in outputs:
        offset_s = offset_frames / output.fps
        for cue in output.cues:
            index = None if cue.segment is None else cue.segment + len(segments)
            cues.append(
                PlannedCue(
                    cue.number, cue.line, cue.speaker, cue.text, cue.begin_s + offset_s, cue.end_s + offset_s, index
                )
            )
        segments += output.segments
        sounds += [
            replace(sound, offset=sound.offset - offset_frames) if sound else None
            for sound in output.sounds or [None] * len(output.segments)
        ]
        offset_frames += sum(segment.slot_frames or segment.window_frames for segment in output.segments)
    source = tuple(path for output in outputs for path in output.source)
    return replace(
        outputs[0],
        stem=name,
        source=source,
        begin_s=0.0,
        cues=tuple(cues),
        segments=tuple(segments),
        sounds=tuple(sounds),
    )


def output_names(files: Sequence[Path]) -> list[str]:
    """Names of outputs: the stems of subtitle files, with their folders or suffixes where stems are equal."""
    if len({path.resolve() for path in files}) < len(files):
        raise InputError("a subtitle file is given twice; remove one of them")
    for name_of in (
        lambda path: path.stem,
        lambda path: f"{path.resolve().parent.name}-{path.stem}",
        lambda path: f"{path.resolve().parent.name}-{path.name.replace('.', '-')}",
    ):
        names = [name_of(path) for path in files]
        if len(set(names)) == len(names):
            return names
    return [f"{number:03d}-{path.stem}" for number, path in enumerate(files, start=1)]
