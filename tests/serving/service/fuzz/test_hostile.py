"""Hostile heads and bodies, and slow clients, against a real server: refused as documented; the server serves on."""

import gzip
import json
import socket
import time

import pytest

from tests.running import RunningService
from tests.serving.service.attacked import SPEECH, alive, attacked, say
from tests.serving.service.raw import ask, connect, drip, head, parse, read_all, read_answer, request
from tts2face.serving.service.connections import LINGER_S

__all__ = ["alive", "attacked"]  # fixtures

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
        gzip.compress(b'{"input": "Hi.", "text": "Hi."}', mtime=0),
        gzip.compress(gzip.compress(bytes(1 << 20), mtime=0), mtime=0),
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
        assert read_answer(connection).status == 200
        connection.sendall(b"GET /v1/mod")
        assert parse(read_all(connection)).status == 408


def test_a_connection_goes_on_after_a_refused_body_has_been_read(attacked: RunningService) -> None:
    kept_open = head("POST", "/nothing", "Content-Length: 2").replace(b"Connection: close\r\n", b"")
    with connect(attacked.url) as connection:
        connection.sendall(kept_open)
        assert read_answer(connection).status == 404
        connection.sendall(b"{}")
        time.sleep(LINGER_S + 0.5)
        connection.sendall(head("GET", "/v1/models"))
        assert parse(read_all(connection)).status == 200


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
