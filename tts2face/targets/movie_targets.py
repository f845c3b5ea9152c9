"""Pictures and sound for servers: WebRTC by WHIP (RFC 9725), RTMP and RTSP, each sent by a process of its own."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import aclosing
from typing import Any, ClassVar

import numpy as np

from lexicon.errors import BackendError
from tts2face.processes.async_parent import AsyncChild, Inputs
from tts2face.processes.message import EVENT
from tts2face.targets.address import TOKEN_VARIABLE, Address
from tts2face.targets.certificate import own_certificate
from tts2face.targets.movie_sender import CONNECT_S, END, SEND, SENDER_PROGRAM, TAKEN
from tts2face.targets.states import CONNECTED
from tts2face.targets.target import ConnectedTarget, TargetLostError
from tts2face.targets.tick import LiveFormat, Tick

STALL_S = 10.0  # for which a server may take nothing
N_AHEAD = 2  # messages that the process has not taken
SOUND_S = 1.0  # of sound that waits for it; what is older is left out
USUAL_KBPS = 1500  # of a face before a still background, of 512 x 512 pixels and 30 frames in a second
USUAL_PIXELS, USUAL_FPS = 512 * 512, 30
KBPS = "kbps"  # options
TOKEN, KEY = "token", "key"
HANDSHAKE_MS = 8000  # of WebRTC


class MovieTarget(ConnectedTarget):
    """Base of the servers that get pictures and sound."""

    draws = True
    container: ClassVar[str]
    audio: ClassVar[str] = "aac"
    options: ClassVar[Mapping[str, str]] = {}

    def __init__(self, address: Address, format: LiveFormat) -> None:
        super().__init__(address, format, max(1, round(SOUND_S * format.fps)))
        self._secret = self.read_secret()

    def read_secret(self) -> str:
        """Key or token of the server; raises as `Address.secret`."""
        return ""

    @property
    def kbps(self) -> int:
        """Bits of pictures in a second, in thousands: of the address, or by size and rate."""
        size = self.format.width * self.format.height / USUAL_PIXELS * float(self.format.fps) / USUAL_FPS
        return int(self.address.options.get(KBPS, round(USUAL_KBPS * max(size, 0.1) ** 0.75)))

    @contextlib.contextmanager
    def opened(self) -> Iterator[tuple[str, dict[str, str]]]:
        """URL that the library opens, and the options of its muxer, valid within a block."""
        yield self.address.url, dict(self.options)

    async def deliver(self, on_connected: Callable[[], None]) -> None:
        """Start the process, and send what waits whenever it has taken what it got."""
        child, room = AsyncChild(SENDER_PROGRAM), asyncio.Semaphore(N_AHEAD)
        is_connected = asyncio.Event()
        with self.opened() as (url, options):
            content = {
                "url": url, "options": options, "container": self.container, "audio": self.audio,
                "fps": str(self.format.fps), "width": self.format.width, "height": self.format.height,
                "kbps": self.kbps, "mark": self.mark.parts(),
            }  # fmt: skip
            try:
                async with asyncio.timeout(CONNECT_S) as limit:
                    inputs = self._inputs(is_connected, room)
                    async with aclosing(child.stream(SEND, content, inputs=inputs)) as messages:
                        async for message in messages:
                            if message.kind != EVENT:
                                return
                            limit.reschedule(asyncio.get_running_loop().time() + STALL_S)
                            if message.content.get("state") == CONNECTED:
                                on_connected()
                                is_connected.set()
                            elif TAKEN in message.content:
                                room.release()
            except TimeoutError as late:
                seconds, did = (STALL_S, "taken") if is_connected.is_set() else (CONNECT_S, "answered")
                raise TargetLostError(f"it has {did} nothing for {seconds:g} s") from late
            except BackendError as refused:
                raise TargetLostError(self.explained(str(refused))) from refused
            finally:
                await child.close()

    def explained(self, reason: str) -> str:
        """Meaning of a refusal, if that is known; never with a secret."""
        return reason.replace(self._secret, "...") if self._secret else reason

    async def _inputs(self, is_connected: asyncio.Event, room: asyncio.Semaphore) -> Inputs:
        await is_connected.wait()
        while True:
            await room.acquire()
            ticks = await self.outbox.take()
            if not ticks:
                yield {END: True}, b""
                return
            yield _content(ticks)


def _content(ticks: list[Tick]) -> tuple[dict[str, Any], bytes]:
    """Message of consecutive ticks: the newest picture, and all their sound."""
    shown = next((tick for tick in reversed(ticks) if tick.pixels is not None), None)
    pixels = b"" if shown is None or shown.pixels is None else np.ascontiguousarray(shown.pixels[:, :, :3]).tobytes()
    sound = np.concatenate([tick.sound for tick in ticks]).astype(np.float32, copy=False).tobytes()
    number = ticks[0].number
    head = {"number": number, "picture": number if shown is None else shown.number, "n_pixels": len(pixels)}
    return head, pixels + sound


class WhipTarget(MovieTarget):
    """WebRTC: H.264 and Opus in stereo, as the muxer's offer says; the token is a Bearer's."""

    container, audio = "whip", "libopus"

    def read_secret(self) -> str:
        """Token of the file that the address names, or of `TOKEN_VARIABLE`."""
        return self.address.secret(TOKEN, TOKEN_VARIABLE)

    @contextlib.contextmanager
    def opened(self) -> Iterator[tuple[str, dict[str, str]]]:
        """With a certificate of one's own, and the default role of DTLS, which all receivers that were tried take."""
        with own_certificate() as files:
            token = {"authorization": self._secret} if self._secret else {}
            yield self.address.url, {"handshake_timeout": str(HANDSHAKE_MS), **files, **token}

    def explained(self, reason: str) -> str:
        """The same, and that a token may be wrong."""
        shown = super().explained(reason)
        if "401" in shown or "403" in shown or "Unauthorized" in shown or "Forbidden" in shown:
            return f"it refuses the token: check the file behind #token= or {TOKEN_VARIABLE}"
        return shown


class RtmpTarget(MovieTarget):
    """RTMP: H.264 and AAC; the stream key may lie in a file."""

    container = "flv"
    options: ClassVar[Mapping[str, str]] = {"flvflags": "no_duration_filesize"}

    def read_secret(self) -> str:
        """Stream key of the file that the address names."""
        return self.address.secret(KEY)

    @contextlib.contextmanager
    def opened(self) -> Iterator[tuple[str, dict[str, str]]]:
        """With the stream key at the end of the path."""
        url = self.address.url
        yield f"{url.rstrip('/')}/{self._secret}" if self._secret else url, dict(self.options)


class RtspTarget(MovieTarget):
    """RTSP, in one connection (TCP): H.264 and AAC."""

    container = "rtsp"
    options: ClassVar[Mapping[str, str]] = {"rtsp_transport": "tcp"}
