"""Latency, jitter, drift and processor time of live targets: a face sent to receivers in other processes.

    python tests/bench/bench_live_targets.py [--seconds 20] [--fps 60] [--size 512] [TARGET ...]

Targets are vmc, livelink, ws, vts, rtmp, rtsp and whip; all by default, one after another. `aiortc-h264` and
`aiortc-vp8` send to the endpoint of whip by aiortc, as one would without this. Ten minutes (`--seconds 600
livelink`) show the drift of the clock, and with pictures (`--seconds 600 rtmp`) whether memory grows and sound stays
with its pictures. Quiet machine; the load is printed.
"""

import argparse
import os
import resource
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.running import LoggedProcess, free_port
from tests.started import children
from tests.targets.receivers import TOKEN, receiver, tell
from tts2face import Session
from tts2face.picture.options import Picture
from tts2face.targets.broadcast import Broadcast, Listener, LivePlan
from tts2face.targets.table import parse_targets

DATAGRAMS = ("vmc", "livelink")
ALL = (*DATAGRAMS, "ws", "vts", "rtmp", "rtsp", "whip")
BY_AIORTC = {"aiortc-h264": "H264", "aiortc-vp8": "VP8"}
TEXTS = ("Hello there, this is a live connection.", "And this is a second sentence.")
FIRST_S, EVERY_S = 3.0, 6.0  # of the first text, and between two
MEMORY_S = 5.0  # between two looks at the memory
PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 1e6


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


def spent_s() -> float:
    """Processor seconds of this process and its ended children."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


class Memory:
    """Resident MB of this process and of those that it has started, but for the receiver, while it sends."""

    def __init__(self, receiver: int) -> None:
        self._receiver, self._ended = receiver, threading.Event()
        self.seen: list[tuple[float, ...]] = []  # seconds, MB of this process, of the others
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self) -> None:
        began = time.monotonic()
        while not self._ended.wait(MEMORY_S):
            others = [one for one in children(os.getpid()) if one != self._receiver]
            held = resident_mb(os.getpid()), sum(map(resident_mb, others))
            self.seen.append((time.monotonic() - began, *held))

    def end(self) -> str:
        """What it has seen: after half a minute (or the first look), at the highest, at the end."""
        self._ended.set()
        if not self.seen:
            return "memory not seen"
        seconds, *held = np.array(self.seen).T
        total = np.sum(held, axis=0)
        early = int(np.searchsorted(seconds, 30.0)) % len(seconds)
        slope = 60 * np.polyfit(seconds[early:], total[early:], 1)[0] if len(seconds) > early + 2 else np.nan
        parts = " + ".join(f"{one[-1]:.0f}" for one in held)
        return (
            f"memory {total[early]:.0f} MB after {seconds[early]:.0f} s, at most {total.max():.0f}, at the end "
            f"{total[-1]:.0f} ({parts} of the senders), {slope:+.2f} MB a minute"
        )


def resident_mb(process: int) -> float:
    """Resident MB of a process; 0 if it has ended."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * PAGE_MB
    except OSError:
        return 0.0


class Sayer:
    """Says texts at their times; seconds from each to its first frame that was sent."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.latencies = seconds, list[float]()
        self._said_at: float | None = None
        self._n_spoken = 0

    def feed(self, face: Any, has_ended: Callable[[], bool]) -> int:
        began, last, n = time.monotonic(), 0, 0
        while (now := time.monotonic() - began) < self.seconds and not has_ended():
            if now >= FIRST_S + n * EVERY_S:
                self._said_at = time.monotonic()
                last = face.say(TEXTS[n % len(TEXTS)])
                n += 1
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
    protocol = "whip" if kind in BY_AIORTC else kind
    plan = LivePlan(parse_targets([address(protocol, port, token)]), Picture(size=str(asked.size)), fps=asked.fps)
    targets, sayer = plan.make_targets(), Sayer(asked.seconds)
    if kind in BY_AIORTC:
        from tests.bench.aiortc_target import AiortcTarget

        targets = (AiortcTarget(plan.addresses[0], plan.format, BY_AIORTC[kind]),)
    sent: list[tuple[float, int]] = []
    send = targets[0].send

    def noted(tick: Any) -> None:
        sent.append((time.monotonic(), tick.number))
        send(tick)
        sayer.note(broadcast.n_spoken, 1 / asked.fps)

    targets[0].send = noted  # type: ignore[method-assign]
    broadcast = Broadcast(plan, targets, Listener(lambda state: None, print))
    with started(protocol, port) as server:
        before, began, memory = spent_s(), time.monotonic(), Memory(server.process.pid)
        broadcast.run(session, sayer.feed)
        held = memory.end()
        seconds, used = time.monotonic() - began, spent_s() - before
        if kind in DATAGRAMS:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ending:
                ending.sendto(b"", ("127.0.0.1", port))
        time.sleep(1.0)
        received = [event for event in server.events() if event["event"] in {"received", "closed"}]
    first = ", ".join(f"{latency:.2f}" for latency in sayer.latencies)
    print(f"{kind}: text to first speaking frame sent: {first} s; {held}")
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
        if kind not in (*ALL, *BY_AIORTC):
            sys.exit(f"there is no target {kind}; the targets are {', '.join([*ALL, *BY_AIORTC])}")
        measure(session, kind, asked)


if __name__ == "__main__":
    main()
