"""A worker without work: what it asks the database, and that it finds work nevertheless."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))

import sqlalchemy

from tests.running import eventually
from tests.serving.work.server.test_jobs import queue
from tests.serving.work.stub_worker import Stub
from tts2face.serving.batch.segment import Segment
from tts2face.serving.work import pauses, worker
from tts2face.serving.work.pauses import IDLE_S, EnginePauses

N_BEATS = 8  # while the worker has nothing to do
MAX_STATEMENTS = 12  # of the engine meanwhile, the last ones of a look; it had about 60 with each look at 0.2 s


def test_a_worker_without_work_asks_little_and_finds_new_work(
    database: str, segments: Callable[..., dict[str, Segment]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker, "BEAT_S", 0.2)
    monkeypatch.setattr(pauses, "AWAKE_S", 0.2, raising=False)
    log, statements = tmp_path / "rendered", []
    one = worker.Worker(database, str(tmp_path / "store"), renderer=Stub(log, 0.0))
    n_beats = 0

    def note(_: Any, __: Any, statement: str, *___: Any) -> None:
        if "tts2face_workers" not in statement:
            statements.append(statement)

    def look() -> bool:
        nonlocal n_beats
        n_beats += 1
        if n_beats == 10:  # the engine has started
            sqlalchemy.event.listen(sqlalchemy.Engine, "before_cursor_execute", note)
        if n_beats == 10 + N_BEATS:
            sqlalchemy.event.remove(sqlalchemy.Engine, "before_cursor_execute", note)
            queue(database, segments("Hello there."))
        return log.exists() or n_beats * 0.2 > 0.5 * IDLE_S

    one.run(look)
    assert len(statements) <= MAX_STATEMENTS, statements
    assert len(log.read_text().splitlines()) == 1


class FakeEngine:
    """An engine with one thread, whose pauses are to be 1 ms."""

    def __init__(self) -> None:
        self.background_thread_stop_events = [threading.Event()]
        self._background_jobs_stop_event = threading.Event()
        self.n_looks = 0

    def run(self) -> None:
        while not self.background_thread_stop_events[0].wait(timeout=0.001):
            self.n_looks += 1


@pytest.mark.smoke
def test_the_engine_looks_while_there_is_work_and_then_sleeps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pauses, "AWAKE_S", 0.0)
    engine, paused = FakeEngine(), EnginePauses()
    paused.install(engine)
    thread = threading.Thread(target=engine.run, daemon=True)
    with paused.busy():
        thread.start()
        eventually(lambda: engine.n_looks > 20)
    eventually(lambda: not paused.is_awake)

    def rests() -> bool:
        before = engine.n_looks
        thread.join(0.1)
        return engine.n_looks == before

    eventually(rests)
    n_looks = engine.n_looks
    monkeypatch.setattr(pauses, "AWAKE_S", 60.0)
    paused.wake()
    eventually(lambda: engine.n_looks > n_looks + 20)
    engine.background_thread_stop_events[0].set()
    thread.join(5.0)
    assert not thread.is_alive()


@pytest.mark.smoke
def test_the_engine_still_has_the_events_whose_waiting_is_replaced() -> None:
    from dbos import DBOS

    engine = DBOS(config={"name": "events", "system_database_url": "sqlite://", "run_migrations": False})
    reason = (
        "this release of dbos has no {}; tts2face.serving.work.pauses needs another way to let the engine of an idle "
        "worker sleep (decision 083)"
    )
    try:
        for name in ("background_thread_stop_events", "_background_jobs_stop_event"):
            assert hasattr(engine, name), reason.format(name)
    finally:
        DBOS.destroy()
