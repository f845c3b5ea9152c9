"""A live target that sends WebRTC by aiortc in the process of the face, to compare with `whip:`."""

import asyncio
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import av
import numpy as np
from aiortc import MediaStreamTrack, RTCPeerConnection, RTCRtpSender, RTCSessionDescription
from aiortc.codecs import h264, vpx
from av.video.reformatter import ColorRange, Colorspace, VideoReformatter

from tests.targets.receivers import TOKEN
from tts2face.targets.address import Address
from tts2face.targets.target import ConnectedTarget, TargetLostError
from tts2face.targets.tick import LiveFormat, Tick
from tts2face.types import SOUND_RATE

CLOCK_HZ = 90_000  # of RTP's pictures
N_BLOCK = SOUND_RATE // 50  # sound of 20 ms: aiortc sends frames of other lengths wrongly
BITS = 1_500_000  # as `whip:` has; aiortc begins with them and follows the receiver's estimate


class Pictures(MediaStreamTrack):
    """Pictures as they come."""

    kind = "video"

    def __init__(self, fps: Fraction) -> None:
        super().__init__()
        self.fps, self.waiting, self._reformatter = fps, asyncio.Queue[Tick](2), VideoReformatter()

    async def recv(self) -> av.VideoFrame:
        """The next picture as YUV."""
        tick = await self.waiting.get()
        frame = self._reformatter.reformat(
            av.VideoFrame.from_numpy_buffer(np.ascontiguousarray(tick.pixels), format="rgb24"), format="yuv420p",
            dst_colorspace=Colorspace.ITU709, src_color_range=ColorRange.JPEG, dst_color_range=ColorRange.MPEG,
            threads=1,
        )  # fmt: skip
        frame.pts, frame.time_base = round(tick.number * CLOCK_HZ / self.fps), Fraction(1, CLOCK_HZ)
        return frame


class Sound(MediaStreamTrack):
    """Sound in blocks of 20 ms."""

    kind = "audio"

    def __init__(self) -> None:
        super().__init__()
        self.waiting, self._n_sent = asyncio.Queue[Any](50), 0

    async def recv(self) -> av.AudioFrame:
        """The next block."""
        samples = await self.waiting.get()
        frame = av.AudioFrame.from_ndarray((samples * 32767).astype(np.int16)[None], format="s16", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = SOUND_RATE, self._n_sent, Fraction(1, SOUND_RATE)
        self._n_sent += len(samples)
        return frame


class AiortcTarget(ConnectedTarget):
    """WebRTC by aiortc; the codec is H264 or VP8."""

    draws = True

    def __init__(self, address: Address, format: LiveFormat, codec: str) -> None:
        super().__init__(address, format, round(format.fps))
        self._codec = codec
        h264.DEFAULT_BITRATE = vpx.DEFAULT_BITRATE = BITS

    async def deliver(self, on_connected: Callable[[], None]) -> None:
        """Offer, and hand ticks to the tracks until the end."""
        import aiohttp

        peer, pictures, sound = RTCPeerConnection(), Pictures(self.format.fps), Sound()
        video = peer.addTransceiver(pictures, direction="sendonly")
        peer.addTransceiver(sound, direction="sendonly")
        codecs = RTCRtpSender.getCapabilities("video").codecs
        video.setCodecPreferences([codec for codec in codecs if self._codec in codec.mimeType.upper()])
        await peer.setLocalDescription(await peer.createOffer())
        heads = {"Content-Type": "application/sdp", "Authorization": f"Bearer {TOKEN}"}
        async with aiohttp.ClientSession() as http:
            async with http.post(self.address.url, data=peer.localDescription.sdp, headers=heads) as answer:
                if answer.status != 201:
                    raise TargetLostError(f"the receiver answers {answer.status}")
                place = answer.headers["Location"]
                await peer.setRemoteDescription(RTCSessionDescription(await answer.text(), "answer"))
            while peer.connectionState != "connected":
                await asyncio.sleep(0.01)
            on_connected()
            await self._hand_over(pictures, sound)
            await http.delete(place)
        await peer.close()

    async def _hand_over(self, pictures: Pictures, sound: Sound) -> None:
        """Hand ticks to the tracks; of pictures the newest, of sound all."""
        left = np.zeros(0, np.float32)
        while ticks := await self.outbox.take():
            for tick in ticks:
                if tick.pixels is not None and not pictures.waiting.full():
                    pictures.waiting.put_nowait(tick)
                left = np.concatenate([left, tick.sound])
                while len(left) >= N_BLOCK:
                    if not sound.waiting.full():
                        sound.waiting.put_nowait(left[:N_BLOCK])
                    left = left[N_BLOCK:]
