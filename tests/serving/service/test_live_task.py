"""The task of a live stream, without a service."""

import itertools
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import tts2face
from tts2face.processes.message import MORE, Message
from tts2face.request import TURN_S
from tts2face.serving.service.live import LiveTask
from tts2face.serving.service.messages import Event, Inputs, Work
from tts2face.serving.service.scheduler import InterruptedTaskError
from tts2face.sound.voice_pool import VoicePool


def test_a_face_listens_until_it_has_something_to_say() -> None:
    now = [0.0]
    inputs: Inputs = deque([Message(MORE, {"type": "listen", "rate": 16_000})])
    session = tts2face.Session()
    listened: list[Any] = []
    live_of = session.live

    def live(**options: Any) -> Any:
        speech = live_of(**options)
        listen = speech.listen
        speech.listen = lambda seconds, cues: listened.append(cues) or listen(seconds, cues)
        return speech

    session.live = live
    work = Work(kind="live", request={"with_idle": False})
    steps = LiveTask(session, work, inputs, clock=lambda: now[0]).steps()
    pulses = np.sign(np.sin(2 * np.pi * 200 * np.arange(32_000) / 16_000))
    inputs.append(Message(MORE, {"type": "heard"}, (8_000 * pulses).astype("<i2").tobytes()))
    for _ in range(3):
        assert next(steps).content["type"] == "curves"
        now[0] += 0.2
    inputs.append(Message(MORE, {"type": "heard"}, bytes(32_000)))  # a pause
    next(steps)
    assert [len(cues) for cues in listened] == [0, 0, 0, 1]
    inputs.append(Message(MORE, {"type": "say", "text": "Yes."}))
    speech = next(steps).content
    assert speech["type"] == "speech"
    assert speech["phones"][0][2] - speech["begin"] == pytest.approx(TURN_S, abs=0.1)
    assert [one.content["type"] for one in itertools.islice(steps, 3) if isinstance(one, Event)][:1] == ["curves"]
    assert len(listened) == 4


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
