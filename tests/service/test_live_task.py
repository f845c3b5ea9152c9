"""The task of a live stream, without a service."""

from collections import deque
from collections.abc import Callable
from typing import Any

import tts2face
from tts2face.processes.message import MORE, Message
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.messages import Event, Inputs, Work
from tts2face.serving.service.scheduler import InterruptedTaskError
from tts2face.sound.voice_pool import VoicePool


def test_idle_motion_is_interrupted_by_cancel() -> None:
    """The stream answers and goes on."""
    inputs: Inputs = deque()
    arriving = [Message(MORE, {"type": "cancel", "arrived": 0.0})]  # between the steps of idle motion

    def run(compute: Callable[[], Any], _: Callable[[], None]) -> Any:
        if arriving:
            inputs.append(arriving.pop())
            raise InterruptedTaskError
        return compute()

    session = tts2face.Session(voices=VoicePool(run=run))
    steps = LiveTask(session, Work(kind="live"), inputs, clock=lambda: 0.0).steps()
    found = [next(steps) for _ in range(2)]
    assert [one.content["type"] for one in found if isinstance(one, Event)] == ["cancelled", "curves"]
