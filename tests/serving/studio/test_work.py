"""The list of background work: limits, turns, cancelling, and what the next server goes on with."""

import asyncio
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from lexicon.errors import DataError, InputError
from tests.serving.studio.background import OWNER, settle, until
from tts2face.serving.studio.work import MAX_TRIES, BackgroundWork, WorkKind, WorkList
from tts2face.serving.work.jobs import CANCELLED, DONE, FAILED, RUNNING, WAITING


async def forever(_: BackgroundWork) -> str:
    await asyncio.Event().wait()
    raise AssertionError


async def succeed(work: BackgroundWork) -> str:
    work.show("counting", 1, 2)
    return f"made {work.content['name']}"


def make_list(folder: Path, run: Callable[[BackgroundWork], Awaitable[str]], **more: Any) -> WorkList:
    """A list with one kind of work, whose files are named like their orders."""

    def prepare(work: BackgroundWork) -> None:
        work.title, work.files = work.content["name"], (work.order.with_suffix(".made"),)

    made = WorkList(folder)
    made.register(WorkKind("thing", "*.json", run, prepare, noun="things", **more))
    return made


def add(work: WorkList, folder: Path, name: str, owner: str = OWNER) -> BackgroundWork:
    return work.add("thing", owner, folder / f"{name}.json", {"name": name})


def test_an_owner_may_have_so_many_open_and_another_one_more(tmp_path):
    async def check():
        work = make_list(tmp_path, forever, max_open=2)
        first, _ = (add(work, tmp_path, name) for name in "ab")
        with pytest.raises(InputError, match="2 things are being made already; wait, or cancel one"):
            add(work, tmp_path, "c")
        assert not (tmp_path / "c.json").exists()
        add(work, tmp_path, "d", owner="eve")
        work.cancel(first)
        add(work, tmp_path, "c")
        await work.close()

    asyncio.run(check())


def test_the_same_work_is_refused_while_it_is_open_and_done_again_later(tmp_path):
    async def check():
        work = make_list(tmp_path, succeed, busy="it is busy")
        first = add(work, tmp_path, "a")
        with pytest.raises(InputError, match="it is busy"):
            add(work, tmp_path, "a")
        await settle(first)
        second = add(work, tmp_path, "a")
        await settle(second)
        assert work.get(first.order) is second
        assert (second.state, second.message, second.share) == (DONE, "made a", 1.0)

    asyncio.run(check())


def test_so_many_run_at_once_of_each_owner_in_their_order(tmp_path):
    running: list[str] = []

    async def run(work: BackgroundWork) -> str:
        running.append(work.title)
        await asyncio.Event().wait()
        raise AssertionError

    async def check():
        work = make_list(tmp_path, run, places=2)
        made = {name: add(work, tmp_path, name) for name in "abcd"}
        other = add(work, tmp_path, "e", owner="eve")
        await until(lambda: len(running) == 3)
        assert running == ["a", "b", "e"]
        assert [one.state for one in made.values()] == [RUNNING, RUNNING, WAITING, WAITING]
        work.cancel(made["a"])
        await until(lambda: len(running) == 4)
        assert running[3] == "c"
        assert other.state == RUNNING
        await work.close()

    asyncio.run(check())


def test_listeners_of_a_kind_and_owner_learn_of_every_change(tmp_path):
    states: list[tuple[str, str, float]] = []

    async def check():
        work = make_list(tmp_path, succeed)
        work.listeners["thing", OWNER].add(lambda: states.append(shown()))

        def shown():
            (one,) = work.of("thing", OWNER)
            return one.state, one.stage, one.share

        await settle(add(work, tmp_path, "x", owner="eve"), add(work, tmp_path, "a"))

    asyncio.run(check())
    assert states == [(WAITING, "", 0.0), (RUNNING, "", 0.0), (RUNNING, "counting", 0.5), (DONE, "counting", 1.0)]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [(DataError("the file is damaged"), "the file is damaged"), (TimeoutError(), "too slow")],
)
def test_what_fails_says_why_and_leaves_no_file(tmp_path, wrong, message):
    ended: list[str] = []

    async def run(work: BackgroundWork) -> str:
        work.files[0].mkdir()
        (work.files[0] / "half").touch()
        raise wrong

    async def check():
        made = make_list(tmp_path, run, late="too slow", end=lambda work: ended.append(work.state))
        work = add(made, tmp_path, "a")
        await settle(work)
        assert (work.state, work.message) == (FAILED, message)

    asyncio.run(check())
    assert ended == [FAILED]
    assert list(tmp_path.iterdir()) == []


