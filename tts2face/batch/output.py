"""Outputs of a batch: clips made of segments, and the plan of all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from tts2face.batch.address import content_address
from tts2face.batch.segment import Segment

OUTPUT_SUFFIX = ".mp4"


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


@dataclass(frozen=True, slots=True)
class Output:
    """A clip: segments in order of time.

    Parameters
    ----------
    name
        Name of the file in the folder of outputs.
    source
        Subtitle files.
    begin_s
        Instant of its first frame in the film.
    sounds
        For each segment, what replaces its sound; empty: nothing.
    """

    name: str
    source: tuple[str, ...]
    begin_s: float
    fps: float
    cues: tuple[PlannedCue, ...]
    segments: tuple[Segment, ...]
    sounds: tuple[Sound | None, ...] = ()

    @property
    def address(self) -> str:
        """Content address: equal for equal files."""
        content: dict[str, Any] = {
            "segments": [segment.address for segment in self.segments],
            "suffix": OUTPUT_SUFFIX,
        }
        if any(self.sounds):
            content["sounds"] = [(one.hash, one.offset) if one else None for one in self.sounds]
        return content_address(content)


@dataclass(frozen=True, slots=True)
class PlanWarning:
    """A defect of a subtitle file or its text, and what is done about it."""

    file: str
    line: int
    message: str


@dataclass(frozen=True, slots=True)
class Plan:
    """Outputs of a batch, and warnings; equal segments occur once in `segments`."""

    outputs: tuple[Output, ...]
    warnings: tuple[PlanWarning, ...]
    n_cues: int
    n_silent: int

    @property
    def segments(self) -> dict[str, Segment]:
        """Different segments by their content address, in order of first use."""
        return {segment.address: segment for output in self.outputs for segment in output.segments}


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
            replace(one, offset=one.offset - offset_frames) if one else None
            for one in output.sounds or [None] * len(output.segments)
        ]
        offset_frames += sum(segment.slot_frames or segment.window_frames for segment in output.segments)
    source = tuple(path for output in outputs for path in output.source)
    return Output(f"{name}{OUTPUT_SUFFIX}", source, 0.0, outputs[0].fps, tuple(cues), tuple(segments), tuple(sounds))
