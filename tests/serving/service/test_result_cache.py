"""Finished results on disk: hits, completeness, budget, and what an entry depends on."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import aclosing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lexicon.errors import BackendError
from tts2face.processes.message import EVENT, RESULT, Message
from tts2face.serving.service.messages import QUALITY, Work
from tts2face.serving.service.result_cache import ResultCache, work_hash
from tts2face.storage.temporary import NAME_INFIX

END = Message(RESULT, {"seconds": 1.0})
HELLO = Work(request={"text": "Hello."}, models={"talker": "grid_s1"})


def result(size: int = 4) -> list[Message]:
    return [Message(EVENT, {"seconds": 0.5, "event": {}}), Message(EVENT, {"seconds": 0.5}, bytes(size)), END]


class Maker:
    """Makes a result and counts how often."""

    def __init__(self, messages: list[Message], *, fails: bool = False) -> None:
        self.messages, self.fails, self.n_made = messages, fails, 0

    async def make(self) -> AsyncIterator[Message]:
        self.n_made += 1
        for message in self.messages:
            yield message
        if self.fails:
            raise BackendError("failed")


def read(cache: ResultCache, work: Work, maker: Maker, *, most: int | None = None) -> list[Message]:
    """Messages of a work, or the first ones of a client that leaves."""

    async def run() -> list[Message]:
        found: list[Message] = []
        async with aclosing(cache.messages(work, maker.make())) as messages:  # type: ignore[type-var]
            async for message in messages:
                found.append(message)
                if len(found) == most:
                    break
        return found

    return asyncio.run(run())


def test_a_second_request_gets_the_same_messages_without_work(tmp_path: Path) -> None:
    cache, maker = ResultCache(tmp_path, 4000), Maker(result())
    first, second = read(cache, HELLO, maker), read(cache, HELLO, maker)
    assert first == second == result()
    assert (maker.n_made, cache.n_hits, cache.n_misses) == (1, 1, 1)
    assert read(ResultCache(tmp_path, 4000), HELLO, maker) == first  # of a new server
    assert maker.n_made == 1


@pytest.mark.parametrize("how", ["left", "failed"])
def test_a_result_that_is_not_complete_is_not_kept(tmp_path: Path, how: str) -> None:
    cache = ResultCache(tmp_path, 4000)
    if how == "left":
        read(cache, HELLO, Maker(result()), most=2)
    else:
        with pytest.raises(BackendError, match="failed"):
            read(cache, HELLO, Maker(result()[:2], fails=True))
    assert list(tmp_path.iterdir()) == []
    maker = Maker(result())
    read(cache, HELLO, maker)
    assert maker.n_made == 1


def test_a_movie_of_less_quality_is_not_kept_and_what_is_kept_serves_all(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path, 4000)
    lowered = Message(EVENT, {"seconds": 0.0, "event": {"type": QUALITY, "has_all_samples": False, "frame_step": 1}})
    first, *rest = result()
    assert read(cache, HELLO, Maker([first, lowered, *rest])) == [first, lowered, *rest]
    assert list(tmp_path.iterdir()) == []
    read(cache, HELLO, Maker(result()))
    maker = Maker(result())
    assert read(cache, replace(HELLO, keeps_pace=True), maker) == result()
    assert maker.n_made == 0


def test_the_least_recently_used_entries_are_removed(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path, 4000)
    works = [Work(request={"text": f"{number}."}) for number in range(5)]
    makers = [Maker(result(600)) for _ in works]
    for number in range(4):
        read(cache, works[number], makers[number])
    read(cache, works[0], makers[0])
    read(cache, works[4], makers[4])
    assert cache.n_bytes == sum(path.stat().st_size for path in tmp_path.iterdir()) <= 4000
    for number in (0, 4, 1):
        read(cache, works[number], makers[number])
    assert [maker.n_made for maker in makers] == [1, 2, 1, 1, 1]


def test_a_large_result_does_not_displace_all_others(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path, 4000)
    read(cache, HELLO, Maker(result(2000)))
    assert list(tmp_path.iterdir()) == []


def test_remains_of_a_server_that_ended_are_removed(tmp_path: Path) -> None:
    (tmp_path / f".new{NAME_INFIX}0123").write_bytes(b"begun")
    assert ResultCache(tmp_path, 4000).n_bytes == 0
    assert list(tmp_path.iterdir()) == []


def test_an_entry_that_another_server_removed_is_made_again(tmp_path: Path) -> None:
    cache, maker = ResultCache(tmp_path, 4000), Maker(result())
    read(cache, HELLO, maker)
    next(tmp_path.iterdir()).unlink()
    assert read(cache, HELLO, maker) == result()
    assert maker.n_made == 2


@pytest.mark.parametrize(
    "other",
    [
        {"request": {"text": "Hello!"}},
        {"request": {"text": "Hello.", "seed": 1}},
        {"format": "webm"},
        {"picture": {"size": "64x64"}},
        {"models": {"talker": "grid_s1", "identity": "kofi"}},
        {"kind": "speech"},
    ],
)
def test_every_part_of_a_work_counts(other: dict[str, Any]) -> None:
    assert work_hash(Work(**{"request": HELLO.request, "models": HELLO.models, **other})) != work_hash(HELLO)
    assert work_hash(Work(request=dict(HELLO.request), models=dict(HELLO.models))) == work_hash(HELLO)


def test_the_content_of_a_file_counts_and_its_path_does_not(tmp_path: Path) -> None:
    first, same, other = (tmp_path / name for name in ("a.wav", "b.wav", "c.wav"))
    for path, content in ((first, b"1"), (same, b"1"), (other, b"2")):
        path.write_bytes(content)
    hashes = [work_hash(Work(request={"audio": str(path)})) for path in (first, same, other)]
    assert hashes[0] == hashes[1] != hashes[2]


def test_a_model_file_that_was_replaced_counts(tmp_path: Path) -> None:
    model = tmp_path / "me.talker"
    model.write_bytes(b"1")
    before = work_hash(Work(models={"talker": str(model)}))
    model.write_bytes(b"12")
    assert work_hash(Work(models={"talker": str(model)})) != before
