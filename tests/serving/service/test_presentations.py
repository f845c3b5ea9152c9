"""Live streams on targets of the operator: who may choose which, and that no address of a client is followed."""

from collections.abc import AsyncIterator, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient, WebSocketTestSession

from lexicon.errors import BackendError, InputError
from tests.serving.service.in_process import SessionProcess, service_client
from tts2face.processes.message import EVENT, RESULT, Message
from tts2face.serving.service import presentations
from tts2face.serving.service.access import RateLimits
from tts2face.serving.service.keys import add_key
from tts2face.serving.service.presentations import Presentations
from tts2face.serving.service.settings import ServiceSettings, read_settings
from tts2face.session.session_cache import SessionCache
from tts2face.targets import table

TARGETS = ("stage=rtmp://a.example/app/stream-key", "puppet=vmc:127.0.0.1:39539")


class MadeChild:
    """A process that says what it is to show, and follows its inputs until ``end``."""

    made: list["MadeChild"] = []  # noqa: RUF012 - all of a test

    def __init__(self, _program: object, on_released: Any) -> None:
        self.content: Mapping[str, Any] = {}
        self.inputs: list[Mapping[str, Any]] = []
        self.is_closed = False
        self._on_released = on_released
        self.made.append(self)

    async def stream(
        self, kind: str, content: Mapping[str, Any], *, inputs: AsyncIterator[Any]
    ) -> AsyncIterator[Message]:
        self.content = content
        try:
            for name in content["targets"]:
                state = {"type": "target", "name": name, "state": "connected"}
                yield Message(EVENT, {"event": state, "seconds": 0.0})
            async for item, _ in inputs:
                self.inputs.append(item)
                if item["type"] == "end":
                    break
                yield Message(EVENT, {"event": {"type": "said", "n": 1}, "seconds": 1.0})
            yield Message(RESULT, {"seconds": 1.5, "cpu_s": 0.1})
        finally:
            self._on_released(0.0)

    async def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def keys(tmp_path: Path) -> dict[str, str]:
    path = tmp_path / "keys.toml"
    return {name: add_key(path, name, scopes) for name, scopes in (("ann", ("speak", "live")), ("bob", ("speak",)))}


