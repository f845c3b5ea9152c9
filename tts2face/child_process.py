"""Child processes that answer requests: their cores, environment and pipes, and their end with their parent."""

import io
import json
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, BinaryIO, TextIO

# glibc returns blocks of 1 MiB and more to the system, instead of keeping those of each thread (decision 064).
RETURNED_BLOCKS = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}


def child_environment(core: int | None) -> dict[str, str]:
    """Environment of a child process that is bound to a core, or to none."""
    threads = {} if core is None else {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return dict(os.environ) | RETURNED_BLOCKS | threads


def bind_to_core(core: int | None) -> None:
    """Bind this process to a core, where the system can; None: to none."""
    if core is not None and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})


def claim_standard_output() -> BinaryIO:
    """Standard output for answers alone; whatever a library prints goes to standard error from now on."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return answers


def received_requests() -> "queue.Queue[tuple[Any, float]]":
    """Lines of JSON of standard input, each with the second of the monotonic clock at which it arrived.

    This process exits when the input ends.
    """
    requests: queue.Queue[tuple[Any, float]] = queue.Queue()

    def read_lines() -> None:
        while line := sys.stdin.buffer.readline():
            requests.put((json.loads(line), time.monotonic()))

    exit_after(read_lines)
    return requests


def received_order() -> tuple[dict[str, Any], TextIO]:
    """The order of a process that gets only one, a line of JSON on standard input, and the stream for its messages.

    This process exits when the input ends.
    """
    order = json.loads(sys.stdin.readline())
    messages = io.TextIOWrapper(claim_standard_output(), encoding="utf-8")
    exit_after(sys.stdin.read)
    return order, messages


def exit_after(wait: Callable[[], object]) -> None:
    """Exit this process as soon as `wait`, which runs in a background thread, returns or raises.

    Ctrl-C, which the terminal sends to the parent, too, is left to the parent.

    Parameters
    ----------
    wait
        Blocking read from a pipe whose other end only the parent holds; it returns when the parent closes the pipe or
        terminates.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_after, args=(wait,), name="exit_after", daemon=True).start()


def _exit_after(wait: Callable[[], object]) -> None:
    try:
        wait()
    finally:
        os._exit(1)  # no clean-up: the parent that would receive the results no longer exists
