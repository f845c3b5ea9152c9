"""A live face: CPU seconds a second of frames, pictures left out, delays, and how long an event loop waits.

``python tests/bench/bench_live_face.py [SECONDS]`` reads frames on a steady clock, idle, of texts and of pushed sound,
with pictures of 512 x 512 and without, and prints a table. CPU seconds are those of the process. ``--beside ../other``
compares those of live video, encoder included, with another working copy, in alternating pairs; ``--delays`` prints the
delays only.
"""

import argparse
import asyncio
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import tts2face
from tts2face.session.live.frames import Frame
from tts2face.session.live.stream import FaceStream

TEXTS = (
    "Good evening, and welcome. Tonight we talk about the future of the city.",
    "If you want to learn a language, you need a little time every day.",
    "The train to London leaves at nine. Please keep your ticket until the end of the journey.",
)
BLOCK_S = 0.02  # of pushed sound, as a call sends it
SIZE = "512x512"
MOVED = 0.05  # of a weight of the jaw, by which a lip has moved
QUIET = 0.01  # of samples in [-1, 1], below which a sound has not begun


def spoken_frames(stream: FaceStream, seconds: float) -> Iterator[Frame]:
    """Frames of some seconds, in which one text follows another."""
    number = stream.say(TEXTS[0])
    for at, frame in enumerate(stream.frames()):
        yield frame
        if frame.ends and frame.utterance == number:
            number = stream.say(TEXTS[at % len(TEXTS)])
        if at >= seconds * stream.fps:
            return


def pushed_frames(sound: tts2face.Waveform) -> Callable[[FaceStream, float], Iterator[Frame]]:
    """Frames of some seconds of sound that arrives in real time, again and again."""
    n_block = round(BLOCK_S * sound.rate)

    def frames(stream: FaceStream, seconds: float) -> Iterator[Frame]:
        given = 0
        began = None
        for at, frame in enumerate(stream.frames()):
            began = time.monotonic() if began is None else began
            yield frame
            if at >= seconds * stream.fps:
                return
            while given < (time.monotonic() - began) * sound.rate:
                start = given % (len(sound.samples) - n_block)
                stream.push_sound(sound.samples[start : start + n_block], sound.rate)
                given += n_block

    return frames


def idle_frames(stream: FaceStream, seconds: float) -> Iterator[Frame]:
    """Frames of some seconds in which nothing is said."""
    for at, frame in enumerate(stream.frames()):
        yield frame
        if at >= seconds * stream.fps:
            return


def measure(session: tts2face.Session, frames: Callable[[FaceStream, float], Iterator[Frame]], seconds: float) -> str:
    """Row of the table."""
    shown = []
    for draws in (False, True):
        with session.face_stream(size=SIZE, draws=draws) as stream:
            first = stream.read(120)
            assert first is not None
            began, cpu, late, n_frames, n_silent = time.monotonic(), time.process_time(), stream.late, 0, 0
            for frame in frames(stream, seconds):
                n_frames += 1
                n_silent += frame.state == "speaking" and not frame.sound.any()
            wall = time.monotonic() - began
            shown.append(f"{(time.process_time() - cpu) / wall:6.3f}")
            shown.append(f"{stream.late - late:4} of {n_frames}" if draws else f"{n_silent:4}")
    return " ".join(f"{text:>12}" for text in shown)


def delays_s(session: tts2face.Session, start: Callable[[FaceStream], Callable[[], object]]) -> list[float]:
    """Seconds from a text or sound to the first picture that speaks and to the first moved jaw; medians of five.

    `start` begins to speak; what it returns is called after each frame.
    """
    found = []
    for _ in range(5):
        with session.face_stream(size=SIZE) as stream:
            jaw = stream.channels.index("jawOpen")
            began, go_on, rest, shown = 0.0, None, 0.0, 0.0
            for at, frame in enumerate(stream.frames()):
                if at == 30:
                    began, rest, go_on = time.monotonic(), float(frame.weights[jaw]), start(stream)
                if go_on is None:
                    continue
                go_on()
                if frame.state == "speaking" and frame.pixels is not None and not shown:
                    shown = time.monotonic() - began
                if shown and frame.weights[jaw] > rest + MOVED:
                    found.append((shown, time.monotonic() - began))
                    break
    return [float(value) for value in np.median(found, axis=0)]


