"""A named file of keys guards the service, however few keys it holds; what is open for a removed key ends."""

import asyncio
import json
import logging
import os
import re
import threading
from collections.abc import Callable, Iterator, MutableMapping
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient, WebSocketDenialResponse, WebSocketTestSession

from lexicon.errors import InputError
from tests.running import eventually
from tests.serving.service.in_process import LocalProcess, another_client, service_client, with_key
from tts2face.processes.child import Call
from tts2face.serving.service import access, exchange
from tts2face.serving.service.access import KeyRing
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import Exchange
from tts2face.serving.service.keys import LOCAL_KEY, SCOPES, ApiKey, add_key, read_keys, remove_key
from tts2face.serving.service.messages import SYNTHESISE, Work
from tts2face.serving.service.settings import ServiceSettings, read_settings
from tts2face.serving.service.state import ServiceState

SOCKETS = ("/v1/stream", "/", "/v1/headtts")
LAST = "the last key"


class Keys:
    """A file of keys and their secrets."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.secrets = {name: add_key(path, name, SCOPES) for name in ("ann", "bob")}


@pytest.fixture
def keys(tmp_path: Path) -> Keys:
    return Keys(tmp_path / "keys.toml")


def speak(call: Call) -> dict[str, float]:
    """Answer a work of sound with an event, a live stream with one for each sentence, until the caller leaves."""
    work = Work(**call.content["work"])
    while work.kind == "live":
        asked = call.more().content
        if asked["type"] == "say":
            call.event({"seconds": 1.0, "event": {"type": "speech", "text": asked["text"]}})
            call.event({"seconds": 0.0, "event": {"type": "said", "n": 1}})
    spoken = {"type": "speech", "rate": 24_000, "words": [], "visemes": [], "marks": [["i0", 0.0]]}
    call.event({"seconds": 1.0, "event": spoken}, b"\0\0")
    return {"seconds": 1.0, "cpu_s": 0.0}


@pytest.fixture
def client(keys: Keys, tmp_path: Path) -> Iterator[TestClient]:
    settings = ServiceSettings(workers=0, data=tmp_path / "data", keys=keys.path, studio=False)
    with service_client(settings, LocalProcess({SYNTHESISE: speak})) as client:
        yield client


def state_of(client: TestClient) -> ServiceState:
    state: ServiceState = client.app.state.service  # type: ignore[attr-defined]
    return state


def reload(client: TestClient) -> None:
    assert client.portal is not None
    client.portal.call(state_of(client).reload_keys)


def status(client: TestClient, secret: str) -> int:
    return with_key(client, secret).get("/v1/models").status_code


def open_socket(client: TestClient, path: str, secret: str) -> WebSocketTestSession:
    return client.websocket_connect(f"ws://localhost{path}?key={secret}")


@pytest.mark.parametrize("path", SOCKETS)
def test_a_browser_sends_its_key_with_a_socket_as_a_subprotocol(client: TestClient, keys: Keys, path: str) -> None:
    def connect(secret: str) -> WebSocketTestSession:
        return client.websocket_connect(f"ws://localhost{path}", subprotocols=["tts2face", f"tts2face.key.{secret}"])

    with connect(keys.secrets["ann"]) as socket:
        assert socket.accepted_subprotocol == "tts2face"
    with pytest.raises(WebSocketDenialResponse), connect("x"):
        pass
    with open_socket(client, path, keys.secrets["ann"]) as socket:
        assert socket.accepted_subprotocol is None


WAYS: dict[str, Callable[[Keys], object]] = {
    LAST: lambda keys: [remove_key(keys.path, name) for name in keys.secrets],
    "an empty file": lambda keys: keys.path.write_text(""),
    "a file of remarks": lambda keys: keys.path.write_text("# none\n"),
    "an empty list": lambda keys: keys.path.write_text("key = []\n"),
    "no file": lambda keys: keys.path.unlink(),
    "a folder": lambda keys: (keys.path.unlink(), keys.path.mkdir()),
    "no TOML": lambda keys: keys.path.write_text("[[key"),
    "no text": lambda keys: keys.path.write_bytes(b"\xff\xfe\x00"),
    "a wrong key": lambda keys: keys.path.write_text("[[key]]\nname = 1"),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_file_that_loses_its_keys_closes_the_door_and_says_so(
    client: TestClient, keys: Keys, caplog: pytest.LogCaptureFixture, way: str
) -> None:
    secret = keys.secrets["ann"]
    assert status(client, secret) == 200
    WAYS[way](keys)
    with caplog.at_level(logging.INFO):
        reload(client)
    (said,) = [one for one in caplog.records if one.getMessage() == "no keys"]
    assert said.levelno == logging.ERROR
    assert said.fields["reason"].endswith("has no valid key, so nobody is served")  # type: ignore[attr-defined]
    for headers in ({}, {"authorization": f"Bearer {secret}"}, {"authorization": "Bearer "}, {"x-api-key": "x"}):
        for path in ("/v1/models", "/metrics", "/v1/jobs", "/v1/usage"):
            refused = client.get(path, headers=headers)
            assert (refused.status_code, refused.json()["error"]["code"]) == (401, "unauthorized"), (path, headers)
            assert "the service has no API keys now" in refused.text
        assert client.delete("/v1/faces/x", headers=headers).status_code == 401
        assert client.post("/v1/clips", json={"text": "Hi."}, headers=headers).status_code == 401
    for path in SOCKETS:
        with pytest.raises(WebSocketDenialResponse), open_socket(client, path, secret):
            pass
    assert client.get("/healthz").status_code == 200


def test_a_pipe_in_place_of_the_keys_closes_the_door_and_is_not_waited_for(
    client: TestClient, keys: Keys, caplog: pytest.LogCaptureFixture
) -> None:
    keys.path.unlink()
    os.mkfifo(keys.path)
    silent = os.open(keys.path, os.O_RDWR)
    end = threading.Timer(10.0, os.close, [silent])  # of a pipe that is read nevertheless
    end.start()
    with caplog.at_level(logging.INFO):
        reload(client)
    assert end.is_alive()
    end.cancel()
    os.close(silent)
    (said,) = [one for one in caplog.records if one.getMessage() == "keys dropped"]
    assert "keys.toml is a pipe, not a file; remove it or use a file" in said.fields["reason"]  # type: ignore[attr-defined]
    assert status(client, keys.secrets["ann"]) == 401


def test_keys_are_read_beside_the_loop_and_stay_until_then(
    client: TestClient, keys: Keys, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A slow disk keeps no request waiting."""
    portal = client.portal
    assert portal is not None
    threads: list[int] = []
    met: list[bool] = []

    def read(path: Path) -> tuple[ApiKey, ...]:
        threads.append(threading.get_ident())
        met.append(bool(state_of(client).keys.named("ann")))
        return read_keys(path)

    monkeypatch.setattr(access, "read_keys", read)
    reload(client)
    assert threads != [portal.call(threading.get_ident)]
    assert met == [True]


