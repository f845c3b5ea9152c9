"""Hostile texts, files and forms against a real server: refused as documented; the server serves on."""

import io
import json

import av
import httpx
import numpy as np
import pytest

from tests.running import RunningService
from tests.serving.service.attacked import alive, attacked
from tests.serving.service.raw import ask, request
from tests.serving.service.test_uploads import png_bomb

__all__ = ["alive", "attacked"]  # fixtures

# Texts


@pytest.mark.parametrize(
    ("text", "statuses"),
    [
        ("a" * 10_000, {400}),
        ("supercalifragilistic" * 500, {400}),
        ("\u0301" * 10_000, {200, 400}),
        ("1" * 10_000, {400}),
        ("\u0661" * 10_000, {400}),
        ("." * 50_000, {200, 400}),
        ("\x00\x01\x1b[31m\u202e\ufeff", {200, 400}),
        ("[" * 50_000, {200, 400}),
        ("<speak>" * 10_000, {400}),
        ("<!DOCTYPE x [<!ENTITY a 'b'>]><speak>&a;</speak>", {400}),
        ("<?xml version='1.0'?><!DOCTYPE s [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><speak>&x;</speak>", {400}),
        ("<speak>" + "<emphasis> " * 4000 + "Hi." + "</emphasis> " * 4000 + "</speak>", {200, 400}),
        ("<speak><break time='1e9s'/>Hi.</speak>", {200}),  # without the pause, with a note
        ("<speak>" + "a<break time='10s'/>" * 4200 + "</speak>", {400}),
        ("a [pause 10] " * 7000, {400}),
        ("<speak><prosody rate='1e-9'>Hi.</prosody></speak>", {200, 400}),
    ],
    ids=lambda value: repr(value[:24]) if isinstance(value, str) else "",
)
def test_hostile_texts(attacked: RunningService, text: str, statuses: set[int]) -> None:
    body = json.dumps({"text": text, "format": "oculus"}).encode()
    answer = ask(attacked.url, request("POST", "/v1/clips", body))
    assert answer.status in statuses, answer


def test_a_billion_laughs_are_refused_at_once(attacked: RunningService) -> None:
    entities = "".join(f"<!ENTITY l{n + 1} '{f'&l{n};' * 10}'>" for n in range(9))
    text = f"<?xml version='1.0'?><!DOCTYPE speak [<!ENTITY l0 'ha'>{entities}]><speak>&l9;</speak>"
    answer = ask(attacked.url, request("POST", "/v1/clips", json.dumps({"text": text}).encode()))
    assert (answer.status, answer.code) == (400, "invalid_request")


# Files


def silence(kind: str, codec: str, minutes: int) -> bytes:
    """Sound of minutes in kilobytes."""
    buffer = io.BytesIO()
    with av.open(buffer, "w", format=kind) as file:
        stream = file.add_stream(codec, rate=48_000, layout="mono")
        zeros = np.zeros((1, 48_000 * 10), np.int16 if codec == "flac" else np.float32)
        for number in range(6 * minutes):
            frame = av.AudioFrame.from_ndarray(zeros, "s16" if codec == "flac" else "fltp", "mono")
            frame.sample_rate, frame.pts = 48_000, number * zeros.shape[1]
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    return buffer.getvalue()


def upload(service: RunningService, **files: tuple[str, bytes]) -> httpx.Response:
    data = {"request": json.dumps({"text": "Hello.", "format": "oculus"})}
    return httpx.post(f"{service.url}/v1/clips", data=data, files=files, timeout=120)


@pytest.mark.parametrize(("kind", "codec"), [("flac", "flac"), ("ogg", "libopus")])
def test_hours_of_silence_in_kilobytes_are_refused(attacked: RunningService, kind: str, codec: str) -> None:
    content = silence(kind, codec, 30)
    assert len(content) < 1_000_000
    answer = upload(attacked, audio=("a.wav", content))
    assert (answer.status_code, "longer than 20 s" in answer.text) == (422, True), answer.text


def test_a_picture_of_gigabytes_is_refused(attacked: RunningService) -> None:
    content = png_bomb(40_000)
    assert len(content) < 10_000
    answer = upload(attacked, background=("b.png", content))
    assert (answer.status_code, "40000 x 40000 pixels" in answer.text) == (422, True), answer.text


@pytest.mark.parametrize(
    ("content", "kind", "statuses"),
    [
        (b"", "multipart/form-data", {400, 422}),
        (b"--x\r\n\r\n", "multipart/form-data; boundary=x", {400, 422}),
        (b"--x\r\n", "multipart/form-data; boundary=" + "x" * 1000, {400, 422}),
        (b"--x\r\n" + b"A: b\r\n" * 20_000 + b"\r\n\r\n--x--", "multipart/form-data; boundary=x", {400, 422}),
        (
            b"".join(b'--x\r\nContent-Disposition: form-data; name="f%d"\r\n\r\n1\r\n' % n for n in range(10_000))
            + b"--x--\r\n",
            "multipart/form-data; boundary=x",
            {400, 422},
        ),
        (
            b'--x\r\nContent-Disposition: form-data; name="audio"; filename="../../etc/x\x00.wav"\r\n\r\n1\r\n--x--',
            "multipart/form-data; boundary=x",
            {400, 422},
        ),
        (b"--x\r\n" * 100_000, "multipart/form-data; boundary=x", {400, 422}),
        (b"a=b&" * 100_000, "application/x-www-form-urlencoded", {400, 422}),
        (b"PK\x03\x04" + bytes(1000), "application/zip", {400, 422}),
    ],
    ids=range(9),
)
def test_hostile_forms(attacked: RunningService, content: bytes, kind: str, statuses: set[int]) -> None:
    answer = ask(attacked.url, request("POST", "/v1/clips", content, kind=kind))
    assert answer.status in statuses, answer
    assert json.loads(answer.body)["error"]
