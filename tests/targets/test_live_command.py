"""``tts2face live`` in this process, with a made world, and receivers of datagrams."""

import io
import json
import os
import socket
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cli.live import NOT_LIVE
from cli.main import run
from tests.targets.made import JAW
from tests.world import World
from tts2face.processes.child import Call, answer
from tts2face.processes.message import EVENT, MORE, Message, read_message
from tts2face.serving.service.routes.live import NOT_IN_LIVE_TEXT
from tts2face.targets import live_targets
from tts2face.targets.live_process import HANDLERS, PRESENT

HEAD = 4 + 37 + 4 + len("tts2face") + 16 + 1  # bytes of a packet before its values
REFUSED = [
    (["Hi."], "there is no target; add --to with one of whip:https://HOST/PATH, rtmp://"),
    (["Hi.", "--to", "ftp:a"], "there is no target 'ftp'"),
    (["Hi.", "--to", "vmc:a", "--to", "vmc:a"], "the target vmc:a:39539 is given twice"),
    (["Hi.", "--to", "vmc:a", "--file", "x.wav"], "a text cannot be combined with --file"),
    (["--to", "vmc:a", "--file", "x.wav", "--microphone", "default"], "--file cannot be combined with --microphone"),
    (["--to", "vmc:a", "--file", "x.wav"], "there is no recording x.wav"),
    ([" ", "--to", "vmc:a"], "the text is empty"),
    (["Hi.", "--to", "vmc:a", "--fps", "0"], "fps must lie between 1 and 120, not 0"),
    (["Hi.", "--to", "vmc:a", "--language", "tlh"], "no language 'tlh'"),
    (["Hi.", "--to", "vmc:a", "--size", "63"], "size"),
    (["Hi.", "--to", "vmc:a", "--consent", "me"], "--consent"),
    (["Hi.", "--to", "vmc:a", "--spoken-mark", " "], "--spoken-mark is empty"),
    (["Hi.", "--to", "rtmp://a/b#key=none"], "the file none with the key of rtmp:a:1935 cannot be read"),
]


