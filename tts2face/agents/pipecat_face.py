"""A face in a Pipecat pipeline (pipecat-ai, BSD 2): after the speech service, before the transport's output."""

import asyncio
from typing import TYPE_CHECKING, Any

from pipecat.frames.frames import (
    CancelFrame,
    EndFrame,
    Frame,
    InterruptionFrame,
    OutputImageRawFrame,
    StartFrame,
    TTSAudioRawFrame,
    TTSStartedFrame,
    TTSStoppedFrame,
)
from pipecat.processors.frame_processor import FrameDirection, FrameProcessor

from tts2face.agents.agent_face import AgentFace, Tick
from tts2face.types import SOUND_RATE

if TYPE_CHECKING:
    from tts2face.session.session import Session

CHUNKS_10MS = 2  # of sound that a transport gathers: with its 4, sound is 40 ms behind its picture


class PipecatFace(FrameProcessor):
    """Takes the sound of a speech service; gives pictures, and the sound of each at the same instant.

    Parameters
    ----------
    size, fps
        Of the pictures.
    options
        As for `tts2face.Session.face_stream`: ``face``, ``style``, ``hair``, ``background``, ...

    Attributes
    ----------
    face
        The `AgentFace`, whose ``stream`` takes gestures and styles.
    """

    def __init__(self, session: "Session", *, size: str = "auto", fps: float = 30.0, **options: Any) -> None:
        super().__init__()
        self.face = AgentFace(session, size, fps, options)
        self._showing: asyncio.Task[None] | None = None
        self._is_open = False  # whether an utterance has begun, and its end has not come
        self._contexts: dict[int, str | None] = {}  # of the utterances that have not been given to their end
        self._is_silent = asyncio.Event()
        self._is_silent.set()

    @property
    def transport_params(self) -> dict[str, Any]:
        """Parameters of the transport that shows the face: ``TransportParams(**face.transport_params)``."""
        return {
            "audio_out_enabled": True, "audio_out_sample_rate": SOUND_RATE, "audio_out_10ms_chunks": CHUNKS_10MS,
            "video_out_enabled": True, "video_out_is_live": True, "video_out_framerate": round(self.face.fps),
            "video_out_width": self.face.width, "video_out_height": self.face.height,
        }  # fmt: skip

    async def process_frame(self, frame: Frame, direction: FrameDirection) -> None:
        """Keep sound and its end, which go on with their pictures; pass on all else."""
        await super().process_frame(frame, direction)
        if isinstance(frame, TTSAudioRawFrame):
            return self._hear(frame)
        if isinstance(frame, TTSStoppedFrame) and self._contexts:
            return self._end()  # one of our own follows the last sound: the bot speaks until then
        if isinstance(frame, TTSStartedFrame):
            self._end()
        if isinstance(frame, InterruptionFrame):
            return await self._interrupt(frame, direction)
        if isinstance(frame, EndFrame):
            self._end()
            await self._is_silent.wait()
        if isinstance(frame, (EndFrame, CancelFrame)):
            await self._stop()
        await self.push_frame(frame, direction)
        if isinstance(frame, StartFrame):
            self._showing = self.create_task(self._show(), "face")
        return None

    async def cleanup(self) -> None:
        """Close the face."""
        await super().cleanup()
        await self._stop()
        await asyncio.to_thread(self.face.close)

    def _hear(self, frame: TTSAudioRawFrame) -> None:
        number = self.face.push(frame.audio, frame.sample_rate, frame.num_channels)
        self._contexts[number] = frame.context_id
        self._is_open = True
        self._is_silent.clear()

    def _end(self) -> None:
        if self._is_open:
            self._is_open = False
            self.face.end()

    async def _interrupt(self, frame: Frame, direction: FrameDirection) -> None:
        self.face.interrupt()
        spoken, self._is_open = list(self._contexts.values()), False
        self._contexts.clear()
        self._is_silent.set()
        await self.push_frame(frame, direction)
        if spoken:  # the transport forgets the end of speech with what it has, and would wait 3 s for another one
            await self.push_frame(TTSStoppedFrame(context_id=spoken[0]))

    async def _show(self) -> None:
        """Give ticks on a clock of our own: the queues of the transport have no end."""
        size = self.face.width, self.face.height
        async for tick in self.face.ticks():
            if tick.picture is not None:
                await self.push_frame(OutputImageRawFrame(tick.picture, size, tick.format))
            # an interruption may have come meanwhile
            if tick.sound is not None and self.face.is_current(tick):
                context = self._contexts.get(tick.utterance)
                await self.push_frame(TTSAudioRawFrame(tick.sound, SOUND_RATE, 1, context_id=context))
            if tick.ends and self.face.is_current(tick):
                await self._finish(tick)

    async def _finish(self, tick: Tick) -> None:
        ended = [tick.utterance] if tick.utterance else list(self._contexts)
        for number in ended:
            await self.push_frame(TTSStoppedFrame(context_id=self._contexts.pop(number, None)))
        if not self._contexts:
            self._is_silent.set()

    async def _stop(self) -> None:
        task, self._showing = self._showing, None
        if task is not None:
            await self.cancel_task(task)
