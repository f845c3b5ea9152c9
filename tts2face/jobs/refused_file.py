"""The error of a decoding process that refuses its file."""


class RefusedFileError(Exception):
    """The file is not what it should be."""
