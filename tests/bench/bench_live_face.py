"""A live face: CPU seconds a second of frames, pictures left out, delays, and how long an event loop waits.

``python tests/bench/bench_live_face.py [SECONDS]`` reads frames on a steady clock, idle, of texts and of pushed sound,
with pictures of 512 x 512 and without, and prints a table. CPU seconds are those of the process.
"""

import asyncio
import sys
import time
from collections.abc import Callable, Iterator

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


def first_speech_s(session: tts2face.Session, start: Callable[[FaceStream], object]) -> float:
    """Seconds from a text or sound to the first frame that speaks, on a clock of frames; the median of five."""
    found = []
    for _ in range(5):
        with session.face_stream(size=SIZE) as stream:
            began = None
            for at, frame in enumerate(stream.frames()):
                if at == 30:
                    began = time.monotonic()
                    start(stream)
                if began is not None and frame.state == "speaking":
                    found.append(time.monotonic() - began)
                    break
    return float(np.median(found))


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
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    session = tts2face.Session()
    sound = session.clip(" ".join(TEXTS)).speech.waveform
    ways = {"idle": idle_frames, "text": spoken_frames, "pushed sound": pushed_frames(sound)}
    print(f"{'':14}{'CPU s/s':>12} {'silent':>12} {'with picture':>12} {'late':>12}")
    for name, frames in ways.items():
        print(f"{name:14}" + measure(session, frames, seconds))
    text_s = first_speech_s(session, lambda stream: stream.say(TEXTS[1]))
    sound_s = first_speech_s(session, lambda stream: stream.push_sound(sound.samples[: sound.rate], sound.rate))
    print(f"first speaking frame: {text_s:.2f} s after a text, {sound_s:.2f} s after sound at once")
    longest, usual = asyncio.run(longest_wait_s(session))
    print(f"event loop: longest wait {1000 * longest:.1f} ms, 99 % below {1000 * usual:.1f} ms")


if __name__ == "__main__":
    main()
