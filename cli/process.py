"""A command as a process: exit codes, standard streams, signals and memory."""

import codecs
import contextlib
import ctypes
import errno
import os
import select
import signal
import sys
import threading
import time
import traceback
import weakref
from collections.abc import Callable, Mapping
from io import TextIOWrapper
from types import FrameType
from typing import TextIO

from cyclopts import CycloptsError

from lexicon.errors import BackendError, DataError, InputError
from tts2face.storage.temporary import remove_held

EXIT_CODES: Mapping[type[Exception], int] = {InputError: 2, CycloptsError: 2, DataError: 3, BackendError: 4, OSError: 4}
BROKEN_PIPE_CODE = 141  # 128 + SIGPIPE, as shells report it
PATH_ERRNOS = frozenset({errno.ENAMETOOLONG, errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP})
MAX_QUOTED_CHARACTERS = 60  # characters of a path in a message
ESCAPE_HANDLER = "tts2face.escapes"  # name of the error handler for characters that the terminal cannot show
REFUSING_HANDLERS = frozenset({"strict", "surrogateescape"})  # the second is Python's default in the C locale
SIGNAL_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C, a service manager or `kill`, a terminal that is closed
REPEAT_S = 0.02  # until an interruption that was dropped is raised again: a callback of the compiler takes about 1 ms
SAME_SIGNAL_S = 0.5  # in which signals count as one: `timeout` and some service managers send each twice
HANDLED_S = 2.0  # after which compiled code that does not return is ended with the process: one kernel takes 3 s
SHOW_CURSOR = b"\x1b[?25h"  # a progress bar hides it
INTERRUPTED = "tts2face: interrupted; {}"
UNCHANGED = "an output that was not complete yet is as it was before"  # also after the first of several outputs
# parameter numbers of mallopt in glibc's malloc.h
TRIM_THRESHOLD = -1
MMAP_THRESHOLD = -3
MOST_ARENAS = -8
N_ARENAS = 2  # heaps from which threads allocate; one for each thread takes 14 MB more in a clip
LARGE_BYTES = 1 << 20  # blocks of at least this size are mapped one by one; pictures of 512 x 512 are smaller
FIRST_BYTES = 8 << 20  # the same until a first result: each mapped block clears its pages, 80,000 by then
COMPILATION = "tts2face.numeric.kernels"  # name of its logger; the module itself would load numpy
Progress = Callable[[int, int], None]  # as in `tts2face.types`, which would load numpy for --help


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


def release_frames(error: BaseException) -> None:
    """Release the variables of all functions that an error has ended.

    An error and its traceback hold each other, and their garbage is not collected at the exit. Libraries in native code
    list on standard error what of theirs is then still there (nanobind, by which soxr is made).
    """
    seen: set[BaseException] = set()
    waiting: list[BaseException | None] = [error]
    while waiting:
        raised = waiting.pop()
        if raised is not None and raised not in seen:
            seen.add(raised)
            traceback.clear_frames(raised.__traceback__)
            waiting += [raised.__cause__, raised.__context__]


