"""Words of a file of another program, given with ``--file`` or ``--transcript``."""

import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cli.process import write_message
from lexicon.values.files import read_text


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
        from tts2face.interchange.transcripts.written_words import check_has_tiers, read_written_words

        # a pipe can be read only once
        if not self.path.is_file():
            check_has_tiers(self.path, self.tier)
            return read_text(self.path, may_be_pipe=True)
        words = read_written_words(self.path, self.tier)
        if words is None:
            return read_text(self.path)
        _write_notes(self, words.notes)
        return words.text


def note_transcript_beside(recording: Path) -> None:
    """Say that words lie beside a recording, which a command does not take unless they are given."""
    if not recording.is_file():
        return
    from tts2face.interchange.transcripts.beside import find_transcript

    found = find_transcript(recording)
    if found is not None and found.is_file():
        given = shlex.quote(str(found))
        write_message(f"tts2face: note: {found} lies beside the recording: --transcript {given} uses its words")


def _write_notes(file: TextFile, notes: Iterable[str]) -> None:
    for note in () if file.quiet else notes:
        write_message(f"tts2face: note: {note}")
