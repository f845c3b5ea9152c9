"""The errors of tts2face: three kinds, named by who can put them right.

Every message says what is wrong, which value, and what to do next.
"""


class Tts2faceError(Exception):
    """Root of everything that tts2face refuses; never raised itself."""


class InputError(Tts2faceError, ValueError):
    """What was asked for cannot be done: ask differently."""


class DataError(Tts2faceError, ValueError):
    """A file is not what it should be: mend or rebuild the file."""


class BackendError(Tts2faceError, RuntimeError):
    """Something that the work needs is missing on this machine: install it."""
