"""Figures of jobs in a database for docs/performance.md: speed-up, overhead, many workers, idle workers, memory.

``PYTHONPATH=. python tests/bench/bench_jobs.py speed|workers|load|idle|memory [--database sqlite|postgres] [...]``.
PostgreSQL is started in a temporary folder (apt install postgresql). The workers of `workers`, `idle` and `memory` are
real ones, forked from one process after its imports, whose rendering is a sleep of `--seconds`.
"""

import argparse
import os
import signal
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from tests.bench.bench_batch import plan_of
from tests.serving.work.conftest import Postgres
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import open_store
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.engine import DatabaseEngine, enqueue, open_client
from tts2face.serving.work.local_workers import LocalWorker, LocalWorkers
from tts2face.serving.work.queue_control import list_jobs
from tts2face.serving.work.worker import Worker, poll_interval
from tts2face.serving.work.workers import BEAT_S, Workers
from tts2face.storage.sql import Database

CLOCK_TICKS = os.sysconf("SC_CLK_TCK")
SETTINGS = "-c max_connections=1200 -c shared_preload_libraries=pg_stat_statements -c shared_buffers=512MB"


class Sleeper:
    """Renders by sleeping."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    def render(self, segment: Segment, out: Path) -> SegmentResult:
        time.sleep(self._seconds)
        out.write_bytes(b"movie")
        return SegmentResult(segment.window_frames, 25.0)


def fork_worker(database: str, store: str, seconds: float) -> int:
    """A worker in a new process; its number."""
    child = os.fork()
    if child:
        return child
    try:
        os.nice(5)  # the database is measured, not the processes of this machine
        Worker(database, store, renderer=Sleeper(seconds), on_message=lambda _: None).run()
    finally:
        os._exit(0)


@contextmanager
def workers(database: str, store: Path, n_workers: int, seconds: float) -> Iterator[list[int]]:
    """Workers that are alive in the database."""
    children: list[int] = []
    try:
        with Workers(database_url(database)) as table:
            while len(children) < n_workers:  # some at a time, so that the start does not last long
                children += [
                    fork_worker(database, str(store), seconds) for _ in range(min(8, n_workers - len(children)))
                ]
                while len(table.alive()) < len(children):
                    time.sleep(0.2)
        yield children
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
        for child in children:
            os.waitpid(child, 0)


def cpu_seconds(processes: list[int]) -> float:
    """Processor time of processes and their ended children so far."""
    total = 0
    for number in processes:
        try:
            fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
        except FileNotFoundError:
            continue
        total += sum(map(int, fields[11:15]))
    return total / CLOCK_TICKS


class Load:
    """Load of a PostgreSQL server between its making and `report`."""

    def __init__(self, server: Postgres | None, database: str, children: list[int]) -> None:
        self._server, self._children = server, children
        self._connection: Any = None
        if server is not None:
            import psycopg

            self._connection = psycopg.connect(database, autocommit=True)
            self._connection.execute("CREATE EXTENSION IF NOT EXISTS pg_stat_statements")
            self._connection.execute("SELECT pg_stat_statements_reset()")
        self._began, self._at = self._sample(), time.perf_counter()

    def _sample(self) -> dict[str, float]:
        found = {"worker_cpu": cpu_seconds(self._children)}
        if self._server is not None:
            found["server_cpu"] = cpu_seconds(self._server.processes())
            found["commits"] = self.one("SELECT xact_commit FROM pg_stat_database WHERE datname = current_database()")
            found["queries"] = self.one(
                "SELECT coalesce(sum(calls), 0) FROM pg_stat_statements s JOIN pg_database d ON d.oid = s.dbid "
                "WHERE d.datname = current_database()"
            )
            found["wal"] = self.one("SELECT wal_bytes FROM pg_stat_wal")
        return found

    def one(self, query: str) -> float:
        """Number that a query gives."""
        return float(self._connection.execute(query).fetchone()[0])

    def report(self, n_jobs: int, n_statements: int = 0) -> str:
        """Figures for each second and each job."""
        ended, took = self._sample(), time.perf_counter() - self._at
        parts = [f"{took:.1f} s"]
        for name, unit in (("worker_cpu", "cores of workers"), ("server_cpu", "cores of the server")):
            if name in ended:
                parts.append(f"{(ended[name] - self._began[name]) / took:.2f} {unit}")
                if n_jobs:
                    parts.append(f"{1000 * (ended[name] - self._began[name]) / n_jobs:.1f} ms each job")
        if self._server is not None:
            used = self.one("SELECT count(*) FROM pg_stat_activity WHERE datname = current_database()")
            for name in ("commits", "queries", "wal"):
                parts.append(f"{(ended[name] - self._began[name]) / took:.0f} {name}/s")
            parts.append(f"{used - 1:.0f} connections")
            parts.append(f"{self.one('SELECT pg_database_size(current_database())') / 1e6:.1f} MB")
            for row in self._connection.execute(
                "SELECT calls, total_exec_time / calls, left(regexp_replace(query, '\\s+', ' ', 'g'), 1500) "
                "FROM pg_stat_statements ORDER BY total_exec_time DESC LIMIT %s",
                (n_statements,),
            ):
                parts.append(f"\n    {row[0]:8d} x {row[1]:7.2f} ms  {row[2]}")
        return ", ".join(parts)


def bench_workers(place: Path, database: str, server: Postgres | None, chosen: argparse.Namespace) -> None:
    """Jobs per second of many workers whose rendering is a sleep."""
    plan = plan_of(place, chosen.jobs)
    store = place / "store"
    url = database_url(database)
    with workers(database, store, chosen.workers, chosen.seconds) as children:
        began = time.perf_counter()
        with open_client(url) as client, closing(Database(url)) as table:
            enqueue(client, table, plan.segments, 10)
        print(f"queued {len(plan.segments)} in {time.perf_counter() - began:.1f} s", flush=True)
        load = Load(server, database, children)
        engine = DatabaseEngine(database, str(store), n_workers=0)
        began, ends = time.perf_counter(), []
        for one in engine.render(plan.segments, open_store(store)):
            assert one.result is not None, one.reason
            ends.append(time.perf_counter() - began)
        report = load.report(len(ends), chosen.statements)
    jobs = list_jobs(database)
    spans = sorted(one.took_s for one in jobs if one.took_s is not None)
    ideal = chosen.workers / chosen.seconds if chosen.seconds else float("inf")
    print(
        f"{chosen.workers} workers, {chosen.seconds:g} s each: {len(ends)} jobs in {ends[-1]:.1f} s = "
        f"{len(ends) / ends[-1]:.1f}/s (without a database at most {ideal:.0f}/s), held for "
        f"{statistics.median(spans):.2f} s each, {sum(one.n_tries for one in jobs) - len(jobs)} tries more than jobs; "
        f"{report}"
    )


def bench_load(place: Path, database: str, server: Postgres | None, chosen: argparse.Namespace) -> None:
    """The statements of many workers, sent by pgbench: one connection stands for a worker."""
    assert server is not None, "--database postgres"
    plan = plan_of(place, 1)
    url = database_url(database)
    with open_client(url) as client, closing(Database(url)) as table:
        enqueue(client, table, plan.segments, 10)
    fill_queue(database, chosen.jobs)
    interval = poll_interval(chosen.workers)
    share = 1.0 if not chosen.seconds else min(1.0, interval / chosen.seconds)
    values = {
        "share": round(1e6 * share),
        "beats": round(1e6 * min(1.0, (interval if chosen.seconds else 0.1) / BEAT_S)),
        "pause_us": round(1e6 * interval) if chosen.seconds else 0,
    }
    load = Load(server, database, [])
    server.run(
        "pgbench", "-n", "-M", "extended", "-h", "127.0.0.1", "-p", str(server.port), "-U", "tts2face", "-T", "30",
        "-c", str(chosen.workers), "-j", "1", *(f"-D{name}={value}" for name, value in values.items()), "-f",
        str(server.put(Path(__file__).with_name("worker_load.sql"))), database.rpartition("/")[2],
    )  # fmt: skip
    n_done = int(load.one("SELECT count(*) FROM dbos.workflow_status WHERE status = 'SUCCESS'"))
    longest = load.one("SELECT max(max_exec_time) FROM pg_stat_statements WHERE query LIKE '%SKIP LOCKED%'")
    print(
        f"pgbench as {chosen.workers} workers, a job in {chosen.seconds:g} s, looks every {interval:g} s: "
        f"{n_done / 30:.0f} jobs/s of {chosen.jobs} queued, longest claim {longest:.0f} ms; "
        f"{load.report(n_done, chosen.statements)}"
    )


def fill_queue(database: str, n_jobs: int) -> None:
    """Copies of the one queued job."""
    import psycopg

    with psycopg.connect(database, autocommit=True) as connection:
        columns = [
            row[0]
            for row in connection.execute(
                "SELECT column_name FROM information_schema.columns WHERE table_schema = 'dbos' AND table_name = %s",
                ("workflow_status",),
            )
        ]
        new = {"workflow_uuid": "md5(n::text) || md5((n + 1)::text) || '.0'", "created_at": "created_at + n"}
        chosen = ", ".join(new.get(name, name) for name in columns)
        connection.execute(
            f"INSERT INTO dbos.workflow_status ({', '.join(columns)}) SELECT {chosen} FROM dbos.workflow_status, "
            f"generate_series(1, {n_jobs}) AS n"
        )
        connection.execute(
            "INSERT INTO dbos.workflow_input (workflow_uuid, inputs) SELECT s.workflow_uuid, i.inputs "
            "FROM dbos.workflow_status s, dbos.workflow_input i ON CONFLICT DO NOTHING"
        )
        connection.execute("VACUUM ANALYZE")
        size = connection.execute("SELECT pg_database_size(current_database())").fetchone()
        print(f"{n_jobs} jobs queued: {size[0] / n_jobs if size else 0:.0f} bytes each")


def bench_idle(place: Path, database: str, server: Postgres | None, chosen: argparse.Namespace) -> None:
    """Load of workers that have nothing to do."""
    with workers(database, place / "store", chosen.workers, 0.0) as children:
        time.sleep(10.0)
        load = Load(server, database, children)
        time.sleep(20.0)
        print(f"{chosen.workers} idle workers: {load.report(0, chosen.statements)}")
        used = [int(Path(f"/proc/{one}/statm").read_text().split()[1]) * 4096 / 1e6 for one in children]
        print(f"resident memory of a worker {statistics.median(used):.0f} MB")


def bench_memory(place: Path, database: str, server: Postgres | None, chosen: argparse.Namespace) -> None:
    """Memory of one worker over many tiny jobs."""
    plan = plan_of(place, chosen.jobs)
    store = place / "store"
    url = database_url(database)
    with workers(database, store, 1, 0.0) as (child,), open_client(url) as client, closing(Database(url)) as table:
        enqueue(client, table, plan.segments, 10)
        done = 0
        while done < chosen.jobs:
            time.sleep(5.0)
            done = len(list(open_store(store).addresses()))
            resident = int(Path(f"/proc/{child}/statm").read_text().split()[1]) * 4096 / 1e6
            threads = len(list(Path(f"/proc/{child}/task").iterdir()))
            files = len(list(Path(f"/proc/{child}/fd").iterdir()))
            print(f"{done} jobs: {resident:.1f} MB, {threads} threads, {files} files", flush=True)


def bench_speed(place: Path, database: str, server: Postgres | None, chosen: argparse.Namespace) -> None:
    """Two workers on a core each against one, and what a worker does beside synthesis and rendering."""
    cores = sorted(os.sched_getaffinity(0))
    for n_workers in (1, 2) * chosen.repeats:
        folder = Path(tempfile.mkdtemp(dir=place))
        plan = plan_of(folder, chosen.jobs)
        where = str(folder / "jobs.sqlite") if server is None else server.database()
        prepare_database(database_url(where))
        children = [
            LocalWorker(LocalWorkers(where, str(folder / "store")), cores[number]) for number in range(n_workers)
        ]
        try:
            run_timed(folder, plan, where, n_workers)
        finally:
            for child in children:
                child.end()


def run_timed(folder: Path, plan: Any, database: str, n_workers: int) -> None:
    """Run a batch; the time between the first and the last end of a segment, and the renderings in it."""
    from tts2face.serving.batch.run import run_batch

    engine = DatabaseEngine(database, str(folder / "store"), n_workers=0)
    store = open_store(folder / "store")
    result = run_batch(plan, folder / "clips", store=store, engine=engine)
    assert not result.failed
    ends: dict[str, list[tuple[float, float]]] = {}
    for job in list_jobs(database):
        address = job.name.partition(".")[0]
        found = store.result(address)
        assert found is not None
        ended = (folder / "store" / address[:2] / f"{address}.json").stat().st_mtime
        ends.setdefault(job.worker, []).append((ended, found.took_s))
    spans = rendering = 0.0
    n_jobs = 0
    for of_worker in ends.values():  # from the end of its first segment to that of its last one
        of_worker.sort()
        spans += of_worker[-1][0] - of_worker[0][0]
        rendering += sum(took for _, took in of_worker[1:])
        n_jobs += len(of_worker) - 1
    first = min(of_worker[0][0] for of_worker in ends.values())
    last = max(of_worker[-1][0] for of_worker in ends.values())
    rate = (len(plan.segments) - n_workers) / (last - first)
    print(
        f"{n_workers} workers: {len(plan.segments)} segments, batch {result.took_s:.1f} s with the start of the "
        f"workers; {rate:.3f} segments/s from the first end on; rendering {rendering / n_jobs:.3f} s each, "
        f"beside it {1000 * (spans - rendering) / n_jobs:.0f} ms = {100 * (spans / rendering - 1):.1f} %",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bench", choices=("speed", "workers", "load", "idle", "memory"))
    parser.add_argument("--database", choices=("sqlite", "postgres"), default="sqlite")
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=0.0, help="of a rendering")
    parser.add_argument("--jobs", type=int, default=400)
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--statements", type=int, default=0, help="slowest statements that are printed")
    chosen = parser.parse_args()
    server = Postgres(f"{SETTINGS}") if chosen.database == "postgres" else None
    try:
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            place = Path(folder)
            database = str(place / "jobs.sqlite") if server is None else server.database()
            prepare_database(database_url(database))
            benches = {
                "speed": bench_speed,
                "workers": bench_workers,
                "load": bench_load,
                "idle": bench_idle,
                "memory": bench_memory,
            }
            benches[chosen.bench](place, database, server, chosen)
    finally:
        if server is not None:
            server.remove()


if __name__ == "__main__":
    main()
