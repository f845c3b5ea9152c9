"""Words of a file of another program, whatever it is: subtitles, tables and tiers of labels, or plain text."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import DataError, InputError
from tts2face.interchange.subtitles.cues import Subtitles, without_options
from tts2face.interchange.subtitles.formats import FILM_SUFFIXES, SUFFIXES, is_subtitle_text
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.interchange.transcripts.file_text import read_text
from tts2face.interchange.transcripts.reader import BY_CONTENT, PLAIN_SUFFIXES, READERS, find_reader, read_transcript

BY_LINES = "holds subtitles by its lines, whose times are not words"


@dataclass(frozen=True, slots=True)
class WrittenWords:
    """Text of a file, and sentences about what was chosen of it, estimated or left out."""

    text: str
    notes: tuple[str, ...] = ()


def read_written_words(path: Path, tier: str | None = None) -> WrittenWords | None:
    """Words of a file, without its times; None for plain text, which is as it stands. Cues are lines.

    Parameters
    ----------
    tier
        Name of the tier of the words; None: the likely one.

    Raises
    ------
    InputError
        There is no such tier, or the file has none.
    DataError
        The file cannot be read, or has no word.
    """
    if is_subtitle_file(path):
        check_has_tiers(path, tier)
        read = read_subtitles(path)
        return WrittenWords("\n".join(cue.text for cue in read.cues if cue.text), tuple(subtitle_notes_of(read)))
    if find_reader(path) is None:
        check_has_tiers(path, tier)
        return None
    found = read_transcript(path, tier)
    return WrittenWords(found.text, found.notes)


def is_subtitle_file(path: Path) -> bool:
    """Whether a file is one of subtitles: by its ending, or in a text of any other one by its content."""
    suffix = path.suffix.lower()
    if suffix in SUFFIXES:
        return suffix not in PLAIN_SUFFIXES
    if suffix in PLAIN_SUFFIXES or (suffix in READERS and suffix not in BY_CONTENT):
        return False
    try:
        text = read_text(path)
    except DataError:
        return False  # said where it is read
    return is_subtitle_text(text)


def subtitle_notes_of(read: Subtitles) -> Iterator[str]:
    """Sentences about subtitles that were read, with their lines, and that a text of another name holds them.

    Words of recordings and of single commands take no options of batches, so that they name none.
    """
    if read.path.suffix.lower() not in {*SUFFIXES, *FILM_SUFFIXES}:
        yield f"{read.path.name} {BY_LINES}"
    for note in (*read.warnings, *read.notes):
        yield f"{read.path.name}, line {note.line}: {without_options(note.message)}"


def check_has_tiers(path: Path, tier: str | None) -> None:
    """Refuse the name of a tier of a file that has none (`InputError`)."""
    if tier is not None:
        raise InputError(f"--tier has no effect on {path}, which has no tiers; remove it")
