"""The service in the process of a test: its application without sockets and without processes of its own.

For tests of what is asked and how it is answered: forms, keys, quotas, routes and refusals. A pool answers from a table
or with sessions of this process; jobs are done by a worker in a thread. Streams, kills, drains and memory are of real
processes (`tests.running`).
"""

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.processes.answered import answered
from tests.running import eventually
from tts2face.processes.message import ERROR, EVENT, RESULT, Message
from tts2face.processes.parent import raised
from tts2face.processes.program import Program
from tts2face.serving.service import uploads
from tts2face.serving.service.messages import Work
from tts2face.serving.service.pool import WarmProcess
from tts2face.serving.service.preparation import Preparation
from tts2face.serving.service.server import Mount, create_app
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.synthesis import Synthesis
from tts2face.session.functions import SessionCache

START_S = 60.0
SECONDS = 1.0  # of speech of an answer of a table


class LocalProcess(WarmProcess):
    """Executes works in this process, one after the other and in the thread of the server.

    Parameters
    ----------
    answer
        Messages of a work, of which the last one is its result or its error.
    """

    def __init__(self, answer: Callable[[Work], Sequence[Message]]) -> None:
        super().__init__({}, Preparation((), 1), lambda: None)
        self._answer, self.is_ready = answer, True

    async def run(self) -> None:
        """Nothing is to be started."""

    async def stream(self, work: Work, priority: int, inputs: Any = None) -> AsyncIterator[Message]:
        """Messages of a work, made when the first one is asked for."""
        made = self._answer(work)
        if made[-1].kind == ERROR:
            raise raised(made[-1])
        for message in made:
            yield message


class SessionProcess(LocalProcess):
    """Executes works with sessions of this process."""

    def __init__(self, sessions: SessionCache) -> None:
        synthesis = Synthesis(sessions)
        super().__init__(
            lambda work: answered(synthesis.synthesise, {"work": work.as_json(), "priority": 0, "id": None})
        )


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
        super().__init__(self._look_up)

    def _look_up(self, work: Work) -> list[Message]:
        self.works.append(work)
        content = self._table.get(work.format, work.format.encode())
        return [
            Message(EVENT, {"seconds": SECONDS}, content),
            Message(RESULT, {"seconds": SECONDS, "cpu_s": 0.0}),
        ]


@contextmanager
def service_client(
    settings: ServiceSettings, process: WarmProcess, mounts: Sequence[Mount] = ()
) -> Iterator[TestClient]:
    """Client of a service with its database, and with the workers that `settings` asks for."""
    app = create_app(settings, mounts)
    app.state.service.pool.processes[:] = [process]
    with TestClient(app, base_url="http://localhost", follow_redirects=False) as client:
        eventually(lambda: client.get("/readyz").json()["checks"]["database"], START_S)
        yield client


def with_key(client: TestClient, secret: str) -> TestClient:
    """Another client of the service of a client, with a key."""
    other = TestClient(client.app, base_url="http://localhost", headers={"authorization": f"Bearer {secret}"})
    other.portal = client.portal  # the thread of the server
    return other


@contextmanager
def working(settings: ServiceSettings) -> Iterator[None]:
    """A worker of the jobs of a service in a thread of this process."""
    from tts2face.serving.batch.render import SegmentRenderer
    from tts2face.serving.work.worker import Worker

    worker = Worker(settings.database_place, settings.store_place, renderer=SegmentRenderer())
    running = threading.Thread(target=worker.run)
    running.start()
    try:
        yield
    finally:
        worker.stop()
        running.join()


@contextmanager
def decoding_here() -> Iterator[None]:
    """Uploads are decoded in this process, without limits of memory and time (`tests/serving/service/test_uploads.py`)."""

    async def call_here(program: Program, kind: str, content: Mapping[str, Any], **_: Any) -> Mapping[str, Any]:
        made = (await asyncio.to_thread(answered, program.load()[kind], content))[-1]
        if made.kind == ERROR:
            raise raised(made)
        return json.loads(json.dumps(made.content))  # type: ignore[no-any-return] # as from another process

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uploads, "call_once", call_here)
        yield
