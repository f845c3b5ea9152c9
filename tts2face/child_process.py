"""Processes that end with the process that started them, however that one ends."""

import os
import threading
from collections.abc import Callable


def exit_after(wait: Callable[[], object]) -> None:
    """End this process, from a thread of its own, when `wait` returns or fails.

    Parameters
    ----------
    wait
        Reads from a pipe whose other end only the parent holds: it returns when the parent closes it or is dead.
    """
    threading.Thread(target=_exit_after, args=(wait,), name="exit_after", daemon=True).start()


def _exit_after(wait: Callable[[], object]) -> None:
    try:
        wait()
    finally:
        os._exit(1)  # without cleaning up: whoever would want the results is gone
