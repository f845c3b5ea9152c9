"""A synthesis process: the server's side, and the tasks that it is given."""

import asyncio
import os
import signal
from pathlib import Path

import pytest

from tests.processes.answered import answered
from tts2face.processes.message import ERROR, RESULT
from tts2face.serving.service import synthesis, warm_process
from tts2face.serving.service.application import Mount, create_app
from tts2face.serving.service.messages import SYNTHESISE, Work
from tts2face.serving.service.pool import LINES_COST, MOVIE_COST, SOUND_COST, work_cost
from tts2face.serving.service.preparation import Preparation
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.warm_process import WarmProcess
from tts2face.session.session_cache import SessionCache
from tts2face.types import Chunk

READY_TIMEOUT_S = 120.0
GIVEN = {"given": lambda *_: iter([Chunk(b"a", 2.0)])}  # a table of tasks


def test_the_end_of_a_process_is_not_taken_from_asyncio(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asyncio warns of an unknown child process if something else has read its exit status."""
    monkeypatch.setattr(warm_process, "PROGRAM", "tests.serving.service.table_synthesis:handlers")

    async def run() -> None:
        process = WarmProcess({}, Preparation((), 1), lambda: None)
        running = asyncio.create_task(process.run())
        async with asyncio.timeout(READY_TIMEOUT_S):
            for number in range(3):
                while not process.is_ready:
                    await asyncio.sleep(0.01)
                assert process.pid is not None
                if number < 2:
                    os.kill(process.pid, signal.SIGKILL)  # it is started again
                else:
                    await process.close()
                while process.is_ready:
                    await asyncio.sleep(0.01)
            await running

    asyncio.run(run())
    assert [one.getMessage() for one in caplog.records if one.name == "asyncio"] == []


def test_processes_have_the_tasks_of_what_is_mounted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SessionCache, "get", lambda *_: None)
    monkeypatch.setattr(synthesis, "configure_logs", lambda *_, **__: None)
    mount = Mount(lambda *_: None, (f"{__name__}:GIVEN",))
    order = {"work": Work("given").as_json(), "priority": 0, "key": ""}
    last = []
    for mounts in ([], [mount]):
        settings = create_app(ServiceSettings(processes=1, data=tmp_path), mounts).state.service.pool.settings
        handlers = synthesis.handlers(**settings.handlers)
        assert {step.call for step in settings.steps} <= set(handlers)
        last.append(answered(handlers[SYNTHESISE], order | {"id": None})[-1])
    assert [one.kind for one in last] == [ERROR, RESULT]
    assert last[0].content["message"].startswith("internal error: KeyError")
    assert last[1].content["seconds"] == 2.0


def test_a_work_costs_what_its_format_does_and_one_of_no_file_what_lines_do() -> None:
    works = [Work(format="mp4"), Work("project-file", format="opus"), Work(format="curves"), Work("live")]
    assert [work_cost(one) for one in works] == [MOVIE_COST, SOUND_COST, LINES_COST, LINES_COST]