class Terminated(KeyboardInterrupt):
    """A termination signal; everything that is cleaned up after Ctrl-C is cleaned up after it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Interruption:
    """The first termination signal of this process, raised in the main thread until the command has ended of it.

    An exception that a signal raises inside a callback of compiled code is dropped there, and so may be one inside a
    library that catches everything. The interruption is then raised again, a moment later. Compiled code that does not
    return ends with the process after two seconds, as does a thread for which Python waits at its exit; a second signal
    ends it at once, even while the clean-up hangs.

    Attributes
    ----------
    number
        Number of the first signal; 0 before it.
    """

    def __init__(self) -> None:
        self.number = 0
        self._is_over = False
        self._raised: weakref.ref[Terminated] | None = None

    def install(self) -> None:
        """Watch for SIGINT, SIGTERM and SIGHUP from now on; ignored signals (``nohup``) stay ignored."""
        for name in SIGNAL_NAMES:
            # an ignored signal (`nohup`) has another handler, and stays ignored
            number = getattr(signal, name, None)  # Windows has no SIGHUP
            if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, self._note)
        # the exception that a callback drops would be shown with its traceback
        show = sys.unraisablehook
        sys.unraisablehook = lambda dropped: None if self.number else show(dropped)
        if hasattr(signal, "setitimer"):  # not on Windows, where a second Ctrl-C is needed after one that was dropped
            signal.signal(signal.SIGALRM, self._raise_again)
            reader, writer = os.pipe()
            # Python requires it of a wake-up descriptor
            os.set_blocking(writer, False)
            signal.set_wakeup_fd(writer, warn_on_full_buffer=False)  # its thread runs while compiled code occupies this
            threading.Thread(target=self._watch, args=(reader,), name="signals", daemon=True).start()

    def end(self) -> None:
        """Raise nothing more: the command has ended."""
        self._is_over = True

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.number == 0 and not self._is_over:
            self.number = number
            raise self._interrupt()
        if not hasattr(signal, "setitimer"):
            _exit_at_once(number)

    def _raise_again(self, number: int, frame: FrameType | None) -> None:
        if self.number and not self._is_over:
            raise self._interrupt()

    def _interrupt(self) -> Terminated:
        """A new exception, whose end is noticed; no frame of this module holds it."""
        interrupt = Terminated(self.number)
        self._raised = weakref.ref(interrupt, self._note_dropped)
        return interrupt

    def _note_dropped(self, _: object) -> None:
        if not self._is_over and hasattr(signal, "setitimer"):
            # no exception is raised here: it would be dropped, too
            signal.setitimer(signal.ITIMER_REAL, REPEAT_S)

    def _watch(self, reader: int) -> None:
        """End the process on a second signal, or if compiled code keeps the first one from being raised."""
        numbers = {getattr(signal, name) for name in SIGNAL_NAMES}
        first, first_s = 0, 0.0
        while True:
            if not select.select([reader], [], [], HANDLED_S if first else None)[0]:
                # the interruption may part a pool from the thread that it has just started: nothing would end it
                if self._is_over and self.number:
                    os._exit(128 + self.number)
                # as long as the exception lives, its clean-up runs, however long
                if not self._is_over and (self._raised is None or self._raised() is None):
                    _exit_at_once(first)
                continue
            number = os.read(reader, 1)[0]
            # the descriptor receives all signals: SIGALRM is this class's own
            if number not in numbers:
                continue
            if not first:
                first, first_s = number, time.monotonic()
            is_too_late = self._is_over and self.number == 0  # no code is left that it could interrupt
            if is_too_late or time.monotonic() - first_s > SAME_SIGNAL_S:
                _exit_at_once(number)


INTERRUPTION = Interruption()


def _exit_at_once(number: int) -> None:
    """End this process without any clean-up but that of the files that it was writing."""
    with contextlib.suppress(OSError):
        remove_held()
        # past sys.stderr, whose lock the interrupted thread may hold
        os.write(2, (SHOW_CURSOR if os.isatty(2) else b"") + f"\n{INTERRUPTED.format(UNCHANGED)}\n".encode())
    # not sys.exit, which only raises: a clean-up that hangs would go on
    os._exit(128 + number)


def signal_exit_code(interrupt: BaseException) -> int:
    """Exit code after a signal by the convention of shells: 128 + its number (130 Ctrl-C, 143 SIGTERM, 129 SIGHUP)."""
    return 128 + (interrupt.number if isinstance(interrupt, Terminated) else INTERRUPTION.number or signal.SIGINT)


def repair_streams() -> None:
    """Open standard streams that the shell closed, and escape characters that standard output cannot encode.

    The number of a closed stream would be reused by the next file that is opened, which would then receive messages.
    """
    for number in range(3):
        _open_if_closed(number)
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115 - a library may have opened number 0
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - for the whole process
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as above
    codecs.register_error(ESCAPE_HANDLER, _escape_characters)
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors in REFUSING_HANDLERS:
        sys.stdout.reconfigure(errors=ESCAPE_HANDLER)


def discard_output(stream: TextIO | None = None) -> None:
    """Redirect a stream, by default standard output, to the null device after a failed write.

    What it still holds would fail again when Python ends, which changes the exit code to 120.
    """
    with contextlib.suppress(OSError, ValueError):
        number = (stream or sys.stdout).fileno()
        null_device = os.open(os.devnull, os.O_WRONLY)
        # the number stays open, so that no other file gets it
        os.dup2(null_device, number)
        os.close(null_device)


def ask(question: str) -> str:
    """Answer of a person at the terminal to a question on standard error; empty without a terminal or an answer."""
    if not sys.stdin.isatty():
        return ""
    sys.stderr.write(f"{question} ")
    sys.stderr.flush()
    return sys.stdin.readline().strip()


def write_message(message: str) -> None:
    """Write a line to standard error; it is lost where that cannot be written."""
    try:
        sys.stderr.write(f"{message}\n")
        sys.stderr.flush()
    except (OSError, ValueError):
        discard_output(sys.stderr)


def _open_if_closed(number: int) -> None:
    try:
        os.fstat(number)
    except OSError:  # 1 is opened for reading: writing a result to it must fail, a lost message on 2 must not
        os.open(os.devnull, os.O_WRONLY if number == 2 else os.O_RDONLY)


def _escape_characters(error: UnicodeError) -> tuple[str, int]:
    r"""Characters as ``\uXXXX``, those beyond the BMP as two surrogates: valid JSON, and readable elsewhere."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    # a lone surrogate (a byte of a path that is not UTF-8) passes, too
    units = error.object[error.start : error.end].encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at]:02x}{units[at + 1]:02x}" for at in range(0, len(units), 2)), error.end


class WhatRemains(str):
    """A note of an interruption: what remains of the work; Python adds others."""


def return_large_blocks(size: int = LARGE_BYTES) -> bool:
    """Make the C library return freed blocks of a size to the system; False where it has no such setting.

    By default glibc raises the size from which blocks are returned, up to 32 MB, whenever one is freed, and then keeps
    the memory of temporary arrays, once for each thread: about 100 MB in a clip (docs/performance.md).
    """
    if not sys.platform.startswith("linux"):
        return False
    # other C libraries of Linux, as musl, lack it
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)  # glibc
    if set_option is None:
        return False
    values = {MMAP_THRESHOLD: size, TRIM_THRESHOLD: size, MOST_ARENAS: N_ARENAS}
    return all(set_option(option, value) == 1 for option, value in values.items())


def use_one_thread_of_blas() -> None:
    """Make NumPy's products use one core, unless the environment says otherwise; before NumPy is imported.

    The products of a clip are small: OpenBLAS's other threads turn in circles between them, a 25th of its time.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
