"""Standard streams as a process finds them: closed, full, or of a terminal that shows few characters."""

import codecs
import contextlib
import os
import sys
from io import TextIOWrapper

ESCAPE_HANDLER = "tts2face.escapes"  # how characters are written that the terminal cannot show


def repair_streams() -> None:
    """Open what the shell closed, and escape on standard output what its encoding lacks.

    A stream that is closed would give its number to the next file that is opened, which then receives messages.
    """
    for number in range(3):
        _open_if_closed(number)
    sys.stdin = sys.stdin or open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - for the whole process
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as above
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as above
    codecs.register_error(ESCAPE_HANDLER, _escape_characters)
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors=ESCAPE_HANDLER)


def discard_output() -> None:
    """Let nothing more be written to standard output, which refused what was written."""
    with contextlib.suppress(OSError, ValueError):
        number = sys.stdout.fileno()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, number)
        os.close(nowhere)


def write_error(message: str) -> None:
    """A line on standard error; lost where that cannot be written."""
    with contextlib.suppress(OSError, ValueError):
        sys.stderr.write(f"{message}\n")
        sys.stderr.flush()


def _open_if_closed(number: int) -> None:
    try:
        os.fstat(number)
    except OSError:  # 1 is opened for reading: an answer that nobody receives is an error, a lost message is none
        os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)


def _escape_characters(error: UnicodeError) -> tuple[str, int]:
    r"""Characters as ``\uXXXX``, those beyond in two halves: what JSON reads, and plain to see elsewhere."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    units = error.object[error.start : error.end].encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at]:02x}{units[at + 1]:02x}" for at in range(0, len(units), 2)), error.end
