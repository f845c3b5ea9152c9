"""Hostile requests against a real server: each is refused as documented, and the server serves on."""

import asyncio
import gzip
import io
import json
import os
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import httpx
import numpy as np
import pytest
import websockets

from tests.service.conftest import RunningService
from tests.service.raw import ask, connect, drip, head, parse, read_all, request
from tests.service.test_uploads import png_bomb

SPEECH = "/v1/audio/speech"
SETTINGS = {"HEAD_S": "1.5", "BODY_S": "2", "STALL_S": "2", "BODY_MB": "2", "SOUND_S": "20", "MESSAGE_KB": "64"}


@pytest.fixture(scope="module")
def attacked() -> Iterator[RunningService]:
    running = RunningService(environment={f"TTS2FACE_SERVE_{name}": value for name, value in SETTINGS.items()})
    try:
        running.wait_until_ready()
        yield running
    finally:
        log = running.close()
    assert running.process.returncode == 0, log[-3000:]
    assert not [event for event in running.events() if event["event"] == "defect"]


@pytest.fixture(autouse=True)
def alive(attacked: RunningService) -> Iterator[None]:
    """After every attack the server is ready and speaks."""
    yield
    assert httpx.get(f"{attacked.url}/readyz", timeout=60).status_code == 200
    assert say(attacked, "Hello.").status_code == 200


def say(service: RunningService, text: str) -> httpx.Response:
    body = {"input": text, "model": "tts-1", "voice": "alloy", "response_format": "pcm"}
    return httpx.post(service.url + SPEECH, json=body, timeout=60)


def spoken(text: str = "Hello.") -> dict[str, str]:
    return {"input": text, "model": "tts-1", "voice": "alloy"}


# Heads


@pytest.mark.parametrize(
    ("lines", "status"),
    [
        (["X-Request-ID: id\r\n\tInjected: yes"], 200),  # a folded line is joined; such an id is replaced
        (["X-Request-ID: \x1b[31m"], 200),
        (["X-Request-ID: id\rInjected: yes"], 400),
        (["X-Request-ID: id\x00"], 400),
        (["Idempotency-Key: a\rb: c"], 400),
        (["Host: other"], 400),
        (["Content-Length: 5", "Content-Length: 6"], 400),
        (["Content-Length: -5"], 400),
        (["Content-Length: " + "9" * 5000], 400),
        (["Content-Length: " + "9" * 18], 413),
        (["Transfer-Encoding: chunked", "Content-Length: 5"], 400),
        (["Transfer-Encoding: gzip, chunked"], 400),
        ([f"X-{number}: a" for number in range(3000)], 431),
        (["X-A: " + "a" * 100_000], 431),
        (["X-A: " + "a" * 1_000_000], 431),
        (["Authorization: Bearer " + "\xff" * 50_000], 200),  # a service without keys ignores it
    ],
)
def test_hostile_heads(attacked: RunningService, lines: list[str], status: int) -> None:
    answer = ask(attacked.url, head("GET", "/v1/models", *lines))
    assert answer.status == status, answer
    assert "injected" not in answer.headers
    if status == 200:
        assert answer.headers["x-request-id"].isalnum()
    else:
        assert answer.code in {"invalid_request", "too_large"}


@pytest.mark.parametrize(
    ("content", "status"),
    [
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 400),  # TLS
        (b"\x00" * 100 + b"\r\n\r\n", 400),
        (b"GET /v1/models HTTP/1.1\r\nConnection: close\r\n\r\n", 400),  # no host
        (b"G\xffT / HTTP/1.1\r\nHost: localhost\r\n\r\n", 400),
        (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 421),
        (head("GET", "/" + "a" * 60_000), 404),
        (head("GET", "/" + "a" * 100_000), 431),
        (head("GET", "/v1/models?" + "a=b&" * 10_000), 200),
        (head("GET", "/%ff%fe%00/..%2f..%2fetc/passwd"), 404),
        (head("GET", "/docs/../../etc/passwd"), 404),
        (head("GET", "http://localhost/v1/models"), 404),
        (head("CONNECT", "localhost:22"), 404),
        (head("TRACE", "/v1/models"), 405),
        (head("X" * 1000, "/v1/models"), 405),
        (head("GET", "/v1/stream", "Connection: upgrade", "Upgrade: websocket"), 400),
    ],
)
def test_hostile_addresses_and_methods(attacked: RunningService, content: bytes, status: int) -> None:
    assert ask(attacked.url, content).status == status


