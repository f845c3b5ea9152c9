"""A command as a process: exit codes, standard streams, signals and memory."""

import codecs
import contextlib
import ctypes
import errno
import os
import signal
import sys
from collections.abc import Mapping
from io import TextIOWrapper
from types import FrameType

from cyclopts import CycloptsError

from lexicon.errors import BackendError, DataError, InputError

EXIT_CODES: Mapping[type[Exception], int] = {InputError: 2, CycloptsError: 2, DataError: 3, BackendError: 4, OSError: 4}
BROKEN_PIPE_CODE = 141  # 128 + SIGPIPE, as shells report it
PATH_ERRNOS = frozenset({errno.ENAMETOOLONG, errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP})
MAX_QUOTED_CHARACTERS = 60  # characters of a path in a message
ESCAPE_HANDLER = "tts2face.escapes"  # name of the error handler for characters that the terminal cannot show
REFUSING_HANDLERS = frozenset({"strict", "surrogateescape"})  # the second is Python's default in the C locale
SIGNAL_NAMES = ("SIGTERM", "SIGHUP")  # sent by a service manager or `kill`, and when a terminal is closed
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # parameter numbers of mallopt in glibc's malloc.h
LARGE_BYTES = 1 << 20  # arrays of at least this size are mapped one by one; pictures of 512 x 512 are smaller


def exit_code(error: Exception) -> int:
    """Exit code of a command that ended with an error."""
    if isinstance(error, OSError) and error.errno in PATH_ERRNOS:
        return EXIT_CODES[InputError]
    return next(code for kind, code in EXIT_CODES.items() if isinstance(error, kind))


def error_message(error: Exception) -> str:
    """The message of an error on one line; a system error is named with its path or with standard output."""
    if isinstance(error, OSError):
        reason = error.strerror or str(error)
        if error.filename is None:
            return f"cannot write to standard output: {reason}; check where it is redirected to"
        path = str(error.filename)
        path = path if len(path) <= MAX_QUOTED_CHARACTERS else f"{path[:MAX_QUOTED_CHARACTERS]}..."
        return f"cannot use {path}: {reason}; check the path"
    return " ".join(str(error).split())


class Terminated(KeyboardInterrupt):
    """A termination signal; everything that is cleaned up after Ctrl-C is cleaned up after it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def raise_on_signals() -> None:
    """Raise `Terminated` in the main thread on SIGTERM and SIGHUP; ignored signals (``nohup``) stay ignored."""
    for name in SIGNAL_NAMES:
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _terminate)


def _terminate(number: int, frame: FrameType | None) -> None:
    for name in SIGNAL_NAMES:  # a second signal must not interrupt the clean-up
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    raise Terminated(number)


def signal_exit_code(interrupt: KeyboardInterrupt) -> int:
    """Exit code after a signal by the convention of shells: 128 + its number (130 Ctrl-C, 143 SIGTERM, 129 SIGHUP)."""
    return 128 + (interrupt.number if isinstance(interrupt, Terminated) else signal.SIGINT)


def repair_streams() -> None:
    """Open standard streams that the shell closed, and escape characters that standard output cannot encode.

    The number of a closed stream would be reused by the next file that is opened, which would then receive messages.
    """
    for number in range(3):
        _open_if_closed(number)
    sys.stdin = sys.stdin or open(0, encoding="utf-8", closefd=False)  # noqa: SIM115 - for the whole process
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as above
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as above
    codecs.register_error(ESCAPE_HANDLER, _escape_characters)
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors in REFUSING_HANDLERS:
        sys.stdout.reconfigure(errors=ESCAPE_HANDLER)


def discard_output() -> None:
    """Redirect standard output to the null device after a failed write."""
    with contextlib.suppress(OSError, ValueError):
        number = sys.stdout.fileno()
        null_device = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null_device, number)
        os.close(null_device)


def write_message(message: str) -> None:
    """Write a line to standard error; it is lost where that cannot be written."""
    with contextlib.suppress(OSError, ValueError):
        sys.stderr.write(f"{message}\n")
        sys.stderr.flush()


def _open_if_closed(number: int) -> None:
    try:
        os.fstat(number)
    except OSError:  # 1 is opened for reading: writing a result to it must fail, a lost message on 2 must not
        os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)


def _escape_characters(error: UnicodeError) -> tuple[str, int]:
    r"""Characters as ``\uXXXX``, those beyond the BMP as two surrogates: valid JSON, and readable elsewhere."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    units = error.object[error.start : error.end].encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at]:02x}{units[at + 1]:02x}" for at in range(0, len(units), 2)), error.end


def return_large_blocks() -> bool:
    """Make the C library return large freed blocks to the system; False where it has no such setting.

    By default glibc raises the size from which blocks are returned, up to 32 MB, whenever one is freed, and then keeps
    the memory of temporary arrays, once for each thread: about 100 MB in a clip (docs/performance.md).
    """
    if not sys.platform.startswith("linux"):
        return False
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)  # glibc
    if set_option is None:
        return False
    return all(set_option(option, LARGE_BYTES) == 1 for option in (MMAP_THRESHOLD, TRIM_THRESHOLD))
