"""The list of background work of the studio: waiting, running and ended, and how the next server goes on.

What waits or runs has an order, a file of JSON beside what it makes: its owner, the tries so far, and what is to be
done. The order goes when the work ends; a server that begins queues those that it finds.
"""

import asyncio
import json
import os
import shutil
import time
from collections import defaultdict
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lexicon.errors import InputError, Tts2faceError
from lexicon.values.files import read_text
from lexicon.values.json_text import LARGEST_JSON_BYTES, parse_json
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import in_background
from tts2face.serving.service.logs import log_event
from tts2face.serving.work.jobs import CANCELLED, DONE, FAILED, OPEN_STATES, RUNNING, WAITING
from tts2face.storage.files import translate_disk_errors, write_atomically

MAX_TRIES = 3  # of a piece of work by servers that ended meanwhile
NUMBER = "number"  # of an order
ID = 12 * "[0-9a-f]"  # pattern of the name of an order that has its folder with others


@dataclass(slots=True, eq=False)
class BackgroundWork:
    """A piece of work of an owner as it is now."""

    kind: str
    owner: str
    order: Path  # file that says what is to be done, until the work has ended
    content: Mapping[str, Any]  # what is to be done, as JSON
    title: str = ""
    state: str = WAITING
    stage: str = ""  # what is being done
    done: float = 0  # steps of the stage
    of: float = 0  # all steps of the stage; 0 while their number is not known
    message: str = ""  # one sentence: what came of it, or why it failed
    files: tuple[Path, ...] = ()  # files and folders that it makes; removed with it, and when it does not get done
    created: float = field(default_factory=time.time)  # seconds since 1970; also the time of the order
    tries: int = 0  # how often it was begun
    number: int = 0  # in which it was queued, by whichever server: no clock decides the order
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)
    on_change: Callable[["BackgroundWork"], None] = field(default=lambda _: None, repr=False)

    @property
    def id(self) -> str:
        """Name of the order."""
        return self.order.stem

    @property
    def is_open(self) -> bool:
        """Whether it waits or runs; a defect of the program may have ended its task."""
        return self.state in OPEN_STATES and not (self.task is not None and self.task.done())

    @property
    def share(self) -> float:
        """Done part, 0 to 1."""
        return 1.0 if self.state == DONE else min(self.done / self.of, 1.0) if self.of else 0.0

    def show(self, stage: str, done: float, of: float) -> None:
        """Set the stage and its steps."""
        self.stage = stage
        self.done = done
        self.of = of
        self.on_change(self)


@dataclass(frozen=True, slots=True)
class WorkKind:
    """How work of a kind is done, and how much of it an owner may have.

    The next kind, as `tts2face.serving.studio.reports` shows:
    1. a class that registers it with the pattern of its orders, so that the next server finds them;
    2. `prepare`, which sets title and files by the content of an order, and `run`, which makes the files and calls
       `BackgroundWork.show`; it may run again, at most `MAX_TRIES` times, from nothing;
    3. its place in `Studio`, and its routes and page;
    4. a test that it goes on with the next server (``tests/serving/studio/test_kinds_of_work.py``).
    """

    name: str
    orders: str  # pattern of the paths of orders, from the folder of the studio
    run: Callable[[BackgroundWork], Awaitable[str]]  # returns the message; raises a `Tts2faceError` or a TimeoutError
    prepare: Callable[[BackgroundWork], None] = lambda _: None  # sets title and files by the content, or refuses it
    end: Callable[[BackgroundWork], None] = lambda _: None  # after any end but that of the server
    stage: str = ""  # of work that waits
    places: int = 1  # of an owner, running
    max_open: int = 10_000  # of an owner, waiting or running
    noun: str = "files"  # what is made, for the refusal of more than `max_open`
    busy: str = "this is at work already; wait until it is done"  # the refusal of work that is open
    late: str = "it took too long; try it again"  # the message of a TimeoutError


