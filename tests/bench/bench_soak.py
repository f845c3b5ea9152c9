"""A month of a service in an hour: mixed requests at the limit, clients that vanish, and attacks on what it needs.

``PYTHONPATH=. python tests/bench/bench_soak.py --requests 20000``, as root on Linux for all attacks: synthesis
processes and workers are killed, the data folder is filled (it lies on a file system of its own), the clock of the
server goes back by an hour (with a C compiler), the database is away for a minute (with PostgreSQL). What cannot be
done here is said and left out. `tests/serving/work/server/test_soak.py` is a short run of the same.
Memory, threads, descriptors and temporary files at the end are compared with those after 1,000 requests, before the
attacks; every job that was accepted has ended once and its webhook has come, and no log line is a defect.
"""

import argparse
import asyncio
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.bench.soak_traffic import AT_ONCE, CUT, KINDS, LONG, Soak, client_of, drive
from tests.running import ServeProcess, eventually
from tests.serving.service.receiver import Receiver
from tests.serving.work.conftest import Postgres
from tests.serving.work.watch import StoreWatch, ends_of_jobs
from tests.started import children

MAX_GROWTH = 0.05
KEEP_ALIVE_S, WAIT_S = 1.0, 240.0
DISK_MB, AWAY_S = 700, 60.0
N_WARM = 1_000
CLOCK = Path(__file__).with_name("shifted_clock.c")


@dataclass(frozen=True, slots=True)
class Usage:
    """What a server and its processes hold."""

    server_bytes: int
    process_bytes: int
    n_threads: int
    n_descriptors: int
    n_processes: int
    n_temporary: int


@dataclass(frozen=True, slots=True)
class Report:
    """What a run has found."""

    statuses: Counter[tuple[str, int]]
    states: Counter[str]  # of the jobs, with their errors
    found: dict[str, str]  # by attack
    before: Usage
    after: Usage

    def rows(self) -> Iterator[tuple[str, float, float]]:
        """Name of a quantity, its value after the warm part, and at the end."""
        for one in fields(Usage):
            scale = 1e-6 if one.name.endswith("_bytes") else 1
            yield one.name, scale * getattr(self.before, one.name), scale * getattr(self.after, one.name)


@contextmanager
def file_system() -> Iterator[Path]:
    """A folder on a file system of its own that can be filled; without the right to mount, one that cannot."""
    folder = Path(tempfile.mkdtemp(prefix="tts2face-soak-"))
    mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", str(folder)]
    is_mounted = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    try:
        yield folder
    finally:
        if is_mounted:
            subprocess.run(["umount", "-l", str(folder)], check=False)
        shutil.rmtree(folder, ignore_errors=True)


def shifted_clock(folder: Path) -> dict[str, str]:
    """Variables of processes whose clock `turn_back` sets; none without a compiler."""
    library, shift = folder / "clock.so", folder / "clock.shift"
    shift.write_bytes(bytes(8))
    if not shutil.which("cc"):
        return {}
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(CLOCK), "-ldl"], check=True)
    return {"LD_PRELOAD": str(library), "SHIFT_FILE": str(shift)}


async def until(condition: Callable[[], Any], what: str) -> None:
    await asyncio.to_thread(eventually, condition, WAIT_S, what)


def kill(server: ServeProcess, word: str) -> str:
    """Kill the processes of the server with a word in their command line."""
    n_killed = 0
    for pid in children(server.process.pid):
        with suppress(OSError):
            if word in Path(f"/proc/{pid}/cmdline").read_text():
                os.kill(pid, signal.SIGKILL)
                n_killed += 1
    return f"killed {n_killed}"


async def kill_synthesis(soak: Soak, _: int) -> str:
    """Kill the synthesis processes in the middle of a clip, whose client sees that it is incomplete."""
    body = {"text": LONG, "size": "128x128"}
    async with client_of(soak) as client, client.stream("POST", "/v1/clips", json=body) as answer:
        parts = answer.aiter_bytes()
        await anext(parts)
        found = kill(soak.server, "synthesis")
        with pytest.raises(httpx.RemoteProtocolError):
            async for _ in parts:
                pass
    await until(lambda: not _missing(soak), "ready again")
    return found


async def fill_disk(soak: Soak, n: int) -> str:
    """Fill the file system, make some requests, and free it."""
    if not soak.folder.is_mount():
        return "left out: it needs the right to mount"
    path = soak.folder / "full"
    with path.open("wb") as file, suppress(OSError):
        while True:
            file.write(bytes(1 << 20))
    await until(lambda: _missing(soak) >= {"data", "temporary"}, "missing the disk")
    await drive(soak, n)
    path.unlink()
    await until(lambda: not _missing(soak), "ready again")
    return "full"


async def turn_back(soak: Soak, _: int) -> str:
    """Set the server's clock back by an hour."""
    if not (soak.folder / "clock.so").exists():
        return "left out: there is no C compiler"
    with (soak.folder / "clock.shift").open("r+b") as file:
        file.write((-3600).to_bytes(8, "little", signed=True))
    return "an hour back"


