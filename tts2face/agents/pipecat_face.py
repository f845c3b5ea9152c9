"""A face in a Pipecat pipeline (pipecat-ai, BSD 2): after the speech service, before the transport's output."""

import asyncio
from typing import TYPE_CHECKING, Any

from pipecat.frames.frames import (
    CancelFrame,
    EndFrame,
    Frame,
    InterruptionFrame,
    LLMFullResponseEndFrame,
    LLMTextFrame,
    OutputImageRawFrame,
    StartFrame,
    TTSAudioRawFrame,
    TTSSpeakFrame,
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
    """Takes the sound of a speech service, or the text of a model; gives pictures, and sound at the same instants.

    Parameters
    ----------
    speaks_text
        Whether it speaks what a language model writes (`LLMTextFrame`, `TTSSpeakFrame`) in the voice of its face, so
        that no speech service is needed.
    size, fps
        Of the pictures.
    options
        As for `tts2face.Session.face_stream`: ``style``, ``voice``, ``hair``, ``background``, ...

    Attributes
    ----------
    face
        The `AgentFace`, whose ``stream`` takes gestures and styles.
    """

    def __init__(
        self, session: "Session", *, speaks_text: bool = False, size: str = "auto", fps: float = 30.0, **options: Any
    ) -> None:
        super().__init__()
        self._speaks_text = speaks_text
        self.face = AgentFace(session, size, fps, options)
        self._showing: asyncio.Task[None] | None = None
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
            return self.face.end()  # one of our own follows the last sound: the bot speaks until then
        if isinstance(frame, InterruptionFrame):
            return await self._interrupt(frame, direction)
        if isinstance(frame, (TTSStartedFrame, EndFrame)):
            self.face.end()
        if self._speaks_text:
            self._read(frame)
        if isinstance(frame, (EndFrame, CancelFrame)):
            await self._stop(is_patient=isinstance(frame, EndFrame))
        await self.push_frame(frame, direction)
        if isinstance(frame, StartFrame):
            self._showing = self.create_task(self._show(), "face")
        return None

    async def cleanup(self) -> None:
        """Close the face."""
        await super().cleanup()
        await self._stop(is_patient=False)
        await asyncio.to_thread(self.face.close)

    def _hear(self, frame: TTSAudioRawFrame) -> None:
        self._begin(self.face.push(frame.audio, frame.sample_rate, frame.num_channels), frame.context_id)

    def _read(self, frame: Frame) -> None:
        """Speak a text, or more of one, sentence by sentence."""
        if isinstance(frame, (LLMTextFrame, TTSSpeakFrame)):
            self._begin(self.face.push_text(frame.text), None)
        if isinstance(frame, (LLMFullResponseEndFrame, TTSSpeakFrame)):
            self.face.end()

    def _begin(self, utterance: int, context: str | None) -> None:
        self._contexts[utterance] = context
        self._is_silent.clear()

    async def _interrupt(self, frame: Frame, direction: FrameDirection) -> None:
        self.face.interrupt()
        spoken = list(self._contexts.values())
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
        for number in [number for number in self._contexts if number <= tick.utterance]:
            await self.push_frame(TTSStoppedFrame(context_id=self._contexts.pop(number)))
        if not self._contexts:
            self._is_silent.set()

    async def _stop(self, *, is_patient: bool) -> None:
        """End the ticks; `is_patient`: when all has been spoken."""
        task, self._showing = self._showing, None
        if task is not None:
            if is_patient:
                await self._is_silent.wait()
            await self.cancel_task(task)
