"""The synthesis processes of a server, whose places all keys share fairly."""

import asyncio
import time
import zlib
from collections import OrderedDict, deque
from collections.abc import AsyncIterator, Callable, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from lexicon.errors import BackendError
from tts2face.picture.sound_stream import SOUND_KINDS
from tts2face.picture.streamed_movie import MOVIE_KINDS
from tts2face.processes.async_parent import started
from tts2face.processes.message import Message
from tts2face.processes.parent import ChildEndedError
from tts2face.processes.threads import available_cores
from tts2face.serving.service.exchange import stage
from tts2face.serving.service.messages import SYNTHESISE, BusyError, Work
from tts2face.serving.service.preparation import Preparation, Step
from tts2face.serving.service.warm_process import InputItem, WarmProcess, synthesis_program, work_call

InputQueue = asyncio.Queue[InputItem]
NICENESS = 10  # of processes for which nobody waits, so that streams go first
MAX_TRIES = 2  # of a request whose process ended before anything was sent
STREAM_PRIORITY = 0
# Shares of a core of a stream in real time, rounded up.
MOVIE_COST = 1.0
LINES_COST = 0.2
SOUND_COST = 0.1
LIVE_COST = 0.02  # of a live stream, which mostly waits for a sentence
# Tasks of each cost that one process makes at a time. They bound its memory (a movie takes 37 MB, a live stream less
# than 1 MB); computing is shared by turns.
PLACES = {MOVIE_COST: 8, LINES_COST: 10, SOUND_COST: 20, LIVE_COST: 1000}
MOST_BEGUN = 1.25  # times as many may have begun, with those that wait for their readers
MOST_BEGUN_BY_SHARE = 1.5  # likewise, for keys that have less than their share of the places


def work_cost(work: Work, *, is_live: bool = False) -> float:
    """Share of a core that a task takes; `is_live`: it gets inputs while it is made."""
    if is_live:
        return LIVE_COST
    if work.format in SOUND_KINDS:
        return SOUND_COST
    return MOVIE_COST if work.format in MOVIE_KINDS else LINES_COST


@dataclass(slots=True, eq=False)
class Place:
    """Of a task in a process; while the task waits for its reader, another one can begin."""

    cost: float
    key: str
    process: Any
    is_paused: bool = False


class Places:
    """Places of the tasks that have begun in one process."""

    def __init__(self) -> None:
        self.begun: list[Place] = []

    @property
    def load(self) -> float:
        """Share of a core that the tasks take."""
        return sum(place.cost for place in self.begun)

    def of(self, cost: float) -> list[Place]:
        """Those of one cost."""
        return [place for place in self.begun if place.cost == cost]

    def take(self, cost: float, key: str, process: Any) -> Place:
        """Place of a task that begins."""
        self.begun.append(Place(cost, key, process))
        return self.begun[-1]

    def has_room(self, cost: float, *, has_less: bool) -> bool:
        """Whether a task can begin; `has_less`: its key has less than its share of the places."""
        begun = self.of(cost)
        if has_less:
            return len(begun) < MOST_BEGUN_BY_SHARE * PLACES[cost]
        n_made = sum(not place.is_paused for place in begun)
        return n_made < PLACES[cost] and len(begun) < MOST_BEGUN * PLACES[cost]


class PoolProcess(WarmProcess):
    """A process of a pool with the places of its tasks."""

    def __init__(self, settings: Mapping[str, Any], preparation: Preparation, on_change: Callable[[], None]) -> None:
        super().__init__(settings, preparation, on_change)
        self.places = Places()


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """A task that waits for a place."""

    cost: float
    since_s: float
    place: "asyncio.Future[Place]"


@dataclass(frozen=True, slots=True)
class PoolSettings:
    """Size of the pool.

    Parameters
    ----------
    n_processes
        Number of synthesis processes; 0: one for each core.
    max_waiting
        Requests that may wait; further ones are refused.
    steps
        What is prepared before a process is ready.
    handlers
        Settings of `tts2face.serving.service.synthesis.handlers`.
    """

    n_processes: int = 0
    max_waiting: int = 64
    steps: tuple[Step, ...] = ()
    handlers: Mapping[str, Any] = field(default_factory=dict)


