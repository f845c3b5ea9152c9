"""All targets of a live face: one thread keeps their connections, and each tick is handed to all of them."""

import asyncio
import contextlib
import os
import socket
import ssl
import threading
import time
from collections.abc import Callable, Sequence

from lexicon.errors import Tts2faceError
from tts2face.targets.states import CLOSED, CONNECTED, CONNECTING, LOST, TargetState
from tts2face.targets.target import Target
from tts2face.targets.tick import Tick

FIRST_WAIT_S, LONGEST_WAIT_S = 1.0, 30.0  # before a lost target is tried again; each wait is twice the one before
HELD_S = 10.0  # for which a connection must have stood, so that waits begin anew
CLOSE_S = 3.0  # in which connections send what waits and end; then they are cut

OnState = Callable[[TargetState], object]


class LiveTargets:
    """Targets from the beginning of a ``with`` block to its end; a lost one is tried again until then.

    Parameters
    ----------
    names
        Of the targets in states.
    on_state
        Called in the thread of the connections.
    """

    def __init__(self, targets: Sequence[Target], names: Sequence[str], on_state: OnState) -> None:
        self._targets, self._names = tuple(targets), tuple(names)
        self._on_state = on_state
        self._loop = asyncio.new_event_loop()
        self._ends = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="targets", daemon=True)

    def __enter__(self) -> "LiveTargets":
        """Begin to connect."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the connections, within `CLOSE_S`."""
        with contextlib.suppress(RuntimeError):  # the thread has ended
            self._loop.call_soon_threadsafe(self._end)
        self._thread.join()

    def send(self, tick: Tick) -> None:
        """Hand a tick to all targets; never waits."""
        for target in self._targets:
            target.send(tick)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._keep_all())
        finally:
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.close()

    def _end(self) -> None:
        self._ends.set()
        for target in self._targets:
            target.end()

    async def _keep_all(self) -> None:
        kept = [
            asyncio.create_task(self._keep(target, name))
            for target, name in zip(self._targets, self._names, strict=True)
        ]
        await self._ends.wait()
        if kept:
            await asyncio.wait(kept, timeout=CLOSE_S)
        for task in kept:
            task.cancel()
        for ended in await asyncio.gather(*kept, return_exceptions=True):
            if isinstance(ended, Exception):  # a fault of the product, not of a target
                raise ended
        for name in self._names:
            self._on_state(TargetState(name, CLOSED))

    async def _keep(self, target: Target, name: str) -> None:
        """Connect a target, and again after each loss."""
        wait_s = FIRST_WAIT_S
        while not self._ends.is_set():
            self._on_state(TargetState(name, CONNECTING))
            connected_at: list[float] = []

            def note(connected_at: list[float] = connected_at) -> None:
                connected_at.append(time.monotonic())
                self._on_state(TargetState(name, CONNECTED))

            try:
                await target.connect(note)
                reason = "it has closed the connection"
            except (OSError, TimeoutError, Tts2faceError) as error:
                reason = reason_of(error)
            if self._ends.is_set():
                return
            if connected_at and time.monotonic() - connected_at[0] > HELD_S:
                wait_s = FIRST_WAIT_S
            self._on_state(TargetState(name, LOST, reason, wait_s))
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ends.wait(), wait_s)
            wait_s = min(2 * wait_s, LONGEST_WAIT_S)


def reason_of(error: Exception) -> str:
    """Why a target is lost, in one line and without its address, which clients of a service read, too."""
    if isinstance(error, TimeoutError) and error.errno is None:
        return "it does not answer"
    if isinstance(error, ssl.SSLError):
        kind = getattr(error, "reason", None) or "of an unknown kind"  # CERTIFICATE_VERIFY_FAILED
        return f"the encryption fails: {kind.lower().replace('_', ' ')}"
    if isinstance(error, OSError):  # asyncio adds the address to the text of the system, and joins those of several
        number = None if isinstance(error, socket.gaierror) else error.errno
        said = os.strerror(number) if number else error.strerror or "it cannot be reached"
        return said[:1].lower() + said[1:]
    return " ".join(str(error).split())