@pytest.fixture
def client(tmp_path: Path, keys: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    monkeypatch.setattr(presentations, "AsyncChild", MadeChild)
    MadeChild.made = []
    settings = ServiceSettings(
        data=tmp_path / "data", workers=0, keys=tmp_path / "keys.toml", live_targets=TARGETS, studio=False
    )
    with service_client(settings, SessionProcess(SessionCache(1))) as client:
        yield client


@contextmanager
def opened(client: TestClient, key: str, *targets: str, **options: Any) -> Iterator[WebSocketTestSession]:
    headers = {"Authorization": f"Bearer {key}"}
    with (
        suppress(CancelledError),  # the client of tests cancels a server that has not ended when it leaves
        client.websocket_connect("ws://localhost/v1/stream", headers=headers) as socket,
    ):
        socket.send_json({"type": "start", "targets": targets, **options})
        yield socket


def received(socket: WebSocketTestSession) -> dict[str, Any]:
    """The next message that is not the mark of synthesis."""
    while (message := socket.receive_json())["type"] == "mark":
        pass
    return dict(message)


def refusal(client: TestClient, key: str, *targets: str) -> str:
    with opened(client, key, *targets) as socket:
        message = received(socket)
    assert message["type"] == "error"
    return str(message["message"])


def test_a_stream_is_shown_on_the_targets_that_the_operator_names(client: TestClient, keys: dict[str, str]) -> None:
    with opened(client, keys["ann"], "stage", "puppet", style="happy", fps=60) as socket:
        shown = [received(socket) for _ in range(2)]
        assert shown == [{"type": "target", "name": name, "state": "connected"} for name in ("stage", "puppet")]
        socket.send_json({"type": "text", "text": "Hello there. "})
        socket.send_json({"type": "end"})
        assert received(socket) == {"type": "done"}
    (child,) = MadeChild.made
    assert child.content["targets"] == dict(pair.split("=", 1) for pair in TARGETS)
    assert child.content["request"] == {"style": "happy", "fps": 60}
    assert child.inputs == [{"type": "say", "text": "Hello there."}, {"type": "end"}]
    assert child.is_closed


def test_sound_is_shown_on_targets_too(client: TestClient, keys: dict[str, str]) -> None:
    with opened(client, keys["ann"], "stage", input="audio", rate=24_000) as socket:
        received(socket)
        socket.send_bytes(b"\0\0" * 10)
        socket.send_json({"type": "end"})
        assert received(socket)["type"] in {"said", "done"}
    (child,) = MadeChild.made
    assert (child.content["rate"], child.content["request"]) == (24_000, {})
    assert [given["type"] for given in child.inputs] == ["audio", "end"]


def test_only_keys_of_scope_live_choose_a_target(client: TestClient, keys: dict[str, str]) -> None:
    assert refusal(client, keys["bob"], "stage") == "the key bob lacks the scope live; use another key"
    assert not MadeChild.made


def test_no_address_of_a_client_is_followed(
    client: TestClient, keys: dict[str, str], subtests: pytest.Subtests
) -> None:
    for name in ("rtmp://evil.example/x", "vmc:10.0.0.1", "stage#key=/etc/passwd", "", "STAGE"):
        with subtests.test(name):
            assert refusal(client, keys["ann"], name) == f"there is no target {name!r}; the targets are stage, puppet"
    assert not MadeChild.made


def test_a_target_shows_one_stream_at_a_time(client: TestClient, keys: dict[str, str]) -> None:
    with opened(client, keys["ann"], "stage") as first:
        received(first)
        assert refusal(client, keys["ann"], "puppet", "stage").startswith("the target stage shows another stream")
        first.send_json({"type": "end"})
        assert received(first)["type"] == "done"
    with opened(client, keys["ann"], "stage") as again:
        assert received(again)["name"] == "stage"


def test_seconds_of_speech_are_counted(
    client: TestClient, keys: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    added: list[float] = []
    monkeypatch.setattr(RateLimits, "add_speech", lambda _self, _key, seconds: added.append(seconds))
    with opened(client, keys["ann"], "puppet") as socket:
        received(socket)
        socket.send_json({"type": "text", "text": "Hello there. "})
        socket.send_json({"type": "end"})
        assert received(socket)["type"] == "done"
    assert sum(added) == pytest.approx(1.5)


def test_a_client_that_leaves_frees_its_target(client: TestClient, keys: dict[str, str]) -> None:
    for _ in range(2):
        with opened(client, keys["ann"], "stage") as socket:
            assert received(socket)["type"] == "target"
    assert all(child.is_closed for child in MadeChild.made)


def test_targets_of_settings_are_checked_at_the_start(subtests: pytest.Subtests) -> None:
    wrong = [
        (("stage",), "live targets are written as stage=rtmp://HOST/APP/KEY"),
        (("Stage=vmc:a",), "live targets are written as"),
        (("a=vmc:a", "a=vmc:b"), "each name once, not 'a'"),
        (("a=ftp://a/b",), "there is no target 'ftp'"),
        (("a=window",), "must be a place that a server reaches, not a window"),
    ]
    for given, sentence in wrong:
        with subtests.test(str(given)), pytest.raises(InputError) as refused:
            ServiceSettings(live_targets=given)
        with subtests.test(f"{given}: sentence"):
            assert sentence in str(refused.value)


def test_what_targets_need_is_there_at_the_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    permissions: Any = None
    with pytest.raises(InputError, match=r"the file .*none with the key of rtmp:a:1935 cannot be read"):
        Presentations([f"stage=rtmp://a/b#key={tmp_path}/none"], permissions)
    monkeypatch.setattr(table, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match="whip:a:443 needs the package cryptography"):
        Presentations(["stage=whip:https://a/b"], permissions)


def test_settings_are_shown_without_stream_keys() -> None:
    settings = read_settings(None, {}, {"TTS2FACE_SERVE_LIVE_TARGETS": ",".join(TARGETS)})
    assert settings.live_targets == TARGETS
    shown = settings.as_toml()
    assert "stage=rtmp:a.example:1935" in shown
    assert "stream-key" not in shown
