"""Webhooks: messages about the end of jobs, signed as by the specification Standard Webhooks.

A receiver is a stranger: a call to it has a total time, and a key and a host have places of their own, so that
receivers which never answer, or slowly, delay nobody else's messages, and the end of the server waits for none.
"""

import asyncio
import base64
import hashlib
import hmac
import socket
import ssl
import threading
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import lru_cache
from typing import Protocol, TypeVar
from urllib.parse import SplitResult, urlsplit

import h11

from tts2face import __version__
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.settings import SECRET_PREFIX, ServiceSettings
from tts2face.serving.work.changes import WebhookDelivery
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.jobs import JobRecord

CALL_S = 10.0  # of a whole call, however often its receiver sends a byte; services that receive webhooks answer in 5
CONNECT_S = 4.0  # to one address of a host
POLL_S = 1.0  # between two polls of the messages that are due, while none ends
# Places bound what one key and one host delay (decision 205).
PLACES = 64  # calls at the same time, of all
KEY_PLACES = 2  # of a key
HOST_PLACES = 8  # to a host
HEAD_BYTES, BLOCK_BYTES = 16 << 10, 4 << 10  # of an answer, of which only the status counts
PORTS = {"https": 443, "http": 80}
Value = TypeVar("Value")


def check_webhook(url: str, settings: ServiceSettings) -> None:
    """Refuse a webhook whose host is not in the setting `webhook_hosts`."""
    try:
        parts = urlsplit(url)
        place = host_of(parts)
    except ValueError as wrong:
        raise RefusedError(400, "invalid_webhook", f"the webhook is no URL: {wrong}") from wrong
    # "@" hides the host from a reader, spaces and control characters divide the request
    if parts.scheme not in PORTS or "@" in parts.netloc or not url.isascii() or not url.isprintable() or " " in url:
        raise RefusedError(400, "invalid_webhook", "the webhook must be a URL https://HOST/PATH without a password")
    if place not in settings.webhook_hosts:
        raise RefusedError(
            400,
            "invalid_webhook",
            f"the host {str(place)[:80]!r} gets no webhooks; add it to the setting webhook_hosts",
        )


def host_of(parts: SplitResult) -> str:
    """Host of a URL, with its port if it names one."""
    return str(parts.hostname) if parts.port is None else f"{parts.hostname}:{parts.port}"


def sign(secret: str, message_id: str, timestamp: int, body: bytes) -> str:
    """Value of the header ``webhook-signature``: HMAC-SHA256 of id, time and body."""
    key = base64.b64decode(secret.removeprefix(SECRET_PREFIX)) if secret.startswith(SECRET_PREFIX) else secret.encode()
    content = f"{message_id}.{timestamp}.".encode() + body
    return "v1," + base64.b64encode(hmac.digest(key, content, hashlib.sha256)).decode()


async def send_message(url: str, message_id: str, body: bytes, secret: str) -> bool:
    """Send a message; whether the receiver has accepted it within `CALL_S`. Redirects are not followed."""
    parts, now = urlsplit(url), int(time.time())
    headers = {
        "Host": host_of(parts),
        "Content-Type": "application/json",
        "Content-Length": str(len(body)),
        "User-Agent": f"tts2face/{__version__}",
        "webhook-id": message_id,
        "webhook-timestamp": str(now),
        "webhook-signature": sign(secret, message_id, now, body),
        "Connection": "close",
    }
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    with suppress(OSError, TimeoutError, ValueError, h11.ProtocolError):
        async with asyncio.timeout(CALL_S):
            reader, writer = await _connect(parts)
            try:
                sender = h11.Connection(h11.CLIENT, max_incomplete_event_size=HEAD_BYTES)
                head = sender.send(h11.Request(method="POST", target=path, headers=list(headers.items())))
                rest = [sender.send(part) for part in (h11.Data(data=body), h11.EndOfMessage())]
                writer.write(b"".join(part for part in (head, *rest) if part))
                await writer.drain()
                # redirects are not followed: they could name any host (decision 092)
                return 200 <= await _read_status(reader, sender) < 300
            finally:
                writer.transport.abort()  # its end is not waited for
    return False


async def _read_status(reader: asyncio.StreamReader, sender: h11.Connection) -> int:
    """Status of the answer; 0 if the receiver leaves without one."""
    while True:
        event = sender.next_event()
        if isinstance(event, h11.Response):
            return event.status_code
        if event is h11.NEED_DATA:
            sender.receive_data(await reader.read(BLOCK_BYTES))
        elif not isinstance(event, h11.InformationalResponse):
            return 0


