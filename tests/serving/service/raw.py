"""HTTP by hand, for requests that no library would send."""

import json
import socket
import time
from contextlib import suppress
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

TIMEOUT_S = 60.0


@dataclass(frozen=True, slots=True)
class RawAnswer:
    """Status, headers and body; status 0: the connection was closed without an answer."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def code(self) -> str:
        """Word of an error in the service's form."""
        content: Any = json.loads(self.body)
        return str(content["error"]["code"])


def connect(url: str) -> socket.socket:
    parts = urlsplit(url)
    return socket.create_connection((parts.hostname, parts.port), TIMEOUT_S)


def read_all(connection: socket.socket) -> bytes:
    """Everything until the other end closes."""
    parts = []
    try:
        while block := connection.recv(65_536):
            parts.append(block)
    except (ConnectionResetError, BrokenPipeError):
        pass
    return b"".join(parts)


def parse(content: bytes) -> RawAnswer:
    """The first answer of what a server has sent."""
    if not content:
        return RawAnswer(0, {}, b"")
    head, _, rest = content.partition(b"\r\n\r\n")
    first, *lines = head.decode("latin-1").split("\r\n")
    headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
    return RawAnswer(int(first.split()[1]), headers, rest[: int(headers.get("content-length", len(rest)))])


def read_answer(connection: socket.socket) -> RawAnswer:
    """The next answer of a connection that stays open; it states its length."""
    content = b""
    while b"\r\n\r\n" not in content or len((answer := parse(content)).body) < int(answer.headers["content-length"]):
        block = connection.recv(65_536)
        assert block, f"the connection has ended within {content!r}"
        content += block
    return answer


def ask(url: str, content: bytes) -> RawAnswer:
    """Send bytes, and read what comes until the connection is closed."""
    with connect(url) as connection:
        with suppress(ConnectionResetError, BrokenPipeError):
            connection.sendall(content)
        return parse(read_all(connection))


def head(method: str, path: str, *lines: str) -> bytes:
    """Head of a request that asks to close the connection after it."""
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: localhost", "Connection: close", *lines, "", ""]).encode(
        "latin-1"
    )


def request(method: str, path: str, body: bytes, *lines: str, kind: str = "application/json") -> bytes:
    """A whole request."""
    return head(method, path, f"Content-Type: {kind}", f"Content-Length: {len(body)}", *lines) + body


def drip(url: str, content: bytes, step: int, pause_s: float) -> tuple[int, bytes]:
    """Send some bytes at a time until the server closes; the number that was sent, and what came."""
    n_sent = 0
    with connect(url) as connection:
        try:
            while n_sent < len(content):
                n_sent += connection.send(content[n_sent : n_sent + step])
                time.sleep(pause_s)
                connection.setblocking(False)
                try:
                    if connection.recv(1, socket.MSG_PEEK):
                        break
                    return n_sent, b""
                except BlockingIOError:
                    pass
                finally:
                    connection.settimeout(TIMEOUT_S)
        except (ConnectionResetError, BrokenPipeError):
            pass
        return n_sent, read_all(connection)
