"""Children: calls and events, errors by name, ends of either side, limits."""

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from lexicon.errors import BackendError, InputError
from tests.processes.handlers import NarrowError
from tests.running import eventually
from tests.started import running_processes
from tts2face.processes import async_parent
from tts2face.processes.async_parent import AsyncChild, started
from tts2face.processes.message import Message
from tts2face.processes.parent import Child, ChildEndedError, raised
from tts2face.processes.program import ProcessLimits, Program

PROGRAM = Program("tests.processes.handlers:HANDLERS")
PAYLOAD = bytes(range(256)) * 5000


@pytest.fixture
def child() -> Iterator[Child]:
    made = Child(PROGRAM)
    yield made
    made.close()


def growing_waits_s() -> Iterator[float]:
    """Timeouts for a child that has started; on a busy machine it may have said nothing in the first ones."""
    return (0.1 * 2**n for n in count())


def is_running(process: int) -> bool:
    return process in running_processes()


def test_one_child_answers_call_after_call(child: Child) -> None:
    events: list[Mapping[str, Any]] = []
    first = child.call("double", {"n": 1}, PAYLOAD, on_event=lambda event: events.append(event.content))
    assert first.payload == 2 * PAYLOAD
    assert events == [{"stage": "doubling", "done": 0, "of": 0}, {"stage": "doubling", "done": 1, "of": 1}]
    assert child.call("double", {"n": 2}).content == {"of": 2, "pid": child.pid}
    assert first.content["pid"] == child.pid


def test_errors_come_back_by_their_names(child: Child) -> None:
    with pytest.raises(NarrowError, match=r"^the file is wrong$"):
        child.call("refuse", {"path": "/private/file"})
    assert child.call("double", {"n": 3}).content["of"] == 3  # the child goes on
    unknown = raised(Message("error", {"errors": ["ElsewhereError", "InputError", "Tts2faceError"], "message": "no"}))
    assert (type(unknown), str(unknown)) == (InputError, "no")
    assert type(raised(Message("error", {"errors": ["ElsewhereError"], "message": "no"}))) is BackendError


def test_a_child_that_dies_says_its_last_words_and_is_followed_by_another(child: Child) -> None:
    with pytest.raises(ChildEndedError, match="the process that was to die ended: out of luck; check its memory"):
        child.call("die", {})
    assert child.call("double", {"n": 4}).content["of"] == 4


def test_a_caller_who_leaves_ends_the_child(child: Child) -> None:
    processes: list[int] = []

    def leave(event: Message) -> None:
        processes.append(event.content["pid"])
        raise KeyError

    with pytest.raises(KeyError):
        child.call("sleep", {}, on_event=leave)
    assert not is_running(processes[0])
    child.call("double", {"n": 1})
    waits_s = growing_waits_s()
    while len(processes) < 2:
        with pytest.raises(ChildEndedError):
            child.call(
                "sleep", {}, on_event=lambda event: processes.append(event.content["pid"]), timeout_s=next(waits_s)
            )
    assert not is_running(processes[-1])


def test_a_child_is_closed_while_a_thread_waits_for_it() -> None:
    child, ended = Child(PROGRAM), list[Exception]()

    def wait() -> None:
        try:
            child.call("sleep", {})
        except BackendError as error:
            ended.append(error)

    thread = threading.Thread(target=wait)
    thread.start()
    eventually(lambda: child.pid is not None, 10.0)
    child.close()
    thread.join(10.0)
    assert len(ended) == 1
    with pytest.raises(BackendError, match="was closed"):
        child.call("double", {"n": 1})


def test_a_missing_tool_is_named() -> None:
    with (
        contextlib.closing(Child(Program("absent"))) as child,
        pytest.raises(BackendError, match="no installed package declares the tool 'absent'") as error,
    ):
        child.call("absent", {})
    assert not isinstance(error.value, ChildEndedError)


def test_a_child_ends_with_its_parent() -> None:
    code = (
        "from tts2face.processes.parent import Child; from tts2face.processes.program import Program;"
        f"Child(Program({PROGRAM.handlers!r}))"
        ".call('sleep', {}, on_event=lambda event: print(event.content['pid'], flush=True))"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        os.kill(parent.pid, signal.SIGKILL)
    eventually(lambda: not is_running(child), 10.0)


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGSTOP")
def test_a_stopped_child_ends_with_the_loop() -> None:
    async def stop() -> int:
        child = AsyncChild(PROGRAM)
        process: int = (await child.call("double", {"n": 1})).content["pid"]
        os.kill(process, signal.SIGSTOP)  # so that it does not see that its input ends
        return process

    process = asyncio.run(stop())
    eventually(lambda: not is_running(process), 10.0)


@pytest.mark.skipif(sys.platform == "win32", reason="limits are those of POSIX")
def test_limits_hold_and_credentials_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "hidden")
    limits = ProcessLimits(memory_bytes=2 << 30, cpu_s=20, file_bytes=1000, n_files=64)
    child = Child(Program(PROGRAM.handlers, limits))
    try:
        small = {"path": str(tmp_path / "small"), "n": 900}
        assert child.call("write", small).content == {"secret": None}
        with pytest.raises(ChildEndedError, match="File too large"):
            child.call("write", {"path": str(tmp_path / "large"), "n": 9000})
    finally:
        child.close()


