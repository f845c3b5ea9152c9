"""Blocks of files, walked by their formats' own rules and not by the product's readers."""

import struct
from collections.abc import Iterator
from pathlib import Path


def riff_chunks(content: bytes) -> dict[bytes, bytes]:
    """Chunks of a WAV file by name; the samples of a stream of unknown length reach to its end."""
    assert (content[:4], content[8:12]) == (b"RIFF", b"WAVE")
    (size,) = struct.unpack("<I", content[4:8])
    assert size in {0xFFFFFFFF, len(content) - 8}
    chunks, at = {}, 12
    while at < len(content):
        name, (size,) = content[at : at + 4], struct.unpack("<I", content[at + 4 : at + 8])
        size = len(content) - at - 8 if size == 0xFFFFFFFF else size
        assert at + 8 + size <= len(content)
        chunks[name] = content[at + 8 : at + 8 + size]
        at += 8 + size + size % 2
    return chunks


def samples_of(content: bytes) -> bytes:
    """Samples of a WAV file."""
    return riff_chunks(content)[b"data"]


def png_chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Names and whole chunks of a PNG file, after its signature."""
    at = 8
    while at < len(content):
        (size,) = struct.unpack(">I", content[at : at + 4])
        yield content[at + 4 : at + 8], content[at : at + 12 + size]
        at += 12 + size
    assert at == len(content)


def boxes(content: bytes) -> list[tuple[bytes, bytes]]:
    """Kinds and contents of boxes of MP4."""
    found = []
    while content:
        size = int.from_bytes(content[:4], "big")
        assert 8 <= size <= len(content)
        found.append((content[4:8], content[8:size]))
        content = content[size:]
    return found


def unmarked(path: Path) -> bytes:
    """A file without its mark, which names the version of the program; of MP4 the coded pictures and sound."""
    content = path.read_bytes()
    match path.suffix:
        case ".png":
            texts = {b"tEXt", b"iTXt"}
            return content[:8] + b"".join(chunk for kind, chunk in png_chunks(content) if kind not in texts)
        case ".wav":
            chunks = riff_chunks(content)
            size, head = len(chunks[b"data"]), chunks[b"fmt "]
            sizes = (0xFFFFFFFF,) * 2 if content[4:8] == b"\xff" * 4 else (36 + size, size)
            riff = struct.pack("<4sI4s4sI", b"RIFF", sizes[0], b"WAVE", b"fmt ", len(head))
            return riff + head + struct.pack("<4sI", b"data", sizes[1]) + chunks[b"data"]
        case ".mp4":
            return b"".join(inner for kind, inner in boxes(content) if kind in {b"mdat", b"moof"})
        case ".glb":
            return content[20 + int.from_bytes(content[12:16], "little") :]
        case _:
            return content
