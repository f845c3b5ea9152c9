"""A month of a service in an hour: mixed requests at the limit, clients that vanish, and disturbances.

``PYTHONPATH=. python tests/bench/bench_soak.py --requests 20000``, as root on Linux for all disturbances: synthesis
processes and workers are killed, the data folder is filled (it lies on a file system of its own), the clock of the
server goes back by an hour (with a C compiler), the database is away for a while (with ``--database postgresql://...``
and ``--stop``, ``--start``: commands that stop and start it). What cannot be done here is said and left out.

Memory, threads, descriptors and temporary files at the end are compared with those after a twentieth of the requests;
every job that was accepted must have ended, and no log line may be a defect.
"""

import argparse
import asyncio
import base64
import json
import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import websockets

from tests.running import ServeProcess
from tests.service.server.test_load import LONG, Usage, usage, wait_until_idle
from tests.started import children, running_processes

SEED, AT_ONCE, MAX_GROWTH = 1, 24, 0.05
KEEP_ALIVE_S = 1.0
DISK_MB, AWAY_S = 700, 60.0
ALLOWED = {200, 202, 400, 404, 422, 429, 503}  # 503 while the disk is full or the database away
Client = httpx.AsyncClient


@dataclass(slots=True)
class Soak:
    """A run: the server, what it answered, and the jobs that it has accepted."""

    url: str
    rng: random.Random = field(default_factory=lambda: random.Random(SEED))
    statuses: Counter[tuple[str, int]] = field(default_factory=Counter)
    jobs: list[str] = field(default_factory=list)

    async def one(self, client: Client) -> None:
        """One request, drawn from `KINDS`; a client that vanishes has the status 0."""
        name = self.rng.choices(list(KINDS), [share for share, _ in KINDS.values()])[0]
        try:
            status = await KINDS[name][1](self, client)
        except (httpx.HTTPError, OSError, websockets.WebSocketException) as error:
            status = -1
            print(f"  {name}: {type(error).__name__}", flush=True)
        self.statuses[name, status] += 1


async def _speech(soak: Soak, client: Client) -> int:
    body = {"input": soak.rng.choice(["Yes.", "Hello there.", "We may."]), "model": "tts-1", "voice": "alloy"}
    return (await client.post("/v1/audio/speech", json=body)).status_code


async def _curves(soak: Soak, client: Client) -> int:
    text = f"Number {soak.rng.randrange(10**6)} is here."  # not one that the server remembers
    return (await client.post("/v1/clips", json={"text": text, "format": "curves"})).status_code


async def _film(soak: Soak, client: Client) -> int:
    return (await client.post("/v1/clips", json={"text": "We may.", "size": "64x64"})).status_code


async def _headtts(soak: Soak, client: Client) -> int:
    return (await client.post("/v1/synthesize", json={"input": "Hello.", "voice": "af_bella"})).status_code


async def _wrong(soak: Soak, client: Client) -> int:
    body = soak.rng.choice([b"{", b'{"text": 3}', b'{"text": "a", "rate": 9}', b"\xff"])
    return (await client.post("/v1/clips", content=body, headers={"content-type": "application/json"})).status_code


async def _vanish(soak: Soak, client: Client) -> int:
    with suppress(TimeoutError):
        async with asyncio.timeout(soak.rng.uniform(0.05, 1.5)):
            await client.post("/v1/clips", json={"text": LONG, "size": "128x128"})
    return 0


async def _live(soak: Soak, client: Client) -> int:
    async with websockets.connect(soak.url.replace("http", "ws", 1) + "/v1/stream", max_size=None) as socket:
        await socket.send(json.dumps({"type": "start"}))
        await socket.send(json.dumps({"type": "text", "text": "We may."}))
        with suppress(TimeoutError):
            async with asyncio.timeout(soak.rng.uniform(0.2, 2.0)):
                async for _ in socket:
                    pass
    return 200


async def _job(soak: Soak, client: Client) -> int:
    subtitles = base64.b64encode(b"1\n00:00:00,500 --> 00:00:02,000\nWe may.\n").decode()
    request = {"text": "We may.", "format": "mp3"} if soak.rng.random() < 0.7 else {"subtitles": subtitles}
    if "subtitles" in request:
        files = {"subtitles": ("a.srt", base64.b64decode(subtitles))}
        order = {"kind": "subtitles", "request": {"format": "mp4", "size": "64x64"}}
        answer = await client.post("/v1/jobs", data={"job": json.dumps(order)}, files=files)
    else:
        answer = await client.post("/v1/jobs", json={"kind": "clip", "request": request})
    if answer.status_code == 202:
        soak.jobs.append(answer.json()["id"])
    return answer.status_code


