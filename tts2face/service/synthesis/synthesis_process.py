"""A process of the server that synthesises: it keeps sessions warm and runs several tasks in turn.

Started as ``python -m tts2face.service.synthesis.synthesis_process SETTINGS``; commands are lines of JSON on standard
input, messages go to standard output. It ends with the server, as its standard input closes then.
"""

import json
import queue
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, BinaryIO

from tts2face.processes.child import bind_to_core, claim_standard_output, exit_after
from tts2face.service.logs import configure_logs
from tts2face.service.synthesis.messages import CANCELS, Message, MessageKind
from tts2face.service.synthesis.remote_aligner import RemoteAligner
from tts2face.service.synthesis.scheduler import Scheduler, Step
from tts2face.service.synthesis.tasks import TASKS
from tts2face.service.synthesis.turns import OneAtATime, TurnSteps
from tts2face.service.synthesis.work import Work, work_from_json
from tts2face.session_cache import Models, SessionCache
from tts2face.voice.pool import VoicePool


class SynthesisProcess:
    """Executes commands: start, cancel, pause, resume, input, wake.

    Parameters
    ----------
    wake
        Puts a command ``wake`` of a task among the commands; called from other threads.
    """

    def __init__(self, send: BinaryIO, sessions: SessionCache, wake: Callable[[int], None]) -> None:
        self._file, self._sessions, self._wake = send, sessions, wake
        self.scheduler = Scheduler(self._send)
        self._inputs: dict[int, queue.SimpleQueue[Any]] = {}
        self._turns: dict[int, TurnSteps] = {}

    def warm_up(self, works: list[dict[str, Any]]) -> None:
        """Load models and compile kernels by executing works, then report that the process is ready."""
        for work in works:
            for _ in self._steps(0, work_from_json(work)):
                pass  # without turns: each step waits for the aligner
        self._inputs.clear()
        self._send(Message(0, MessageKind.READY, b"{}"))

    def execute(self, command: dict[str, Any], arrived: float) -> None:
        """Execute one command that arrived at a second of the monotonic clock."""
        number = command["task"]
        match command["do"]:
            case "start":
                work = work_from_json(command["work"])
                self._inputs[number] = queue.SimpleQueue()
                self._turns[number] = TurnSteps(lambda: self._steps(number, work), lambda: self._wake(number))
                self.scheduler.start(
                    number, lambda: self._turns[number], command["priority"], request=command.get("id")
                )
            case "cancel" if number in self._turns:
                self.scheduler.cancel(number)
                self._forget(number)
                seconds = round(time.monotonic() - arrived, 6)
                self._send(Message(number, MessageKind.CANCELLED, json.dumps({"seconds": seconds}).encode()))
            case "pause" | "resume" as what:
                self.scheduler.pause(number, is_paused=what == "pause")
            case "input":
                if number in self._inputs:
                    self._inputs[number].put(command["content"] | {"arrived": arrived})
                    is_urgent = command["content"].get("type") in CANCELS
                    if is_urgent:
                        self._turns[number].interrupt()
                    self.scheduler.wake(number, is_urgent=is_urgent)
            case "wake":
                self.scheduler.wake(number)

    def _forget(self, number: int) -> None:
        self._inputs.pop(number, None)
        self._turns.pop(number, None)

    def _steps(self, number: int, work: Work) -> Iterator[Step]:
        inputs = self._inputs.setdefault(number, queue.SimpleQueue())
        session = self._sessions.get(Models(**work.models), work.owner)
        return TASKS[work.kind](session, work, inputs)

    def _send(self, message: Message) -> None:
        if message.kind in {MessageKind.END, MessageKind.ERROR}:
            self._forget(message.task)
        self._file.write(message.encode())
        self._file.flush()


def received_requests() -> "queue.Queue[tuple[Any, float]]":
    """Lines of JSON of standard input, each with the second of the monotonic clock at which it arrived.

    This process exits when the input ends.
    """
    requests: queue.Queue[tuple[Any, float]] = queue.Queue()

    def read_lines() -> None:
        while line := sys.stdin.buffer.readline():
            requests.put((json.loads(line), time.monotonic()))

    exit_after(read_lines)
    return requests


def main() -> None:
    """Execute commands until standard input ends."""
    settings = json.loads(sys.argv[1])
    configure_logs(settings["log_format"], with_text=settings["log_text"])
    bind_to_core(settings.get("core"))
    messages, commands = claim_standard_output(), received_requests()
    aligner = RemoteAligner()
    aligner.start()
    process = SynthesisProcess(
        messages,
        SessionCache(
            settings["n_sessions"],
            voices=VoicePool(aligner, OneAtATime()),
            max_bytes=settings["memory_mb"] * 1_000_000 or None,
            memory_mb=settings["sentences_mb"],
        ),
        lambda task: commands.put(({"do": "wake", "task": task}, time.monotonic())),
    )
    process.warm_up(settings["warm"])
    while True:
        while not commands.empty():
            process.execute(*commands.get())
        if not process.scheduler.run_step():
            with suppress(queue.Empty):
                process.execute(*commands.get(timeout=process.scheduler.seconds_to_wait()))


if __name__ == "__main__":
    main()
