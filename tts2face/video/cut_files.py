"""Files whose sound is cut off: uncompressed sound states how many bytes it has, and is read however few there are.

Other formats cannot be read without their end, or state their duration (`tts2face.video.container.decode_frames`).
"""

import struct
from pathlib import Path
from typing import BinaryIO, NamedTuple

LEAST_CUT_S = 0.1  # less is what a program rounds
MAX_CHUNKS = 1000  # before the sound
# Sizes of sound that is sent while it is made: the largest one of 31 or 32 bits, less what precedes it, or none.
UNKNOWN_SIZES = (range(1), range(0x7FFF0000, 0x80000001), range(0xFFFF0000, 0x100000000))
RIFF_START = 12
AU = b".snd"


class StatedSound(NamedTuple):
    """Bytes of a file at which its sound begins, ends by what it states, and ends.

    FFmpeg takes the duration from what is there, of AU from what is stated.
    """

    start: int
    stated_end: int
    end: int
    is_duration_stated: bool = False


def missing_seconds(path: Path, duration: float) -> float:
    """Seconds of sound that a file states and lacks at its end, by its `duration` in FFmpeg; 0.0 if none."""
    with path.open("rb") as file:
        found = _stated_sound(file, path.stat().st_size)
    if found is None or not found.start < found.end < found.stated_end:
        return 0.0
    last = found.stated_end if found.is_duration_stated else found.end
    missing = duration * (found.stated_end - found.end) / (last - found.start)
    return missing if missing >= LEAST_CUT_S else 0.0


def _stated_sound(file: BinaryIO, end: int) -> StatedSound | None:
    """Bytes of the sound of an open file; None where it states none, or is of another format."""
    head = file.read(RIFF_START)
    start, size = 0, 0
    match head[:4], head[8:]:
        case b"RIFF", b"WAVE":
            start, size = _data_chunk(file, "<4sI", RIFF_START, 2)
        case b"RIFF", b"AVI ":
            start, size = RIFF_START, int.from_bytes(head[4:8], "little") - 4
        case b"riff", _:
            start, size = _data_chunk(file, "<4s12xQ", 40, 8, counts_head=True)
        case b"caff", _:
            start, size = _data_chunk(file, ">4sQ", 8, 1)
        case first, _ if first == AU:
            start, size = struct.unpack(">II", head[4:12])
    is_known = size > 0 and size < 1 << 62 and not any(size in sizes for sizes in UNKNOWN_SIZES)
    return StatedSound(start, start + size, end, head.startswith(AU)) if is_known else None


def _data_chunk(file: BinaryIO, head: str, at: int, align: int, *, counts_head: bool = False) -> tuple[int, int]:
    """Start and stated size of the chunk ``data`` of a file whose chunks begin at a byte; 0, 0 without one."""
    n_head = struct.calcsize(head)
    for _ in range(MAX_CHUNKS):
        file.seek(at)
        content = file.read(n_head)
        if len(content) < n_head:
            break
        name, size = struct.unpack(head, content)
        size -= n_head if counts_head else 0
        if name == b"data":
            return at + n_head, size
        if not 0 <= size < 1 << 62:
            break
        at += n_head + size + -size % align
    return 0, 0
