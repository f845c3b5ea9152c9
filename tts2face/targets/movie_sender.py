"""The process that encodes a live face and sends it by PyAV; connecting there stops every thread of its process."""

import signal
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from types import MappingProxyType
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from lexicon.errors import BackendError
from tts2face.picture.movie import LIVE_H264, MovieKind, MovieWriter
from tts2face.processes.child import Call, Handler
from tts2face.processes.program import Program
from tts2face.storage.marks import Mark
from tts2face.targets.states import CONNECTED
from tts2face.targets.tick import LiveFormat
from tts2face.types import SOUND_RATE

SENDER_PROGRAM = Program(f"{__name__}:HANDLERS")
SEND = "send"  # name of the call
TAKEN = "taken"  # event: a message has been encoded and sent
END = "end"  # field of the last message
CONNECT_S = 15.0  # within which a server must answer
MAX_REASON_CHARACTERS = 300
ALARM_S = CONNECT_S + 5.0  # after which the system ends a process whose parent is gone while it connects


def send(call: Call) -> Mapping[str, Any]:
    """Connect, then encode and send the frames of each message until its `END`.

    Payloads are the pixels, if there are new ones, and the samples, which begin with the frame ``number``. Samples that
    the parent has left out are silence: behind a gap of times encoders place sound too early.

    Raises
    ------
    BackendError
        The server refuses the stream, or the connection is lost.
    """
    import av

    content = call.content
    format = LiveFormat(Fraction(content["fps"]), content["width"], content["height"])
    try:
        writer = _open(content, format)
        call.event({"state": CONNECTED})
        first: int | None = None
        n_samples = 0
        while not (message := call.more()).content.get(END):
            number, n_pixels = message.content["number"], message.content["n_pixels"]
            first = number if first is None else first
            samples = np.frombuffer(message.payload, np.float32, offset=n_pixels)
            missing = format.sample(number) - format.sample(first) - n_samples
            samples = np.concatenate([np.zeros(max(missing, 0), np.float32), samples])
            n_samples += len(samples)
            if n_pixels:
                shape = format.height, format.width, 3
                pixels = np.frombuffer(message.payload, np.uint8, n_pixels).reshape(shape)
                writer.n_frames = message.content["picture"] - first
                writer.picture(pixels)
            writer.sound(samples)
            call.event({TAKEN: number})
        writer.finish()
    except (av.FFmpegError, OSError) as error:
        raise BackendError(_reason(error, content["url"])) from error
    return {}


def _open(content: Mapping[str, Any], format: LiveFormat) -> MovieWriter:
    """A writer that is connected."""
    if hasattr(signal, "setitimer"):  # not on Windows
        signal.setitimer(signal.ITIMER_REAL, ALARM_S)
    kind = live_kind(content["container"], content["audio"], format)
    kind = replace(kind, container_options=content["options"], video_bits=1000 * content["kbps"])
    shape = format.height, format.width, 3
    writer = MovieWriter(content["url"], kind, shape, (format.fps, SOUND_RATE), Mark(**content["mark"]))
    writer.start()
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return writer


def live_kind(container: str, audio: str, format: LiveFormat) -> MovieKind:
    """Encoding for a server: H.264 that every browser decodes, with a key picture every two seconds."""
    options = dict(LIVE_H264)
    options["x264-params"] += f":keyint={max(1, round(2 * format.fps))}"
    sound = {"application": "lowdelay", "frame_duration": "20"} if audio == "libopus" else {}
    return MovieKind(container, "libx264", audio, 128_000, options, audio_options=sound, audio_layout="stereo")


def _reason(error: Exception, url: str) -> str:
    """Message of the library, without the address."""
    said = getattr(error, "strerror", None) or str(error)
    log = getattr(error, "log", None)  # level, part of the library, message
    said += f": {log[2]}" if log else ""
    for address in (url, str(urlsplit(url).hostname)):
        said = said.replace(address, "the server")
    return " ".join(said.split())[:MAX_REASON_CHARACTERS]


HANDLERS: Mapping[str, Handler] = MappingProxyType({SEND: send})