async def kill_worker(soak: Soak, _: int) -> str:
    """Kill the worker while it has a job."""
    async with client_of(soak) as client:
        while not (await client.get("/v1/jobs", params={"state": "running"})).json()["jobs"]:
            await soak.one(client, "job")
    return kill(soak.server, "tts2face.serving.work.worker")


async def stop_database(soak: Soak, n: int) -> str:
    """Stop the database while jobs wait: streams go on, jobs are refused, and those that wait end well."""
    postgres = soak.postgres
    if postgres is None:
        return "left out: it needs PostgreSQL"
    async with client_of(soak) as client:
        for _ in range(6):
            await soak.one(client, "job")
        job = f"/v1/jobs/{soak.jobs[-1]}"
        async with client.stream("GET", f"{job}/events") as events:
            await asyncio.to_thread(postgres.stop)
            began = time.monotonic()
            await until(lambda: _missing(soak) == {"database"}, "missing the database")
            assert (await client.get("/healthz")).status_code == 200
            refused = await client.post("/v1/jobs", json={"kind": "clip", "request": {"text": "Now."}})
            assert (refused.status_code, refused.json()["error"]["code"]) == (503, "unavailable")
            assert int(refused.headers["retry-after"]) > 0
            assert "127.0.0.1" not in refused.text
            assert (await client.post(f"{job}/cancel")).status_code == (await client.get("/v1/jobs")).status_code == 503
            while time.monotonic() < began + soak.away_s:
                assert (await client.post("/v1/clips", json={"text": "A stream."})).status_code == 200
                await drive(soak, n)
            await asyncio.to_thread(postgres.start)
            seconds = time.monotonic() - began
            assert '"state": "done"' in "".join([line async for line in events.aiter_lines()])
    await until(lambda: not _missing(soak), "ready again")
    return f"away for {seconds:.0f} s"


ATTACKS: Mapping[str, Callable[[Soak, int], Awaitable[str]]] = {  # on a soak, with a number of requests meanwhile
    "synthesis processes": kill_synthesis, "disk": fill_disk, "clock": turn_back, "worker": kill_worker,
    "database": stop_database,
}  # fmt: skip


def _missing(soak: Soak) -> set[str]:
    """What `/readyz` names as missing; it answers 200 where there is nothing that streams need."""
    answer = httpx.get(f"{soak.server.url}/readyz", timeout=60)
    missing = {name for name, is_there in answer.json()["checks"].items() if not is_there}
    assert (answer.status_code == 200) == (missing <= {"database", "workers"})
    return missing


def states_of_jobs(soak: Soak) -> Counter[str]:
    """States and errors of all accepted jobs when none is open any more, and their webhooks have come."""
    states, left = Counter[str](), set(soak.jobs)
    with httpx.Client(base_url=soak.server.url, timeout=60) as client:

        def have_ended() -> bool:
            for job in sorted(left):
                one = client.get(f"/v1/jobs/{job}").json()
                if one["state"] not in {"waiting", "running"}:
                    states[f"{one['state']}: {one['error']}" if one["error"] else one["state"]] += 1
                    left.remove(job)
            return not left

        eventually(have_ended, WAIT_S, lambda: f"jobs have not ended: {left}")
    told = soak.receiver.messages
    eventually(lambda: {name for name, _ in told} >= set(soak.jobs), WAIT_S, "webhooks have not come")
    assert soak.receiver.wrong == []
    return states


def usage(soak: Soak) -> Usage:
    """What the server holds when no work runs or waits, and connections and their threads have ended."""
    quiet = {"tts2face_waiting 0.0", "tts2face_load 0.0"}
    eventually(lambda: quiet <= set(httpx.get(f"{soak.server.url}/metrics").text.splitlines()), 120.0)
    time.sleep(KEEP_ALIVE_S)
    looks: list[Usage] = []

    def is_steady() -> bool:
        looks.append(_look(soak))
        return len(looks) > 4 and all(_counts(one) == _counts(looks[-1]) for one in looks[-4:])

    eventually(is_steady, 60.0, "numbers of threads and descriptors are not steady")
    return looks[-1]


def _counts(one: Usage) -> tuple[int, ...]:
    return (one.n_threads, one.n_descriptors, one.n_processes, one.n_temporary)


