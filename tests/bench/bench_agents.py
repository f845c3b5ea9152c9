"""A face in a LiveKit room and in a Pipecat pipeline: delay, pictures, sync, interruptions, processor time, memory.

Run: ``python tests/bench/bench_agents.py --minutes 10``. Nothing leaves the machine: the room publishes nothing, the
transport writes into a list. An utterance of some 6 s is sent in real time or at once, every fourth is interrupted.
"""

import argparse
import asyncio
import json
import resource
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import tts2face
from tests.agents import livekit_stage, pipecat_stage
from tts2face.agents.agent_face import Tick
from tts2face.types import SOUND_RATE

TEXT = "Hello, I am the face of an agent. I move my lips to sound that another voice has made, piece by piece."
RATE = 24_000
BLOCK = 480  # samples
PAUSE_S = 1.0
INTERRUPTED_AFTER_S = 2.0
PATIENCE_S = 30.0
QUEUE_S = 0.1  # of sound that waits in the transport, as in LiveKit's source


def cpu_s() -> float:
    """Processor time of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def memory_mb() -> float:
    """Resident memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


class Watched:
    """A stage of a framework and the instants at which it gives speaking pictures and their sound.

    Parameters
    ----------
    stage
        Of `tests.agents`.
    face
        Its `AgentFace`.
    """

    def __init__(self, stage: Any, face: Any) -> None:
        self.stage, self.face = stage, face
        self.pictures: list[tuple[float, int]] = []  # instant and utterance
        self.sounds: list[tuple[float, float]] = []  # instant at which it is heard, and seconds
        self.n_new = self.n_ended = 0
        self._shown: dict[int, Tick] = {}
        self._latest: Tick | None = None
        made = face._tick

        def keep(frame: Any) -> Tick:
            self.n_new += frame.pixels is not None and frame.utterance > 0
            self._latest = made(frame)
            return self._latest

        face._tick = keep

    @property
    def speaks(self) -> int:
        """Utterance of the latest tick."""
        return 0 if self._latest is None else self._latest.utterance

    def see(self) -> None:
        """Note a picture that is given now."""
        self.pictures.append((time.monotonic(), self.speaks))

    def hear(self, seconds: float, queued_s: float = 0.0) -> None:
        """Note sound that is given now behind some that waits."""
        self.sounds.append((time.monotonic() + queued_s, seconds))


def watch_livekit(stage: Any) -> Watched:
    """A stage of LiveKit, whose sources are noted in place of kept."""
    watched = Watched(stage, stage.avatar.face)
    video, audio = stage.runner._video_source, stage.runner._audio_source
    capture_picture, capture_sound = type(video).capture_frame, type(audio).capture_frame

    def see(frame: Any, **more: Any) -> None:
        watched.see()
        capture_picture(video, frame, **more)

    async def hear(frame: Any) -> None:
        watched.hear(frame.duration, audio.queued_duration)
        await capture_sound(audio, frame)

    video.capture_frame, audio.capture_frame = see, hear
    stage.audio.on("playback_finished", lambda _: setattr(watched, "n_ended", watched.n_ended + 1))
    return watched


def watch_pipecat(stage: Any) -> Watched:
    """A stage of Pipecat, whose transport plays in real time."""
    watched, recorder = Watched(stage, stage.face.face), stage.recorder
    plays_until = 0.0
    push = type(recorder).push_frame

    async def see(_: Any) -> bool:
        watched.see()
        return True

    async def hear(frame: Any) -> bool:
        nonlocal plays_until
        now, seconds = time.monotonic(), frame.num_frames / SOUND_RATE
        plays_until = max(plays_until, now)
        watched.hear(seconds, plays_until - now)
        plays_until += seconds
        await asyncio.sleep(max(0.0, plays_until - now - QUEUE_S))
        return True

    async def pass_on(frame: Any, *more: Any) -> None:
        watched.n_ended += type(frame).__name__ == "BotStoppedSpeakingFrame" and not more
        await push(recorder, frame, *more)
        recorder.written.clear()

    recorder.write_video_frame, recorder.write_audio_frame, recorder.push_frame = see, hear, pass_on
    return watched


async def until(condition: Callable[[], object]) -> None:
    """Wait for a condition, as long as is patient."""
    with suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE_S):
            while not condition():
                await asyncio.sleep(0.005)


