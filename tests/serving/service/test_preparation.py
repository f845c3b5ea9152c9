"""What synthesis processes do before they are ready: kernels once, models in each; the log and /readyz say it."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from lexicon.errors import BackendError, InputError, Tts2faceError
from tts2face.processes.message import EVENT, Message
from tts2face.processes.parent import ChildEndedError
from tts2face.processes.program import Program
from tts2face.serving.service import pool as service_pool
from tts2face.serving.service.messages import Work
from tts2face.serving.service.pool import NICENESS, Pool, PoolSettings
from tts2face.serving.service.preparation import Preparation, Step

STEPS = (
    Step("kernels of pictures", "pictures", {}, is_shared=True),
    Step("kernels of motion", "motion", {}, is_shared=True),
    Step("voice", "voice", {}),
    Step("models", "models", {}),
)


class Processes:
    """Processes of a preparation, whose calls last some turns of the event loop."""

    def __init__(self, count: int) -> None:
        self.preparation = Preparation(STEPS, count)
        self.calls: list[tuple[str, int]] = []
        self.ends: dict[tuple[str, int], str] = {}  # calls that fail, with the reason
        self.seen: list[tuple[dict[str, Any], str]] = []

    async def run(self, number: int) -> None:
        """The part of one process."""

        async def call(name: str, _: Mapping[str, Any]) -> None:
            self.calls.append((name, number))
            for _ in range(5):
                await asyncio.sleep(0)
            self.seen.append((self.preparation.as_json(), str(self.preparation)))
            if (name, number) in self.ends:
                raise BackendError(self.ends.pop((name, number)))

        await self.preparation.run(call, number)


def test_kernels_are_compiled_by_one_process_each_and_models_loaded_by_all() -> None:
    processes = Processes(3)

    async def run() -> None:
        await asyncio.gather(*(processes.run(number) for number in range(3)))

    asyncio.run(run())
    names = [name for name, _ in processes.calls]
    assert {name: names.count(name) for name in names} == {"pictures": 1, "motion": 1, "voice": 3, "models": 3}
    assert processes.calls[:2] == [("pictures", 0), ("motion", 1)]
    assert set(names[:2]) == {"pictures", "motion"}  # nobody is ready before the kernels are there
    assert processes.seen[0][0]["parts"] == ["kernels of motion", "kernels of pictures"]  # at once


def test_another_process_compiles_what_one_that_ended_did_not() -> None:
    processes = Processes(2)
    processes.ends["pictures", 0] = "killed"

    async def run() -> list[BaseException | None]:
        return await asyncio.gather(processes.run(0), processes.run(1), return_exceptions=True)

    ended, well = asyncio.run(run())
    assert str(ended) == "killed"
    assert well is None
    assert processes.calls.count(("pictures", 1)) == 1
    assert processes.preparation.as_json() == {"parts": [], "done": 4, "of": 6}
    asyncio.run(processes.run(0))  # it is started again
    assert [call for call in processes.calls if call[1] == 0] == [("pictures", 0), ("voice", 0), ("models", 0)]
    assert processes.preparation.as_json() == {"parts": [], "done": 6, "of": 6}


def test_the_log_tells_the_progress(caplog: pytest.LogCaptureFixture) -> None:
    processes = Processes(1)
    with caplog.at_level("INFO"):
        asyncio.run(processes.run(0))
    assert [(one.getMessage(), one.fields) for one in caplog.records if one.getMessage() == "preparing"] == [  # type: ignore[attr-defined]
        ("preparing", {"part": step.name, "done": done, "of": 4}) for done, step in enumerate(STEPS)
    ]
    assert processes.seen[1] == (
        {"parts": ["kernels of motion"], "done": 1, "of": 4},
        "the service prepares kernels of motion (1 of 4 steps are done)",
    )


@pytest.fixture
def asides(monkeypatch: pytest.MonkeyPatch) -> list[Program]:
    """Programs of the processes that were started for one work each."""
    programs: list[Program] = []

    async def call(*_: object, on_event: Callable[[Message], object]) -> None:
        for payload in (b"a", b"b"):
            on_event(Message(EVENT, {}, payload))

    @asynccontextmanager
    async def started(program: Program) -> AsyncIterator[SimpleNamespace]:
        programs.append(program)
        yield SimpleNamespace(call=call)

    monkeypatch.setattr(service_pool, "started", started)
    return programs


def test_what_nobody_waits_for_is_made_aside_once_all_processes_are_ready(asides: list[Program]) -> None:
    async def run() -> bytes:
        pool = Pool(PoolSettings(n_processes=2))
        making = asyncio.create_task(pool.make_aside(Work("face")))
        for process in pool.processes:
            await asyncio.sleep(0.01)
            assert not asides
            process.is_ready = True
            process._on_change()
        return await making

    assert asyncio.run(run()) == b"ab"
    assert [one.niceness for one in asides] == [NICENESS]


@pytest.mark.parametrize(
    ("error", "times", "lack"),
    [
        (InputError("there is no talker 'x' in /srv/models/x"), 1, "its models: there is no talker 'x' in x"),
        (BackendError("the voice is not installed"), 1, "its models: the voice is not installed"),
        (ChildEndedError("exit code -9"), 2, ""),  # an accident, as of a process that is killed
        (ChildEndedError("exit code -9"), 3, "its models: exit code -9"),
    ],
)
def test_what_keeps_every_process_from_being_ready_is_known(error: Tts2faceError, times: int, lack: str) -> None:
    preparation = Preparation([Step("models", "models", {})], 1)

    async def fail(*_: object) -> None:
        raise error

    async def work(*_: object) -> None:
        pass

    async def run() -> str:
        for _ in range(times):
            with pytest.raises(type(error)):
                await preparation.run(fail, 0)
        found = preparation.lack
        await preparation.run(work, 0)
        assert preparation.lack == ""
        return found

    assert asyncio.run(run()).removeprefix("the service cannot prepare ") == lack


def test_works_that_wait_for_a_missing_model_are_refused() -> None:
    """With the reason, as soon as it is known, and at once from then on; processes are started less and less often."""

    async def run() -> None:
        pool = Pool(PoolSettings(1, steps=(Step("voice", "voice", {}),)))
        served: list[float] = []

        async def serve() -> None:
            served.append(asyncio.get_running_loop().time())

            async def load(*_: object) -> None:
                raise InputError("there is no talker 'x'")

            await pool.preparation.run(load, 0)

        (process,) = pool.processes
        process._serve = serve  # type: ignore[method-assign]
        waiting = asyncio.create_task(anext(pool.stream(Work(request={"text": "x"}))))
        await asyncio.sleep(0)
        pool.start()
        for work in (waiting, anext(pool.stream(Work(request={"text": "x"})))):
            with pytest.raises(BackendError, match=r"the service cannot prepare its voice: there is no talker 'x'"):
                await work
        assert pool.n_waiting == 0
        assert len(served) == 1
        await asyncio.wait_for(pool.close(), 10)  # which does not wait for the next start
        assert len(served) == 1

    asyncio.run(run())
