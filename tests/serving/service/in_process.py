"""The service in the process of a test: its application without sockets and without processes of its own.

For tests of what is asked and how it is answered: forms, keys, quotas, routes and refusals. A pool answers from a table
or with sessions of this process; jobs are done by a worker in a thread. Streams, kills, drains and memory are of real
processes (`tests.running`).
"""

import asyncio
import io
import json
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.processes.answered import answered
from tests.running import eventually
from tts2face.processes.child import Call, Handler, answer
from tts2face.processes.message import ERROR, EVENT, MORE, STOP, Message, read_message
from tts2face.processes.parent import raised
from tts2face.processes.program import Program
from tts2face.serving.service import decoders
from tts2face.serving.service.application import Mount, create_app
from tts2face.serving.service.messages import SYNTHESISE, Work
from tts2face.serving.service.pool import PoolProcess
from tts2face.serving.service.preparation import Preparation
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState
from tts2face.serving.service.synthesis import TASKS, Synthesis
from tts2face.serving.service.warm_process import InputItem
from tts2face.session.session_cache import SessionCache
from tts2face.storage.signing import Signer

START_S = 60.0
SECONDS = 1.0  # of speech of an answer of a table


class LocalProcess(PoolProcess):
    """A process of the pool that is this one.

    Parameters
    ----------
    handlers
        Its answer to `SYNTHESISE`; each call has a thread.
    """

    def __init__(self, handlers: Mapping[str, Handler]) -> None:
        super().__init__({}, Preparation((), 1), lambda: None)
        self._handlers, self.is_ready = handlers, True
        self._changed = threading.Condition()

    async def run(self) -> None:
        """Nothing is to be started."""

    async def stream(
        self, call: Mapping[str, Any], inputs: AsyncIterator[InputItem] | None, on_paused: Callable[[bool], None]
    ) -> AsyncIterator[Message]:
        """Messages of a work as they are made; it is never paused."""
        answers = Answers(asyncio.get_running_loop())
        order = Call(Message(SYNTHESISE, call), answers, self._changed)
        asked = asyncio.create_task(asyncio.to_thread(answer, order, self._handlers))
        given = asyncio.create_task(_pass_on(order, inputs)) if inputs is not None else None
        try:
            while (message := await answers.queue.get()).kind == EVENT:
                yield message
            if message.kind == ERROR:
                raise raised(message)
            yield message
        finally:
            if given is not None:
                given.cancel()
            order.control(Message(STOP, {}))
            await asyncio.shield(asked)


async def _pass_on(call: Call, inputs: AsyncIterator[InputItem]) -> None:
    async for item in inputs:
        call.control(Message(MORE, *item))


class Answers(io.BytesIO):
    """Where the thread of a call writes messages, each in one piece, for the thread of the server."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._loop, self.queue = loop, asyncio.Queue[Message]()

    def write(self, content: Any) -> int:
        """Pass a message on."""
        message = read_message(io.BytesIO(content))
        assert message is not None
        self._loop.call_soon_threadsafe(self.queue.put_nowait, message)
        return len(content)


class SessionProcess(LocalProcess):
    """Executes works with sessions of this process; `tables` of further tasks as `synthesis.handlers` takes them."""

    def __init__(self, sessions: SessionCache, tables: Sequence[str] = ()) -> None:
        tasks = dict(TASKS)
        for table in tables:
            tasks |= Program(table).load()
        super().__init__({SYNTHESISE: Synthesis(sessions, tasks).synthesise})


class TableProcess(LocalProcess):
    """Answers works of files with what a table has for their format, and keeps the works in `works`.

    Parameters
    ----------
    table
        Bytes by format; of others: the name of the format.
    """

    def __init__(self, table: Mapping[str, bytes] | None = None) -> None:
        self.works: list[Work] = []
        self._table = table or {}
        super().__init__({SYNTHESISE: self._look_up})

    def _look_up(self, call: Call) -> Mapping[str, float]:
        work = Work(**call.content["work"])
        self.works.append(work)
        call.event({"seconds": SECONDS}, self._table.get(work.format, work.format.encode()))
        return {"seconds": SECONDS, "cpu_s": 0.0}


@contextmanager
def service_client(
    settings: ServiceSettings, process: PoolProcess, mounts: Sequence[Mount] = ()
) -> Iterator[TestClient]:
    """Client of a service with its database, and with the workers that `settings` asks for."""
    app = create_app(settings, mounts)
    service: ServiceState = app.state.service
    service.pool.processes[:] = [process]
    with TestClient(app, base_url="http://localhost", follow_redirects=False) as client:
        eventually(lambda: client.portal and client.portal.call(service.jobs.is_reachable), START_S)
        yield client


def another_client(client: TestClient, path: str = "", **headers: str) -> TestClient:
    """Another client of the service of a client, which asks below a path."""
    base = f"http://localhost/{path}"
    other = TestClient(client.app, base_url=base, headers=headers, follow_redirects=False)
    other.portal = client.portal  # the thread of the server
    return other


def with_key(client: TestClient, secret: str) -> TestClient:
    """Another client of the service of a client, with a key."""
    return another_client(client, authorization=f"Bearer {secret}")


@contextmanager
def working(settings: ServiceSettings, signer: Signer | None = None) -> Iterator[None]:
    """A worker of the jobs of a service in a thread of this process."""
    from tts2face.serving.batch.render import SegmentRenderer
    from tts2face.serving.work.worker import Worker

    worker = Worker(settings.database_place, settings.store_place, renderer=SegmentRenderer(), signer=signer)
    running = threading.Thread(target=worker.run)
    running.start()
    try:
        yield
    finally:
        worker.stop()
        running.join()


@contextmanager
def decoding_here() -> Iterator[None]:
    """Uploads are decoded in this process, without limits of memory and time (those: `test_uploads.py`)."""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(decoders, "started", DecoderHere)
        yield


class DecoderHere:
    """A decoder of a program that works in a thread of this process."""

    pid = None

    def __init__(self, program: Program) -> None:
        self._program = program

    async def __aenter__(self) -> "DecoderHere":
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    async def call(self, kind: str, content: Mapping[str, Any], **_: Any) -> Message:
        """Result of a call, as from another process."""
        made = (await asyncio.to_thread(answered, self._program.load()[kind], content))[-1]
        if made.kind == ERROR:
            raise raised(made)
        return Message(made.kind, json.loads(json.dumps(made.content)))
