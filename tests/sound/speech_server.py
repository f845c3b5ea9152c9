"""A small server with OpenAI's route of speech on this machine, whose voice is espeak-ng, and what it was asked for."""

import base64
import io
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

from tts2face.sound.voice_pool import load_voice
from tts2face.storage.wave_files import wave_bytes
from tts2face.types import Speech

Reply = tuple[int, dict[str, str], bytes]


def spoken(text: str, speed: float = 1.0) -> Speech:
    """A sentence by espeak-ng, the same for the server and the test."""
    return load_voice("espeak", "en-us").speak(text, rate=speed)


def wave_reply(speech: Speech) -> Reply:
    """Answer with a WAV file."""
    content = wave_bytes(speech.waveform.samples, speech.waveform.rate)
    return 200, {"Content-Type": "audio/wav"}, content


def captioned_reply(speech: Speech, later_s: float = 0.0) -> Reply:
    """Answer of Kokoro-FastAPI with the times of words, which are late, and as much silence."""
    edges = speech.phones.edges
    words = [
        {"word": word.text, "start_time": edges[word.first] + later_s, "end_time": edges[word.last] + later_s}
        for word in speech.words
    ]
    samples = np.pad(speech.waveform.samples, (0, round(later_s * speech.waveform.rate)))
    audio = base64.b64encode(wave_bytes(samples, speech.waveform.rate)).decode()
    return 200, {"Content-Type": "application/json"}, json.dumps({"audio": audio, "timestamps": words}).encode()


@dataclass
class SpeechServer:
    """Replies of a server by path, and the requests that it got: path, headers, content."""

    replies: dict[str, Callable[[dict[str, Any]], Reply]] = field(default_factory=dict)
    asked: list[tuple[str, dict[str, str], dict[str, Any]]] = field(default_factory=list)
    port: int = 0

    @property
    def url(self) -> str:
        """URL of its voice."""
        return f"http://127.0.0.1:{self.port}/v1#af_heart"

    def texts(self, path: str = "/v1/audio/speech") -> list[str]:
        """Texts for which a path was asked."""
        return [content["input"] for asked, _, content in self.asked if asked == path]


@contextmanager
def speech_server(**replies: Callable[[dict[str, Any]], Reply]) -> Iterator[SpeechServer]:
    """A running server: `speech` and `captioned` are its replies to the two routes; others are not found."""
    paths = {"speech": "/v1/audio/speech", "captioned": "/dev/captioned_speech"}
    state = SpeechServer({paths[name]: reply for name, reply in replies.items()})

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            content = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            state.asked.append((self.path, dict(self.headers), content))
            reply = state.replies.get(self.path)
            status, headers, body = (404, {}, b'{"detail": "Not Found"}') if reply is None else reply(content)
            self.send_response(status)
            for name, value in {"Content-Length": str(len(body)), **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            with io.BytesIO(body) as rest:
                self.wfile.write(rest.read())

        def log_message(self, *_: Any) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    state.port = server.server_address[1]
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield state
    finally:
        server.shutdown()
        server.server_close()
