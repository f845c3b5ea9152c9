"""Signals that end a command as Ctrl-C does: nothing half written stays, and no other process."""

import signal
from types import FrameType

NAMES = ("SIGTERM", "SIGHUP")  # of a service manager or `kill`, and of a terminal that is closed


class Terminated(KeyboardInterrupt):
    """A signal asks the command to end; whatever cleans up after Ctrl-C cleans up after it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def raise_on_signals() -> None:
    """Raise `Terminated` in the main thread at SIGTERM and SIGHUP; signals that are ignored (``nohup``) stay so."""
    for name in NAMES:
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _terminate)


def _terminate(number: int, frame: FrameType | None) -> None:
    for name in NAMES:  # a second signal must not interrupt cleaning up
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    raise Terminated(number)


def stop_code(stopped: KeyboardInterrupt) -> int:
    """Exit code after a signal, as shells count: 128 and its number (130 Ctrl-C, 143 SIGTERM, 129 SIGHUP)."""
    return 128 + (stopped.number if isinstance(stopped, Terminated) else signal.SIGINT)