KINDS: Mapping[str, tuple[float, Callable[[Soak, Client], Awaitable[int]]]] = {  # shares of the requests
    "speech": (0.4, _speech), "curves": (0.15, _curves), "film": (0.05, _film), "headtts": (0.1, _headtts),
    "wrong": (0.1, _wrong), "vanish": (0.1, _vanish), "live": (0.05, _live), "job": (0.05, _job),
}  # fmt: skip


async def drive(soak: Soak, n: int) -> None:
    """Make some requests, `AT_ONCE` of them at the same time."""
    limits = httpx.Limits(max_connections=AT_ONCE, max_keepalive_connections=0)
    async with Client(base_url=soak.url, limits=limits, timeout=300) as client:
        left = iter(range(n))

        async def go_on() -> None:
            for _ in left:
                await soak.one(client)

        await asyncio.gather(*(go_on() for _ in range(AT_ONCE)))


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


def processes(server: ServeProcess, word: str) -> list[int]:
    """Processes of the server with a word in their command line."""
    found = []
    for pid in children(server.process.pid):
        with suppress(OSError):
            found += [pid] if word in Path(f"/proc/{pid}/cmdline").read_text() else []
    return found


def kill(server: ServeProcess, word: str) -> str:
    """Kill one of these processes."""
    found = processes(server, word)
    for pid in found[:1]:
        os.kill(pid, signal.SIGKILL)
    return f"killed {len(found[:1])} of {len(found)}"


async def fill(folder: Path, soak: Soak, n: int) -> str:
    """Fill the file system, make some requests, and free it."""
    if not folder.is_mount():
        return "left out: it needs the right to mount"
    path = folder / "full"
    with path.open("wb") as file, suppress(OSError):
        while True:
            file.write(bytes(1 << 20))
    await drive(soak, n)
    path.unlink()
    return f"full for {n} requests"


async def take_away(commands: Sequence[str], soak: Soak, n: int) -> str:
    """Stop the database, make some requests, and start it again."""
    if not all(commands):
        return "left out: give --stop and --start"
    subprocess.run(commands[0], shell=True, check=True)
    began = time.monotonic()
    await drive(soak, n)
    await asyncio.sleep(max(AWAY_S - (time.monotonic() - began), 0.0))
    subprocess.run(commands[1], shell=True, check=True)
    return f"away for {time.monotonic() - began:.0f} s"


# Of the clock that can be set, and not of the monotonic one; libfaketime makes sleeping fail where that one goes on.
SHIFTED_CLOCK = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>

static int (*original)(clockid_t, struct timespec *);
static const volatile long *shift_s;

int clock_gettime(clockid_t clock, struct timespec *now) {
    if (!original) {
        shift_s = mmap(0, sizeof(long), PROT_READ, MAP_SHARED, open(getenv("SHIFT_FILE"), O_RDONLY), 0);
        original = dlsym(RTLD_NEXT, "clock_gettime");
    }
    int failed = original(clock, now);
    if (!failed && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) now->tv_sec += *shift_s;
    return failed;
}

int gettimeofday(struct timeval *now, void *zone) {
    struct timespec precise;
    int failed = clock_gettime(CLOCK_REALTIME, &precise);
    now->tv_sec = precise.tv_sec, now->tv_usec = precise.tv_nsec / 1000;
    return failed;
}

time_t time(time_t *seconds) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return seconds ? *seconds = now.tv_sec : now.tv_sec;
}
"""


def shifted_clock(folder: Path) -> dict[str, str]:
    """Variables of processes whose clock `turn_back` sets; none without a compiler."""
    library, (source, shift) = folder / "clock.so", (folder / "clock.c", folder / "clock.shift")
    source.write_text(SHIFTED_CLOCK)
    shift.write_bytes(bytes(8))
    if not shutil.which("cc"):
        return {}
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"], check=True)
    return {"LD_PRELOAD": str(library), "SHIFT_FILE": str(shift)}


def turn_back(folder: Path) -> str:
    """Set the server's clock back by an hour."""
    if not (folder / "clock.so").exists():
        return "left out: there is no C compiler"
    with (folder / "clock.shift").open("r+b") as file:
        file.write((-3600).to_bytes(8, "little", signed=True))
    return "an hour back"


