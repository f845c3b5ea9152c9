"""Latency and throughput of a running `tts2face serve`: first bytes, live curves, lateness, cancelling.

Run: ``python tests/bench/bench_service.py [--quick] [--start | --clients | --streams]``. It starts a server of its
own on this machine, with one process for each core, and prints the figures that docs/performance.md sums up. As a
reference it measures the same synthesis in this process before and after, so that the load of the machine shows.
``--start`` measures starts only, ``--clients`` first bytes, ``--streams`` movies.
"""

import argparse
import asyncio
import functools
import io
import json
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

import av
import httpx
import numpy as np
import websockets

VOICE_TEXT = "We were away a year ago, but Bob may move five big maps before we go."  # 5 s of speech
UNSEEN_TEXT = "We were away YEARS years ago, but Bob may move five big maps before we go."
LONG_TEXT = " ".join(["the garden behind the old house near the river had been green for years and nobody knew"] * 12)
AFTER_TEXT = "The garden behind the old house near the river had been green for years."
CLIENTS, STREAMS = (1, 4, 16, 64), (1, 2, 4)
LEAVE_AFTER_S = 2.0  # clients leave at a random time until then
CANCEL_AFTER_S = 6.0  # the same for `cancel`: within the first sentence or a later one, which is longer
LIVE_S = 20.0
Measure = Callable[[str], Awaitable[float]]


def start_server(**variables: str) -> tuple[subprocess.Popen[bytes], str]:
    """A server and its address, when all its processes are ready; it prints when it and they were."""
    folder, began = tempfile.mkdtemp(prefix="tts2face-bench-"), time.monotonic()
    command = [sys.executable, "-m", "tts2face", "serve", "--port", "0"]
    settings = {"TTS2FACE_SERVE_WAITING": "256", "TTS2FACE_SERVE_DATA": folder, "TTS2FACE_SERVE_WORKERS": "0"}
    log = Path(folder, "log")
    with log.open("w") as file:
        server = subprocess.Popen(command, stderr=file, env=os.environ | settings | variables)
    found: list[str] = []
    while not found:
        time.sleep(0.1)
        found = re.findall(r'"url": ?"(http[^"]+)"', log.read_text())
        assert server.poll() is None, log.read_text()
    url, seconds = found[0], [time.monotonic() - began]
    while httpx.get(f"{url}/readyz").status_code != 200:
        time.sleep(0.1)
    seconds.append(time.monotonic() - began)
    while measure(url, "tts2face_processes_ready") < (os.cpu_count() or 1):
        time.sleep(0.1)
    seconds.append(time.monotonic() - began)
    row("start: listening, ready, all processes; processor time", *seconds, family_cpu_s(server.pid))
    return server, url


def family_cpu_s(pid: int) -> float:
    """Seconds of processor time of a process and its descendants that live, and of those that have been waited for."""
    children = [int(one) for file in Path(f"/proc/{pid}/task").glob("*/children") for one in file.read_text().split()]
    ticks = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:15]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK") + sum(family_cpu_s(child) for child in children)


def starts() -> None:
    """Print the seconds of the first start on a machine, which compiles all kernels, and of two later ones."""
    with tempfile.TemporaryDirectory() as kernels:
        for _ in range(3):
            server, _ = start_server(NUMBA_CACHE_DIR=kernels, TTS2FACE_SERVE_WORKERS="1")
            server.terminate()
            server.wait()


def measure(url: str, name: str) -> float:
    """Value of a metric."""
    lines = httpx.get(f"{url}/metrics").text.splitlines()
    return next(float(line.split()[-1]) for line in lines if line.startswith(name))


def unseen(body: dict[str, object]) -> dict[str, object]:
    """The body, in whose text YEARS is a number that the server has not met, since it keeps finished sentences."""
    text = str(body.get("text")).replace("YEARS", str(random.randrange(20, 10**6)))
    return body | {"text": text} if "text" in body else body


def first_byte(path: str, body: dict[str, object]) -> Measure:
    """Measure of the seconds until the first byte of a body; the rest is read, too."""

    async def run(url: str) -> float:
        begin, found = time.perf_counter(), 0.0
        async with client().stream("POST", f"{url}{path}", json=unseen(body)) as answer:
            assert answer.status_code == 200, await answer.aread()
            async for chunk in answer.aiter_raw():
                if chunk and not found:
                    found = time.perf_counter() - begin
        return found

    return run


@functools.cache
def _client_of(_: asyncio.AbstractEventLoop) -> httpx.AsyncClient:
    return httpx.AsyncClient(timeout=600, limits=httpx.Limits(max_connections=None))


def client() -> httpx.AsyncClient:
    """Client of the running event loop: making one takes longer than a short sentence."""
    return _client_of(asyncio.get_running_loop())