@pytest.mark.parametrize("way", [LAST, "an empty file", "a file of remarks", "an empty list"])
def test_a_service_that_starts_with_a_file_without_keys_is_closed(keys: Keys, tmp_path: Path, way: str) -> None:
    WAYS[way](keys)
    settings = ServiceSettings(host="0.0.0.0", workers=0, data=tmp_path / "data", keys=keys.path, studio=False)
    with service_client(settings, LocalProcess({SYNTHESISE: speak})) as client:
        assert client.get("/metrics").status_code == 401
        assert client.get("/v1/models").status_code == 401
        secret = add_key(keys.path, "new", ["speak"])
        reload(client)
        assert status(client, secret) == 200


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_a_variable_without_a_name_of_a_file_opens_nothing(host: str) -> None:
    """As ``TTS2FACE_SERVE_KEYS=`` of a file whose own variable is missing."""
    variables = {"TTS2FACE_SERVE_KEYS": "", "TTS2FACE_SERVE_HOST": host}
    with pytest.raises(InputError, match=r"the file of keys \. cannot be read: Is a directory"):
        ServiceState(read_settings(environment=variables))


def test_a_service_without_a_file_of_keys_is_open_on_this_machine(tmp_path: Path) -> None:
    settings = ServiceSettings(workers=0, data=tmp_path / "data", studio=False)
    with service_client(settings, LocalProcess({SYNTHESISE: speak})) as client:
        assert client.get("/metrics").status_code == 200
        reload(client)  # a signal changes nothing
        assert client.get("/metrics", headers={"authorization": "Bearer x"}).status_code == 200
    assert KeyRing(None).find("") is LOCAL_KEY


