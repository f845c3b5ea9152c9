"""Answers that end before they are complete: each says why, in the way that its form has, and none looks complete."""

import base64
import json
import os
import signal
import socket
from collections.abc import Iterator

import httpx
import pytest

from tests.running import TABLE_PROGRAM, ServeProcess
from tests.serving.service import raw
from tests.serving.service.table_synthesis import FAILS, FAILURE, N_BEFORE_FAILURE, PART
from tests.started import children

SENT = PART * N_BEFORE_FAILURE  # of a film that fails
WRONG = {"error": {"message": FAILURE, "type": "invalid_request_error", "param": None, "code": "invalid_request"}}
BINARY = ("mp4", "webm", "mp3", "opus", "weba", "aac", "flac", "wav", "pcm", "livelink")
LINES = ("curves", "oculus", "azure", "words")
FIELD = b"X-Tts2face-Error: "


@pytest.fixture(scope="module")
def service() -> Iterator[ServeProcess]:
    running = ServeProcess(environment={"TTS2FACE_SERVE_WORKERS": "0"}, program=TABLE_PROGRAM)
    try:
        running.wait_until_ready()
        yield running
    finally:
        running.close()


def asked(path: str, content: dict[str, object], *lines: str, version: str = "1.1") -> bytes:
    body = json.dumps(content).encode()
    return raw.request("POST", path, body, *lines).replace(b"HTTP/1.1", f"HTTP/{version}".encode(), 1)


def chunks_of(body: bytes) -> tuple[bytes, bytes]:
    """Content of a chunked body, and what follows its last chunk."""
    content = b""
    while True:
        size, _, body = body.partition(b"\r\n")
        if int(size, 16) == 0:
            return content, body
        content, body = content + body[: int(size, 16)], body[int(size, 16) + 2 :]


@pytest.mark.parametrize("format", BINARY)
def test_a_binary_answer_has_a_trailer_and_no_end(format: str, service: ServeProcess) -> None:
    answer = raw.ask(service.url, asked("/v1/clips", {"text": f"It {FAILS}.", "format": format}))
    assert (answer.status, answer.headers["trailer"]) == (200, "X-Tts2face-Error")
    content, trailer = chunks_of(answer.body)
    assert content == SENT
    assert trailer.startswith(FIELD)
    assert json.loads(trailer.removeprefix(FIELD)) == WRONG
    assert not trailer.endswith(b"\r\n\r\n")  # whoever reads no trailers sees that the answer is incomplete


def test_a_client_that_reads_trailers_gets_the_end_of_the_message(service: ServeProcess) -> None:
    answer = raw.ask(service.url, asked("/v1/clips", {"text": FAILS, "format": "mp4"}, "TE: trailers, deflate"))
    _, trailer = chunks_of(answer.body)
    assert trailer.endswith(b"\r\n\r\n")
    assert json.loads(trailer.removeprefix(FIELD)) == WRONG


def test_a_client_without_trailers_sees_that_the_answer_is_incomplete(service: ServeProcess) -> None:
    with (
        pytest.raises(httpx.RemoteProtocolError, match="peer"),
        httpx.stream("POST", f"{service.url}/v1/clips", json={"text": FAILS}, timeout=60) as answer,
    ):
        for _ in answer.iter_bytes():
            pass


def test_a_client_of_http_1_0_gets_what_there_is(service: ServeProcess) -> None:
    answer = raw.ask(service.url, asked("/v1/clips", {"text": FAILS, "format": "mp4"}, version="1.0"))
    assert (answer.status, answer.body) == (200, SENT)


@pytest.mark.parametrize("format", LINES)
def test_lines_end_with_one_of_the_error(format: str, service: ServeProcess) -> None:
    answer = httpx.post(f"{service.url}/v1/clips", json={"text": FAILS, "format": format}, timeout=60)
    assert "trailer" not in answer.headers
    assert json.loads(answer.content.removeprefix(SENT)) == WRONG
    assert answer.content.endswith(b"\n")


def test_events_end_with_one_of_the_error(service: ServeProcess) -> None:
    asked = {"input": FAILS, "stream_format": "sse"}
    events = httpx.post(f"{service.url}/v1/audio/speech", json=asked, timeout=60).text.strip().split("\n\n")
    assert len(events) == N_BEFORE_FAILURE + 1
    kind, _, data = events[-1].partition("\n")
    assert kind == "event: error"
    assert json.loads(data.removeprefix("data: ")) == {"type": "error", **WRONG}


def test_an_object_ends_as_one(service: ServeProcess) -> None:
    asked = {"input": FAILS, "timestamps": ["word"]}
    answer = httpx.post(f"{service.url}/v1/audio/speech", json=asked, timeout=60).json()
    assert answer == {"audio": base64.b64encode(SENT[: len(SENT) // 3 * 3]).decode(), **WRONG}


def test_captioned_lines_end_with_one_of_the_error(service: ServeProcess) -> None:
    answer = httpx.post(f"{service.url}/dev/captioned_speech", json={"input": FAILS}, timeout=60).text.splitlines()
    assert len(answer) == N_BEFORE_FAILURE + 1
    assert json.loads(answer[-1]) == WRONG


def begun(service: ServeProcess) -> socket.socket:
    """A connection on which a film has begun."""
    connection = raw.connect(service.url)
    connection.sendall(asked("/v1/clips", {"text": "We were away.", "format": "mp4"}))
    content = b""
    while PART[:256] not in content:
        content += connection.recv(65_536)
    return connection


def reason_of(connection: socket.socket) -> dict[str, str]:
    """What the trailer of an answer says of its end."""
    with connection:
        found = raw.read_all(connection).rpartition(FIELD)
    assert found[1]
    error: dict[str, str] = json.loads(found[2])["error"]
    return error


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_the_end_of_a_process_is_said(service: ServeProcess) -> None:
    connection = begun(service)
    for process in children(service.process.pid):
        os.kill(process, signal.SIGKILL)
    assert reason_of(connection)["code"] == "unavailable"
    service.wait_until_ready()


def test_the_end_of_the_service_is_said() -> None:
    environment = {"TTS2FACE_SERVE_DRAIN_S": "0.2", "TTS2FACE_SERVE_WORKERS": "0"}
    running = ServeProcess(environment=environment, program=TABLE_PROGRAM)
    try:
        running.wait_until_ready()
        connection = begun(running)
        running.process.send_signal(signal.SIGTERM)
        assert reason_of(connection)["code"] == "draining"
    finally:
        running.close()


def test_the_log_has_the_reason(service: ServeProcess) -> None:
    with pytest.raises(httpx.RemoteProtocolError):
        httpx.post(f"{service.url}/v1/clips", json={"text": FAILS}, timeout=60, headers={"X-Request-ID": "failed-late"})
    assert service.wait_for_event("request", id="failed-late")["code"] == "invalid_request"