async def live_curves(url: str) -> float:
    """Seconds from the last word of a sentence to its first curves."""
    async with websockets.connect(f"{url.replace('http', 'ws', 1)}/v1/stream", max_size=None) as connection:
        await connection.send(json.dumps({"type": "start", "with_idle": False}))
        for word in ["Hello", "there,", "how", "are", "you", "today?"]:
            await connection.send(json.dumps({"type": "text", "text": f"{word} "}))
            await asyncio.sleep(0.02)
        begin = time.perf_counter()
        await connection.send('{"type": "flush"}')
        while True:
            message = await connection.recv()
            if isinstance(message, str) and json.loads(message)["type"] == "curves":
                return time.perf_counter() - begin


async def lateness(url: str, seconds: float = LIVE_S) -> list[float]:
    """Seconds by which the curves of each event come after the instant on the clock of the stream at which they begin.

    A living face, with a sentence every four seconds.
    """
    found: list[float] = []
    async with websockets.connect(f"{url.replace('http', 'ws', 1)}/v1/stream", max_size=None) as connection:
        await connection.send(json.dumps({"type": "start"}))
        began, spoken = 0.0, 0
        while not began or time.perf_counter() < began + seconds:
            message = await connection.recv()
            content = {"type": "sound"} if isinstance(message, bytes) else json.loads(message)
            if content["type"] != "curves":
                continue
            now = time.perf_counter()
            began = began or now - content["begin"]
            found.append(max(0.0, now - (began + content["begin"])))
            if now > began + 4.0 * spoken:
                spoken += 1
                await connection.send('{"type": "text", "text": "Hello there, how are you today?"}')
                await connection.send('{"type": "flush"}')
    return found


async def cancel(url: str, *, at_client: bool = False) -> float:
    """Seconds from `cancel` to the end of what it cancels, in the synthesis process or as the client sees it."""
    async with websockets.connect(f"{url.replace('http', 'ws', 1)}/v1/stream", max_size=None) as connection:
        await connection.send(json.dumps({"type": "start", "with_idle": False}))
        await connection.send(json.dumps({"type": "text", "text": LONG_TEXT}))
        await connection.send('{"type": "flush"}')
        await asyncio.sleep(random.uniform(0.0, CANCEL_AFTER_S))
        begin = time.perf_counter()
        await connection.send('{"type": "cancel"}')
        while True:
            message = await connection.recv()
            if isinstance(message, str) and (content := json.loads(message))["type"] == "cancelled":
                return time.perf_counter() - begin if at_client else float(content["after_ms"]) / 1000


async def leave(url: str) -> float:
    """A client of a clip that leaves; the server measures what follows."""
    body = {"text": LONG_TEXT, "size": "256x256"}
    try:
        async with asyncio.timeout(random.uniform(0.1, LEAVE_AFTER_S)):
            await first_byte("/v1/clips", body)(url)
    except TimeoutError:
        pass
    return 0.0


def repeat(url: str, one: Measure, clients: int, rounds: int) -> list[float]:
    """Results of a number of clients at once, some rounds one after another."""

    async def run() -> list[float]:
        client()
        return [value for _ in range(rounds) for value in await asyncio.gather(*(one(url) for _ in range(clients)))]

    return asyncio.run(run())


def row(*cells: object) -> None:
    """Print a row of a table."""
    print("|", " | ".join(f"{cell:.3f}" if isinstance(cell, float) else str(cell) for cell in cells), "|", flush=True)


def percentiles(values: Sequence[float]) -> list[float]:
    """50th, 95th and 99th percentile, and the largest value."""
    return [*(float(np.percentile(values, share)) for share in (50, 95, 99)), max(values)]


def reference() -> float:
    """Seconds that this process takes for the sentence, without server."""
    import tts2face

    session, found = tts2face.Session(), []
    for _ in range(4):
        begin = time.perf_counter()
        session.clip(VOICE_TEXT)
        found.append(time.perf_counter() - begin)
    return statistics.median(found[1:])


