"""Calls of a session for event loops: the same results, while the loop goes on, and an end with their task."""

import asyncio
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tts2face
from lexicon.errors import InputError
from tests.world import World
from tts2face.session.asynchronous import iterate

TEXT = "We were away. Bob may move."
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def session(world: World) -> tts2face.Session:
    return world.session()


def test_results_are_those_of_the_other_calls(session: tts2face.Session, tmp_path: Path) -> None:
    async def run() -> tuple[Any, ...]:
        clip = await session.aclip(TEXT)
        pieces = [piece.text async for piece in session.astream(TEXT)]
        chunks = [chunk.content async for chunk in session.astream_file(TEXT, "wav")]
        await session.awrite(TEXT, tmp_path / "a", size="16x16", fps=10)
        await session.aexport(TEXT, tmp_path / "a.csv")
        return clip, pieces, chunks

    clip, pieces, chunks = asyncio.run(run())
    np.testing.assert_array_equal(clip.motion.values, session.clip(TEXT).motion.values)
    assert pieces == ["We were away.", "Bob may move."]
    assert b"".join(chunks) == b"".join(chunk.content for chunk in session.stream_file(TEXT, "wav"))
    session.export(TEXT, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert len(list((tmp_path / "a").glob("*.png"))) > 10


def test_errors_are_those_of_the_other_calls(session: tts2face.Session) -> None:
    with pytest.raises(InputError, match="there is no style 'purple'"):
        asyncio.run(session.aclip(TEXT, style="purple"))


def test_synthesis_ends_with_its_task(session: tts2face.Session, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sentence in work is finished, those behind it are not begun."""
    begun, goes_on, has_ended = threading.Event(), threading.Event(), threading.Event()
    made: list[int] = []

    def stream(*_: Any, **__: Any) -> Iterator[Any]:
        try:
            for number in range(100):
                made.append(number)
                begun.set()
                goes_on.wait(PATIENCE_S)
                yield number
        finally:
            has_ended.set()

    async def run() -> None:
        task = asyncio.create_task(session.aclip(TEXT))
        await asyncio.to_thread(begun.wait, PATIENCE_S)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        goes_on.set()
        assert await asyncio.to_thread(has_ended.wait, PATIENCE_S)

    monkeypatch.setattr(session, "stream", stream)
    asyncio.run(run())
    assert made == [0]


def test_a_cancelled_film_leaves_no_file(session: tts2face.Session, tmp_path: Path) -> None:
    async def run() -> None:
        task = asyncio.create_task(session.awrite(TEXT * 20, tmp_path / "a.mp4", size="16x16"))
        while not any(tmp_path.iterdir()):
            await asyncio.sleep(0.01)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(run())  # waits for the threads of the loop
    assert list(tmp_path.iterdir()) == []


def test_an_item_is_made_while_the_one_before_it_is_used() -> None:
    made: list[int] = []

    def numbers() -> Iterator[int]:
        for number in range(3):
            made.append(number)
            yield number

    async def run() -> list[int]:
        found = []
        async for number in iterate(numbers):
            while len(made) < min(number + 2, 3):
                await asyncio.sleep(0.001)
            found.append(number)
        return found

    assert asyncio.run(run()) == [0, 1, 2]