def _look(soak: Soak) -> Usage:
    own = children(soak.server.process.pid)
    every = [Path(f"/proc/{pid}") for pid in (soak.server.process.pid, *own)]
    pages = [int((one / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") for one in every]
    return Usage(
        pages[0], sum(pages[1:]), sum(len(os.listdir(one / "task")) for one in every),
        sum(len(os.listdir(one / "fd")) for one in every), len(own),
        sum(len(folders) + len(files) for _, folders, files in os.walk(soak.folder / "tmp")),
    )  # fmt: skip


async def attacked(soak: Soak, n: int, attacks: Sequence[str]) -> dict[str, str]:
    """Make requests in equal parts, each with an attack meanwhile; what became of the attacks."""
    found, part = {}, n // (len(attacks) + 1)
    for name in attacks:
        found[name], _ = await asyncio.gather(ATTACKS[name](soak, max(part // 10, len(KINDS))), drive(soak, part))
        print(f"  {name}: {found[name]}", flush=True)
    await drive(soak, part)
    return found


def run_soak(
    n_requests: int, *, n_warm: int, postgres: Postgres | None, processes: int = 1, away_s: float = AWAY_S,
    attacks: Sequence[str] = tuple(ATTACKS),
) -> Report:  # fmt: skip
    """Make mixed requests, attack the service meanwhile, and look whether it has kept its word."""
    with ExitStack() as stack:
        folder, receiver = stack.enter_context(file_system()), stack.enter_context(Receiver(n_refused=1))
        (folder / "tmp").mkdir()
        database = str(folder / "jobs.sqlite") if postgres is None else postgres.database()
        settings = {"KEEP_ALIVE_S": str(KEEP_ALIVE_S), "DATA": str(folder / "data"), "DATABASE": database,
                    "STORE": str(folder / "store")}  # fmt: skip
        environment = receiver.environment | {f"TTS2FACE_SERVE_{name}": value for name, value in settings.items()}
        server = ServeProcess(
            processes=processes, environment=environment | {"TMPDIR": str(folder / "tmp")} | shifted_clock(folder)
        )
        stack.callback(server.close)
        server.wait_until_ready()
        watch = stack.enter_context(StoreWatch(folder / "store"))
        soak = Soak(server, folder, receiver, postgres, away_s)
        asyncio.run(drive(soak, n_warm))
        states_of_jobs(soak)
        before = usage(soak)
        found = asyncio.run(attacked(soak, n_requests, attacks))
        states = states_of_jobs(soak)
        after = usage(soak)
        assert watch.n_twice == 0
        check_ends(soak, *ends_of_jobs(database))
    check_log(server, postgres)
    return Report(soak.statuses, states, found, before, after)


def check_ends(soak: Soak, ends: Mapping[str, int], results: Mapping[str, int]) -> None:
    """Each job that was accepted has ended once and has its results.

    There may be others: the database may stop between the entry of a job and the answer, which is 503 then.
    """
    assert {job: n for job, n in ends.items() if n != 1} == {}
    assert set(soak.jobs) - ends.keys() == set()
    assert len(ends.keys() - set(soak.jobs)) <= soak.statuses["job", 503]
    assert results.keys() == ends.keys()


def check_log(server: ServeProcess, postgres: Postgres | None) -> None:
    """No line is a defect; the outage of the database is two lines, and the incomplete clip one with its reason."""
    names = [event["event"] for event in server.events()]
    assert "defect" not in names
    assert "Traceback" not in "".join(server.lines)
    if postgres is not None:
        assert [one for one in names if one.startswith("jobs ")] == ["jobs not available", "jobs available"]
    ends = [(one["status"], one["code"]) for one in server.events() if one["event"] == "request"]
    assert (200, "unavailable") in ends


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--requests", type=int, default=20_000)
    parser.add_argument("--processes", type=int, default=2)
    chosen = parser.parse_args()
    postgres, began = None, time.monotonic()
    with suppress(pytest.skip.Exception):
        postgres = Postgres()
    try:
        report = run_soak(
            chosen.requests, n_warm=min(N_WARM, chosen.requests // 2), postgres=postgres, processes=chosen.processes
        )
    finally:
        if postgres is not None:
            postgres.remove()
    print(f"\n{sum(report.statuses.values())} requests in {time.monotonic() - began:.0f} s")
    print("statuses:", {f"{name} {status}": n for (name, status), n in sorted(report.statuses.items())})
    print("jobs:", dict(report.states))
    print("\n| quantity | before the attacks | at the end | change |\n| --- | --- | --- | --- |")
    for name, before, after in report.rows():
        change = (after - before) / before if before else float(after > 0)
        print(f"| {name} | {before:.0f} | {after:.0f} | {100 * change:+.1f} % |{' **grown**' * (change > MAX_GROWTH)}")
    check(report)


def check(report: Report) -> None:
    """Every answer is one of the expected ones, and every job is done."""
    allowed = {name: statuses for name, (_, _, statuses) in KINDS.items()}
    wrong = {(name, status) for name, status in report.statuses if status not in allowed[name] | {CUT}}
    assert not wrong, wrong
    n_cut = sum(n for (_, status), n in report.statuses.items() if status == CUT)
    assert n_cut <= AT_ONCE, "more were cut than ran when the synthesis processes were killed"
    assert report.states.keys() == {"done"}, report.states


if __name__ == "__main__":
    main()
