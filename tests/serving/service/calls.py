"""Calls of one process that take turns, in the process of the test."""

import io
import threading
from collections.abc import Callable, Iterator
from typing import Any

from tests.running import eventually
from tts2face.processes.child import Call, StoppedError
from tts2face.processes.message import Message, read_message
from tts2face.serving.service.messages import Step
from tts2face.serving.service.scheduler import Turns
from tts2face.types import Chunk

WAIT_S = 60.0


class Calls:
    """Calls of one process, and what they have sent; their seconds pass only when steps let them."""

    def __init__(self) -> None:
        self.now = 0.0
        self.turns, self.changed = Turns(lambda: self.now), threading.Condition()
        self.sent: list[Message] = []
        self.results: dict[int, Any] = {}  # measures or error
        self._calls: dict[int, Call] = {}
        self._threads: dict[int, threading.Thread] = {}

    def write(self, content: bytes) -> None:
        message = read_message(io.BytesIO(content))
        assert message is not None
        self.sent.append(message)

    def flush(self) -> None:
        pass

    def start(self, id: int, steps: Callable[[], Iterator[Step]], priority: int = 0, key: str = "") -> None:
        """Begin a call; returns when it has had a turn or waits for one."""
        call = self._calls[id] = Call(Message("make", id=id), self, self.changed)  # type: ignore[arg-type]

        def run() -> None:
            try:
                self.results[id] = self.turns.run(call, steps, priority, key)
            except (Exception, StoppedError) as error:  # noqa: BLE001
                self.results[id] = error

        before = self.sent[:]
        thread = self._threads[id] = threading.Thread(target=run, daemon=True)
        thread.start()
        eventually(lambda: id in self.results or self.n_waiting(id) or self.sent != before, WAIT_S)

    def n_waiting(self, id: int) -> int:
        return sum(one.call.id == id for one in self.turns._waiting)

    def control(self, id: int, kind: str, **content: Any) -> None:
        self._calls[id].control(Message(kind, content, id=id))

    def end(self, id: int) -> Any:
        """Result of a call."""
        self._threads[id].join(WAIT_S)
        return self.results[id]

    @property
    def order(self) -> list[int]:
        """Calls of all messages."""
        return [one.id for one in self.sent]

    def speech(self, n_steps: int, *, seconds: float = 1.0) -> Iterator[Step]:
        for number in range(n_steps):
            self.now += 0.1
            yield Chunk(bytes([number]), seconds)
