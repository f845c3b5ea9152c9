"""A process of the server that synthesises: it keeps sessions warm and runs several tasks in turn.

Started as ``python -m tts2face.service.synthesis_process SETTINGS``; commands are lines of JSON on standard input,
messages go to standard output. It ends with the server, as its standard input closes then.
"""

import json
import os
import queue
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, BinaryIO

from tts2face.child_process import exit_after
from tts2face.service.logs import configure_logs
from tts2face.service.messages import Message, MessageKind
from tts2face.service.scheduler import Scheduler, Step
from tts2face.service.tasks import TASKS
from tts2face.service.work import Work, work_from_json
from tts2face.session_cache import Models, SessionCache


class SynthesisProcess:
    """Executes commands: start, cancel, pause, resume, input."""

    def __init__(self, send: BinaryIO, n_sessions: int) -> None:
        self._file = send
        self.scheduler = Scheduler(self._send)
        self._sessions = SessionCache(n_sessions)
        self._inputs: dict[int, queue.SimpleQueue[Any]] = {}

    def warm_up(self, works: list[dict[str, Any]]) -> None:
        """Load models and compile kernels by executing works, then report that the process is ready."""
        for work in works:
            for _ in self._steps(0, work_from_json(work)):
                pass
        self._inputs.clear()
        self._send(Message(0, MessageKind.READY, b"{}"))

    def execute(self, command: dict[str, Any]) -> None:
        """Execute one command."""
        number = command["task"]
        match command["do"]:
            case "start":
                work = work_from_json(command["work"])
                self.scheduler.start(
                    number, lambda: self._steps(number, work), command["priority"], request=command.get("id")
                )
            case "cancel":
                self.scheduler.cancel(number)
                self._inputs.pop(number, None)
            case "pause" | "resume" as what:
                self.scheduler.pause(number, is_paused=what == "pause")
            case "input":
                if number in self._inputs:
                    self._inputs[number].put(command["content"])
                    self.scheduler.wake(number)

    def _steps(self, number: int, work: Work) -> Iterator[Step]:
        inputs: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._inputs[number] = inputs
        session = self._sessions.get(Models(**work.models))
        return TASKS[work.kind](session, work, inputs)

    def _send(self, message: Message) -> None:
        if message.kind in {MessageKind.END, MessageKind.ERROR}:
            self._inputs.pop(message.task, None)
        self._file.write(message.encode())
        self._file.flush()


def main() -> None:
    """Execute commands until standard input ends."""
    settings = json.loads(sys.argv[1])
    configure_logs(settings["log_format"], with_text=settings["log_text"])
    if settings.get("core") is not None and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {settings["core"]})
    messages = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints must not mix with the messages
    commands: queue.Queue[bytes] = queue.Queue()

    def read_commands() -> None:
        while line := sys.stdin.buffer.readline():
            commands.put(line)

    exit_after(read_commands)
    process = SynthesisProcess(messages, settings["n_sessions"])
    process.warm_up(settings["warm"])
    while True:
        while not commands.empty():
            process.execute(json.loads(commands.get()))
        if not process.scheduler.run_step():
            with suppress(queue.Empty):
                process.execute(json.loads(commands.get(timeout=process.scheduler.seconds_to_wait())))


if __name__ == "__main__":
    main()