def print_delays(session: tts2face.Session, sound: tts2face.Waveform) -> None:
    """Print the delays of a text, of sound at once and of sound in real time; all sounds begin at once."""
    samples = sound.samples[int(np.argmax(np.abs(sound.samples) > QUIET)) :]
    n_block = round(BLOCK_S * sound.rate)

    def text(stream: FaceStream) -> Callable[[], object]:
        stream.say(TEXTS[1])
        return lambda: None

    def at_once(stream: FaceStream) -> Callable[[], object]:
        stream.push_sound(samples[: sound.rate], sound.rate)
        return lambda: None

    def in_real_time(stream: FaceStream) -> Callable[[], object]:
        began, given = time.monotonic(), 0

        def push() -> None:
            nonlocal given
            while given < (time.monotonic() - began + BLOCK_S) * sound.rate:
                stream.push_sound(samples[given : given + n_block], sound.rate)
                given += n_block

        push()
        return push

    for name, start in {"a text": text, "sound at once": at_once, "sound in real time": in_real_time}.items():
        shown, moved = delays_s(session, start)
        print(f"from {name}: first speaking picture {shown:.2f} s, first moving lip {moved:.2f} s")


def beside(other: Path, seconds: float, n_pairs: int) -> None:
    """Print CPU seconds of a second of live video of this and another working copy, and the median of their ratios."""
    for what in ("text", "idle", "sound"):
        pairs = np.array([[cost(tree, what, seconds) for tree in (Path.cwd(), other)] for _ in range(n_pairs)])
        here, there = np.median(pairs, axis=0)
        ratios = pairs[:, 0] / pairs[:, 1]
        print(
            f"{what}: {here:.3f} and {there:.3f} CPU s/s (least {pairs[:, 0].min():.3f} and {pairs[:, 1].min():.3f}), "
            f"ratio {np.median(ratios):.2f} ({ratios.min():.2f} to {ratios.max():.2f}) of {n_pairs} pairs "
            f"(load {os.getloadavg()[0]:.1f})", flush=True,
        )  # fmt: skip


def cost(tree: Path, what: str, seconds: float) -> float:
    """CPU seconds of a second of live video of a working copy."""
    command = [sys.executable, str(Path(__file__).with_name("live_cost.py").resolve()), what, str(seconds)]
    environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=tree, env=environment)
    return float(done.stdout.split()[0])


async def longest_wait_s(session: tts2face.Session) -> tuple[float, float]:
    """Longest and 99 % quantile of the seconds for which an event loop does not turn while clips are made."""
    waits: list[float] = []

    async def turn() -> None:
        while True:
            began = time.perf_counter()
            await asyncio.sleep(0.001)
            waits.append(time.perf_counter() - began - 0.001)

    turning = asyncio.create_task(turn())
    for text in TEXTS:
        await session.aclip(text)
    turning.cancel()
    return max(waits), float(np.quantile(waits, 0.99))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seconds", type=float, nargs="?", default=20.0)
    parser.add_argument("--beside", type=Path, help="another working copy")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--delays", action="store_true")
    asked = parser.parse_args()
    if asked.beside is not None:
        beside(asked.beside, asked.seconds, asked.pairs)
        return
    session = tts2face.Session()
    sound = session.clip(" ".join(TEXTS)).speech.waveform
    print_delays(session, sound)
    if asked.delays:
        return
    ways = {"idle": idle_frames, "text": spoken_frames, "pushed sound": pushed_frames(sound)}
    print(f"{'':14}{'CPU s/s':>12} {'silent':>12} {'with picture':>12} {'late':>12}")
    for name, frames in ways.items():
        print(f"{name:14}" + measure(session, frames, asked.seconds))
    longest, usual = asyncio.run(longest_wait_s(session))
    print(f"event loop: longest wait {1000 * longest:.1f} ms, 99 % below {1000 * usual:.1f} ms")


if __name__ == "__main__":
    main()