def test_what_a_key_of_a_file_leaves_out_is_no_permission(keys: Keys) -> None:
    hashed = read_keys(keys.path)[0].hash
    keys.path.write_text(f'[[key]]\nname = "plain"\nhash = "{hashed}"\n')
    assert read_keys(keys.path)[0].scopes == ()
    assert KeyRing(keys.path).find(keys.secrets["ann"]).scopes == ()
    empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"  # of a request without a key
    for wrong in ("", "x", "\u00e9" * 64, empty, hashed.upper()):
        keys.path.write_text(f'[[key]]\nname = "plain"\nhash = "{wrong}"\n')
        with pytest.raises(ValueError, match="the hash of the key plain is that of no key"):
            KeyRing(keys.path)


@pytest.mark.parametrize("path", SOCKETS)
def test_a_reload_closes_the_sockets_of_a_removed_key_alone(client: TestClient, keys: Keys, path: str) -> None:
    with (
        open_socket(client, path, keys.secrets["ann"]) as removed,
        open_socket(client, path, keys.secrets["bob"]) as kept,
    ):
        eventually(lambda: len(state_of(client).exchanges) == 2)
        remove_key(keys.path, "ann")
        reload(client)
        said = json.loads(removed.receive()["text"])
        assert (said["type"], said["code"]) == ("error", "unauthorized")
        assert said["message"] == "the API key ann has been removed; connect with another one"
        closed = removed.receive()
        assert (closed["type"], closed["code"]) == ("websocket.close", 1008)
        eventually(lambda: [one.key.name for one in state_of(client).exchanges if one.key] == ["bob"])
        kept.send_text(json.dumps({"type": "start", "with_idle": False, "id": 1}))
        kept.send_text(json.dumps({"type": "flush"}))
    assert status(client, keys.secrets["ann"]) == 401


@pytest.mark.parametrize("path", SOCKETS)
def test_keys_are_asked_again_at_each_utterance(client: TestClient, keys: Keys, path: str) -> None:
    """Also where nothing has closed the socket: its next utterance is refused."""
    is_live = path == "/v1/stream"

    def say(socket: WebSocketTestSession) -> dict[str, Any]:
        if is_live:
            socket.send_text(json.dumps({"type": "text", "text": "We were away."}))
            socket.send_text(json.dumps({"type": "flush"}))
        else:
            socket.send_text(json.dumps({"type": "synthesize", "id": 1, "data": {"input": "We were away."}}))
        answer: dict[str, Any] = json.loads(socket.receive()["text"])
        return answer

    with open_socket(client, path, keys.secrets["ann"]) as socket:
        if is_live:
            socket.send_text(json.dumps({"type": "start", "with_idle": False}))
            assert json.loads(socket.receive()["text"])["type"] == "mark"
        assert say(socket)["type"] == ("speech" if is_live else "audio")
        if not is_live:
            socket.receive()  # its sound
        remove_key(keys.path, "ann")
        assert client.portal is not None
        client.portal.call(state_of(client).keys.reload)
        refused = say(socket)
        assert refused["type"] == "error"
        assert "the API key ann has been removed" in json.dumps(refused)