def first_bytes(url: str, rounds: int) -> None:
    """Print the first bytes of 1, 4, 16 and 64 clients at once."""
    speech = {"input": VOICE_TEXT, "voice": "alloy", "model": "tts-1"}
    kinds: dict[str, Measure] = {
        "voice, 5 s (wav)": first_byte("/v1/audio/speech", speech | {"response_format": "wav"}),
        "voice, 5 s (mp3)": first_byte("/v1/audio/speech", speech),
        "unseen sentence (curves)": first_byte("/v1/clips", {"text": UNSEEN_TEXT, "format": "curves"}),
        "unseen sentence (mp4)": first_byte("/v1/clips", {"text": UNSEEN_TEXT, "size": "256x256"}),
        "live curves after the last word": live_curves,
    }
    row("first bytes", "clients", "p50", "p95", "p99", "max")
    row(*["---"] * 6)
    for name, one in kinds.items():
        repeat(url, one, 2, 2)  # the first picture of a size takes 0.7 s in each process
        for clients in CLIENTS:
            row(name, clients, *percentiles(repeat(url, one, clients, max(1, 4 * rounds // clients))))


def streams(url: str, rounds: int) -> None:
    """Print how fast movies are made that are seen at once, and for how long the slowest one stalls."""
    row("streams of 512 x 512", "of real time", "longest stall", "first byte")
    row(*["---"] * 4)
    for number in STREAMS:
        for _ in range(rounds):
            found = asyncio.run(_watch(url, number))
            row(number, *(f(column) for f, column in zip((min, max, max), zip(*found, strict=True), strict=True)))


async def _watch(url: str, number: int) -> list[tuple[float, float, float]]:
    return await asyncio.gather(*(watch(url) for _ in range(number)))


async def watch(url: str) -> tuple[float, float, float]:
    """Seconds of a movie by those until its end; its longest stall; its first byte."""
    begin, arrivals, content = time.perf_counter(), [], b""
    body = unseen({"text": f"{UNSEEN_TEXT} {AFTER_TEXT}", "size": "512x512"})
    async with client().stream("POST", f"{url}/v1/clips", json=body) as answer:
        assert answer.status_code == 200, await answer.aread()
        async for chunk in answer.aiter_raw():
            content += chunk
            arrivals.append((time.perf_counter() - begin, len(content)))
    with av.open(io.BytesIO(content)) as movie:
        ends = [(one.pos + one.size, float((one.pts + one.duration) * one.time_base))
                for one in movie.demux(video=0) if one.pts is not None]  # fmt: skip
    dry_at, stall, shown = arrivals[0][0], 0.0, 0.0
    for second, n_bytes in arrivals:
        here = max((end for place, end in ends if place <= n_bytes), default=0.0)
        if here > shown:
            stall = max(stall, second - dry_at if shown else 0.0)
            dry_at, shown = max(dry_at, second) + here - shown, here
    return shown / arrivals[-1][0], stall, arrivals[0][0]


def figures(url: str, rounds: int) -> None:
    """Print the figures of a running server."""
    first_bytes(url, rounds)
    streams(url, rounds)
    for format in ("wav", "curves", "mp4"):
        one = first_byte("/v1/clips", {"text": LONG_TEXT, "format": format, "size": "64x64", "supersampling": 1})
        repeat(url, one, 2, 2)
        row(f"200 words without a point ({format})", 1, *percentiles(repeat(url, one, 1, rounds)))
    for number in (1, 8):
        found = asyncio.run(_gather_lateness(url, number))
        row("lateness of live curves", number, *percentiles(found))
    for name, one in {"process": cancel, "client": functools.partial(cancel, at_client=True)}.items():
        row(f"cancel in a sentence, at the {name}", 1, *percentiles(repeat(url, one, 1, 8 * rounds)))
        row(f"cancel in a sentence, at the {name}", 8, *percentiles(repeat(url, one, 8, rounds)))
    repeat(url, leave, 4, 4 * rounds)
    time.sleep(5.0)
    for bound in ("0.025", "0.05", "0.1"):
        share = measure(url, f'tts2face_cancel_seconds_bucket{{le="{bound}"}}')
        print(f"clients that left: {share:g} of {measure(url, 'tts2face_cancel_seconds_count'):g} within {bound} s")
    for name, body in {
        "voice": {"format": "wav"},
        "curves": {"format": "curves"},
        "movie": {"size": "256x256"},
    }.items():
        repeat(url, first_byte("/v1/clips", {"text": VOICE_TEXT} | body), 2, 1)
        before, begin = measure(url, "tts2face_speech_seconds_total"), time.perf_counter()
        repeat(url, first_byte("/v1/clips", {"text": VOICE_TEXT} | body), 8, 1 if rounds < 5 else 2)
        seconds = time.perf_counter() - begin
        made = measure(url, "tts2face_speech_seconds_total") - before
        print(f"{name}: {made / seconds / (os.cpu_count() or 1):.2f} streams in real time per core", flush=True)


def main() -> None:
    """Print the figures that docs/performance.md sums up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    parser.add_argument("--start", action="store_true", help="only the first and later starts")
    parser.add_argument("--clients", action="store_true", help="only the first bytes of many clients")
    parser.add_argument("--streams", action="store_true", help="only movies that are seen at once")
    arguments = parser.parse_args()
    if arguments.start:
        starts()
        return
    rounds = 2 if arguments.quick else 5
    print(f"in this process: {reference():.3f} s for 5 s of speech, load {os.getloadavg()[0]:.1f}", flush=True)
    server, url = start_server()
    try:
        part = first_bytes if arguments.clients else streams if arguments.streams else figures
        part(url, rounds)
    finally:
        server.terminate()
        server.wait()
    print(f"in this process: {reference():.3f} s for 5 s of speech, load {os.getloadavg()[0]:.1f}")


async def _gather_lateness(url: str, streams: int) -> list[float]:
    found = await asyncio.gather(*(lateness(url) for _ in range(streams)))
    return [value for one in found for value in one]


if __name__ == "__main__":
    main()
