"""Recordings of cues in a folder, found by the name of the subtitle file and the number of the cue."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

SOUND_SUFFIXES = frozenset({".wav", ".flac", ".mp3", ".m4a", ".ogg", ".opus", ".aac", ".aif", ".aiff", ".mp4", ".mov",
                            ".mkv", ".webm"})  # fmt: skip
_NUMBERED = re.compile(r"(?:(?P<name>.*)[-_ .])?0*(?P<number>\d{1,9})")


def index_recordings(folder: Path) -> dict[str, Path]:
    """Recordings of a folder and its folders by ``name/number``; `name` is empty for names that are only a number."""
    found: dict[str, Path] = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() not in SOUND_SUFFIXES:
            continue
        match = _NUMBERED.fullmatch(path.stem)
        if match is None:
            continue
        name = match["name"] or ("" if path.parent == folder else path.parent.name)
        found.setdefault(f"{name.lower()}/{int(match['number'])}", path)
    return found


def find_recording(recordings: Mapping[str, Path], names: Sequence[str], number: int) -> Path | None:
    """The recording of a cue by the names of its subtitle file; None without one."""
    return next((recordings[key] for name in names if (key := f"{name.lower()}/{number}") in recordings), None)
