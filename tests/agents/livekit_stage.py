"""An avatar under LiveKit's own runner, in a room that publishes nothing; what its tracks get is kept in its order."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np

from tests.agents.made import FPS, SIZE, FakeSession

RATE = 24_000
PATIENCE_S = 30.0


class FakeRoom:
    """What the runner asks of a room."""

    class _Published:
        async def wait_for_subscription(self) -> None:
            pass

    def __init__(self) -> None:
        self.local_participant = self

    async def publish_track(self, *_: object) -> "_Published":
        return self._Published()

    def on(self, *_: object) -> None:
        pass

    off = on

    def isconnected(self) -> bool:
        return True


class Stage:
    """An avatar under its runner, and the pictures and sound that its tracks get, in their order."""

    def __init__(self, session: Any, **options: Any) -> None:
        from livekit.agents.voice.avatar import QueueAudioOutput

        from tts2face.agents import LiveKitAvatar

        self.avatar = LiveKitAvatar(session, **{"size": str(SIZE), "fps": FPS, **options})
        self.audio = QueueAudioOutput(sample_rate=RATE)
        self.given: list[tuple[str, Any]] = []
        self.ended: list[tuple[float, bool]] = []
        self.audio.on("playback_finished", lambda end: self.ended.append((end.playback_position, end.interrupted)))

    async def start(self) -> None:
        self.runner = self.avatar.runner(FakeRoom(), self.audio)  # type: ignore[arg-type]
        video, audio = self.runner._video_source, self.runner._audio_source
        capture_picture, capture_sound = video.capture_frame, audio.capture_frame

        def see(frame: Any, **more: Any) -> None:
            self.given.append(("picture", np.frombuffer(frame.data, np.uint8).reshape(frame.height, frame.width, -1)))
            capture_picture(frame, **more)

        async def hear(frame: Any) -> None:
            self.given.append(("sound", np.frombuffer(frame.data, np.int16)))
            await capture_sound(frame)

        video.capture_frame, audio.capture_frame = see, hear
        await self.runner.start()

    async def say(self, sound: bytes, *, is_whole: bool = True) -> None:
        await self.push(sound)
        if is_whole:
            await self.end()

    async def push(self, sound: bytes) -> None:
        from livekit import rtc

        for at in range(0, len(sound), 960):
            block = sound[at : at + 960]
            await self.audio.capture_frame(rtc.AudioFrame(block, RATE, 1, len(block) // 2))

    async def end(self) -> None:
        self.audio.flush()

    async def until(self, condition: Callable[[], object]) -> None:
        async with asyncio.timeout(PATIENCE_S):
            while not condition():
                await asyncio.sleep(0.005)

    @property
    def sound(self) -> np.ndarray:
        return np.concatenate([value for kind, value in self.given if kind == "sound"] or [np.zeros(0, np.int16)])

    def utterances(self, begin: int = 0) -> list[int]:
        """Utterances of the pictures since an index."""
        return [int(value[1, 0, 0]) for kind, value in self.given[begin:] if kind == "picture"]


def perform(script: Callable[[Stage], Awaitable[None]], session: Any = None, **options: Any) -> Stage:
    async def run() -> Stage:
        stage = Stage(session or FakeSession(), **options)
        await stage.start()
        try:
            await script(stage)
        finally:
            await stage.avatar.aclose()
        return stage

    return asyncio.run(run())
