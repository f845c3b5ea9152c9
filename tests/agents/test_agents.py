"""Whole agents: LiveKit's own session with the avatar as its output, and the example programs."""

import asyncio
import runpy
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import av
import pytest

from tests.agents.livekit_stage import PATIENCE_S, RATE, FakeRoom, Stage, perform
from tests.agents.made import FPS, tone
from tests.docs.blocks import DOCS
from tests.docs.programs import ENVIRONMENT, prepare_example

needs_livekit = pytest.mark.needs("livekit.agents")


async def sound(seconds: float) -> AsyncIterator[Any]:
    from livekit import rtc

    content = tone(seconds, RATE)
    for at in range(0, len(content), 960):
        block = content[at : at + 960]
        yield rtc.AudioFrame(block, RATE, 1, len(block) // 2)


@needs_livekit
def test_an_agent_session_knows_what_was_heard() -> None:
    """Its utterance is done when the avatar has given its sound; one that is interrupted is marked so."""
    from livekit.agents import Agent, AgentSession

    async def script(stage: Stage) -> None:
        session = AgentSession()  # type: ignore[var-annotated]
        session.output.audio = stage.audio
        await session.start(Agent(instructions="speak"))
        whole = session.say("Hello there.", audio=sound(0.5))
        await asyncio.wait_for(whole, PATIENCE_S)
        assert (stage.ended, whole.interrupted) == ([(pytest.approx(0.5, abs=1 / FPS), False)], False)
        cut = session.say("Hello there again.", audio=sound(3.0))
        await stage.until(lambda: len(stage.sound) > 0.8 * 48_000)
        await session.interrupt()
        await asyncio.wait_for(cut, PATIENCE_S)
        assert cut.interrupted
        assert [is_cut for _, is_cut in stage.ended] == [False, True]
        await session.aclose()

    perform(script)


@needs_livekit
def test_the_agent_of_livekits_example_answers() -> None:
    from livekit.agents import Agent, AgentSession

    program = runpy.run_path(str(DOCS / "examples/livekit_agent.py"))

    async def run() -> bool:
        session = AgentSession()  # type: ignore[var-annotated]
        avatar = await program["show"](session, FakeRoom())
        try:
            await session.start(Agent(instructions=""))
            said = await program["answer"](session, SimpleNamespace(text="Hello."))
            await asyncio.wait_for(said, 2 * PATIENCE_S)
            await session.aclose()
            return bool(said.interrupted)
        finally:
            await avatar.aclose()

    assert asyncio.run(run()) is False


@pytest.mark.needs("pipecat")
def test_the_agent_of_pipecats_example_makes_a_film(tmp_path: Path) -> None:
    import subprocess

    prepare_example("pipecat_agent", tmp_path)
    command = [sys.executable, "-W", "ignore", "pipecat_agent.py"]
    ended = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, input="Hello there.\nI am well.\n", text=True, capture_output=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr[-3000:]
    with av.open(str(tmp_path / "agent.mp4")) as film:
        pictures, heard = film.streams.video[0], film.streams.audio[0]
        assert heard.duration is not None
        assert pictures.duration is not None
        seconds = float(heard.duration * heard.time_base)
        assert 1.0 < seconds < float(pictures.duration * pictures.time_base) + 0.1
