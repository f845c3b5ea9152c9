"""The transcript that lies beside a recording, under its name."""

from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.subtitles.formats import SUFFIXES as ALL_SUBTITLES
from tts2face.interchange.transcripts.reader import READERS, TEXT_SUFFIX, find_reader

SUBTITLE_SUFFIXES = tuple(suffix for suffix in ALL_SUBTITLES if suffix != ".xml")  # in order of preference
# in order of preference: the words of a person before tables of programs
_FIRST = (TEXT_SUFFIX, ".textgrid", ".align", *SUBTITLE_SUFFIXES)
SUFFIXES = (*_FIRST, *(suffix for suffix in READERS if suffix not in _FIRST))
OTHERS_TOO = frozenset({".tsv", ".json", ".rec"})  # tables and facts of anything, recordings of television


def find_transcript(recording: Path) -> Path | None:
    """The transcript beside a recording, in the order of `SUFFIXES`; None without one."""
    beside = {path.suffix.lower(): path for path in sorted(recording.parent.iterdir()) if path.stem == recording.stem}
    return next((beside[suffix] for suffix in SUFFIXES if suffix in beside and _may_be(beside[suffix])), None)


def _may_be(path: Path) -> bool:
    """Whether a file can be a transcript: of endings of other files, too, the content decides."""
    if path.suffix.lower() not in OTHERS_TOO:
        return True  # what is no file is refused by name where it is read
    try:
        return find_reader(path) is not None
    except DataError:
        return False
