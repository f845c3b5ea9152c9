"""The drawn face of a session under the runners of both frameworks: whole sound, pictures that move."""

from typing import Any

import numpy as np
import pytest

import tts2face
from tests.agents import livekit_stage, pipecat_stage
from tests.agents.made import tone
from tests.tones import WorldVoices
from tts2face.types import SOUND_RATE

SECONDS, FPS = 1.0, 20.0
needs_livekit = pytest.mark.needs("livekit.agents")
needs_pipecat = pytest.mark.needs("pipecat")


@pytest.fixture(scope="module")
def session() -> tts2face.Session:
    return tts2face.Session(voices=WorldVoices())


def moving(pictures: list[np.ndarray]) -> int:
    """Number of different pictures."""
    return len({picture.tobytes() for picture in pictures})


@needs_livekit
def test_a_session_speaks_in_a_room(session: tts2face.Session) -> None:
    async def script(stage: livekit_stage.Stage) -> None:
        await stage.say(tone(SECONDS, livekit_stage.RATE))
        await stage.until(lambda: stage.ended)

    stage = livekit_stage.perform(script, session, fps=FPS, seed=3)
    assert stage.ended == [(pytest.approx(SECONDS, abs=2 / FPS), False)]
    assert len(stage.sound) == pytest.approx(SECONDS * SOUND_RATE, abs=2 * SOUND_RATE / FPS)
    pictures: list[Any] = [value for kind, value in stage.given if kind == "picture"]
    assert moving(pictures) >= 5


@needs_pipecat
@pytest.mark.filterwarnings("ignore:'audioop' is deprecated:DeprecationWarning")
def test_a_session_speaks_in_a_pipeline(session: tts2face.Session) -> None:
    async def script(stage: pipecat_stage.Stage) -> None:
        await stage.say(tone(SECONDS, pipecat_stage.RATE))
        await stage.until(lambda: stage.count("stopped"))

    stage = pipecat_stage.perform(script, session, fps=FPS, seed=3)
    assert len(stage.sound) == pytest.approx(SECONDS * SOUND_RATE, abs=2 * SOUND_RATE / FPS)
    assert moving([value for kind, value in stage.written if kind == "picture"]) >= 5
