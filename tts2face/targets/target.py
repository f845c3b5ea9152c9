"""Targets of a live face: what each does with a frame, and how it is reached.

`DatagramTarget` sends on the clock, since a datagram never waits.
`ConnectedTarget` sends from its connection what is newest: a slow or dead receiver holds nothing up.
"""

import asyncio
import contextlib
import socket
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from threading import Lock
from typing import ClassVar

from lexicon.errors import BackendError
from tts2face.storage.marks import LIVE_NOTICE, Mark
from tts2face.targets.address import Address
from tts2face.targets.tick import LiveFormat, Tick


class TargetLostError(BackendError):
    """A target cannot be reached, or no longer: another try may succeed."""


class Target(ABC):
    """A place that shows a live face.

    Attributes
    ----------
    draws, has_curves
        Whether it needs pictures, and ARKit's weights.
    mark
        Statement that the face is synthetic, sent where the protocol has a place for it.
    """

    draws: ClassVar[bool] = False
    has_curves: ClassVar[bool] = False

    def __init__(self, address: Address, format: LiveFormat) -> None:
        self.address, self.format = address, format
        self.mark = Mark(LIVE_NOTICE)

    @abstractmethod
    def send(self, tick: Tick) -> None:
        """Take a tick, on the clock of the stream: never waits and never fails."""

    @abstractmethod
    async def connect(self, on_connected: Callable[[], None]) -> None:
        """Reach the place and stay until `end`; called again after a loss.

        Raises
        ------
        TargetLostError, OSError, TimeoutError
            The place cannot be reached, or no longer.
        """

    @abstractmethod
    def end(self) -> None:
        """Let `connect` return after what has been sent; called in its event loop."""


class DatagramTarget(Target):
    """Target of UDP: nobody answers, so that it is connected as soon as its name is known."""

    has_curves = True

    def __init__(self, address: Address, format: LiveFormat) -> None:
        super().__init__(address, format)
        self._socket: socket.socket | None = None
        self._ended = asyncio.Event()

    async def connect(self, on_connected: Callable[[], None]) -> None:
        """Resolve the name of the host, and wait for the end."""
        found = await asyncio.get_running_loop().getaddrinfo(
            self.address.host, self.address.port, type=socket.SOCK_DGRAM
        )
        family, kind, protocol, _, place = found[0]
        with socket.socket(family, kind, protocol) as opened:
            opened.setblocking(False)
            self._place, self._socket = place, opened
            on_connected()
            try:
                await self._ended.wait()
            finally:
                self._socket = None

    def send(self, tick: Tick) -> None:
        """Send the datagrams of a tick; one that the system does not take at once is left out."""
        if (opened := self._socket) is None:
            return
        # a full buffer, or a network that is away: the next tick tries again
        with contextlib.suppress(OSError):
            for datagram in self.datagrams(tick):
                opened.sendto(datagram, self._place)

    def end(self) -> None:
        """Stop at once."""
        self._ended.set()

    @abstractmethod
    def datagrams(self, tick: Tick) -> list[bytes]:
        """Datagrams of a tick."""


class Outbox:
    """Ticks that a connection has not taken yet: the newest `n_ticks`, of which only the newest picture is kept."""

    def __init__(self, n_ticks: int) -> None:
        self._ticks: deque[Tick] = deque(maxlen=n_ticks)
        self._lock, self._has_some = Lock(), asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._is_ended = False

    def put(self, tick: Tick) -> None:
        """Add a tick, from any thread; without a connection it is forgotten."""
        if (loop := self._loop) is None:
            return
        with self._lock:
            if tick.pixels is not None:
                for at, older in enumerate(self._ticks):
                    if older.pixels is not None:
                        self._ticks[at] = replace(older, pixels=None)
            self._ticks.append(tick)
        # the loop may have ended between two statements
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(self._has_some.set)

    def begin(self) -> None:
        """Take ticks from now on, in the event loop of the connection."""
        with self._lock:
            self._ticks.clear()
        self._loop = asyncio.get_running_loop()

    def stop(self) -> None:
        """Forget ticks: there is no connection."""
        self._loop = None

    def end(self) -> None:
        """After the ticks that wait there are no more."""
        self._is_ended = True
        self._has_some.set()

    async def take(self) -> list[Tick]:
        """All ticks that wait, at least one; none at the end."""
        while True:
            with self._lock:
                taken = list(self._ticks)
                self._ticks.clear()
                self._has_some.clear()
            if taken or self._is_ended:
                return taken
            await self._has_some.wait()


class ConnectedTarget(Target):
    """Target with a connection, which takes the newest ticks from `outbox` when it can send."""

    def __init__(self, address: Address, format: LiveFormat, n_kept: int = 1) -> None:
        super().__init__(address, format)
        self.outbox = Outbox(n_kept)

    def send(self, tick: Tick) -> None:
        """Keep a tick until the connection sends it."""
        self.outbox.put(tick)

    def end(self) -> None:
        """Send what waits, then close."""
        self.outbox.end()

    async def connect(self, on_connected: Callable[[], None]) -> None:
        """Connect, and send until the end or a loss."""

        def begin() -> None:
            self.outbox.begin()
            on_connected()

        try:
            await self.deliver(begin)
        finally:
            self.outbox.stop()

    @abstractmethod
    async def deliver(self, on_connected: Callable[[], None]) -> None:
        """Connect, call `on_connected`, and send what `outbox` has until it ends; raises as `connect`."""