def end_of_jobs(soak: Soak, seconds: float) -> Counter[str]:
    """States and errors of all accepted jobs when none is open any more."""
    deadline, states = time.monotonic() + seconds, Counter[str]()
    with httpx.Client(base_url=soak.url, timeout=60) as client:
        while time.monotonic() < deadline:
            found = [client.get(f"/v1/jobs/{job}").json() for job in soak.jobs]
            states = Counter(f"{one['state']}: {one['error']}" if one["error"] else one["state"] for one in found)
            if not {one["state"] for one in found} & {"waiting", "running"}:
                break
            time.sleep(2.0)
    return states


def settled(server: ServeProcess, temporary: Path) -> tuple[Usage, int]:
    """What the server holds when it is idle, and the number of its temporary files."""
    wait_until_idle(server)
    time.sleep(KEEP_ALIVE_S + 2.0)
    return usage(server), sum(len(files) for _, _, files in os.walk(temporary))


def row(name: str, before: float, after: float) -> str:
    grown = (after - before) / before if before else float(after > 0)
    return (
        f"| {name} | {before:.0f} | {after:.0f} | {100 * grown:+.0f} % |{'' if grown <= MAX_GROWTH else ' **grown**'}"
    )


async def disturbed(soak: Soak, server: ServeProcess, folder: Path, chosen: argparse.Namespace) -> None:
    """The requests in six parts, with a disturbance after each of the first five."""
    part = chosen.requests // 6
    few = max(part // 10, AT_ONCE)
    disturbances: list[tuple[str, Callable[[], Awaitable[str] | str]]] = [
        ("synthesis process", lambda: kill(server, "synthesis")),
        ("worker", lambda: kill(server, "worker")),
        ("disk", lambda: fill(folder, soak, few)),
        ("clock", lambda: turn_back(folder)),
        ("database", lambda: take_away((chosen.stop, chosen.start), soak, few)),
    ]
    for name, disturb in disturbances:
        await drive(soak, part)
        found = disturb()
        print(f"  {name}: {found if isinstance(found, str) else await found}", flush=True)
    await drive(soak, part)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--requests", type=int, default=20_000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--database", default="", help="PostgreSQL in place of SQLite")
    parser.add_argument("--stop", default="", help="command that stops the database")
    parser.add_argument("--start", default="", help="command that starts it")
    chosen = parser.parse_args()
    with file_system() as folder:
        temporary = folder / "tmp"
        temporary.mkdir()
        server = ServeProcess(processes=chosen.processes, environment={
            "TTS2FACE_SERVE_KEEP_ALIVE_S": str(KEEP_ALIVE_S), "TTS2FACE_SERVE_DATA": str(folder / "data"),
            "TTS2FACE_SERVE_DATABASE": chosen.database, "TMPDIR": str(temporary),
            **shifted_clock(folder),
        })  # fmt: skip
        try:
            server.wait_until_ready()
            soak, began = Soak(server.url), time.monotonic()
            asyncio.run(drive(soak, chosen.requests // 20))
            before, n_before = settled(server, temporary)
            asyncio.run(disturbed(soak, server, folder, chosen))
            states = end_of_jobs(soak, 600.0)
            after, n_after = settled(server, temporary)
            defects = [event for event in server.events() if event["event"] == "defect"]
        finally:
            server.close()
    seconds = time.monotonic() - began
    print(f"\n{sum(soak.statuses.values())} requests in {seconds:.0f} s; {len(running_processes())} processes here")
    print("statuses:", {f"{name} {status}": n for (name, status), n in sorted(soak.statuses.items())})
    print("jobs:", dict(states), "defects:", len(defects))
    print("\n| quantity | after a twentieth | at the end | change |\n| --- | --- | --- | --- |")
    print(row("server MB", before.server_bytes / 1e6, after.server_bytes / 1e6))
    print(row("synthesis and workers MB", before.synthesis_bytes / 1e6, after.synthesis_bytes / 1e6))
    for name in ("n_threads", "n_files", "n_children"):
        print(row(name.removeprefix("n_"), getattr(before, name), getattr(after, name)))
    print(row("temporary files", n_before, n_after))
    wrong = {status for _, status in soak.statuses} - ALLOWED - {0}
    assert not wrong, wrong
    assert states.keys() == {"done"}, states
    assert not defects, defects[:3]


if __name__ == "__main__":
    main()
