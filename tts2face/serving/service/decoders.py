"""One queue of decoders: whoever sends a picture, a sound or a video, it is decoded in a place of this queue.

A file of kilobytes can take gigabytes to decode. A place is a child process; before it decodes, the memory that it
will take, by the head and the format of its file, must be free among all of them.
"""

import asyncio
import errno
import os
from collections import Counter, OrderedDict, deque
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face.processes.async_parent import started
from tts2face.processes.parent import ChildEndedError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import while_client_stays
from tts2face.serving.work.tools import run_take_tool
from tts2face.serving.work.uploaded_file import DECODE, MEASURE, PICTURE, FileOrder, program

MAX_REASON = 300  # characters
MEMORY_BYTES = 1 << 30  # of what is decoded at the same time; the largest picture of the default settings takes .8 GB
ADDRESS_BYTES = 256 << 20  # of a child with its libraries, most of which take no memory; 149 MB measured
AVATAR_CPU_S, AVATAR_S = 240, 300.0  # the head of a person takes 15 s
# seconds until a place of the queue may be free
RETRY_S = 10


@dataclass(frozen=True, slots=True)
class Shares:
    """Places that run at the same time, those of one key among them, and how many of a key may wait."""

    running: int
    of_key: int
    waiting: int


# Uploads that somebody waits for; videos of the studio, which are read for minutes.
UPLOADS, TAKES = Shares(4, 2, 20), Shares(2, 1, 1000)
BODIES_OF_KEY = 4  # recordings of talkers that a key may be sending at the same time, of up to `video_mb` each


class KeyTurns:
    """Places that keys take in turns."""

    def __init__(self, shares: Shares) -> None:
        self._shares = shares
        self._running: Counter[str] = Counter()
        self._waiting: OrderedDict[str, deque[asyncio.Future[None]]] = OrderedDict()

    @asynccontextmanager
    async def turn(self, key: str) -> AsyncIterator[None]:
        """Hold a place of a key, for which is waited.

        Raises
        ------
        RefusedError
            As many of the key wait already as may.
        ClientDisconnect
            The client of the present request has left.
        """
        n_waiting = sum(not turn.cancelled() for turn in self._waiting.get(key, ()))
        if n_waiting >= self._shares.waiting:
            message = f"{n_waiting} files of the key {key} wait to be decoded; send it again later"
            raise RefusedError(429, "busy", message, {"Retry-After": str(RETRY_S)})
        place: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(key, deque()).append(place)
        self._wake()
        try:
            with while_client_stays():
                await place
            yield
        finally:
            self._running[key] -= place.done() and not place.cancelled()
            self._wake()

    def _wake(self) -> None:
        """Give free places to those that wait, one key after the other."""
        for key in list(self._waiting):
            waiting = self._waiting[key]
            # clients that have left wait no longer
            while waiting and waiting[0].cancelled():
                waiting.popleft()
            is_free = self._running.total() < self._shares.running and self._running[key] < self._shares.of_key
            if waiting and is_free:
                self._running[key] += 1
                waiting.popleft().set_result(None)
                self._waiting.move_to_end(key)
            if not waiting:
                del self._waiting[key]


class MemoryBudget:
    """Bytes of memory that decoders share; who comes first gets them first."""

    def __init__(self, n_bytes: int) -> None:
        self._n_bytes, self._n_used = n_bytes, 0
        self._waiting: deque[tuple[int, asyncio.Future[None]]] = deque()

    @asynccontextmanager
    async def reserved(self, n_bytes: int) -> AsyncIterator[None]:
        """Hold some bytes; more than all of them are held alone."""
        place: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.append((n_bytes, place))
        self._wake()
        try:
            await place
            yield
        finally:
            self._n_used -= n_bytes if place.done() and not place.cancelled() else 0
            self._wake()

    def _wake(self) -> None:
        while self._waiting:
            n_bytes, place = self._waiting[0]
            if not place.cancelled():
                # in the order of asking, so that no large file waits for ever (decision 204)
                if self._n_used and self._n_used + n_bytes > self._n_bytes:
                    return
                self._n_used += n_bytes
                place.set_result(None)
            self._waiting.popleft()


