"""The error of a decoding process that refuses its file."""

from lexicon.errors import Tts2faceError


class RefusedFileError(Tts2faceError):
    """The file is not what it should be."""
