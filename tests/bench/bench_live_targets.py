"""Latency, jitter, drift and processor time of live targets: a face sent to receivers in other processes.

    python tests/bench/bench_live_targets.py [--seconds 20] [--fps 60] [--size 512] [TARGET ...]

Targets are vmc, livelink, ws, vts, rtmp, rtsp and whip; all by default, one after another. Ten minutes (`--seconds 600
livelink`) show the drift of the clock. Quiet machine; the load is printed.
"""

import argparse
import os
import resource
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.running import LoggedProcess, free_port
from tests.targets.receivers import TOKEN, receiver, tell
from tts2face import Session
from tts2face.picture.options import Picture
from tts2face.targets.broadcast import Broadcast, Listener, LivePlan
from tts2face.targets.table import parse_targets

DATAGRAMS = ("vmc", "livelink")
ALL = (*DATAGRAMS, "ws", "vts", "rtmp", "rtsp", "whip")
TEXTS = ("Hello there, this is a live connection.", "And this is a second sentence.")
FIRST_S, EVERY_S = 3.0, 6.0  # of the first text, and between two


def stamp(port: int) -> None:
    """A receiver of datagrams: times of the last one of each frame."""
    times: list[float] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", port))
        tell("ready")
        while data := opened.recv(4096):
            if b"/VMC" not in data or b"/Blend/Apply" in data:
                times.append(time.monotonic())
    tell("received", at=times)


def address(kind: str, port: int, token: Path) -> str:
    """Address of a receiver."""
    return {
        "ws": f"ws://127.0.0.1:{port}/x", "rtmp": f"rtmp://127.0.0.1:{port}/live/key",
        "rtsp": f"rtsp://127.0.0.1:{port}/live", "whip": f"whip:http://127.0.0.1:{port}/w#token={token}",
    }.get(kind, f"{kind}:127.0.0.1:{port}")  # fmt: skip


def started(kind: str, port: int) -> Any:
    """A receiver in a process."""
    if kind not in DATAGRAMS:
        return receiver("sockets" if kind in {"ws", "vts"} else kind, port)
    return StampedReceiver(port)


class StampedReceiver:
    """A process of `stamp`."""

    def __init__(self, port: int) -> None:
        self.port = port
        code = f"from tests.bench.bench_live_targets import stamp; stamp({port})"
        self.process = LoggedProcess("-c", code, environment={})

    def __enter__(self) -> LoggedProcess:
        self.process.wait_for_event("ready")
        return self.process

    def __exit__(self, *_: object) -> None:
        self.process.end()


def memory_mb() -> float:
    """Memory of this process that is not shared, in MB."""
    pages, shared = (int(value) for value in Path("/proc/self/statm").read_text().split()[1:3])
    return (pages - shared) * os.sysconf("SC_PAGE_SIZE") / 1e6


def spent_s() -> float:
    """Processor seconds of this process and its ended children."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


class Sayer:
    """Says texts at their times; seconds from each to its first frame that was sent."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.latencies = seconds, list[float]()
        self.memory_mb: list[float] = []
        self._said_at: float | None = None
        self._n_spoken = 0

    def feed(self, face: Any, has_ended: Callable[[], bool]) -> int:
        began, last, n = time.monotonic(), 0, 0
        while (now := time.monotonic() - began) < self.seconds and not has_ended():
            if now >= FIRST_S + n * EVERY_S:
                self._said_at = time.monotonic()
                last = face.say(TEXTS[n % len(TEXTS)])
                n += 1
                self.memory_mb.append(memory_mb())
            time.sleep(0.02)
        return last

    def note(self, n_spoken: int, frame_s: float) -> None:
        """Follow the number of frames in speech, which is counted behind each of them."""
        if self._said_at is not None and n_spoken > self._n_spoken:
            self.latencies.append(time.monotonic() - frame_s - self._said_at)
            self._said_at = None
        self._n_spoken = n_spoken


def measure(session: Session, kind: str, asked: argparse.Namespace) -> None:
    """Print the figures of one target."""
    port, token = free_port(), Path(tempfile.mkdtemp(), "token")
    token.write_text(TOKEN)
    plan = LivePlan(parse_targets([address(kind, port, token)]), Picture(size=str(asked.size)), fps=asked.fps)
    targets, sayer = plan.make_targets(), Sayer(asked.seconds)
    sent: list[tuple[float, int]] = []
    send = targets[0].send

    def noted(tick: Any) -> None:
        sent.append((time.monotonic(), tick.number))
        send(tick)
        sayer.note(broadcast.n_spoken, 1 / asked.fps)

    targets[0].send = noted  # type: ignore[method-assign]
    broadcast = Broadcast(plan, targets, Listener(lambda state: None, print))
    with started(kind, port) as server:
        before, began = spent_s(), time.monotonic()
        broadcast.run(session, sayer.feed)
        seconds, used = time.monotonic() - began, spent_s() - before
        if kind in DATAGRAMS:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ending:
                ending.sendto(b"", ("127.0.0.1", port))
        time.sleep(1.0)
        received = [event for event in server.events() if event["event"] in {"received", "closed"}]
    first = ", ".join(f"{latency:.2f}" for latency in sayer.latencies)
    print(f"{kind}: text to first speaking frame sent: {first} s; memory at each text: ", end="")
    print(", ".join(f"{used:.0f}" for used in sayer.memory_mb), "MB")
    report((kind, used / seconds, broadcast.n_late), asked, sent, received[-1] if received else {})


def report(made: tuple[str, float, int], asked: argparse.Namespace, sent: Any, received: dict[str, Any]) -> None:
    """Print one line."""
    kind, cpu, n_late = made
    times, numbers = np.array(sent).T
    lateness = 1000 * (times - times[0] - (numbers - numbers[0]) / asked.fps)
    drift = np.median(lateness[-100:]) - np.median(lateness[:100])
    said = [
        f"{kind}: {len(sent)} ticks, {n_late} without a new picture, {cpu:.3f} CPU s/s",
        f"sent: jitter p50 {jitter(times, asked.fps, 50):.2f} ms, p95 {jitter(times, asked.fps, 95):.2f} ms",
        f"lateness p95 {np.percentile(lateness, 95):.2f} ms, drift {drift:.2f} ms",
    ]
    if "at" in received:
        arrived = np.array(received["at"])
        said.append(f"{len(arrived)} arrived, jitter p95 {jitter(arrived, asked.fps, 95):.2f} ms")
    elif received:
        said.append(f"received { ({name: value for name, value in received.items() if name != 'event'}) }")
    print("; ".join(said), f"(load {os.getloadavg()[0]:.1f})", flush=True)


def jitter(times: Any, fps: float, share: float) -> float:
    """Percentile of the differences of gaps from the tick in milliseconds."""
    return float(np.percentile(np.abs(1000 * np.diff(times) - 1000 / fps), share))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("targets", nargs="*", default=ALL)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--fps", type=float, default=30.0)
    parser.add_argument("--size", type=int, default=512)
    asked = parser.parse_args()
    session = Session()
    session.clip("Warm up.")
    for kind in asked.targets:
        if kind not in ALL:
            sys.exit(f"there is no target {kind}; the targets are {', '.join(ALL)}")
        measure(session, kind, asked)


if __name__ == "__main__":
    main()
