"""Subtitles of videos as cues with margins."""

from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.reader import read_subtitles

SUBTITLE_SUFFIXES = (".srt", ".vtt", ".ass", ".ssa", ".ttml")  # in order of preference
CUE_MARGIN_S = 0.3  # before and after a cue; subtitles are rarely closer to the speech


@dataclass(frozen=True, slots=True)
class SpokenCue:
    """Words spoken between two instants in seconds."""

    start: float
    end: float
    text: str


def find_subtitles(video: Path) -> Path | None:
    """The subtitle file of a video, or None."""
    return next((path for suffix in SUBTITLE_SUFFIXES if (path := video.with_suffix(suffix)).is_file()), None)


def read_cues(path: Path) -> tuple[SpokenCue, ...]:
    """Spoken cues in temporal order, each extended by `CUE_MARGIN_S` but not beyond the middle to its neighbour.

    Cues without words and cues whose end is only estimated are left out.
    """
    read = read_subtitles(path).cues
    spoken = [(cue.begin_s, cue.end_s, cue.text) for cue in read if cue.text and not cue.has_estimated_end]
    if not spoken:
        raise DataError(f"{path} contains no subtitles; export them again")
    cues = []
    for number, (start, end, text) in enumerate(spoken):
        before = spoken[number - 1][1] if number else 0.0
        behind = spoken[number + 1][0] if number + 1 < len(spoken) else end + 2 * CUE_MARGIN_S
        earliest, latest = min((before + start) / 2, start), max((end + behind) / 2, end)
        cues.append(SpokenCue(max(start - CUE_MARGIN_S, earliest, 0.0), min(end + CUE_MARGIN_S, latest), text))
    return tuple(cues)