# Bodies


def nested(depth: int) -> bytes:
    return b'{"input": ' + b"[" * depth + b"]" * depth + b"}"


@pytest.mark.parametrize("path", [SPEECH, "/v1/clips", "/v1/synthesize"])
@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"null",
        b'{"input": NaN, "text": NaN, "speed": NaN, "rate": NaN}',
        b'{"input": "Hi.", "text": "Hi.", "speed": Infinity, "rate": -Infinity, "fps": 1e999}',
        b'{"input": "Hi.", "text": "Hi.", "speed": ' + b"9" * 10_000 + b', "rate": ' + b"9" * 10_000 + b"}",
        b'{"input": "Hi.\xff\xfe", "text": "Hi.\xff\xfe"}',
        b'{"input": "\\ud800", "text": "\\ud800"}',
        b'{"input": {"\\udfff": 1}, "text": 1}',
        b"\xff\xfe{\x00}\x00",
        nested(100_000),
        gzip.compress(b'{"input": "Hi.", "text": "Hi."}'),
        gzip.compress(gzip.compress(bytes(1 << 20))),
    ],
    ids=lambda body: repr(body[:30]) if isinstance(body, bytes) else body,
)
def test_hostile_json(attacked: RunningService, path: str, body: bytes) -> None:
    answer = ask(attacked.url, request("POST", path, body))
    assert answer.status in {400, 422}, answer
    assert json.loads(answer.body)["error"]


def test_an_encoded_body_is_not_decoded(attacked: RunningService) -> None:
    """A tiny body that would decode to gigabytes is no JSON."""
    bomb = gzip.compress(gzip.compress(bytes(1 << 24)))
    assert ask(attacked.url, request("POST", SPEECH, bomb, "Content-Encoding: gzip")).status in {400, 422}


def test_the_last_of_two_equal_fields_counts_and_unknown_ones_are_refused(attacked: RunningService) -> None:
    twice = b'{"text": "", "text": "Hello.", "format": "wav", "format": "oculus"}'
    answer = ask(attacked.url, request("POST", "/v1/clips", twice))
    assert (answer.status, b"Hello" not in answer.body) == (200, True)
    unknown = ask(attacked.url, request("POST", "/v1/clips", b'{"text": "Hi.", "__class__": "os.system"}'))
    assert (unknown.status, unknown.code) == (422, "invalid_request")


def test_a_gigabyte_is_refused_before_it_is_sent(attacked: RunningService) -> None:
    """Stated: nothing is read. In chunks: a little more than the limit is read, then the connection ends."""
    stated = ask(attacked.url, head("POST", SPEECH, "Content-Type: application/json", "Content-Length: 1000000000"))
    assert (stated.status, stated.code) == (413, "too_large")
    expected = head("POST", SPEECH, "Content-Length: 1000000000", "Expect: 100-continue")
    assert ask(attacked.url, expected).status == 413
    block = b"10000\r\n" + b" " * 0x10000 + b"\r\n"
    n_sent, kept_open = 0, head("POST", SPEECH, "Transfer-Encoding: chunked").replace(b"Connection: close\r\n", b"")
    with connect(attacked.url) as connection:
        connection.sendall(kept_open)
        try:
            while n_sent < 1_000_000_000:
                n_sent += connection.send(block)
        except (ConnectionResetError, BrokenPipeError):
            pass
    assert n_sent < 100_000_000
    with connect(attacked.url) as connection:
        connection.sendall(kept_open + 40 * block)
        answer = parse(read_all(connection))
    assert (answer.status, answer.code) == (413, "too_large")


