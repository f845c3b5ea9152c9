"""Addresses of targets: what is taken, what is refused, and what is never shown."""

from fractions import Fraction
from pathlib import Path

import pytest

from lexicon.errors import BackendError, InputError
from tts2face.targets import table
from tts2face.targets.address import TOKEN_VARIABLE
from tts2face.targets.table import TARGETS, make_target, parse_target, parse_targets
from tts2face.targets.tick import LiveFormat

FORMAT = LiveFormat(Fraction(30), 64, 48)
TAKEN = [
    ("whip:https://a.example/live/x", "whip", "a.example", 443, "https://a.example/live/x"),
    ("whip:http://a.example:8889/live#kbps=900", "whip", "a.example", 8889, "http://a.example:8889/live"),
    ("rtmp://a.example/app/k-e-y", "rtmp", "a.example", 1935, "rtmp://a.example/app/k-e-y"),
    ("rtsp://a.example:8554/face", "rtsp", "a.example", 8554, "rtsp://a.example:8554/face"),
    ("vmc:127.0.0.1:39540#vowels", "vmc", "127.0.0.1", 39540, "ws://127.0.0.1:39540"),
    ("vmc:avatar", "vmc", "avatar", 39539, "ws://avatar:39539"),
    ("livelink:[::1]", "livelink", "::1", 11111, "ws://[::1]:11111"),
    ("vts:localhost#keep", "vts", "localhost", 8001, "ws://localhost:8001"),
    ("ws://a.example/curves?room=1", "ws", "a.example", 80, "ws://a.example/curves?room=1"),
    ("window", "window", "", 0, ""),
]
REFUSED = [
    ("webrtc:x", "there is no target 'webrtc'; the targets are whip:"),
    ("", "there is no target ''"),
    ("whip:ftp://a.example/x", "needs a URL of http or https"),
    ("whip:https:///x", "names no host"),
    ("whip:a.example/secret", "'a.example' names no host"),
    ("rtmp://user:secret@a.example/x", "holds no password"),
    ("rtmp://a.example:99999/x", "is no address of a target"),
    ("vmc:a.example:1/x", "needs a host and a port alone"),
    ("vmc:", "'' names no host"),
    ("vmc:a.example:b", "'a.example:b' is no address of a target"),
    ("vmc:a.example:0", "(port 0 is none)"),
    ("window:1", "takes no place"),
    ("vmc:a#vowel", "there is no option 'vowel' of vmc:HOST:39539; its options are vowels"),
    ("vmc:a#vowels=1", "must stand there once, as vowels, without a value"),
    ("whip:https://a/b#token", "must stand there once, as token=VALUE"),
    ("whip:https://a/b#token=x,token=y", "must stand there once"),
    ("window#keep", "which has none"),
    ("rtsp://a/b#kbps=7", "kbps must be a whole number from 50 to 100000, not '7'"),
]


def test_addresses_are_taken(subtests: pytest.Subtests) -> None:
    for text, kind, host, port, url in TAKEN:
        with subtests.test(text):
            found = parse_target(text)
            assert (found.kind, found.host, found.port, found.url) == (kind, host, port, url)


def test_wrong_addresses_are_refused_in_one_sentence(subtests: pytest.Subtests) -> None:
    for text, sentence in REFUSED:
        with subtests.test(text), pytest.raises(InputError) as refused:
            parse_target(text)
        with subtests.test(f"{text}: sentence"):
            assert sentence in str(refused.value)
            assert "secret" not in str(refused.value)


def test_the_same_place_twice_is_refused() -> None:
    with pytest.raises(InputError, match="rtmp:a:1935 is given twice"):
        parse_targets(["rtmp://a/b", "window", "rtmp://a/b#kbps=800"])
    assert len(parse_targets(["rtmp://a/b#key=one.txt", "rtmp://a/b#key=two.txt"])) == 2


def test_paths_and_options_are_never_shown() -> None:
    address = parse_target("rtmp://a.example/app/stream-key#kbps=800")
    assert address.shown == "rtmp:a.example:1935"
    assert "stream-key" not in repr(address)
    assert parse_target("vts:[::1]").shown == "vts:[::1]:8001"


def test_every_kind_has_a_class_whose_module_loads() -> None:
    for kind in TARGETS:
        assert kind.load().__doc__


def test_tokens_come_from_a_file_or_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "token"
    file.write_text(" abc \n")
    monkeypatch.setenv(TOKEN_VARIABLE, "from-environment")
    assert parse_target(f"ws://a/b#token={file}").secret("token", TOKEN_VARIABLE) == "abc"
    assert parse_target("ws://a/b").secret("token", TOKEN_VARIABLE) == "from-environment"
    file.write_text("two words\n")
    with pytest.raises(InputError, match="must hold the token of ws:a:80 alone"):
        parse_target(f"ws://a/b#token={file}").secret("token")
    with pytest.raises(InputError, match="cannot be read: No such file"):
        make_target(parse_target(f"ws://a/b#token={tmp_path}/none"), FORMAT)


def test_a_missing_package_is_named_before_anything_connects(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match=r"ws:a:80 needs the package websockets; run: pip install 'tts2face\[live\]"):
        make_target(parse_target("ws://a/b"), FORMAT)


def test_bit_rates_follow_size_and_rate() -> None:
    def kbps(text: str, *format: int) -> int:
        return make_target(parse_target(text), LiveFormat(Fraction(format[0]), *format[1:])).kbps  # type: ignore[attr-defined]

    assert kbps("rtmp://a/b", 30, 512, 512) == 1500
    assert 1500 < kbps("rtmp://a/b", 60, 512, 512) < kbps("rtmp://a/b", 60, 1920, 1080)
    assert kbps("rtmp://a/b#kbps=750", 30, 512, 512) == 750
