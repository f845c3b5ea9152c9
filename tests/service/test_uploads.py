"""Uploaded files: decoded elsewhere, within limits."""

import io
import json
import subprocess
import sys
import tempfile
import wave
import zlib
from pathlib import Path

import av
import httpx
import numpy as np
import pytest
from PIL import Image

import tts2face
from tts2face.service.uploads.decode_process import REFUSED

RATE = 16_000


def decode(kind: str, content: bytes, folder: Path, limit: float) -> tuple[int, str, Path]:
    given, decoded = folder / "given", folder / "decoded"
    given.write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-m", "tts2face.service.uploads.decode_process", kind, given, decoded, str(limit)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    return done.returncode, done.stderr, decoded


def wav(seconds: float = 1.0) -> bytes:
    samples = 0.3 * np.sin(2 * np.pi * 220 * np.arange(int(seconds * RATE)) / RATE)
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes((32767 * samples).astype("<i2").tobytes())
    return buffer.getvalue()


def png(width: int, height: int) -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (width, height), (10, 200, 30)).save(buffer, "PNG")
    return buffer.getvalue()


def png_bomb(side: int) -> bytes:
    """A picture of some kilobytes that decodes to gigabytes."""

    def chunk(name: bytes, content: bytes) -> bytes:
        return len(content).to_bytes(4, "big") + name + content + zlib.crc32(name + content).to_bytes(4, "big")

    head = side.to_bytes(4, "big") * 2 + bytes([8, 2, 0, 0, 0])
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(bytes(1 << 20), 9))
        + chunk(b"IEND", b"")
    )


def test_sound_becomes_plain_sound(tmp_path: Path) -> None:
    code, message, path = decode("sound", wav(), tmp_path, 10.0)
    assert (code, message) == (0, "")
    with wave.open(str(path)) as file:
        assert (file.getframerate(), file.getnchannels()) == (48_000, 1)
        assert file.getnframes() == pytest.approx(48_000, abs=100)


def test_a_picture_becomes_a_plain_picture(tmp_path: Path) -> None:
    code, message, path = decode("picture", png(64, 32), tmp_path, 1e6)
    assert (code, message) == (0, "")
    with Image.open(path) as picture:
        assert picture.size == (64, 32)
        assert picture.getpixel((3, 3)) == (10, 200, 30)


PLAYLIST = b"#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\nfile:///etc/passwd\n#EXT-X-ENDLIST\n"


@pytest.mark.parametrize(
    ("kind", "content", "limit", "reason"),
    [
        ("sound", wav(3.0), 2.0, "longer than 2 s"),
        ("sound", b"", 2.0, "no sound that can be decoded"),
        ("sound", b"RIFF" + bytes(100), 2.0, "no sound that can be decoded"),
        ("sound", PLAYLIST, 2.0, "no sound that can be decoded"),
        ("sound", b"ffconcat version 1.0\nfile /etc/passwd\n", 2.0, "no sound that can be decoded"),
        ("sound", png(16, 16), 2.0, "no sound that can be decoded"),
        ("picture", png(200, 200), 10_000, "200 x 200 pixels, more than 10000"),
        ("picture", png_bomb(60_000), 4e7, "60000 x 60000 pixels"),
        ("picture", b"GIF89a" + bytes(100), 1e6, "no picture that can be decoded"),
        ("picture", b"<svg xmlns='http://www.w3.org/2000/svg'/>", 1e6, "no picture that can be decoded"),
        ("picture", png(64, 64)[:60], 1e6, "no picture that can be decoded"),
    ],
)
def test_wrong_files_are_refused(tmp_path: Path, kind: str, content: bytes, limit: float, reason: str) -> None:
    code, message, _ = decode(kind, content, tmp_path, limit)
    assert (code, reason in message) == (REFUSED, True), message


def test_a_decoder_cannot_take_the_memory_of_the_machine(tmp_path: Path) -> None:
    """A picture within the limit of pixels but beyond that of memory ends its process only."""
    code, message, _ = decode("picture", png_bomb(30_000), tmp_path, 1e9)
    assert code != 0
    assert "Traceback" not in message


def movie_bytes() -> bytes:
    session = tts2face.Session()
    small = tts2face.Picture(size="32x32", supersampling=1)
    return b"".join(chunk.content for chunk in session.stream_file("We were away.", "mp4", picture=small))


def test_a_recording_and_a_background_make_a_clip(client: httpx.Client) -> None:
    """The video's sound is spoken on a green wall; nothing of the uploads stays."""
    folders = set(Path(tempfile.gettempdir()).glob("tts2face-upload-*"))
    options = {"text": "We were away.", "size": "64x64", "supersampling": 1, "fps": 25}
    response = client.post(
        "/v1/clips",
        data={"request": json.dumps(options)},
        files={"audio": ("../../evil;name.mp4", movie_bytes()), "background": ("b.png", png(64, 64))},
    )
    assert response.status_code == 200, response.text
    with av.open(io.BytesIO(response.content)) as movie:
        frames = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
    assert len(frames) > 20
    assert np.abs(frames[0][2, 2].astype(int) - (10, 200, 30)).max() < 25
    assert set(Path(tempfile.gettempdir()).glob("tts2face-upload-*")) == folders


def test_a_timeline_moves_the_face(client: httpx.Client) -> None:
    timeline = json.dumps({"expressions": [{"expression": "happy", "weight": 1.0}]})
    options = {"text": "Hello there.", "format": "curves"}
    plain = client.post("/v1/clips", json=options).text
    form = {"request": json.dumps(options)}
    happy = client.post("/v1/clips", data=form, files={"timeline": ("t.json", timeline)}).text
    smiles = []
    for lines in (plain, happy):
        head, *frames = map(json.loads, lines.splitlines())
        smiles.append(max(frame["weights"][head["weights"].index("mouthSmileLeft")] for frame in frames))
    assert smiles[1] > smiles[0] + 0.1


@pytest.mark.parametrize(
    ("data", "files", "status", "reason"),
    [
        ({}, {"audio": ("a.wav", b"no sound")}, 422, "audio cannot be used: it is no sound"),
        ({}, {"background": ("b.png", png_bomb(60_000))}, 422, "background cannot be used: it has 60000 x 60000"),
        ({}, {"timeline": ("t.json", b"{")}, 422, "t"),
        ({}, {"timeline": ("t.json", b"[" * 100_000)}, 422, "t"),
        ({}, {"song": ("s.wav", b"x")}, 422, "there is no part 'song'"),
        ({"request": "{"}, {"audio": ("a.wav", wav())}, 422, "JSON"),
        ({"request": "{}", "audio": "text"}, {"background": ("b.png", png(4, 4))}, 422, "audio must be a file"),
    ],
)
def test_wrong_forms_are_refused(
    client: httpx.Client, data: dict[str, str], files: dict[str, tuple[str, bytes]], status: int, reason: str
) -> None:
    response = client.post("/v1/clips", data={"request": '{"text": "Hello."}'} | data, files=files)
    assert (response.status_code, reason in response.json()["error"]["message"]) == (status, True), response.text
