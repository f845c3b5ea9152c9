"""Transcripts beside videos: what they say, and which files are passed over."""

from collections.abc import Iterable
from pathlib import Path

from corpus_tools.recordings.subtitle_cues import read_cues
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.transcripts.beside import SUFFIXES
from tts2face.interchange.transcripts.reader import encoding_note
from tts2face.interchange.transcripts.written_words import WrittenWords, is_subtitle_file, read_written_words

MAX_NAMED = 8  # files in a note


def read_transcript(transcript: Path, tier: str | None = None) -> WrittenWords:
    """All words of a transcript, in order; of files with tiers those of one, by default the likely one.

    Raises
    ------
    InputError
        There is no such tier.
    DataError
        The file cannot be read, or has no word.
    """
    if is_subtitle_file(transcript):
        return WrittenWords(" ".join(cue.text for cue in read_cues(transcript)))
    found = read_written_words(transcript, tier)
    if found is None:
        note = encoding_note(transcript)
        return WrittenWords(read_text(transcript), (note,) if note else ())
    return found


def passed_over(videos: Iterable[Path], transcripts: Iterable[Path]) -> str:
    """A sentence that names the files of the videos' names that are neither a video nor read; empty without one."""
    used = {*videos, *transcripts}
    stems = {(video.parent, video.stem) for video in used}
    left = [
        path
        for folder in sorted({folder for folder, _ in stems})
        for path in sorted(folder.iterdir())
        if path not in used and path.is_file() and _stems(path) & {stem for at, stem in stems if at == folder}
    ]
    if not left:
        return ""
    more = f" and {len(left) - MAX_NAMED} more" if len(left) > MAX_NAMED else ""
    names = ", ".join(path.name for path in left[:MAX_NAMED])
    verb = "lies beside a video and is not read" if len(left) == 1 else "lie beside videos and are not read"
    return f"{names}{more} {verb}; transcripts are read from one file of the video's name ({', '.join(SUFFIXES)})"


def _stems(path: Path) -> set[str]:
    """Names of videos to which a file belongs: v.en.srt to v.en and v."""
    parts = path.name.split(".")
    return {".".join(parts[:n]) for n in range(1, len(parts))}
