"""A face before Pipecat's own output transport, which writes into a list."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np

from tests.agents.made import FPS, SIZE, FakeSession

RATE = 24_000
PATIENCE_S = 30.0


def recorder(params: dict[str, Any]) -> Any:
    """Pipecat's output transport; `written` has what it writes in its order, and the ends of speech."""
    from pipecat.frames.frames import BotStoppedSpeakingFrame
    from pipecat.transports.base_output import BaseOutputTransport
    from pipecat.transports.base_transport import TransportParams

    class Recorder(BaseOutputTransport):
        def __init__(self) -> None:
            super().__init__(TransportParams(**params, audio_out_auto_silence=False, audio_out_end_silence_secs=0))
            self.written: list[tuple[str, Any]] = []

        async def start(self, frame: Any) -> None:
            await super().start(frame)
            await self.set_transport_ready(frame)

        async def write_video_frame(self, frame: Any) -> bool:
            pixels = np.frombuffer(frame.image, np.uint8)
            self.written.append(("picture", pixels.reshape(frame.size[1], frame.size[0], -1)))
            return True

        async def write_audio_frame(self, frame: Any) -> bool:
            self.written.append(("sound", np.frombuffer(frame.audio, np.int16)))
            return True

        async def push_frame(self, frame: Any, *more: Any) -> None:
            if isinstance(frame, BotStoppedSpeakingFrame) and not more:
                self.written.append(("stopped", None))
            await super().push_frame(frame, *more)

    return Recorder()


class Stage:
    """A pipeline of a face and a recorder."""

    def __init__(self, session: Any, **options: Any) -> None:
        from pipecat.pipeline.pipeline import Pipeline
        from pipecat.pipeline.worker import PipelineWorker

        from tts2face.agents import PipecatFace

        self.face = PipecatFace(session, **{"size": str(SIZE), "fps": FPS, **options})
        self.recorder = recorder(self.face.transport_params)
        pipeline = Pipeline([self.face, self.recorder])
        self.worker = PipelineWorker(pipeline, cancel_on_idle_timeout=False, enable_rtvi=False)

    async def say(self, sound: bytes, *, is_whole: bool = True) -> None:
        from pipecat.frames.frames import TTSStartedFrame

        await self.worker.queue_frame(TTSStartedFrame())
        await self.push(sound)
        if is_whole:
            await self.end()

    async def push(self, sound: bytes) -> None:
        from pipecat.frames.frames import TTSAudioRawFrame

        for at in range(0, len(sound), 960):
            await self.worker.queue_frame(TTSAudioRawFrame(sound[at : at + 960], RATE, 1))

    async def end(self) -> None:
        from pipecat.frames.frames import TTSStoppedFrame

        await self.worker.queue_frame(TTSStoppedFrame())

    async def until(self, condition: Callable[[], object]) -> None:
        async with asyncio.timeout(PATIENCE_S):
            while not condition():
                await asyncio.sleep(0.005)

    @property
    def written(self) -> list[tuple[str, Any]]:
        return self.recorder.written  # type: ignore[no-any-return]

    @property
    def sound(self) -> np.ndarray:
        return np.concatenate([value for kind, value in self.written if kind == "sound"] or [np.zeros(0, np.int16)])

    def count(self, kind: str) -> int:
        return sum(one == kind for one, _ in self.written)


def perform(script: Callable[[Stage], Awaitable[None]], session: Any = None, **options: Any) -> Stage:
    from pipecat.frames.frames import EndFrame
    from pipecat.workers.runner import WorkerRunner

    async def run() -> Stage:
        stage, runner = Stage(session or FakeSession(), **options), WorkerRunner()
        await runner.add_workers(stage.worker)
        running = asyncio.create_task(runner.run())
        try:
            await script(stage)
            await stage.worker.queue_frame(EndFrame())
            await asyncio.wait_for(running, PATIENCE_S)
        finally:
            await stage.worker.cancel()
        return stage

    return asyncio.run(run())
