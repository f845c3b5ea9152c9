"""A face as the avatar of a LiveKit agent (livekit-agents, Apache 2.0): run by its own `AvatarRunner`."""

import asyncio
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any

from livekit import rtc
from livekit.agents.voice.avatar import AudioReceiver, AudioSegmentEnd, AvatarOptions, AvatarRunner, VideoGenerator

from tts2face.agents.agent_face import SAMPLE_BYTES, AgentFace
from tts2face.types import SOUND_RATE

if TYPE_CHECKING:
    from tts2face.session.session import Session

BUFFERS = {"RGB": rtc.VideoBufferType.RGB24, "RGBA": rtc.VideoBufferType.RGBA}  # LiveKit takes no other order of bytes


class LiveKitAvatar(VideoGenerator):
    """Speaks the sound that an agent sends, and gives pictures and sound to a room.

    Parameters
    ----------
    size, fps
        Of the pictures.
    options
        As for `tts2face.Session.face_stream`: ``style``, ``voice``, ``hair``, ``background``, ...

    Attributes
    ----------
    face
        The `AgentFace`, whose ``stream`` takes gestures and styles.
    """

    def __init__(self, session: "Session", *, size: str = "auto", fps: float = 30.0, **options: Any) -> None:
        self.face = AgentFace(session, size, fps, options)
        self._runner: AvatarRunner | None = None
        self._is_open = False  # whether a segment has begun, and its end has not come
        self._has_ended = asyncio.Event()  # the last segment

    @property
    def options(self) -> AvatarOptions:
        """Size and rate of pictures, rate and channels of sound: LiveKit fixes them at the beginning."""
        return AvatarOptions(self.face.width, self.face.height, self.face.fps, SOUND_RATE, 1)

    def runner(self, room: rtc.Room, audio: AudioReceiver) -> AvatarRunner:
        """Runner that takes sound from a receiver and publishes the avatar's tracks in a room."""
        self._runner = AvatarRunner(room, audio_recv=audio, video_gen=self, options=self.options)
        return self._runner

    async def push_audio(self, frame: rtc.AudioFrame | AudioSegmentEnd) -> None:
        """Speak more of a segment, or its end.

        It returns when an ended segment has been given as a whole: the runner reports the end of one segment only
        where the next one reaches it later (livekit-agents 1.8).
        """
        if isinstance(frame, rtc.AudioFrame):
            self.face.push(bytes(frame.data), frame.sample_rate, frame.num_channels)
            self._is_open = True
        elif self._is_open:
            self._is_open = False
            self._has_ended.clear()
            self.face.end()
            await self._has_ended.wait()

    async def clear_buffer(self) -> None:
        """Be silent at once; what the runner has taken and not sent is forgotten, too, which it does not do itself."""
        self.face.interrupt()
        self._is_open = False
        self._has_ended.set()
        if self._runner is not None:
            await self._runner.av_sync.clear_queue()

    async def __aiter__(self) -> AsyncIterator[rtc.VideoFrame | rtc.AudioFrame | AudioSegmentEnd]:
        """Each tick its picture, then its sound: none in silence, since the runner takes every sample for speech."""
        width, height = self.face.width, self.face.height
        async for tick in self.face.ticks():
            if tick.picture is not None:
                yield rtc.VideoFrame(width, height, BUFFERS[tick.format], tick.picture)
            # an interruption may have come while the runner took the picture
            if tick.sound is not None and self.face.is_current(tick):
                yield rtc.AudioFrame(tick.sound, SOUND_RATE, 1, len(tick.sound) // SAMPLE_BYTES)
            if tick.ends and self.face.is_current(tick):
                yield AudioSegmentEnd()
                self._has_ended.set()

    async def aclose(self) -> None:
        """Close runner and face."""
        if self._runner is not None:
            await self._runner.aclose()
        self._has_ended.set()
        await asyncio.to_thread(self.face.close)
