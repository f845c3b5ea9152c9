"""Exit codes: which kind of error ends a command with which number."""

from collections.abc import Mapping

from cyclopts import CycloptsError

from lexicon.errors import BackendError, DataError, InputError

EXIT_CODES: Mapping[type[Exception], int] = {InputError: 2, CycloptsError: 2, DataError: 3, BackendError: 4}


def exit_code(error: Exception) -> int:
    """The number with which a command ends after an error."""
    return next(code for kind, code in EXIT_CODES.items() if isinstance(error, kind))


def sentence(error: Exception) -> str:
    """What is wrong, on one line."""
    return " ".join(str(error).split())