@pytest.mark.parametrize("path", SOCKETS)
def test_a_damaged_file_is_said_as_it_is(
    client: TestClient, keys: Keys, caplog: pytest.LogCaptureFixture, path: str
) -> None:
    """No key has been removed from it."""
    with open_socket(client, path, keys.secrets["ann"]) as socket, caplog.at_level(logging.INFO):
        eventually(lambda: len(state_of(client).exchanges) == 1)
        keys.path.write_text("[[key")
        reload(client)
        said = json.loads(socket.receive()["text"])["message"]
        assert said == "the service has no API keys now, so that nobody is served; ask its operator"
        assert socket.receive()["code"] == 1008
    logged = {one.getMessage(): one.fields for one in caplog.records}  # type: ignore[attr-defined]
    assert "keys.toml is not TOML" in logged["keys dropped"]["reason"]
    assert logged["keys dropped"]["ended"] == 1
    assert "keys not reloaded" not in logged


def test_a_key_that_may_do_less_is_asked_to_connect_again(client: TestClient, keys: Keys) -> None:
    with open_socket(client, "/", keys.secrets["ann"]) as socket:
        text = keys.path.read_text()
        less = re.sub(r"scopes = \[.*\]", 'scopes = ["speak"]', text, count=1)
        assert less != text
        keys.path.write_text(less)
        reload(client)
        assert "the API key ann has lost admin, build, live" in json.loads(socket.receive()["text"])["message"]
        assert socket.receive()["code"] == 1008
    assert status(client, keys.secrets["ann"]) == 200


def test_events_of_a_job_end_with_the_key(client: TestClient, keys: Keys) -> None:
    """An answer that would last for hours is cut."""
    ann = with_key(client, keys.secrets["ann"])
    job = ann.post("/v1/jobs", json={"kind": "clip", "request": {"text": "Hello.", "format": "wav"}}).json()["id"]
    portal = client.portal
    assert portal is not None
    following = portal.start_task_soon(lambda: asyncio.to_thread(ann.get, f"/v1/jobs/{job}/events"))
    eventually(lambda: any(one.status == 200 for one in state_of(client).exchanges))
    remove_key(keys.path, "ann")
    reload(client)
    assert "retry: 2000" in following.result(30).text
    assert not state_of(client).exchanges


def test_a_client_that_reads_nothing_does_not_keep_its_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exchange, "CLOSE_S", 0.01)

    async def run() -> Exchange:
        async def send(message: MutableMapping[str, Any]) -> None:
            if message["type"] != "websocket.accept":
                await asyncio.Event().wait()  # as uvicorn's of a client that does not read

        async def receive() -> MutableMapping[str, Any]:
            raise AssertionError

        made = Exchange({"type": "websocket", "path": "/", "headers": []}, receive, send)

        async def work() -> None:
            await made.send({"type": "websocket.accept"})
            await made.send({"type": "websocket.send", "text": "x"})

        running = asyncio.create_task(made.run(work()))
        await asyncio.sleep(0)
        await made.revoke(RefusedError(401, "unauthorized", "removed"))
        await asyncio.wait_for(running, 10)
        return made

    ended = asyncio.run(run())
    assert (ended.is_cut, ended.code) == (True, "unauthorized")


def test_the_login_of_a_closed_service_lets_nobody_in(keys: Keys, tmp_path: Path) -> None:
    pytest.importorskip("nicegui")
    from tts2face.serving.studio.pages.login import make_router

    keys.path.write_text("")
    settings = ServiceSettings(workers=0, data=tmp_path / "data", keys=keys.path, studio=False)
    with service_client(settings, LocalProcess({SYNTHESISE: speak})) as client:
        client.app.include_router(make_router(state_of(client)))  # type: ignore[attr-defined]
        browser = another_client(client, "studio", accept="text/html")
        assert "API key" in browser.get("/login").text
        for given in ("", keys.secrets["ann"]):
            assert browser.post("/login", data={"key": given}).status_code == 401
