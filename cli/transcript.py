"""Words of a file of another program, given with ``--file`` or ``--transcript``."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cli.process import write_message
from lexicon.errors import InputError
from lexicon.values.files import read_text

PLAIN = frozenset({"", ".ssml", ".md", ".xml"})  # endings of texts that are no transcripts of other programs


@dataclass(frozen=True, slots=True)
class TextFile:
    """The file of ``--file``, the tier of its words if it is named, and whether notes are left out."""

    path: Path
    tier: str | None
    quiet: bool

    def read(self) -> str:
        """The text, or the words of a transcript or of subtitles.

        Raises
        ------
        OSError
            The file cannot be opened or read.
        InputError
            There is no such tier, or the file has none.
        DataError
            It is no text, or has no word.
        """
        # a pipe can be read only once
        words = _timed_words(self) if self.path.is_file() else None
        if words is None and self.tier is not None:
            raise InputError(f"--tier has no effect on {self.path}, which has no tiers; remove it")
        return read_text(self.path, may_be_pipe=True) if words is None else words


def _timed_words(file: TextFile) -> str | None:
    """Words of a transcript or of subtitles; None for plain text."""
    suffix = file.path.suffix.lower()
    if suffix in PLAIN:
        return None
    from tts2face.interchange.subtitles.formats import SUFFIXES
    from tts2face.interchange.transcripts.reader import READERS, find_reader, find_reader_of_text, read_transcript

    is_subtitles = suffix in SUFFIXES
    if suffix in READERS:
        is_timed = find_reader(file.path) is not None
    else:
        is_timed = not is_subtitles and find_reader_of_text(read_text(file.path)) is not None
    if is_timed:
        found = read_transcript(file.path, file.tier)
        _write_notes(file, found.notes)
        return found.text
    if not is_subtitles or file.tier is not None:
        return None
    from tts2face.interchange.subtitles.reader import read_subtitles

    read = read_subtitles(file.path)
    _write_notes(
        file, [f"{file.path.name}, line {note.line}: {note.message}" for note in (*read.warnings, *read.notes)]
    )
    return "\n".join(cue.text for cue in read.cues if cue.text)


def _write_notes(file: TextFile, notes: Iterable[str]) -> None:
    for note in () if file.quiet else notes:
        write_message(f"tts2face: note: {note}")