class Decoders:
    """Decoders of the files that clients send; methods belong to the event loop."""

    def __init__(self) -> None:
        self._uploads, self._takes = KeyTurns(UPLOADS), KeyTurns(TAKES)
        self._memory = MemoryBudget(MEMORY_BYTES)
        self._bodies: Counter[str] = Counter()

    async def decode(self, key: str, asked: FileOrder, name: str, timeout_s: float) -> tuple[str, ...]:
        """Decode a file of a key; `name` is for messages. Sentences on what is guessed of its sound.

        Raises
        ------
        RefusedError
            The file is refused, takes too much memory or time, or too many of the key wait.
        OSError
            The disk is full.
        """
        order = asked._asdict() | {"source": str(asked.source), "target": str(asked.target)}
        async with self._uploads.turn(key):
            with while_client_stays(), _refusing(name, timeout_s):
                async with started(program(asked.kind)) as child:
                    n_bytes = (await child.call(MEASURE, order, timeout_s=timeout_s)).content["memory_bytes"]
                    async with self._memory.reserved(n_bytes):  # the time counts from then on
                        if asked.kind == PICTURE:
                            _limit_memory(child.pid, n_bytes)
                        answer = (await child.call(DECODE, order, timeout_s=timeout_s)).content
        # the child's disk is the server's: its error is raised here, as one of the server
        if answer["is_full"]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return tuple(note.replace(str(asked.source), name) for note in answer["notes"])

    async def make_avatar(self, key: str, order: Mapping[str, Any]) -> None:
        """Make the head of a person in the photo ``take``, which takes all of the memory; errors as `decode`."""
        shown = Path(order["take"]).name
        async with self._uploads.turn(key):
            with while_client_stays(), _refusing("the photo", AVATAR_S, shown):
                async with self._memory.reserved(MEMORY_BYTES), asyncio.timeout(AVATAR_S):
                    await run_take_tool("avatar", order, lambda **_: None, cpu_s=AVATAR_CPU_S)

    async def read_take(
        self, key: str, kind: str, order: Mapping[str, Any], on_message: Callable[..., None]
    ) -> Mapping[str, Any]:
        """Result of an order of the tool ``takes`` of a key; errors as `run_take_tool`."""
        async with self._takes.turn(key):
            return await run_take_tool(kind, order, on_message)

    @contextmanager
    def receiving(self, key: str) -> Iterator[None]:
        """Receive the recording of a talker; who sends slowly holds a place of the own key only."""
        if self._bodies[key] >= BODIES_OF_KEY:
            message = f"the key {key} sends {BODIES_OF_KEY} recordings already; send this one when one has arrived"
            raise RefusedError(429, "busy", message, {"Retry-After": str(RETRY_S)})
        self._bodies[key] += 1
        try:
            yield
        finally:
            self._bodies[key] -= 1


def _limit_memory(pid: int | None, n_bytes: int) -> None:
    """Let a child take no more memory than is reserved for it, where the system has limits of other processes."""
    # Linux alone limits other processes
    with suppress(ImportError, AttributeError, OSError):
        import resource

        if pid is not None:
            limit = n_bytes + ADDRESS_BYTES
            resource.prlimit(pid, resource.RLIMIT_AS, (limit, limit))


@contextmanager
def _refusing(name: str, timeout_s: float, hidden: str = "") -> Iterator[None]:
    """Refuse a file whose child refuses it, ends, or takes too long; its name `hidden` is not shown."""
    try:
        yield
    except TimeoutError as late:
        raise RefusedError(
            422, "invalid_data", f"{name} took more than {timeout_s:g} s to decode; send a simpler file"
        ) from late
    except ChildEndedError as ended:
        raise _refused(name, "it needs too much memory or time") from ended
    except (InputError, DataError) as refused:
        raise _refused(name, str(refused).replace(hidden, name) if hidden else str(refused)) from refused


def _refused(name: str, reason: str) -> RefusedError:
    return RefusedError(422, "invalid_data", f"{name} cannot be used: {reason[:MAX_REASON]}; send another file")
