"""Targets and receivers in other processes: aiortc, FFmpeg, and a WebSocket that answers as VTube Studio does."""

import os
import stat
import tempfile
from pathlib import Path

import pytest

from tests.packages import needs
from tests.running import eventually, free_port
from tests.targets.made import FORMAT, sending
from tests.targets.receivers import TOKEN, receiver
from tts2face.storage.marks import LIVE_NOTICE
from tts2face.targets import live_targets, movie_targets
from tts2face.targets.certificate import own_certificate


@pytest.fixture(autouse=True)
def short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_targets, "FIRST_WAIT_S", 0.2)


@pytest.mark.parametrize("kind", ["rtmp", "rtsp"])
def test_ffmpeg_gets_pictures_and_sound_at_the_same_times(kind: str) -> None:
    port = free_port()
    path = {"rtmp": "live/key", "rtsp": "live"}[kind]
    with receiver(kind, port) as server:
        with sending([f"{kind}://127.0.0.1:{port}/{path}"]) as (states, *_):
            server.wait_for_event("sixty")
        received = server.wait_for_event("received")
    assert states.names()[-2:] == ["connected", "closed"]
    (first_picture, last_picture, n_pictures), (first_sound, last_sound, _) = (
        received["times"][stream] for stream in ("video", "audio")
    )
    assert n_pictures >= 60
    # an encoder of sound begins some thousand samples early
    assert first_picture == pytest.approx(first_sound, abs=0.1)
    assert last_picture == pytest.approx(last_sound, abs=0.15)
    assert last_picture - first_picture == pytest.approx((n_pictures - 1) / 30, abs=0.5)
    assert 0.2 < received["loudest"] < 0.45
    if kind == "rtmp":  # RTSP has no place for it
        assert received["comment"] == LIVE_NOTICE
    assert received["levels"] > 20


def test_webrtc_gets_pictures_and_sound_with_its_token(tmp_path: Path) -> None:
    needs("aiortc", "cryptography")
    port, token = free_port(), tmp_path / "token"
    token.write_text(TOKEN)
    before = set(Path(tempfile.gettempdir()).glob("tts2face-*"))
    with receiver("whip", port) as server, sending([f"whip:http://127.0.0.1:{port}/w#token={token}"]) as (states, *_):
        seen = server.wait_for_event("sixty")
        assert (seen["width"], seen["height"]) == (FORMAT.width, FORMAT.height)
    assert states.names() == ["connecting", "connected", "closed"]
    assert not set(Path(tempfile.gettempdir()).glob("tts2face-*")) - before


def test_a_wrong_token_is_named_and_not_shown(tmp_path: Path) -> None:
    needs("aiortc", "cryptography")
    port, token = free_port(), tmp_path / "token"
    token.write_text("another-one")
    with receiver("whip", port), sending([f"whip:http://127.0.0.1:{port}/w#token={token}"]) as (states, *_):
        lost = states.wait_for("lost")
    assert "it refuses the token" in lost.sentence
    assert "another-one" not in str(states.all)


def test_a_server_that_comes_back_gets_the_face_again() -> None:
    port = free_port()
    url = f"rtmp://127.0.0.1:{port}/live/key"
    with sending([url]) as (states, _, sent):
        assert "refused" in states.wait_for("lost").reason.lower()
        for _ in range(2):
            n_lost = states.names().count("lost")
            with receiver("rtmp", port) as server:
                server.wait_for_event("sixty")
            n_sent = len(sent)
            eventually(lambda n_lost=n_lost: states.names().count("lost") > n_lost)
            eventually(lambda n_sent=n_sent: len(sent) > n_sent)  # the clock goes on


def test_a_silent_server_is_left_in_time_and_stops_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    import socket

    monkeypatch.setattr(movie_targets, "CONNECT_S", 4.0)
    with socket.create_server(("127.0.0.1", 0)) as silent, receiver("sockets", port := free_port()) as server:
        url = f"rtmp://127.0.0.1:{silent.getsockname()[1]}/live/key"
        with sending([url, f"ws://127.0.0.1:{port}/curves"]) as (states, _, sent):
            server.wait_for_event("sixty")
            lost = states.wait_for("lost", "rtmp")
    assert "it has answered nothing for 4 s" in lost.reason
    assert states.names("ws") == ["connecting", "connected", "closed"]
    assert sent == list(range(len(sent)))


def test_vtube_studio_gets_parameters_and_its_token_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs("websockets")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    port = free_port()
    with receiver("sockets", port) as server:
        for n_agreed in (1, 1):
            with sending([f"vts:127.0.0.1:{port}#keep"]) as (states, *_):
                states.wait_for("connected")
                first = server.wait_for_event("first")["content"]
            assert [event["event"] for event in server.events()].count("agreed") == n_agreed
        server.wait_for_event("closed")
    assert first["found"] is True
    assert {"FaceAngleX", "MouthOpen", "EyeOpenLeft"} <= first.keys()
    (kept,) = (tmp_path / "tts2face" / "vtube-studio").iterdir()
    assert kept.read_text() == TOKEN
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600


def test_a_token_of_vtube_studio_is_not_kept_unasked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs("websockets")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with receiver("sockets", port := free_port()) as server, sending([f"vts:127.0.0.1:{port}"]):
        server.wait_for_event("sixty")
    assert not list(tmp_path.rglob("*.token"))


def test_curves_have_the_form_of_the_services_live_streams(tmp_path: Path) -> None:
    needs("websockets")
    token = tmp_path / "token"
    token.write_text(TOKEN)
    with receiver("sockets", port := free_port()) as server, sending([f"ws://127.0.0.1:{port}/x#token={token}"]):
        assert server.wait_for_event("opened")["authorization"] == f"Bearer {TOKEN}"
        assert server.wait_for_event("mark")["notice"] == LIVE_NOTICE
        first = server.wait_for_event("first")["content"]
        later = server.wait_for_event("sixty")["content"]
    assert first.keys() == {"type", "begin", "fps", "names", "head_names", "weights", "head"}
    assert later.keys() == first.keys() - {"names", "head_names"}
    assert (len(first["names"]), len(first["weights"]), len(first["weights"][0])) == (52, 1, 52)
    assert later["begin"] > first["begin"]


def test_the_key_of_webrtc_is_for_this_user_alone_and_is_removed() -> None:
    needs("cryptography")
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    with own_certificate() as files:
        key = Path(files["key_file"])
        assert stat.S_IMODE(key.stat().st_mode) == 0o600
        assert stat.S_IMODE(key.parent.stat().st_mode) == 0o700
        assert load_pem_private_key(key.read_bytes(), None).curve.name == "secp256r1"  # type: ignore[union-attr]
    assert not os.path.exists(key.parent)
