"""The result of a rendered segment; a module without heavy imports."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any


@dataclass(frozen=True, slots=True)
class SegmentResult:
    """A rendered segment.

    Parameters
    ----------
    n_frames, fps
        Its length.
    rate
        Speaking rate of the fit; 1 for silence and recordings.
    speech_s
        Seconds from its cue to the end of its last word, of an excerpt from its start; 0 without words.
    overflow_s
        Seconds by which the speech ends after its cue.
    cut_s
        Seconds of speech that is left out or cut off, as the next cue begins.
    warnings
        What does not match the subtitles.
    took_s
        Seconds of work.
    overlap_s
        Seconds of speech that sound on after the next cue has begun.
    """

    n_frames: int
    fps: float
    rate: float = 1.0
    speech_s: float = 0.0
    overflow_s: float = 0.0
    cut_s: float = 0.0
    warnings: tuple[str, ...] = ()
    took_s: float = 0.0
    overlap_s: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """JSON object from which `result_from_json` makes the result again."""
        return asdict(self) | {"warnings": list(self.warnings)}


def result_from_json(content: Mapping[str, Any]) -> SegmentResult:
    """The result of `SegmentResult.as_json`; unknown names are ignored."""
    known = {field.name for field in fields(SegmentResult)}
    found = {name: value for name, value in content.items() if name in known}
    return SegmentResult(**{**found, "warnings": tuple(found.get("warnings", ()))})
