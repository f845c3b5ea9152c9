"""Datagrams of VMC and Live Link Face, read by python-osc and at the offsets of the packet's layout."""

import math
import struct
from typing import Any

import numpy as np
import pytest

from tests.packages import package
from tests.targets.made import FORMAT, JAW, made_tick
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.targets.table import make_target, parse_target
from tts2face.targets.target import DatagramTarget
from tts2face.targets.vmc import MAX_DATAGRAM_BYTES, osc_message


def datagrams(text: str, number: int = 5) -> list[bytes]:
    target = make_target(parse_target(text), FORMAT)
    assert isinstance(target, DatagramTarget)
    return target.datagrams(made_tick(number))


def messages(text: str) -> list[tuple[str, list[Any]]]:
    """Messages of a tick by python-osc, in their order."""
    bundles = package("pythonosc.osc_bundle").OscBundle
    return [(one.address, list(one.params)) for data in datagrams(text) for one in bundles(data)]


def test_vmc_sends_all_weights_and_applies_them_last() -> None:
    found = messages("vmc:127.0.0.1")
    assert [address for address, _ in found][:3] == ["/VMC/Ext/OK", "/VMC/Ext/T", "/VMC/Ext/Bone/Pos"]
    assert found[-1] == ("/VMC/Ext/Blend/Apply", [])
    weights = {name: value for address, (name, value) in found[3:-1]}
    assert list(weights) == [name[0].upper() + name[1:] for name in ARKIT_SHAPES]
    assert weights["JawOpen"] == pytest.approx(0.5)
    assert found[1][1] == [pytest.approx(5 / 30)]


def test_vmc_datagrams_fit_into_one_frame_of_ethernet() -> None:
    sizes = [len(data) for data in datagrams("vmc:127.0.0.1")]
    assert len(sizes) == 2
    assert max(sizes) <= MAX_DATAGRAM_BYTES


def test_vmc_turns_the_head_in_left_handed_axes() -> None:
    bone = next(values for address, values in messages("vmc:127.0.0.1") if address == "/VMC/Ext/Bone/Pos")
    name, *place, x, y, z, w = bone
    assert (name, place) == ("Head", [0.0, 0.0, 0.0])
    assert x**2 + y**2 + z**2 + w**2 == pytest.approx(1.0, abs=1e-6)
    # in Unity a nod down is positive about x; a turn and a tilt to the own left are negative about y and z
    assert x > 0 > y
    only_yaw = made_tick(0)
    only_yaw.head[:] = [0, 0.4, 0, 0, 0, 0]
    target = make_target(parse_target("vmc:127.0.0.1"), FORMAT)
    assert isinstance(target, DatagramTarget)
    first = target.datagrams(only_yaw)[0]
    at = first.index(b"Head\0\0\0\0") + 8
    assert struct.unpack_from(">7f", first, at) == pytest.approx((0, 0, 0, 0, -math.sin(0.2), 0, math.cos(0.2)))


def test_vmc_vowels_are_those_of_vrm() -> None:
    sent = [values for address, values in messages("vmc:127.0.0.1#vowels") if address == "/VMC/Ext/Blend/Val"]
    assert [name for name, _ in sent] == ["A", "I", "U", "E", "O", "Blink", "Blink_L", "Blink_R"]
    assert all(0.0 <= value <= 1.0 for _, value in sent)
    assert sum(value for _, value in sent[:5]) > 0.1


def test_osc_strings_fill_four_bytes() -> None:
    assert osc_message("/abc", "s", "abcd") == b"/abc\0\0\0\0,s\0\0abcd\0\0\0\0"
    assert osc_message("/a", "i", 1) == b"/a\0\0,i\0\0\0\0\0\1"


def test_live_link_packets_have_the_layout_of_the_app() -> None:
    (data,) = datagrams("livelink:127.0.0.1#subject=Ada")
    assert len(data) == 4 + 37 + 4 + 3 + 16 + 1 + 4 * 61
    assert struct.unpack_from("<i", data)[0] == 6
    assert data[4:5] == b"$"
    assert data[41:48] == b"\0\0\0\3Ada"
    frame, part, rate, denominator, n = struct.unpack_from(">ifiib", data, 48)
    assert (rate, denominator, n) == (30, 1, 61)
    assert 0 <= frame < 24 * 3600 * 30
    assert 0.0 <= part < 1.0
    values = struct.unpack_from(">61f", data, 65)
    tick = made_tick(5)
    assert values[:52] == pytest.approx(tick.weights)
    assert values[JAW] == pytest.approx(0.5)
    assert values[52:55] == pytest.approx([-0.2, 0.1, 0.3])  # yaw to the right, pitch down, roll
    assert values[55:] == pytest.approx(np.arange(6) / 10)


def test_the_device_of_live_link_is_the_same_in_each_run() -> None:
    first, second = (datagrams("livelink:127.0.0.1")[0][4:41] for _ in range(2))
    assert first == second != datagrams("livelink:127.0.0.1#subject=Ada")[0][4:41]


def test_a_long_subject_is_cut_between_characters() -> None:
    (data,) = datagrams(f"livelink:127.0.0.1#subject={'ä' * 40}x")
    length = struct.unpack_from(">i", data, 41)[0]
    assert data[45 : 45 + length].decode() == "ä" * 32