def test_cancelled_work_is_listed_and_removed_work_is_not(tmp_path):
    async def run(work: BackgroundWork) -> str:
        try:
            await asyncio.Event().wait()
        finally:
            work.files[0].touch()  # by a process that ends late
        raise AssertionError

    async def check():
        work = make_list(tmp_path, run, places=2)
        one, other, waiting = (add(work, tmp_path, name) for name in "abc")
        await until(lambda: other.state == RUNNING)
        work.cancel(one)
        work.remove(other)
        work.cancel(waiting)
        assert [(name.id, name.state) for name in work.of("thing", OWNER)] == [("a", CANCELLED), ("c", CANCELLED)]
        await until(lambda: one.task.done() and other.task.done())
        assert list(tmp_path.iterdir()) == []

    asyncio.run(check())


def test_work_in_a_folder_is_forgotten_with_it(tmp_path):
    async def check():
        work = make_list(tmp_path, forever, places=2)
        gone, kept = (add(work, tmp_path / name, name) for name in ("one", "other"))
        await until(lambda: gone.state == RUNNING)
        await work.forget(tmp_path / "one")
        assert gone.task.done()
        assert list((tmp_path / "one").iterdir()) == []
        assert work.of("thing", OWNER) == [kept]
        await work.close()

    asyncio.run(check())


def test_the_next_server_keeps_the_order_whatever_the_clock_was(tmp_path):
    async def begin() -> None:
        work = make_list(tmp_path, forever)
        for name in "cab":
            add(work, tmp_path, name)
        await work.close()

    async def serve() -> list[str]:
        work = make_list(tmp_path, forever)
        await work.resume()
        if not (tmp_path / "d.json").exists():
            add(work, tmp_path, "d")
        found = [one.id for one in work.of("thing", OWNER)]
        await work.close()
        return found

    asyncio.run(begin())
    tomorrow = (tmp_path / "c.json").stat().st_mtime + 86_400.0
    os.utime(tmp_path / "c.json", (tomorrow, tomorrow))  # by a clock that was a day ahead
    assert asyncio.run(serve()) == ["c", "a", "b", "d"]
    assert asyncio.run(serve()) == ["c", "a", "b", "d"]


def test_the_next_server_goes_on_and_gives_up_after_some_tries(tmp_path):
    ended: list[str] = []

    async def serve(run: Callable[[BackgroundWork], Awaitable[str]]) -> list[BackgroundWork]:
        """A server that ends while its first work runs."""
        work = make_list(tmp_path, run, end=lambda one: ended.append(f"{one.id} {one.state} {one.message}"))
        await work.resume()
        found = work.of("thing", OWNER)
        await until(lambda: all(one.state != WAITING for one in found[:1]))
        await work.close()
        return found

    async def begin() -> None:
        work = make_list(tmp_path, forever)
        add(work, tmp_path, "a")
        await until(lambda: work.get(tmp_path / "a.json").state == RUNNING)
        add(work, tmp_path, "b")
        await work.close()

    asyncio.run(begin())
    (tmp_path / "a.made").touch()
    (tmp_path / "damaged.json").write_text("{")
    for tries in range(1, MAX_TRIES):
        found = asyncio.run(serve(forever))
        assert [(one.id, one.tries) for one in found] == [("a", tries + 1), ("b", 0)]
    assert ended == []
    assert not (tmp_path / "damaged.json").exists()
    (found,) = asyncio.run(serve(succeed))
    assert (found.id, found.state) == ("b", DONE)
    assert ended == [f"a failed {MAX_TRIES} servers ended while it was made", "b done made b"]
    assert list(tmp_path.iterdir()) == []
