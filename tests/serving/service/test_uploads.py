"""Uploaded files: decoded elsewhere, within limits."""

import asyncio
import errno
import io
import wave
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.processes.answered import refusal
from tts2face.serving.service.decoders import Decoders
from tts2face.serving.work.uploaded_file import PICTURE, SOUND, SUBTITLES, VIDEO, FileOrder

RATE = 16_000
PLAYLIST = b"#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\nfile:///etc/passwd\n#EXT-X-ENDLIST\n"


def decode(kind: str, content: bytes, folder: Path, limit: float, **options: bool) -> tuple[str, Path]:
    given, decoded = folder / "given", folder / "decoded"
    given.write_bytes(content)
    return refusal(kind, given, decoded, limit, **options), decoded


def wav(seconds: float = 1.0, level: float = 0.3, gains: tuple[float, ...] = (1.0,)) -> bytes:
    samples = level * np.sin(2 * np.pi * 220 * np.arange(int(seconds * RATE)) / RATE)
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setparams((len(gains), 2, RATE, 0, "NONE", ""))
        file.writeframes((32767 * np.outer(samples, gains)).astype("<i2").tobytes())
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


@pytest.mark.parametrize("is_limited", [False, True])
def test_sound_becomes_plain_sound(tmp_path: Path, is_limited: bool) -> None:
    """In the process of the test, as those below, and in a child within its limits."""
    message, path = decode("sound", wav(), tmp_path, 10.0, is_limited=is_limited)
    assert message == ""
    with wave.open(str(path)) as file:
        assert (file.getframerate(), file.getnchannels()) == (48_000, 1)
        assert file.getnframes() == pytest.approx(48_000, abs=100)


def test_a_picture_becomes_a_plain_picture(tmp_path: Path) -> None:
    message, path = decode("picture", png(64, 32), tmp_path, 1e6)
    assert message == ""
    with Image.open(path) as picture:
        assert picture.size == (64, 32)
        assert picture.getpixel((3, 3)) == (10, 200, 30)


def saved(format: str) -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (8, 8)).save(buffer, format)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (saved("GIF"), "GIF is not read; give a PNG, JPEG or WebP"),
        (b"\0\0\0 ftypavif\0\0\0\0avifmif1", "AVIF is not read; give a PNG, JPEG or WebP"),
        (b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "HEIC is not read; give a PNG, JPEG or WebP"),
        (b"", "it is empty"),
        (png_bomb(7000), "it has 7000 x 7000 pixels, more than 40000000"),
        (b"no picture", "it is no picture that can be decoded"),
    ],
)
def test_a_picture_is_refused_for_what_it_is(tmp_path: Path, content: bytes, reason: str) -> None:
    assert decode(PICTURE, content, tmp_path, 4e7)[0] == reason


@pytest.mark.parametrize("kind", [SOUND, VIDEO])
def test_an_empty_file_is_refused_as_such(tmp_path: Path, kind: str) -> None:
    assert decode(kind, b"", tmp_path, 10.0)[0] == "it is empty"


@pytest.mark.parametrize(
    ("kind", "content", "limit", "reason"),
    [
        ("sound", wav(3.0), 2.0, "longer than 2 s"),
        ("sound", b"", 2.0, "it is empty"),
        ("sound", b"RIFF" + bytes(100), 2.0, "no sound that can be decoded"),
        ("sound", PLAYLIST, 2.0, "no sound that can be decoded"),
        ("sound", b"ffconcat version 1.0\nfile /etc/passwd\n", 2.0, "no sound that can be decoded"),
        ("sound", png(16, 16), 2.0, "no sound that can be decoded"),
        ("picture", png(200, 200), 10_000, "200 x 200 pixels, more than 10000"),
        ("picture", png_bomb(60_000), 4e7, "60000 x 60000 pixels"),
        ("picture", b"GIF89a" + bytes(100), 1e6, "GIF is not read"),
        ("picture", b"<svg xmlns='http://www.w3.org/2000/svg'/>", 1e6, "SVG is not read"),
        ("picture", png(64, 64)[:60], 1e6, "no picture that can be decoded"),
    ],
)
def test_wrong_files_are_refused(tmp_path: Path, kind: str, content: bytes, limit: float, reason: str) -> None:
    message, _ = decode(kind, content, tmp_path, limit)
    assert reason in message


def test_a_decoder_cannot_take_the_memory_of_the_machine(tmp_path: Path) -> None:
    """A picture within the limit of pixels but beyond that of memory ends its process only."""
    message, _ = decode("picture", png_bomb(30_000), tmp_path, 1e9, is_limited=True)
    assert message
    assert "Traceback" not in message


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    ("kind", "content"),
    [(SUBTITLES, b"1\n00:00:01,000 --> 00:00:02,000\nHello.\n"), (PICTURE, png(64, 64)), (SOUND, wav())],
    ids=["subtitles", "picture", "sound"],
)
def test_a_full_disk_is_not_a_fault_of_the_file(kind: str, content: bytes, tmp_path: Path) -> None:
    """The guard answers this error; a refusal would tell the client to send another file."""
    (tmp_path / "given").write_bytes(content)
    with pytest.raises(OSError, match="No space left") as full:
        asyncio.run(Decoders().decode("a", FileOrder(kind, tmp_path / "given", Path("/dev/full"), 1e6), "it", 60.0))
    assert full.value.errno == errno.ENOSPC
