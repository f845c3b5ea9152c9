"""Recordings in a folder: one for each cue, or one for a whole subtitle file, found by name."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from lexicon.errors import InputError
from tts2face.video.sound_survey import sound_notes

SOUND_SUFFIXES = frozenset({".wav", ".flac", ".mp3", ".m4a", ".ogg", ".opus", ".aac", ".aif", ".aiff", ".mp4", ".mov",
                            ".mkv", ".webm", ".ts", ".mpg", ".mpeg", ".avi", ".m4v"})  # fmt: skip
_NUMBERED = re.compile(r"(?:(?P<name>.*)[-_ .])?0*(?P<number>\d{1,9})")


@dataclass(frozen=True, slots=True)
class SubtitleRecordings:
    """Recordings of one subtitle file: `track` is one of the whole file, else `cues` are those of cues by number."""

    track: Path | None = None
    cues: Mapping[int, Path] = field(default_factory=dict)

    def notes(self) -> tuple[str, ...]:
        """Sentences on what is guessed of `track`, of which clips take excerpts; those of `cues` have their own."""
        return sound_notes([] if self.track is None else [self.track])


def find_recordings(folder: Path, subtitles: Path, names: Sequence[str]) -> SubtitleRecordings:
    """Recordings of a subtitle file.

    Parameters
    ----------
    names
        Names under which its recordings may be stored, the best one first; the empty name is that of files that are
        only a number.

    Raises
    ------
    InputError
        Several recordings of the whole file, or recordings of the file and of its cues.
    """
    files = [path for path in sorted(folder.rglob("*")) if path.suffix.lower() in SOUND_SUFFIXES]
    named = {name.lower() for name in names if name}
    tracks = [path for path in files if path.stem.lower() in named]
    beside = [path for path in tracks if path.parent.name == subtitles.resolve().parent.name]
    tracks = beside if len(tracks) > 1 and beside else tracks
    if len(tracks) > 1:
        raise InputError(f"{tracks[0]} and {tracks[1]} are both recordings of {subtitles}; keep one of them")
    found: dict[str, Path] = {}
    for path in files:
        match = _NUMBERED.fullmatch(path.stem)
        if match is not None and path not in tracks:
            name = match["name"] or ("" if path.parent == folder else path.parent.name)
            found.setdefault(f"{name.lower()}/{int(match['number'])}", path)
    cues: dict[int, Path] = {}
    for name in names:
        prefix = f"{name.lower()}/"
        for key, path in found.items():
            if key.startswith(prefix):
                cues.setdefault(int(key.removeprefix(prefix)), path)
    if tracks and cues:
        raise InputError(
            f"{tracks[0]} is a recording of the whole of {subtitles}, and {min(cues.values())} one of a cue; keep one "
            "kind"
        )
    return SubtitleRecordings(tracks[0] if tracks else None, cues)
