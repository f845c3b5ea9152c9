"""The service in the process of a test: its application without sockets and without synthesis processes."""

from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Any

from starlette.testclient import TestClient

from tests.processes.answered import answered
from tests.running import eventually
from tts2face.processes.message import RESULT, Message
from tts2face.serving.service.messages import Work
from tts2face.serving.service.pool import WarmProcess
from tts2face.serving.service.preparation import Preparation
from tts2face.serving.service.server import create_app
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.synthesis import Synthesis
from tts2face.session.functions import SessionCache

START_S = 60.0


class SessionProcess(WarmProcess):
    """Executes works with sessions of this process, one after the other and in the thread of the server."""

    def __init__(self, sessions: SessionCache) -> None:
        super().__init__({}, Preparation((), 1), lambda: None)
        self._synthesis, self.is_ready = Synthesis(sessions), True

    async def run(self) -> None:
        """Nothing is to be started."""

    async def stream(self, work: Work, priority: int, inputs: Any = None) -> AsyncIterator[Message]:
        """Messages of a work, made when the first one is asked for."""
        made = answered(self._synthesis.synthesise, {"work": work.as_json(), "priority": priority, "id": None})
        assert made[-1].kind == RESULT, made[-1]
        for message in made:
            yield message


@contextmanager
def service_client(settings: ServiceSettings, sessions: SessionCache) -> Iterator[TestClient]:
    """Client of a service with its database, and with the workers that `settings` asks for."""
    app = create_app(settings)
    app.state.service.pool.processes[:] = [SessionProcess(sessions)]
    with TestClient(app, base_url="http://localhost") as client:
        eventually(lambda: client.get("/readyz").json()["checks"]["database"], START_S)
        yield client
