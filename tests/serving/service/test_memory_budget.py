"""Sessions of a process within a memory budget."""

import gc
import subprocess
import sys
from typing import Any

import pytest

from tts2face.session import session_cache
from tts2face.session.named_models import Models
from tts2face.session.session_cache import SessionCache

MB = 1_000_000


class FakeSession:
    """A session that takes 100 MB while anything holds it; it holds itself in a circle, as sessions do."""

    alive: "set[int]" = set()  # noqa: RUF012 - of the class

    def __init__(self, talker: str, *_: Any, **__: Any) -> None:
        self.talker, self.itself = talker, self
        FakeSession.alive.add(id(self))

    def __del__(self) -> None:
        FakeSession.alive.discard(id(self))


@pytest.fixture(scope="module")
def few_objects() -> None:
    """Python's collector leaves out the objects of all other tests, through which it looks for 0.3 s each time."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def memory(few_objects: None, monkeypatch: pytest.MonkeyPatch) -> None:
    FakeSession.alive.clear()
    monkeypatch.setattr("tts2face.session.session.Session", FakeSession)
    monkeypatch.setattr(session_cache, "resident_bytes", lambda: 100 * MB * len(FakeSession.alive))


@pytest.mark.usefixtures("memory")
@pytest.mark.parametrize(("max_mb", "kept"), [(None, 4), (1000, 4), (250, 2), (100, 1), (1, 1)])
def test_sessions_beyond_the_budget_are_released(max_mb: int | None, kept: int) -> None:
    cache = SessionCache(4, max_bytes=None if max_mb is None else max_mb * MB)
    for name in ("a", "b", "c", "d"):
        assert cache.get(Models(talker=name)).talker == name  # type: ignore[comparison-overlap]
    assert len(FakeSession.alive) == kept


@pytest.mark.usefixtures("memory")
def test_the_least_recently_used_session_is_released_first() -> None:
    cache = SessionCache(4, max_bytes=250 * MB)
    first = id(cache.get(Models(talker="a")))
    second = id(cache.get(Models(talker="b")))
    cache.get(Models(talker="a"))
    cache.get(Models(talker="c"))
    assert first in FakeSession.alive
    assert second not in FakeSession.alive


def test_the_memory_of_a_process_is_measured() -> None:
    """In a new process, which has no free memory to use again."""
    code = """
from tts2face.session.session_cache import resident_bytes
before = resident_bytes()
block = bytearray(b"x" * 50_000_000)
print(before, resident_bytes() - before)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    before, more = map(int, done.stdout.split())
    assert before == 0 or more > 40 * MB
