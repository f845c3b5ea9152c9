"""Three keys under their own load, without and with a fourth one that attacks; the memory of server and processes.

``PYTHONPATH=. python tests/bench/bench_keys.py --minutes 20``. Each attack of `key_attacks` has an equal part of the
time; without an attack the same load is measured before it. The table has the seconds to the first byte, or to the
first event of a live sentence; processor time is that of the server and its processes.
`tests/serving/service/server/test_keys_under_attack.py` is a run of five minutes.
Another tree is measured in the same way by its path in PYTHONPATH.
"""

import argparse
import asyncio
import json
import os
import random
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import websockets

from tests.bench.key_attacks import ATTACKS, Target, socket_of
from tests.running import ServeProcess, free_port
from tts2face.serving.service.keys import add_key

KINDS = ("mp3", "curves", "mp4", "live")
PAUSE_S = {"mp3": 0.3, "curves": 0.5, "mp4": 1.0, "live": 1.0}  # between two requests of a key
TARGETS_S = {"mp3": 0.5, "curves": 1.0, "mp4": 2.0, "live": 1.0}  # 95th percentile on two cores with nothing else
MOST_RATIO = 2.0
MOST_SERVER_MB, MOST_PROCESSES_MB = 300, 2000
LOOK_S = 1.0
KB = 1024
SENTENCE = "Number {} is here, but Bob may move five big maps before we go."
BODIES: Mapping[str, Mapping[str, Any]] = {
    "mp3": {"format": "mp3"}, "curves": {"format": "curves"}, "mp4": {"format": "mp4", "size": "256x256"}
}  # fmt: skip


