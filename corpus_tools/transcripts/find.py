"""The words in the transcript beside a video, whatever its format."""

from pathlib import Path

from corpus_tools.recordings.subtitles import SUBTITLE_FORMATS, read_cues
from corpus_tools.transcripts.decoding import read_text
from corpus_tools.transcripts.textgrid import read_textgrid
from corpus_tools.transcripts.word_times import read_word_times

TEXT_SUFFIX = ".txt"
READERS = {".textgrid": read_textgrid, ".align": read_word_times, **dict.fromkeys(SUBTITLE_FORMATS, read_cues)}


def find_transcript(video: Path) -> Path | None:
    """The transcript beside a video: text before TextGrid, word times and subtitles; None without one."""
    beside = {path.suffix.lower(): path for path in sorted(video.parent.iterdir()) if path.stem == video.stem}
    return next((beside[suffix] for suffix in (TEXT_SUFFIX, *READERS) if suffix in beside), None)


def read_transcript(transcript: Path) -> str:
    """All words of a transcript, in order.

    Raises
    ------
    DataError
        It cannot be read or holds no word.
    BackendError
        A package that reads it is missing.
    """
    suffix = transcript.suffix.lower()
    if suffix == TEXT_SUFFIX:
        return read_text(transcript)
    return " ".join(cue.text for cue in READERS[suffix](transcript))
