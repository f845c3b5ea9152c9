"""Blocks of a WebM file stand in the order of their times, as Media Source Extensions demand."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from tts2face.picture.movie import STREAMED_WEBM, WEBM_MOVIE, MovieKind, MovieWriter
from tts2face.picture.write_buffer import WriteBuffer

SEGMENT, CLUSTER, CLUSTER_TIME, GROUP, BLOCK, SIMPLE_BLOCK = 0x18538067, 0x1F43B675, 0xE7, 0xA0, 0xA1, 0xA3
N_FRAMES, RATE = 100, 24_000


def number(content: bytes, at: int, *, has_mark: bool) -> tuple[int, int]:
    """A number of variable length (RFC 8794, 4), with or without the bit that marks its length, and where it ends."""
    n_bytes = 9 - content[at].bit_length()
    value = int.from_bytes(content[at : at + n_bytes], "big")
    return value if has_mark else value & ~(1 << 7 * n_bytes), at + n_bytes


def blocks(content: bytes) -> list[tuple[int, int]]:
    """Time in milliseconds and track of each block of a WebM file, in the order of the file."""
    found, at, start = [], 0, 0
    while at < len(content):
        name, at = number(content, at, has_mark=True)
        size, at = number(content, at, has_mark=False)
        if name in {SEGMENT, CLUSTER, GROUP}:  # their content follows, whose size a stream may not know
            continue
        if name == CLUSTER_TIME:
            start = int.from_bytes(content[at : at + size], "big")
        elif name in {BLOCK, SIMPLE_BLOCK}:
            track, after = number(content, at, has_mark=False)
            found.append((start + int.from_bytes(content[after : after + 2], "big", signed=True), track))
        at += size
    return found


def written(kind: MovieKind, fps: Fraction, n_channels: int, path: Path) -> bytes:
    """A film of `N_FRAMES` pictures with noise as sound."""
    target = WriteBuffer() if kind is STREAMED_WEBM else path
    writer = MovieWriter(target, kind, (48, 64, n_channels), (fps, RATE))
    noise, at = np.random.default_rng(0), 0
    for frame in range(N_FRAMES):
        writer.picture(np.full((48, 64, n_channels), frame, np.uint8))
        end = int((frame + 1) * RATE / fps)
        writer.sound(noise.normal(0, 0.1, end - at).astype(np.float32))
        at = end
    writer.finish()
    return target.take() if isinstance(target, WriteBuffer) else path.read_bytes()


@pytest.mark.parametrize("n_channels", [3, 4], ids=["opaque", "transparent"])
@pytest.mark.parametrize("fps", [Fraction(24_000, 1001), Fraction(25), Fraction(30), Fraction(60)], ids=str)
@pytest.mark.parametrize("kind", [STREAMED_WEBM, WEBM_MOVIE], ids=["streamed", "file"])
def test_no_block_stands_after_a_later_one(kind: MovieKind, fps: Fraction, n_channels: int, tmp_path: Path) -> None:
    found = blocks(written(kind, fps, n_channels, tmp_path / "film.webm"))
    times = [time for time, _ in found]
    assert times == sorted(times)
    pictures = [time for time, track in found if track == 1]
    assert pictures == pytest.approx([1000 * float(frame / fps) for frame in range(N_FRAMES)], abs=0.51)