@dataclass(slots=True)
class Load:
    """What three keys have met: seconds by the kind of their request, and answers that are no success."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    refused: Counter[str] = field(default_factory=Counter)

    def p(self, kind: str, share: float) -> float:
        """A percentile of a kind; endless where nothing was answered."""
        return float(np.percentile(self.seconds[kind], share)) if self.seconds[kind] else float("inf")


@dataclass(frozen=True, slots=True)
class Finding:
    """An attack: the load without and with it, processor time a second, the most memory, what the attacker got."""

    attack: str
    without: Load
    under: Load
    cpu: float
    server_mb: float
    processes_mb: float
    statuses: Counter[str]

    def ratio(self, kind: str) -> float:
        """How many times longer the 95th percentile of a kind is with the attack."""
        return self.under.p(kind, 95) / self.without.p(kind, 95)


class Keys:
    """A server with the keys of three clients and of an attacker."""

    def __init__(self, folder: Path, processes: int) -> None:
        path = folder / "keys.toml"
        self.keys = {kind: add_key(path, kind, ["speak"], concurrent=100) for kind in ("mp3", "curves", "mp4")}
        self.keys["live"] = self.keys["mp3"]
        attacker = add_key(path, "attacker", ["speak", "build"], concurrent=1000)
        port = free_port()
        given = {"WEBHOOK_HOSTS": f"127.0.0.1:{port}", "WEBHOOK_SECRET": "a-secret-of-a-bench", "STUDIO": "false"}
        environment = {f"TTS2FACE_SERVE_{name}": value for name, value in given.items()}
        self.server = ServeProcess("--keys", str(path), processes=processes, environment=environment)
        self.server.wait_until_ready()
        self.target = Target(self.server.url, attacker, port)
        self._most = [0.0, 0.0]

    async def load(self, seconds: float) -> Load:
        """The load of the three keys for some seconds."""
        load, end = Load(), time.monotonic() + seconds
        async with httpx.AsyncClient(base_url=self.server.url, timeout=30) as client:

            async def repeat(kind: str, ask: Callable[[], Awaitable[float]]) -> None:
                while time.monotonic() < end:
                    try:
                        load.seconds[kind].append(await ask())
                    except (httpx.HTTPError, OSError, websockets.WebSocketException, _RefusedError) as error:
                        load.refused[f"{kind}: {str(error) or type(error).__name__}"] += 1
                    await asyncio.sleep(PAUSE_S[kind] * random.uniform(0.8, 1.2))

            asking = [repeat(kind, lambda kind=kind: self._first_byte(client, kind)) for kind in BODIES]  # type: ignore[misc]
            async with self._live() as sentence:
                await asyncio.gather(repeat("live", sentence), *asking)
        return load

    async def _first_byte(self, client: httpx.AsyncClient, kind: str) -> float:
        body = {**BODIES[kind], "text": SENTENCE.format(random.randrange(20, 10**6))}
        headers, began, found = {"authorization": f"Bearer {self.keys[kind]}"}, time.perf_counter(), 0.0
        async with client.stream("POST", "/v1/clips", json=body, headers=headers) as answer:
            if answer.status_code != 200:
                raise _RefusedError(str(answer.status_code))
            async for _ in answer.aiter_raw():
                found = found or time.perf_counter() - began
        return found

    @asynccontextmanager
    async def _live(self) -> AsyncIterator[Callable[[], Awaitable[float]]]:
        """A function that says a sentence to a live stream: seconds to its first event."""
        async with socket_of(self.server.url, self.keys["live"]) as connection:
            await connection.send(json.dumps({"type": "start", "with_idle": False}))

            async def say() -> float:
                began = time.perf_counter()
                await connection.send(json.dumps({"type": "text", "text": SENTENCE.format(random.randrange(20, 1000))}))
                await connection.send('{"type": "flush"}')
                found = 0.0
                async with asyncio.timeout(60):
                    while True:
                        message = await connection.recv()
                        kind = "sound" if isinstance(message, bytes) else json.loads(message)["type"]
                        if kind == "error":
                            raise _RefusedError(str(message))
                        found = found or time.perf_counter() - began
                        if kind == "curves":
                            return found

            yield say

    async def watch(self) -> None:
        """Note the most memory of the server and of its processes together, until it is cancelled."""
        while True:
            pids = family(self.server.process.pid)
            sizes = [memory_mb(pid) for pid in pids]
            self._most = [max(self._most[0], sizes[0]), max(self._most[1], sum(sizes[1:]))]
            await asyncio.sleep(LOOK_S)

    async def under(self, attack: str, seconds: float) -> Finding:
        """Measure the load without an attack, and then with it."""
        without = await self.load(seconds / 3)
        self._most = [0.0, 0.0]
        self.target.statuses.clear()
        watching = asyncio.create_task(self.watch())
        attacking = asyncio.create_task(ATTACKS[attack](self.target))
        try:
            await asyncio.sleep(min(3.0, seconds / 10))
            cpu_s, began = family_cpu_s(self.server.process.pid), time.monotonic()
            under = await self.load(2 * seconds / 3)
            cpu = (family_cpu_s(self.server.process.pid) - cpu_s) / (time.monotonic() - began)
        finally:
            for task in (attacking, watching):
                task.cancel()
            await asyncio.gather(attacking, watching, return_exceptions=True)
        return Finding(attack, without, under, cpu, *self._most, self.target.statuses.copy())


class _RefusedError(Exception):
    """The service has refused a request."""


def family(pid: int) -> list[int]:
    """A process and its descendants."""
    found = [pid]
    with suppress(OSError):
        for file in Path(f"/proc/{pid}/task").glob("*/children"):
            found += [one for child in file.read_text().split() for one in family(int(child))]
    return found


def memory_mb(pid: int) -> float:
    """Memory of a process, of pages of several processes its share; 0 if it has ended."""
    with suppress(OSError):
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
        return next(int(line.split()[1]) / KB for line in lines if line.startswith("Pss:"))
    return 0.0


def family_cpu_s(pid: int) -> float:
    """Seconds of processor time of a process and its descendants, and of those that have ended."""
    total = 0.0
    for one in family(pid):
        with suppress(OSError):
            ticks = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()[11:15]
            total += sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
    return total


def run_keys(minutes: float, attacks: Sequence[str] = tuple(ATTACKS), processes: int = 2) -> list[Finding]:
    """Measure each attack for an equal part of the time; prints a table of them."""
    findings = []
    with tempfile.TemporaryDirectory() as folder:
        keys = Keys(Path(folder), processes)
        try:
            asyncio.run(keys.load(3.0))  # the first pictures of a size take longer
            print("| attack | kind | n | p50 | p95 | with it: n | p50 | p95 | ratio | refused |\n|" + " --- |" * 10)
            for attack in attacks:
                findings.append(asyncio.run(keys.under(attack, 60 * minutes / len(attacks))))
                show(findings[-1])
        finally:
            keys.server.close()
    return findings


def show(found: Finding) -> None:
    """Print the rows of an attack."""
    for kind in KINDS:
        cells = [f"{len(load.seconds[kind])} | {load.p(kind, 50):.3f} | {load.p(kind, 95):.3f}"
                 for load in (found.without, found.under)]  # fmt: skip
        n_refused = sum(n for name, n in found.under.refused.items() if name.startswith(kind))
        print(f"| {found.attack} | {kind} | {' | '.join(cells)} | {found.ratio(kind):.2f} | {n_refused} |")
    print(
        f"{found.attack}: {found.cpu:.2f} cores, server {found.server_mb:.0f} MB, processes {found.processes_mb:.0f} "
        f"MB, load of the machine {os.getloadavg()[0]:.1f}; attacker: {dict(found.statuses)}; "
        f"refused: {dict(found.under.refused)}",
        flush=True,
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--attacks", nargs="+", choices=tuple(ATTACKS), default=tuple(ATTACKS))
    chosen = parser.parse_args()
    run_keys(chosen.minutes, chosen.attacks, chosen.processes)


if __name__ == "__main__":
    main()