class WorkList:
    """Work of all owners in the folder of a studio; its methods belong to the event loop."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._kinds: dict[str, WorkKind] = {}
        self._all: dict[Path, BackgroundWork] = {}  # by their orders
        self._turns: dict[tuple[str, str], asyncio.Semaphore] = {}  # of kinds and owners
        self._last = 0  # number of the work that was queued last
        self.listeners: defaultdict[tuple[str, str], set[Callable[[], None]]] = defaultdict(set)  # as `_turns`

    def register(self, kind: WorkKind) -> None:
        """Add a kind of work."""
        self._kinds[kind.name] = kind

    def add(self, kind: str, owner: str, order: Path, content: Mapping[str, Any]) -> BackgroundWork:
        """Queue new work.

        Raises
        ------
        InputError
            The owner has too many open ones, this one is open already, or its kind refuses it.
        BackendError
            The order cannot be written.
        """
        rules, earlier = self._kinds[kind], self.get(order)
        if earlier is not None and earlier.is_open:
            raise InputError(rules.busy)
        if sum(item.is_open for item in self.of(kind, owner)) >= rules.max_open:
            raise InputError(f"{rules.max_open} {rules.noun} are being made already; wait, or cancel one")
        work = BackgroundWork(kind, owner, order, content, number=self._last + 1)
        self._prepare(work)
        with translate_disk_errors(order):
            order.parent.mkdir(parents=True, exist_ok=True)
        _write_order(work)
        self._begin(work)
        return work

    async def resume(self) -> None:
        """Queue again what an earlier server did not finish, the oldest first of each kind."""
        for kind in self._kinds.values():
            for number, order in await asyncio.to_thread(_oldest_first, self._folder.glob(kind.orders)):
                self._last = max(self._last, number)
                self._resume(kind, order)

    def get(self, order: Path) -> BackgroundWork | None:
        """The work of an order, the last since the server began; None if there is none."""
        return self._all.get(order)

    def of(self, kind: str, owner: str) -> list[BackgroundWork]:
        """Work of a kind and an owner since the server began, the oldest first."""
        return [item for item in self._all.values() if (item.kind, item.owner) == (kind, owner)]

    def cancel(self, work: BackgroundWork) -> None:
        """Cancel work that waits or runs."""
        if work.is_open:
            self._end(work, CANCELLED)
            if work.task is not None:
                work.task.cancel()

    def remove(self, work: BackgroundWork) -> None:
        """Cancel work that waits or runs; forget it, and remove what it has made."""
        self.cancel(work)
        self._all.pop(work.order, None)
        _remove(work.files)
        self._notify(work)

    async def forget(self, folder: Path) -> None:
        """Cancel and forget all work whose orders are in a folder, and wait until it has ended."""
        found = [item for item in self._all.values() if item.order.is_relative_to(folder)]
        for item in found:
            self.cancel(item)
            del self._all[item.order]
        await _wait_for(found)

    async def close(self) -> None:
        """End all; a later server does what is not done."""
        found = list(self._all.values())
        for item in found:
            if item.task is not None:
                item.task.cancel()
        await _wait_for(found)

    def _resume(self, kind: WorkKind, order: Path) -> None:
        work = None
        try:
            content = dict(parse_json(read_text(order, LARGEST_JSON_BYTES), order.name))
            owner, tries = str(content.pop("owner")), int(content.pop("tries"))
            created, number = order.stat().st_mtime, _number(content)
            work = BackgroundWork(kind.name, owner, order, content, tries=tries, created=created, number=number)
            self._prepare(work)
            if tries >= MAX_TRIES:
                raise InputError(f"{MAX_TRIES} servers ended while it was made")
        except (OSError, Tts2faceError, LookupError, TypeError, ValueError) as wrong:
            log_event("work not queued again", file=order.name, reason=str(wrong))
            order.unlink(missing_ok=True)
            if work is not None:
                self._end(work, FAILED, str(wrong))
        else:
            self._begin(work)

    def _prepare(self, work: BackgroundWork) -> None:
        kind = self._kinds[work.kind]
        work.stage, work.on_change = kind.stage, self._notify
        kind.prepare(work)

    def _begin(self, work: BackgroundWork) -> None:
        self._last = max(self._last, work.number)
        self._all.pop(work.order, None)  # the newest is the last
        self._all[work.order] = work
        work.task = in_background(self._run(work))
        self._notify(work)

    async def _run(self, work: BackgroundWork) -> None:
        kind = self._kinds[work.kind]
        try:
            async with self._turns.setdefault((work.kind, work.owner), asyncio.Semaphore(kind.places)):
                work.state, work.tries = RUNNING, work.tries + 1
                _write_order(work)
                _remove(work.files)  # of a try that an ended server left
                self._notify(work)
                self._end(work, DONE, await kind.run(work))
        except (RefusedError, Tts2faceError) as wrong:
            self._end(work, FAILED, wrong.message if isinstance(wrong, RefusedError) else str(wrong))
        except TimeoutError:
            self._end(work, FAILED, kind.late)
        finally:
            if work.state != DONE:
                _remove(work.files)

    def _end(self, work: BackgroundWork, state: str, message: str = "") -> None:
        if not work.is_open:
            return  # it was cancelled, and its task ends now
        work.state, work.message = state, message
        work.order.unlink(missing_ok=True)
        if state != DONE:
            _remove(work.files)
        try:
            self._kinds[work.kind].end(work)
        except Tts2faceError as wrong:
            log_event("work not ended", file=work.order.name, reason=str(wrong))
        self._notify(work)

    def _notify(self, work: BackgroundWork) -> None:
        for listener in list(self.listeners[work.kind, work.owner]):
            listener()


def _write_order(work: BackgroundWork) -> None:
    order = {"owner": work.owner, "tries": work.tries, NUMBER: work.number, **work.content}
    write_atomically(work.order, json.dumps(order, ensure_ascii=False).encode())
    os.utime(work.order, (work.created, work.created))


def _oldest_first(orders: Iterable[Path]) -> list[tuple[int, Path]]:
    """Orders with their numbers, the smallest first; 0 for one that cannot be read."""
    found = []
    for order in orders:
        number = 0
        with suppress(OSError, Tts2faceError, LookupError, TypeError, ValueError):
            number = _number(dict(parse_json(read_text(order, LARGEST_JSON_BYTES), order.name)))
        found.append((number, order))
    return sorted(found)


def _number(content: dict[str, Any]) -> int:
    """Number of an order, which is taken out of its content; 0 for those of earlier versions."""
    return int(content.pop(NUMBER, 0))


def _remove(files: Iterable[Path]) -> None:
    """Remove files, and folders with everything in them."""
    for path in files:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


async def _wait_for(work: Iterable[BackgroundWork]) -> None:
    await asyncio.gather(*(item.task for item in work if item.task is not None), return_exceptions=True)
