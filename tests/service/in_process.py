"""The service in the process of a test: its application without sockets and without synthesis processes."""

import queue
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Any

from starlette.testclient import TestClient

from tests.running import eventually
from tts2face.service.app import create_app
from tts2face.service.settings import ServiceSettings
from tts2face.service.synthesis.messages import Message, MessageKind
from tts2face.service.synthesis.scheduler import Scheduler
from tts2face.service.synthesis.tasks import TASKS
from tts2face.service.synthesis.warm_process import WarmProcess
from tts2face.service.synthesis.work import Work
from tts2face.session_cache import Models, SessionCache

START_S = 60.0


class SessionProcess(WarmProcess):
    """Executes works with sessions of this process, one after the other and in the thread of the server."""

    def __init__(self, sessions: SessionCache) -> None:
        super().__init__({}, lambda: None)
        self._sessions, self.is_ready = sessions, True

    async def run(self) -> None:
        """Nothing is to be started."""

    async def stream(self, work: Work, priority: int, inputs: Any = None) -> AsyncIterator[Message]:
        """Messages of a work, made when the first one is asked for."""
        sent: list[Message] = []
        scheduler, session = Scheduler(sent.append), self._sessions.get(Models(**work.models))
        scheduler.start(1, lambda: TASKS[work.kind](session, work, queue.SimpleQueue()))
        while scheduler.run_step():
            continue
        assert sent[-1].kind == MessageKind.END, sent[-1]
        for message in sent:
            yield message


@contextmanager
def service_client(settings: ServiceSettings, sessions: SessionCache) -> Iterator[TestClient]:
    """Client of a service with its database, and with the workers that `settings` asks for."""
    app = create_app(settings)
    app.state.service.pool.processes[:] = [SessionProcess(sessions)]
    with TestClient(app, base_url="http://localhost") as client:
        eventually(lambda: client.get("/readyz").json()["checks"]["database"], START_S)
        yield client