class Pool:
    """Distributes works over synthesis processes.

    While all places of the processes are taken, works wait in one queue for each key, and the keys take turns. A key
    that has less than its share of the places gets one nevertheless, up to `MOST_BEGUN_BY_SHARE` (decision 203). The
    places to wait are shared, too: when all are taken, a key that has fewer of them gets one of the key that has most
    (decision 180).
    """

    def __init__(self, settings: PoolSettings) -> None:
        self.settings = settings
        count = settings.n_processes or available_cores()
        self.preparation = Preparation(settings.steps, count)
        self.processes = [PoolProcess(settings.handlers, self.preparation, self._wake) for _ in range(count)]
        self.is_prepared = asyncio.Event()  # all processes have been ready
        self._waiting: OrderedDict[str, deque[_Waiting]] = OrderedDict()
        self._runs: list[asyncio.Task[None]] = []

    @property
    def n_ready(self) -> int:
        """Number of processes that are ready."""
        return sum(process.is_ready for process in self.processes)

    @property
    def n_waiting(self) -> int:
        """Number of tasks that wait for a process."""
        return sum(len(queue) for queue in self._waiting.values())

    @property
    def oldest_waiting_s(self) -> float:
        """Age of the work that waits longest."""
        since_s = [waiting.since_s for queue in self._waiting.values() for waiting in queue]
        return time.monotonic() - min(since_s) if since_s else 0.0

    @property
    def load(self) -> float:
        """Cost of all running tasks."""
        return sum(process.places.load for process in self.processes)

    @property
    def _lack(self) -> str:
        """Why no process is ready, nor will be; empty where one is, or may be."""
        return "" if self.n_ready else self.preparation.lack

    def start(self) -> None:
        """Start the processes in the running event loop."""
        self._runs = [asyncio.create_task(process.run()) for process in self.processes]

    async def close(self) -> None:
        """End all processes."""
        for process in self.processes:
            await process.close()
        await asyncio.gather(*self._runs, return_exceptions=True)

    async def make_aside(self, work: Work) -> bytes:
        """All bytes of a long work that nobody waits for, made by a process of its own once all others are ready.

        Raises
        ------
        Tts2faceError
            As the work.
        """
        await self.is_prepared.wait()
        content = bytearray()
        async with started(synthesis_program(self.settings.handlers, niceness=NICENESS)) as child:
            await child.call(SYNTHESISE, work_call(work), on_event=lambda message: content.extend(message.payload))
        return bytes(content)

    async def stream(
        self,
        work: Work,
        key: str = "",
        priority: int = STREAM_PRIORITY,
        inputs: InputQueue | None = None,
    ) -> AsyncIterator[Message]:
        """Messages of a task up to its result; leaving the iteration cancels it. `inputs` as for `WarmProcess.stream`.

        Raises
        ------
        InputError, DataError, BackendError
            As the work.
        BusyError
            Too many tasks wait.
        BackendError
            No process can become ready.
        """
        cost, tries = work_cost(work, is_live=inputs is not None), 0
        while True:
            with stage("queue"):
                place = await self._take(cost, key, work.affinity)
            is_begun = False
            call = work_call(work, priority, key)
            given = None if inputs is None else each_input(inputs)
            messages = place.process.stream(call, given, lambda is_paused, of=place: self._pause(of, is_paused))
            try:
                with stage("synthesis"):
                    async for message in messages:
                        is_begun = True
                        yield message
                return
            except ChildEndedError:
                tries += 1
                # what a client has begun to read cannot be sent again
                if is_begun or tries >= MAX_TRIES:
                    raise
            finally:
                await messages.aclose()
                self._release(place)

    async def _take(self, cost: float, key: str, affinity: str) -> Place:
        waiting = self._keys_that_wait(cost)
        is_first = key not in waiting and (not waiting or self._has_less(cost, key))
        found = self._place(cost, key, affinity) if is_first else None
        if found is not None:
            return found
        if self._lack:
            raise BackendError(self._lack)
        if self.n_waiting >= self.settings.max_waiting:
            self._make_room(key)
        future: asyncio.Future[Place] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(key, deque()).append(_Waiting(cost, time.monotonic(), future))
        try:
            return await future
        except asyncio.CancelledError:
            # the place came at the moment in which the client left
            if future.done() and not future.cancelled() and future.exception() is None:
                self._release(future.result())
            raise
        finally:
            self._forget(key, future)

    def _make_room(self, key: str) -> None:
        """Refuse the newest waiting work of the key that has most, unless that gives this key as many."""
        waits = {name: sum(not waiting.place.done() for waiting in queue) for name, queue in self._waiting.items()}
        largest = max(waits, key=lambda name: waits[name], default=key)
        # a place moves only where the numbers become more alike (decision 180)
        if waits.get(largest, 0) <= waits.get(key, 0) + 1:
            raise BusyError(f"{self.n_waiting} requests are waiting already; repeat the request later")
        # the newest has waited least
        newest = next(waiting.place for waiting in reversed(self._waiting[largest]) if not waiting.place.done())
        newest.set_exception(BusyError("other keys need the places to wait; repeat the request later"))
        self._forget(largest, newest)

    def _release(self, place: Place) -> None:
        place.process.places.begun.remove(place)
        self._wake()

    def _pause(self, place: Place, is_paused: bool) -> None:
        place.is_paused = is_paused
        self._wake()

    def _place(self, cost: float, key: str, affinity: str = "") -> Place | None:
        """A place in a process for a task that begins; None if there is none."""
        has_less = self._has_less(cost, key)
        free = [
            process
            for process in self.processes
            if process.is_ready and process.places.has_room(cost, has_less=has_less)
        ]
        usual = self.processes[zlib.crc32(affinity.encode()) % len(self.processes)] if affinity else None
        process = usual if usual in free else min(free, key=lambda process: process.places.load, default=None)
        return None if process is None else process.places.take(cost, key, process)

    def _has_less(self, cost: float, key: str) -> bool:
        """Whether a key has begun fewer tasks of a cost than its share of the places."""
        ready = [process.places for process in self.processes if process.is_ready]
        return has_less_than_share(ready, cost, key, self._keys_that_wait(cost))

    def _keys_that_wait(self, cost: float) -> set[str]:
        waits = self._waiting.items()
        return {
            key for key, queue in waits if any(waiting.cost == cost and not waiting.place.done() for waiting in queue)
        }

    def _wake(self) -> None:
        """Give free places to waiting tasks, one key after the other; those of one cost do not wait for others."""
        if self.n_ready == len(self.processes):
            self.is_prepared.set()
        if self._lack:
            for future in [
                waiting.place for queue in self._waiting.values() for waiting in queue if not waiting.place.done()
            ]:
                future.set_exception(BackendError(self._lack))
        for key in list(self._waiting):
            firsts = {waiting.cost: waiting for waiting in reversed(self._waiting[key]) if not waiting.place.done()}
            for cost, waiting in firsts.items():
                if (place := self._place(cost, key)) is not None:
                    waiting.place.set_result(place)
                    self._waiting.move_to_end(key)
                    self._forget(key, waiting.place)
                    break

    def _forget(self, key: str, future: "asyncio.Future[Place]") -> None:
        queue = self._waiting.get(key)
        if queue is not None:
            with suppress(StopIteration):
                queue.remove(next(waiting for waiting in queue if waiting.place is future))
            if not queue:
                del self._waiting[key]


def has_less_than_share(processes: Sequence[Places], cost: float, key: str, waiting: Set[str]) -> bool:
    """Whether a key has begun fewer tasks of a cost than there are places for each key that has or awaits some.

    Parameters
    ----------
    waiting
        Keys that await some.
    """
    holders = [place.key for places in processes for place in places.of(cost)]
    n_keys = len({key, *holders, *waiting})
    return holders.count(key) < max(1, len(processes) * PLACES[cost] // n_keys)


async def each_input(inputs: InputQueue) -> AsyncIterator[InputItem]:
    """Inputs of a stream, without an end."""
    while True:
        yield await inputs.get()