# Time


def test_slow_heads_and_bodies_are_ended(attacked: RunningService) -> None:
    """A byte now and then keeps no connection open, the first request of a connection or a later one."""
    n_sent, came = drip(attacked.url, head("GET", "/v1/models"), 1, 0.1)
    assert n_sent < len(head("GET", "/v1/models"))
    assert parse(came).status == 408
    body = b'{"input": ' + b" " * 5000 + b'"Hi."}'
    n_sent, came = drip(attacked.url, request("POST", SPEECH, body), 20, 0.1)
    assert n_sent < len(body)
    assert (parse(came).status, parse(came).code) == (408, "too_slow")
    with connect(attacked.url) as connection:
        connection.sendall(b"GET /v1/models HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert parse(connection.recv(65_536)).status == 200
        connection.sendall(b"GET /v1/mod")
        assert parse(read_all(connection)).status == 408


def test_idle_connections_are_closed_and_do_not_disturb(attacked: RunningService) -> None:
    connections = [connect(attacked.url) for _ in range(200)]
    try:
        assert say(attacked, "Hello.").status_code == 200
        assert [read_all(connection) for connection in connections] == [b""] * 200
    finally:
        for connection in connections:
            connection.close()


def test_a_client_that_reads_nothing_is_ended(attacked: RunningService) -> None:
    """It would hold its process for ever."""
    body = json.dumps({"text": "We were away a year ago. " * 30, "format": "curves", "fps": 120}).encode()
    with connect(attacked.url) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.sendall(request("POST", "/v1/clips", body, "X-Request-ID: stalled"))
        attacked.wait_for_event("request", id="stalled")


# Texts


@pytest.mark.parametrize(
    ("text", "statuses"),
    [
        ("a" * 10_000, {400}),
        ("supercalifragilistic" * 500, {400}),
        ("\u0301" * 10_000, {200, 400}),
        ("1" * 10_000, {400}),
        ("\u0661" * 10_000, {400}),
        ("." * 50_000, {200, 400}),
        ("\x00\x01\x1b[31m\u202e\ufeff", {200, 400}),
        ("[" * 50_000, {200, 400}),
        ("<speak>" * 10_000, {400}),
        ("<!DOCTYPE x [<!ENTITY a 'b'>]><speak>&a;</speak>", {400}),
        ("<?xml version='1.0'?><!DOCTYPE s [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><speak>&x;</speak>", {400}),
        ("<speak>" + "<emphasis> " * 4000 + "Hi." + "</emphasis> " * 4000 + "</speak>", {200, 400}),
        ("<speak><break time='1e9s'/>Hi.</speak>", {400}),
        ("<speak><prosody rate='1e-9'>Hi.</prosody></speak>", {200, 400}),
    ],
    ids=lambda value: repr(value[:24]) if isinstance(value, str) else "",
)
def test_hostile_texts(attacked: RunningService, text: str, statuses: set[int]) -> None:
    body = json.dumps({"text": text, "format": "oculus"}).encode()
    answer = ask(attacked.url, request("POST", "/v1/clips", body))
    assert answer.status in statuses, answer


def test_a_billion_laughs_are_refused_at_once(attacked: RunningService) -> None:
    entities = "".join(f"<!ENTITY l{n + 1} '{f'&l{n};' * 10}'>" for n in range(9))
    text = f"<?xml version='1.0'?><!DOCTYPE speak [<!ENTITY l0 'ha'>{entities}]><speak>&l9;</speak>"
    answer = ask(attacked.url, request("POST", "/v1/clips", json.dumps({"text": text}).encode()))
    assert (answer.status, answer.code) == (400, "invalid_request")


# Files


def silence(kind: str, codec: str, minutes: int) -> bytes:
    """Sound of minutes in kilobytes."""
    buffer = io.BytesIO()
    with av.open(buffer, "w", format=kind) as file:
        stream = file.add_stream(codec, rate=48_000, layout="mono")
        zeros = np.zeros((1, 48_000 * 10), np.int16 if codec == "flac" else np.float32)
        for number in range(6 * minutes):
            frame = av.AudioFrame.from_ndarray(zeros, "s16" if codec == "flac" else "fltp", "mono")
            frame.sample_rate, frame.pts = 48_000, number * zeros.shape[1]
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    return buffer.getvalue()


def upload(service: RunningService, **files: tuple[str, bytes]) -> httpx.Response:
    data = {"request": json.dumps({"text": "Hello.", "format": "oculus"})}
    return httpx.post(f"{service.url}/v1/clips", data=data, files=files, timeout=120)


@pytest.mark.parametrize(("kind", "codec"), [("flac", "flac"), ("ogg", "libopus")])
def test_hours_of_silence_in_kilobytes_are_refused(attacked: RunningService, kind: str, codec: str) -> None:
    content = silence(kind, codec, 30)
    assert len(content) < 1_000_000
    answer = upload(attacked, audio=("a.wav", content))
    assert (answer.status_code, "longer than 20 s" in answer.text) == (422, True), answer.text


def test_a_picture_of_gigabytes_is_refused(attacked: RunningService) -> None:
    content = png_bomb(40_000)
    assert len(content) < 10_000
    answer = upload(attacked, background=("b.png", content))
    assert (answer.status_code, "40000 x 40000 pixels" in answer.text) == (422, True), answer.text


@pytest.mark.parametrize(
    ("content", "kind", "statuses"),
    [
        (b"", "multipart/form-data", {400, 422}),
        (b"--x\r\n\r\n", "multipart/form-data; boundary=x", {400, 422}),
        (b"--x\r\n", "multipart/form-data; boundary=" + "x" * 1000, {400, 422}),
        (b"--x\r\n" + b"A: b\r\n" * 20_000 + b"\r\n\r\n--x--", "multipart/form-data; boundary=x", {400, 422}),
        (
            b"".join(b'--x\r\nContent-Disposition: form-data; name="f%d"\r\n\r\n1\r\n' % n for n in range(10_000))
            + b"--x--\r\n",
            "multipart/form-data; boundary=x",
            {400, 422},
        ),
        (
            b'--x\r\nContent-Disposition: form-data; name="audio"; filename="../../etc/x\x00.wav"\r\n\r\n1\r\n--x--',
            "multipart/form-data; boundary=x",
            {400, 422},
        ),
        (b"--x\r\n" * 100_000, "multipart/form-data; boundary=x", {400, 422}),
        (b"a=b&" * 100_000, "application/x-www-form-urlencoded", {400, 422}),
        (b"PK\x03\x04" + bytes(1000), "application/zip", {400, 422}),
    ],
    ids=range(9),
)
def test_hostile_forms(attacked: RunningService, content: bytes, kind: str, statuses: set[int]) -> None:
    answer = ask(attacked.url, request("POST", "/v1/clips", content, kind=kind))
    assert answer.status in statuses, answer
    assert json.loads(answer.body)["error"]


# WebSockets

Attack = Callable[[websockets.ClientConnection], object]
PATHS = ("/v1/stream", "/")


def attack(service: RunningService, path: str, *messages: object, raw: bytes = b"") -> int | None:
    """Send messages (bytes: binary); the close code with which the connection ends, None if the client ends it."""

    async def run() -> int | None:
        address = service.url.replace("http", "ws", 1) + path
        async with websockets.connect(address, max_size=None, compression="deflate") as connection:
            try:
                for message in messages:
                    await connection.send(message if isinstance(message, str | bytes) else json.dumps(message))
                if raw:
                    connection.transport.write(raw)
                async with asyncio.timeout(1):
                    while True:
                        await connection.recv()
            except websockets.ConnectionClosed as closed:
                return closed.rcvd.code if closed.rcvd else 1006
            except TimeoutError:
                return None

    return asyncio.run(run())


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize(
    ("message", "codes"),
    [
        ("x" * 100_000, {1009}),
        (b"x" * 100_000, {1009}),
        (" " * 10_000_000, {1009}),  # 10 kB with compression
        (b"\x00\xff", {None, 1000, 1003, 1007}),
        ("[" * 30_000, {None, 1000, 1007}),
        ('{"type": "start", "fps": NaN}', {None, 1000, 1007}),
        ('{"type": "synthesize", "id": 1, "data": {"input": [[[]]]}}', {None, 1007}),
        ('{"type": "synthesize", "id": 1, "data": [1]}', {None, 1007}),
        ('{"type": "setup", "data": {"voice": {"a": 1}}}', {None, 1007}),
        ("\u0000", {None, 1007}),
    ],
    ids=range(10),
)
def test_hostile_messages(attacked: RunningService, path: str, message: object, codes: set[int | None]) -> None:
    assert attack(attacked, path, message) in codes


@pytest.mark.parametrize(
    "raw",
    [
        b"\xff" * 1000,  # reserved bits and an unknown opcode
        b"\x81\x03abc",  # not masked
        b"\x89\xfe\xff\xff" + bytes(70_000),  # a ping of 64 KB
        b"\x81\xff" + struct.pack(">Q", 1 << 62) + bytes(4),  # four exabytes
        b"\x81\x83" + bytes(4) + b"\xff\xfe\xfd",  # no UTF-8
    ],
    ids=range(5),
)
def test_broken_frames_close_the_socket(attacked: RunningService, raw: bytes) -> None:
    assert attack(attacked, "/", raw=raw) in {1002, 1006, 1007, 1009}


def test_a_flood_of_pings_takes_no_memory(attacked: RunningService) -> None:
    """A client that sends pings and never reads the answers is not read from any more, and then ended."""
    ping = b"\x89\xfd" + bytes(4) + b"p" * 125
    with connect(attacked.url) as connection:
        lines = ["GET / HTTP/1.1", "Host: localhost", "Connection: Upgrade", "Upgrade: websocket"]
        lines += ["Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "", ""]
        connection.sendall("\r\n".join(lines).encode())
        assert connection.recv(65_536).startswith(b"HTTP/1.1 101")
        connection.settimeout(30)
        before, n_sent = resident_bytes(attacked.process.pid), 0
        try:
            while n_sent < 300_000_000:
                n_sent += connection.send(ping * 1000)
        except (ConnectionError, TimeoutError):
            pass
        assert n_sent < 300_000_000
        assert resident_bytes(attacked.process.pid) - before < 50_000_000


def resident_bytes(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def test_too_many_connections_get_503() -> None:
    running = RunningService(environment={"TTS2FACE_SERVE_CONNECTIONS": "5", "TTS2FACE_SERVE_HEAD_S": "60"})
    try:
        held = [connect(running.url) for _ in range(5)]
        answer = ask(running.url, head("GET", "/healthz"))
        assert (answer.status, answer.code, answer.headers["retry-after"]) == (503, "busy", "2")
        for connection in held:
            connection.close()
        deadline = time.monotonic() + 60
        while ask(running.url, head("GET", "/healthz")).status != 200:
            assert time.monotonic() < deadline
    finally:
        running.close()


@pytest.mark.parametrize("path", PATHS)
def test_sockets_of_other_pages_are_refused_with_a_status(attacked: RunningService, path: str) -> None:
    async def open_socket() -> None:
        address = attacked.url.replace("http", "ws", 1) + path
        async with websockets.connect(address, origin="https://evil.example"):
            pass

    with pytest.raises(websockets.InvalidStatus) as refused:
        asyncio.run(open_socket())
    assert refused.value.response.status_code == 403
    assert b"unknown_origin" in refused.value.response.body
