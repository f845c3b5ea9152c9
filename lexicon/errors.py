"""The errors of tts2face: three kinds, by who can correct them.

Every message states what is wrong, which value, and what to do.
"""


class Tts2faceError(Exception):
    """Base class of all errors; never raised itself."""


class InputError(Tts2faceError, ValueError):
    """An invalid request: change the request."""


class DataError(Tts2faceError, ValueError):
    """An invalid or damaged file: correct or rebuild the file."""


class BackendError(Tts2faceError, RuntimeError):
    """A required library, model or device is missing on this machine: install it."""
