"""The errors of tts2face: three kinds, by who can correct them.

Every message states what is wrong, which value, and what to do. Values of any length may stand in it: of a word of more
than 1,000 characters, the first 60 remain.
"""

import contextlib
import re
from collections.abc import Iterator

_LONG_WORD = re.compile(r"(\S{60})\S{940,}")


class Tts2faceError(Exception):
    """Base class of all errors; never raised itself."""

    def __init__(self, message: object = "") -> None:
        super().__init__(_LONG_WORD.sub(r"\1...", str(message)))


class InputError(Tts2faceError, ValueError):
    """An invalid request: change the request."""


class SilentTextError(InputError):
    """There is nothing to say in a text, or in a part of one: no word, or none that the voice has sounds for."""


class DataError(Tts2faceError, ValueError):
    """An invalid or damaged file: correct or rebuild the file."""


class BackendError(Tts2faceError, RuntimeError):
    """A required library, model or device is missing on this machine: install it."""


@contextlib.contextmanager
def import_of_extra(advice: str) -> Iterator[None]:
    """Translate the failed import of a package that not every installation has into a `BackendError` with advice."""
    try:
        yield
    except ImportError as missing:
        raise BackendError(advice) from missing