async def _connect(parts: SplitResult) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connection to the first address of a URL's host that answers."""
    name, port = str(parts.hostname), parts.port or PORTS[parts.scheme]
    secured = {"ssl": _tls(), "server_hostname": name} if parts.scheme == "https" else {}
    for address in await _addresses(name, port):
        with suppress(OSError, TimeoutError):
            async with asyncio.timeout(CONNECT_S):
                return await asyncio.open_connection(address, port, **secured)  # type: ignore[arg-type]
    raise OSError(f"no address of {name} answers")


async def _addresses(name: str, port: int) -> list[str]:
    """Addresses of a host, from a thread that nobody waits for at the end of the server.

    Those of the event loop are few, and joined at its end: a name server that never answers would hold them.
    """
    loop = asyncio.get_running_loop()
    found: asyncio.Future[list[str]] = loop.create_future()

    def tell(addresses: list[str]) -> None:
        if not found.done():
            found.set_result(addresses)

    def resolve() -> None:
        addresses: list[str] = []
        with suppress(OSError, UnicodeError):
            infos = socket.getaddrinfo(name, port, type=socket.SOCK_STREAM)
            addresses = list(dict.fromkeys(str(info[4][0]) for info in infos))
        # a thread of an address outlives it
        with suppress(RuntimeError):  # the loop has ended meanwhile
            loop.call_soon_threadsafe(tell, addresses)

    threading.Thread(target=resolve, name="webhooks", daemon=True).start()
    return await found


@lru_cache(maxsize=1)
def _tls() -> ssl.SSLContext:
    return ssl.create_default_context()


class Call(Protocol):
    """Value of a function of the jobs' client, as `JobService.call` gives it."""

    def __call__(self, function: Callable[[JobClient], Value]) -> Awaitable[Value]:
        """Value of the function; raises `RefusedError` while the database cannot be reached."""


class Webhooks:
    """Sends messages about ended jobs; methods belong to the event loop.

    Parameters
    ----------
    call
        Calls a function of the client of the database.
    message_of
        Body of the message about a job.
    """

    def __init__(self, settings: ServiceSettings, call: Call, message_of: Callable[[JobRecord], bytes]) -> None:
        self._settings = settings
        self._call = call
        self._message_of = message_of
        self._sending: dict[asyncio.Task[None], WebhookDelivery] = {}

    async def run(self) -> None:
        """Send what is due, until this is cancelled; what is being sent then, another server sends again."""
        if not self._settings.webhook_hosts:
            return
        try:
            while True:
                n_begun = 0
                with suppress(RefusedError):  # the database is away; the next time may succeed
                    n_begun = await self._begin()
                if not n_begun:
                    await self._wait()
        finally:
            for task in self._sending:
                task.cancel()

    async def _wait(self) -> None:
        """Wait until a place is free, or a moment."""
        if self._sending:
            timeout_s = POLL_S if len(self._sending) < PLACES else None
            await asyncio.wait(self._sending, timeout=timeout_s, return_when=asyncio.FIRST_COMPLETED)
        else:
            await asyncio.sleep(POLL_S)

    async def _begin(self) -> int:
        """Begin to send those due messages that have a place; their number."""
        keys = Counter(delivery.key_name for delivery in self._sending.values())
        if keys.total() >= PLACES:
            return 0
        busy = [name for name, n_places in keys.items() if n_places >= KEY_PLACES]
        due = await self._call(lambda client: client.changes.due_webhooks(busy))
        chosen = self._with_places(due, keys)
        for delivery in await self._call(lambda client: client.changes.take_webhooks(chosen)) if chosen else ():
            task = asyncio.create_task(self._deliver(delivery))
            self._sending[task] = delivery
            task.add_done_callback(self._sending.pop)
        return len(chosen)

    def _with_places(self, due: list[WebhookDelivery], keys: Counter[str]) -> list[WebhookDelivery]:
        """Those of some messages that have a place: of all, of their key and of their host."""
        chosen: list[WebhookDelivery] = []
        hosts = Counter(host_of(urlsplit(delivery.url)) for delivery in self._sending.values())
        for delivery in due:
            host = host_of(urlsplit(delivery.url))
            if keys[delivery.key_name] < KEY_PLACES and hosts[host] < HOST_PLACES and keys.total() < PLACES:
                chosen.append(delivery)
                keys[delivery.key_name] += 1
                hosts[host] += 1
        return chosen

    async def _deliver(self, delivery: WebhookDelivery) -> None:
        """Send a message once and note the result; the id of the message is that of the job."""
        with suppress(RefusedError):  # the database is away; the message is sent again after its lease
            record = await self._call(lambda client: client.table.get(delivery.job_id))
            if record is not None:
                arrives = False
                if host_of(urlsplit(delivery.url)) in self._settings.webhook_hosts:  # it may have been taken out since
                    secret = self._settings.webhook_secret
                    arrives = await send_message(delivery.url, record.id, self._message_of(record), secret)
                await self._call(lambda client: client.changes.note_delivery(delivery, is_delivered=arrives))