def test_a_call_goes_on_with_further_inputs() -> None:
    async def numbers() -> AsyncIterator[tuple[Mapping[str, Any], bytes]]:
        for n in (1, 2, 3):
            yield {"n": n}, b""

    async def totals() -> list[int]:
        async with started(PROGRAM) as child, contextlib.aclosing(child.stream("add", {}, inputs=numbers())) as answers:
            return [answer.content["total"] async for answer in answers]

    assert asyncio.run(totals()) == [1, 3, 6, 6]


def test_asyncio_has_the_same_errors_and_ends() -> None:
    async def use() -> None:
        child = AsyncChild(PROGRAM)
        with pytest.raises(NarrowError, match="the file is wrong"):
            await child.call("refuse", {"path": "/private/file"})
        with pytest.raises(ChildEndedError, match="out of luck"):
            await child.call("die", {})
        processes: list[int] = []
        await child.call("double", {"n": 4})
        waits_s = growing_waits_s()
        while not processes:
            began = time.monotonic()
            with pytest.raises(TimeoutError):
                await child.call(
                    "sleep", {}, on_event=lambda event: processes.append(event.content["pid"]), timeout_s=next(waits_s)
                )
        assert time.monotonic() - began < 30.0
        assert not is_running(processes[0])
        assert (await child.call("double", {"n": 5})).content["of"] == 5
        task = asyncio.create_task(
            child.call("sleep", {}, on_event=lambda event: processes.append(event.content["pid"]))
        )
        while len(processes) < 2:
            await asyncio.sleep(0.05)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert not is_running(processes[1])
        await child.close()

    asyncio.run(use())


def test_handlers_are_made_of_settings() -> None:
    child = Child(Program("tests.processes.handlers:named", settings={"n_sessions": 2}))
    assert child.call("settings", {}).content == {"n_sessions": 2}
    child.close()


def test_a_child_that_ended_between_two_calls_is_followed_by_another(child: Child) -> None:
    child.call("double", {"n": 1})
    assert child.pid is not None
    os.kill(child.pid, signal.SIGKILL)
    assert child._child is not None
    child._child.wait()
    assert child.call("double", {"n": 2}).content["pid"] == child.pid


def test_one_child_works_on_several_calls_at_once() -> None:
    """Each gets its own inputs; one that is left is stopped and the others go on; their end is that of the child."""
    given: asyncio.Queue[int] = asyncio.Queue()
    released: list[float] = []

    async def numbers() -> AsyncIterator[tuple[Mapping[str, Any], bytes]]:
        while True:
            yield {"n": await given.get()}, b""

    async def use() -> None:
        child = AsyncChild(replace(PROGRAM, at_once=3), released.append)
        adding, counting = child.stream("add", {}, inputs=numbers()), child.stream("count", {})
        given.put_nowait(1)
        assert (await anext(adding)).content == {"total": 1}
        process = (await anext(counting)).content["pid"]
        assert process == child.pid == (await child.call("double", {"n": 5})).content["pid"]
        await counting.aclose()
        while not released:
            await asyncio.sleep(0.01)
        given.put_nowait(5)
        assert [answer.content["total"] async for answer in adding] == [6, 6]
        ends = [asyncio.create_task(child.call("sleep", {})) for _ in range(2)]
        await asyncio.sleep(0.1)
        with pytest.raises(ChildEndedError, match="out of luck"):
            await child.call("die", {})
        assert [type(one) for one in await asyncio.gather(*ends, return_exceptions=True)] == [ChildEndedError] * 2
        assert (await child.call("double", {"n": 6})).content["pid"] != process
        await child.close()
        assert child.pid is None

    asyncio.run(use())


def test_a_call_that_nobody_reads_is_paused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(async_parent, "PAUSE_BYTES", 3 << 20)

    async def use() -> None:
        child = AsyncChild(replace(PROGRAM, at_once=2))
        async with contextlib.aclosing(child.stream("count", {})) as messages:
            await anext(messages)
            (call,) = child._running._calls.values()  # type: ignore[union-attr]
            before = -1
            while before != call.n_bytes or not call.is_paused:
                before = call.n_bytes
                await asyncio.sleep(0.1)
            assert call.n_bytes < 64 << 20
            assert [(await anext(messages)).content["number"] for _ in range(100)] == list(range(1, 101))
        await child.close()

    asyncio.run(use())
