"""The error of a decoding process that refuses its file."""

from lexicon.errors import DataError


class RefusedFileError(DataError):
    """The file is not what it should be."""
