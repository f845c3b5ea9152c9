"""Exit codes: which kind of error ends a command with which number."""

import errno
from collections.abc import Mapping

from cyclopts import CycloptsError

from lexicon.errors import BackendError, DataError, InputError

PATH_ERRNOS = frozenset({errno.ENAMETOOLONG, errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP})
MAX_QUOTED_CHARACTERS = 60  # characters of a path in a message
EXIT_CODES: Mapping[type[Exception], int] = {InputError: 2, CycloptsError: 2, DataError: 3, BackendError: 4, OSError: 4}


def exit_code(error: Exception) -> int:
    """The number with which a command ends after an error."""
    if isinstance(error, OSError) and error.errno in PATH_ERRNOS:
        return EXIT_CODES[InputError]
    return next(code for kind, code in EXIT_CODES.items() if isinstance(error, kind))


def error_message(error: Exception) -> str:
    """What is wrong, on one line; of an error of the system the path, or the stream to which an answer went."""
    if isinstance(error, OSError):
        reason = error.strerror or str(error)
        if error.filename is None:
            return f"cannot write the answer: {reason}; check where standard output goes"
        shown = str(error.filename)
        shown = shown if len(shown) <= MAX_QUOTED_CHARACTERS else f"{shown[:MAX_QUOTED_CHARACTERS]}..."
        return f"cannot use {shown}: {reason}; check the path"
    return " ".join(str(error).split())
