"""Termination of child processes together with their parent process, however the parent ends."""

import os
import threading
from collections.abc import Callable


def exit_after(wait: Callable[[], object]) -> None:
    """Exit this process as soon as `wait`, which runs in a background thread, returns or raises.

    Parameters
    ----------
    wait
        Blocking read from a pipe whose other end only the parent holds; it returns when the parent closes the pipe or
        terminates.
    """
    threading.Thread(target=_exit_after, args=(wait,), name="exit_after", daemon=True).start()


def _exit_after(wait: Callable[[], object]) -> None:
    try:
        wait()
    finally:
        os._exit(1)  # no clean-up: the parent that would receive the results no longer exists