async def utter(
    watched: Watched, sound: bytes, *, realtime: bool, interrupt: Callable[[], Any] | None
) -> dict[str, float]:
    """Figures of one utterance."""
    n_pictures, n_sounds, n_new = len(watched.pictures), len(watched.sounds), watched.n_new
    n_ended, used, began = watched.n_ended, cpu_s(), time.monotonic()
    for at in range(0, len(sound), 2 * BLOCK):
        await watched.stage.push(sound[at : at + 2 * BLOCK])
        if realtime:
            await asyncio.sleep(max(0.0, began + (at / 2 + BLOCK) / RATE - time.monotonic()))
        if interrupt and time.monotonic() - began > INTERRUPTED_AFTER_S:
            break
    if not interrupt:
        await watched.stage.end()
    else:
        await asyncio.sleep(max(0.0, began + INTERRUPTED_AFTER_S - time.monotonic()))
        called = time.monotonic()
        await interrupt()
        await until(lambda: watched.n_ended > n_ended)
        await asyncio.sleep(PAUSE_S)
        pictures = [at for at, utterance in watched.pictures if at > called and utterance]
        sounds = [at for at, _ in watched.sounds if at > called]
        return {"old_picture_ms": 1000 * (max(pictures, default=called) - called),
                "old_sound_ms": 1000 * (max(sounds, default=called) - called)}  # fmt: skip
    await until(lambda: watched.n_ended > n_ended)
    took = time.monotonic() - began
    seen = np.array([at for at, utterance in watched.pictures[n_pictures:] if utterance])
    heard = watched.sounds[n_sounds:]
    starts = np.cumsum([0.0, *(seconds for _, seconds in heard)])[:-1]
    of_pictures = np.interp(np.arange(len(seen)) / watched.face.fps, starts, [at for at, _ in heard])
    return {
        "first_picture_s": seen[0] - began, "first_sound_s": heard[0][0] - began, "pictures": len(seen),
        "new": watched.n_new - n_new, "gap_p95_ms": 1000 * float(np.percentile(np.diff(seen), 95)),
        "sound_after_picture_ms": 1000 * float(np.median(of_pictures - seen)),
        "cpu_s_a_second": (cpu_s() - used) / took,
        "sound_lost_s": len(sound) / 2 / RATE - sum(seconds for _, seconds in heard),
    }  # fmt: skip


async def run(watched: Watched, interrupt: Callable[[], Any], minutes: float, sound: bytes) -> dict[str, Any]:
    """Figures of all utterances of some minutes."""
    found: dict[str, list[dict[str, float]]] = {"real time": [], "at once": [], "interrupted": []}
    await utter(watched, sound[: RATE * 2], realtime=False, interrupt=None)  # kernels compile
    memory, began = [], time.monotonic()
    while time.monotonic() < began + 60 * minutes:
        n = sum(map(len, found.values()))
        kind = "interrupted" if n % 4 == 3 else "real time" if n % 2 else "at once"
        stop = interrupt if kind == "interrupted" else None
        found[kind].append(await utter(watched, sound, realtime=kind == "real time", interrupt=stop))
        await asyncio.sleep(PAUSE_S)
        memory.append(round(memory_mb(), 1))
        watched.pictures.clear()
        watched.sounds.clear()
    used, at = cpu_s(), time.monotonic()
    await asyncio.sleep(3.0)
    idle = (cpu_s() - used) / (time.monotonic() - at)
    figures = {kind: {name: round(float(np.median([one[name] for one in many])), 3) for name in many[0]}
               for kind, many in found.items() if many}  # fmt: skip
    return {
        "n": n + 1, **figures, "idle cpu_s_a_second": round(idle, 3), "late": watched.face.stream.late,
        "memory_mb": memory[:: max(1, len(memory) // 10)],
    }  # fmt: skip


async def livekit(session: tts2face.Session, minutes: float, sound: bytes, **options: Any) -> dict[str, Any]:
    """Figures under LiveKit's runner."""
    stage = livekit_stage.Stage(session, **options)
    await stage.start()
    watched = watch_livekit(stage)

    async def interrupt() -> None:
        stage.audio.flush()
        stage.audio.clear_buffer()

    try:
        return await run(watched, interrupt, minutes, sound)
    finally:
        await stage.avatar.aclose()


async def pipecat(session: tts2face.Session, minutes: float, sound: bytes, **options: Any) -> dict[str, Any]:
    """Figures before Pipecat's output transport."""
    from pipecat.frames.frames import EndFrame, InterruptionFrame
    from pipecat.workers.runner import WorkerRunner

    stage, runner = pipecat_stage.Stage(session, **options), WorkerRunner()
    watched = watch_pipecat(stage)
    await runner.add_workers(stage.worker)
    running = asyncio.create_task(runner.run())
    try:
        return await run(watched, lambda: stage.worker.queue_frame(InterruptionFrame()), minutes, sound)
    finally:
        await stage.worker.queue_frame(EndFrame())
        await asyncio.wait_for(running, PATIENCE_S)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="of each framework")
    parser.add_argument("--size", default="512")
    parser.add_argument("--only", choices=["livekit", "pipecat"])
    given = parser.parse_args()
    session = tts2face.Session()
    spoken = session.clip(TEXT).speech.waveform.resampled(RATE).samples
    samples = np.rint(spoken.clip(-1, 1) * 32767).astype("<i2").tobytes()
    for play in [livekit, pipecat] if given.only is None else [globals()[given.only]]:
        print(
            json.dumps(
                {play.__name__: asyncio.run(play(session, given.minutes, samples, size=given.size, fps=30.0))}, indent=1
            )
        )
