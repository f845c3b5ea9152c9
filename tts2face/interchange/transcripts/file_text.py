"""Text of a transcript, which is longer than subtitles are: a whole lecture has the times of all its phones."""

from pathlib import Path

from tts2face.interchange.subtitles.decoding import decode_file
from tts2face.interchange.subtitles.encodings import Decoded

# two hours with words and phones are 11 MB in Praat's long form, 22 MB in UTF-16; .4 s each MB
MAX_BYTES = 64 << 20


def read_text(path: Path) -> str:
    """Characters of a transcript, as `decode_text`."""
    return decode_text(path).text


def decode_text(path: Path) -> Decoded:
    """Characters of a transcript and how they were decoded; a DataError of other files, or above `MAX_BYTES`."""
    return decode_file(path, max_bytes=MAX_BYTES)
