"""Webhooks: signatures against the examples of their specification, settings, and receivers that hold a call."""

import asyncio
import base64
import os
import signal
import socket
import threading
import uuid
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from lexicon.errors import InputError
from tests.packages import reason
from tests.running import TABLE_PROGRAM, ServeProcess, eventually
from tests.serving.service.receiver import SECRET, Receiver
from tts2face.serving.service import server as server_module
from tts2face.serving.service import webhooks
from tts2face.serving.service.job_views import message_of
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.webhooks import KEY_PLACES, Webhooks, send_message, sign

pytest.importorskip("dbos", reason=reason("dbos"))

from tts2face.serving.work.blobs import open_blobs
from tts2face.serving.work.changes import Ending, JobChanges
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.jobs import NewJob
from tts2face.storage.sql import Database


def test_the_signature_is_that_of_standard_webhooks() -> None:
    """Example of the specification's own libraries (standard-webhooks, tests of signing)."""
    secret = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"
    body = b'{"test": 2432232314}'
    assert sign(secret, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, body) == (
        "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="
    )
    plain = base64.b64decode(secret.removeprefix("whsec_"))
    with pytest.raises(UnicodeDecodeError):
        plain.decode()  # so that a secret in base64 is another key than its letters
    assert sign("other", "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, body) != sign(secret, "x", 1614265330, body)


def test_hosts_need_a_secret_that_is_never_shown(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="webhook_hosts needs webhook_secret"):
        ServiceSettings(webhook_hosts=("example.org",))
    settings = ServiceSettings(data=tmp_path, webhook_hosts=("example.org",), webhook_secret="hush")
    assert "hush" not in settings.as_toml()
    assert "hush" not in repr(settings)
    assert "example.org" in settings.as_toml()


def test_the_password_of_the_database_is_not_shown() -> None:
    settings = ServiceSettings(database="postgresql://ann:s%40cret@db.example:5432/jobs")
    assert 'database = "postgresql://ann@db.example:5432/jobs"' in settings.as_toml()
    assert "cret" not in settings.as_toml()


class Silent:
    """A receiver that accepts connections, reads, and sends `drip` again and again in place of an answer."""

    def __init__(self, drip: bytes = b"", every_s: float = 0.05) -> None:
        self.connections: list[socket.socket] = []
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.host = f"127.0.0.1:{self._socket.getsockname()[1]}"
        self._drip, self._every_s, self._ended = drip, every_s, threading.Event()

    def __enter__(self) -> "Silent":
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._socket.close()
        for one in self.connections:
            one.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                self.connections.append(self._socket.accept()[0])
                threading.Thread(target=self._send, args=(self.connections[-1],), daemon=True).start()

    def _send(self, connection: socket.socket) -> None:
        with suppress(OSError):
            while self._drip and not self._ended.wait(self._every_s):
                connection.sendall(self._drip)


@pytest.fixture
def client(tmp_path: Path) -> Iterator[JobClient]:
    url = database_url(str(tmp_path / "service.sqlite"))
    prepare_database(url)
    made = JobClient(url, open_blobs(tmp_path / "store", "results"))
    yield made
    made.close()


def end_job(tmp_path: Path, client: JobClient, key: str, url: str) -> str:
    """A job of a key that has failed; its webhook is due."""
    record, _ = client.submit(NewJob(uuid.uuid4().hex, key, "clip", {"text": "Hi."}, "0" * 64, webhook=url))
    connections = Database(database_url(str(tmp_path / "service.sqlite")))
    assert JobChanges(connections).end(record.id, Ending("failed", error="why"))
    connections.close()
    return record.id


@asynccontextmanager
async def sending(client: JobClient, *hosts: str) -> AsyncIterator[None]:
    settings = ServiceSettings(webhook_hosts=hosts, webhook_secret=SECRET)

    async def call(function: Callable[[JobClient], Any]) -> Any:
        return await asyncio.to_thread(function, client)

    running = asyncio.create_task(Webhooks(settings, call, message_of).run())
    try:
        yield
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


@pytest.mark.parametrize("drip", [b"H", b"HTTP/1.1 100 Continue\r\n\r\n", b"x" * 40_000], ids=["byte", "100", "long"])
def test_a_call_has_a_total_time(monkeypatch: pytest.MonkeyPatch, drip: bytes) -> None:
    """A limit for each read never ends a receiver that sends a byte now and then."""
    monkeypatch.setattr(webhooks, "CALL_S", 0.5)
    with Silent(drip) as receiver:
        assert not asyncio.run(send_message(f"http://{receiver.host}/", "a", b"{}", SECRET))
        assert len(receiver.connections) == 1


def test_receivers_that_never_answer_delay_no_other_key(
    tmp_path: Path, client: JobClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webhooks, "CALL_S", 600.0)  # none of the silent calls ends within this test
    with Silent() as silent, Receiver() as receiver:
        for _ in range(12):
            end_job(tmp_path, client, "mallory", f"http://{silent.host}/")
        names = {end_job(tmp_path, client, "ann", f"http://{receiver.host}/") for _ in range(2 * KEY_PLACES + 1)}

        async def run() -> None:
            async with sending(client, silent.host, receiver.host):
                await asyncio.to_thread(eventually, lambda: {name for name, _ in receiver.messages} == names)
                await asyncio.to_thread(eventually, lambda: len(silent.connections) >= KEY_PLACES)

        asyncio.run(run())
        assert len(silent.connections) == KEY_PLACES
        assert receiver.wrong == []


def test_a_host_that_never_answers_delays_no_other_host(
    tmp_path: Path, client: JobClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webhooks, "CALL_S", 600.0)
    monkeypatch.setattr(webhooks, "HOST_PLACES", 3)
    monkeypatch.setattr(webhooks, "PLACES", 5)
    with Silent() as silent, Receiver() as receiver:
        for number in range(12):
            end_job(tmp_path, client, f"key{number}", f"http://{silent.host}/")
        name = end_job(tmp_path, client, "key0", f"http://{receiver.host}/")

        async def run() -> None:
            async with sending(client, silent.host, receiver.host):
                await asyncio.to_thread(eventually, lambda: [one for one, _ in receiver.messages] == [name])
                await asyncio.to_thread(eventually, lambda: len(silent.connections) >= 3)

        asyncio.run(run())
        assert len(silent.connections) == 3


def test_a_host_that_was_taken_out_of_the_settings_is_told_no_more(tmp_path: Path, client: JobClient) -> None:
    """Also of jobs that were queued before; if it comes back, it is told then."""
    with Receiver() as removed, Receiver() as kept:
        first = end_job(tmp_path, client, "ann", f"http://{removed.host}/")
        second = end_job(tmp_path, client, "ann", f"http://{kept.host}/")

        async def run() -> None:
            async with sending(client, kept.host):
                await asyncio.to_thread(eventually, lambda: [one for one, _ in kept.messages] == [second])
                await asyncio.to_thread(eventually, lambda: tries(first) == 1)

        def tries(name: str) -> int:
            record = client.table.get(name)
            assert record is not None
            assert record.webhook is not None
            return record.webhook.tries

        asyncio.run(run())
        assert removed.messages == []


@pytest.mark.server
@pytest.mark.parametrize("drip", [b"H", b""], ids=["drips", "silent"])
def test_a_server_ends_while_a_receiver_holds_a_call(tmp_path: Path, client: JobClient, drip: bytes) -> None:
    with Silent(drip) as silent:
        environment = {
            "TTS2FACE_SERVE_WEBHOOK_HOSTS": silent.host, "TTS2FACE_SERVE_WEBHOOK_SECRET": SECRET,
            "TTS2FACE_SERVE_WORKERS": "0", "TTS2FACE_SERVE_DATABASE": str(tmp_path / "service.sqlite"),
        }  # fmt: skip
        end_job(tmp_path, client, "ann", f"http://{silent.host}/")
        own = ServeProcess(environment=environment, program=TABLE_PROGRAM)
        try:
            eventually(lambda: silent.connections)
            own.process.send_signal(signal.SIGTERM)
            assert own.process.wait(60) == 0
            own.close()
        finally:
            own.process.kill()


def test_a_name_server_that_never_answers_holds_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The threads of the event loop are joined at its end."""
    answered = threading.Event()

    def never(*_: object, **__: object) -> list[Any]:
        assert threading.current_thread().daemon
        answered.wait()
        return []

    monkeypatch.setattr(webhooks.socket, "getaddrinfo", never)  # type: ignore[attr-defined]
    monkeypatch.setattr(webhooks, "CALL_S", 0.2)
    assert not asyncio.run(send_message("http://example.org/", "a", b"{}", SECRET))
    answered.set()


def test_signals_reach_who_watched_them_before_the_server_ran() -> None:
    """At the exit of the process, which may wait for a thread, a second signal ends it."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    try:

        async def serve() -> None:
            loop = asyncio.get_running_loop()
            loop.add_signal_handler(signal.SIGUSR1, lambda: None)
            loop.remove_signal_handler(signal.SIGUSR1)

        with server_module._signals_of_process():
            asyncio.run(serve())
        assert signal.set_wakeup_fd(-1) == writer
    finally:
        signal.set_wakeup_fd(before)
        os.close(reader)
        os.close(writer)