class Packets:
    """A receiver of Live Link Face, which keeps the weights of the jaw."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        self.jaws: list[float] = []
        self.has_some = threading.Event()
        self._thread = threading.Thread(target=self._receive)
        self._thread.start()

    def _receive(self) -> None:
        with self._socket:
            while data := self._socket.recv(4096):
                self.jaws.append(struct.unpack_from(">61f", data, HEAD)[JAW])
                self.has_some.set()

    def close(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(b"", ("127.0.0.1", self.port))
        self._thread.join()


@pytest.fixture
def packets() -> Iterator[Packets]:
    packets = Packets()
    yield packets
    packets.close()


@pytest.mark.parametrize(
    ("arguments", "reason"), REFUSED, ids=lambda given: " ".join(given)[:60] if isinstance(given, list) else ""
)
def test_wrong_orders_are_refused_before_anything_is_loaded(
    arguments: list[str],
    reason: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("cli.live.open_session", lambda *_, **__: pytest.fail("models were loaded"))
    assert run(["live", *arguments]) == 2
    said = capsys.readouterr().err
    assert reason in said
    assert said.count("\n") == 1


def test_it_takes_the_options_of_the_services_live_streams() -> None:
    assert {
        name
        for name, reason in NOT_IN_LIVE_TEXT.items()
        if not reason.startswith("curves are") and "hair" not in name and name != "spoken_mark"
    } == NOT_LIVE


def test_a_text_moves_a_puppet_and_the_command_ends(
    tones: World, packets: Packets, capsys: pytest.CaptureFixture[str]
) -> None:
    target = f"livelink:127.0.0.1:{packets.port}"
    assert run(["live", "Papa, mama, Bob.", "--to", target, *tones.flags]) == 0
    said = capsys.readouterr().err.splitlines()
    assert [line.removeprefix(f"{target}: ") for line in said[:3]] == ["connecting", "connected", "closed"]
    assert said[3].startswith("sent ")
    assert len(packets.jaws) > 30
    assert max(packets.jaws) > min(packets.jaws)


def test_standard_input_is_spoken_as_it_is_written(
    tones: World, packets: Packets, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, write = os.pipe()
    with os.fdopen(read) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)

        def dictate() -> None:
            packets.has_some.wait(60)
            os.write(write, b"Papa, ma")
            os.write(write, b"ma. Bob. ")
            os.close(write)

        threading.Thread(target=dictate, daemon=True).start()
        assert run(["live", "--to", f"livelink:127.0.0.1:{packets.port}", "--quiet", *tones.flags]) == 0
    assert max(packets.jaws) > min(packets.jaws)


def test_an_input_without_a_text_is_no_success(
    tones: World, packets: Packets, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with open(os.devnull) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        assert run(["live", "--to", f"livelink:127.0.0.1:{packets.port}", "--quiet", *tones.flags]) == 2
    assert "standard input ended without a text; write one, or add --stay" in capsys.readouterr().err


def test_what_cannot_be_spoken_is_said_and_is_no_success(
    tones: World, packets: Packets, capsys: pytest.CaptureFixture[str]
) -> None:
    target = f"livelink:127.0.0.1:{packets.port}"
    assert run(["live", "<speak>Papa <b", "--to", target, "--quiet", *tones.flags]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("tts2face: the SSML is not well-formed")
    assert said[1] == "tts2face: not all has been spoken; the messages above say why"


def test_ctrl_c_closes_the_targets(
    tones: World, packets: Packets, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tts2face.targets.broadcast.Broadcast._is_over", interrupt)
    assert run(["live", "Papa.", "--stay", "--to", f"livelink:127.0.0.1:{packets.port}", *tones.flags]) == 130
    said = capsys.readouterr().err
    assert "closed" in said
    assert said.endswith("tts2face: interrupted; the connections to the targets have been closed\n")


def presented(tones: World, packets: Packets, said: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], float]:
    """Events of the service's process, and the seconds that it spoke."""
    models = dict(zip(("talker", "face", "palette"), tones.models[1::2], strict=True))
    request = {"voice": "tones", "fps": 30}
    content = {
        "models": models, "request": request, "targets": {"puppet": f"livelink:127.0.0.1:{packets.port}"}, "rate": None,
    }  # fmt: skip
    out = io.BytesIO()
    call = Call(Message(PRESENT, content), out, threading.Condition())
    for given in [*said, {"type": "end"}]:
        call.control(Message(MORE, given))
    answer(call, HANDLERS)
    out.seek(0)
    messages = list(iter(lambda: read_message(out), None))
    events = [message.content["event"] for message in messages if message.kind == EVENT]
    return events, messages[-1].content["seconds"]


def test_the_process_of_the_service_ends_behind_what_is_cancelled(tones: World, packets: Packets) -> None:
    cancel = {"type": "cancel", "arrived": time.monotonic()}
    events, _ = presented(tones, packets, [{"type": "say", "text": "Papa, mama."}, cancel])
    assert [event["n"] for event in events if event["type"] == "said"] == [1]
    assert events[-1] == {"type": "target", "name": "puppet", "state": "closed"}


def test_the_process_of_the_service_tells_the_end_of_each_text(tones: World, packets: Packets) -> None:
    """One that cannot be spoken ends in its turn, not when its error is told."""
    texts = ("Papa, mama.", "<speak>Papa <b")
    events, _ = presented(tones, packets, [{"type": "say", "text": text} for text in texts])
    assert [event["type"] for event in events if event["type"] in {"said", "error"}] == ["error", "said", "said"]


def test_the_process_of_the_service_follows_a_client(tones: World, packets: Packets) -> None:
    said: list[dict[str, Any]] = [
        {"type": "style", "style": "no-such-style"},
        {"type": "listen", "rate": None},
        {"type": "say", "text": "Papa, mama."},
        {"type": "say", "text": "Bob."},
    ]
    events, seconds = presented(tones, packets, said)
    states = [event["state"] for event in events if event["type"] == "target"]
    assert states == ["connecting", "connected", "closed"]
    assert sum(event["n"] for event in events if event["type"] == "said") == 2
    assert ["no-such-style" in event["message"] for event in events if event["type"] == "error"] == [True]
    assert seconds > 0.8
    assert json.dumps(events)


@pytest.fixture(autouse=True)
def short_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_targets, "CLOSE_S", 0.5)
