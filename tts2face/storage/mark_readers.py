"""Packets of XMP, and signatures of C2PA, in files of pictures and sound, found by the structure of each format.

`find_packet` reads heads of blocks, boxes and chunks, and skips what they hold, so that a long film takes no memory.
Sources: those of `tts2face.storage.marks`; for places of C2PA its specification 2.2, appendix A.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO
from xml.parsers import expat

from lexicon.errors import DataError
from tts2face.storage.marks import GIF_XMP, NAMESPACE, PNG_KEYWORD, XMP_BOX

MOST_BYTES = 1 << 20  # of a packet or a text: those of cameras have up to 64 KB
MOST_BLOCKS = 1_000_000  # of a file; a damaged one may have blocks without content
C2PA_BOX = bytes.fromhex("d8fec3d61b0e483c92975828877ec481")
NAMESPACES = {
    "http://iptc.org/std/Iptc4xmpExt/2008-02-29/": "iptc", "http://ns.adobe.com/photoshop/1.0/": "photoshop",
    "http://ns.adobe.com/xap/1.0/": "xmp", NAMESPACE: "made",
}  # fmt: skip
_RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
_JPEG_XMP, _JPEG_ALONE = b"http://ns.adobe.com/xap/1.0/\0", range(0xD0, 0xD8)
_GIF_C2PA, _ID3_C2PA = b"C2PA_GIF", b"jumdc2pa"


@dataclass(slots=True)
class Found:
    """Parts of a file that say something of its making.

    Parameters
    ----------
    format
        Name of the format; empty for one that is not known here.
    packet
        XMP; empty without one.
    comment
        Text for people beside it; empty without one.
    has_signature
        Whether the file has a place with a manifest of C2PA.
    """

    format: str = ""
    packet: bytes = b""
    comment: str = ""
    has_signature: bool = False


class _Blocks:
    """Reading of a file whose blocks state their sizes."""

    def __init__(self, file: BinaryIO, path: Path) -> None:
        self._file, self._path = file, path
        self._size = os.fstat(file.fileno()).st_size
        self._n_blocks = 0

    def at_end(self) -> bool:
        """Whether nothing follows; counts a block."""
        self._n_blocks += 1
        return self._n_blocks > MOST_BLOCKS or self._file.tell() >= self._size

    def read(self, n_bytes: int) -> bytes:
        """Bytes that must be there."""
        content = self._file.read(n_bytes)
        if len(content) != n_bytes:
            raise DataError(f"{self._path} ends within a block; copy it again")
        return content

    def number(self, n_bytes: int, order: str) -> int:
        """An unsigned integer, ``big`` or ``little`` endian."""
        return int.from_bytes(self.read(n_bytes), "big" if order == "big" else "little")

    def content(self, n_bytes: int) -> bytes:
        """Content of a block, passed over (b"") where it is larger than any text."""
        if n_bytes <= MOST_BYTES:
            return self.read(n_bytes)
        self.skip(n_bytes)
        return b""

    def skip(self, n_bytes: int) -> None:
        """Pass over bytes."""
        if self._file.tell() + n_bytes > self._size:
            raise DataError(f"{self._path} ends within a block; copy it again")
        self._file.seek(n_bytes, os.SEEK_CUR)

    def place(self) -> int:
        """Bytes before the next block."""
        return self._file.tell()

    def go_to(self, place: int) -> None:
        """Continue at a place."""
        self._file.seek(place)

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return self._size


def find_packet(path: Path) -> Found:
    """Parts of a file that say something of its making; a format that is not known has none.

    Raises
    ------
    DataError
        The file ends within a block.
    """
    with path.open("rb") as file:
        head = file.read(16)
        for is_format, reader in _readers():
            if is_format(head):
                file.seek(0)
                found = Found()
                reader(_Blocks(file, path), found)
                return found
    return Found()


def parse_packet(packet: bytes) -> Mapping[str, str]:
    """Properties of a packet of XMP by ``namespace:name`` of `NAMESPACES`; those before damage where it is damaged.

    A property may be an attribute or an element, with its value as text, in a list, or as ``rdf:resource``.
    """
    found: dict[str, str] = {}
    path: list[str] = []

    def known(name: str) -> str:
        space, _, local = name.rpartition(" ")
        return f"{NAMESPACES[space]}:{local}" if space in NAMESPACES else ""

    def start(name: str, attributes: Mapping[str, str]) -> None:
        path.append(known(name) or (path[-1] if path else ""))
        for key, value in attributes.items():
            named = path[-1] if key == f"{_RDF} resource" else known(key)
            if named:
                found.setdefault(named, value)

    def text(content: str) -> None:
        if path and path[-1] and content.strip():
            found[path[-1]] = found.get(path[-1], "") + content.strip()

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler, parser.CharacterDataHandler = start, text
    parser.EndElementHandler = lambda _: path.pop() and None
    # without document types there are no entities, which could expand without end
    parser.StartDoctypeDeclHandler = _refuse_document_type
    parser.buffer_text = True
    with suppress(expat.ExpatError, DataError):
        parser.Parse(packet.strip(b"\0"), True)
    return found


def _refuse_document_type(*_: object) -> None:
    raise DataError("XMP has no document type")


def _png(blocks: _Blocks, found: Found) -> None:
    found.format = "png"
    blocks.skip(8)
    while not blocks.at_end():
        size, kind = blocks.number(4, "big"), blocks.read(4)
        if kind in {b"tEXt", b"iTXt"}:
            _png_text(blocks.content(size), found)
        else:
            found.has_signature |= kind == b"caBX"
            blocks.skip(size)
        blocks.skip(4)
        if kind == b"IEND":
            return


def _png_text(content: bytes, found: Found) -> None:
    keyword, _, rest = content.partition(b"\0")
    if keyword == PNG_KEYWORD.encode() and rest[:1] == b"\0":  # not compressed, as XMP demands
        found.packet = rest[2:].partition(b"\0")[2].partition(b"\0")[2]
    elif keyword in {b"Comment", b"Description"}:
        found.comment = rest.decode("utf-8", "replace").strip("\0")


def _gif(blocks: _Blocks, found: Found) -> None:
    found.format = "gif"
    blocks.skip(10)
    flags = blocks.number(1, "little")
    blocks.skip(2 + (3 << (flags & 7) + 1 if flags & 0x80 else 0))
    while not blocks.at_end():
        match blocks.read(1):
            case b"!":
                _gif_extension(blocks, found, blocks.read(1))
            case b",":
                blocks.skip(8)
                flags = blocks.number(1, "little")
                blocks.skip((3 << (flags & 7) + 1 if flags & 0x80 else 0) + 1)
                _sub_blocks(blocks)
            case _:
                return


def _gif_extension(blocks: _Blocks, found: Found, label: bytes) -> None:
    if label == b"\xfe":
        found.comment = _sub_blocks(blocks).decode("utf-8", "replace")
        return
    if label != b"\xff":
        _sub_blocks(blocks)
        return
    name = blocks.read(blocks.number(1, "little"))
    found.has_signature |= name.startswith(_GIF_C2PA)
    content = _sub_blocks(blocks, has_sizes=name == GIF_XMP[3:])
    if name == GIF_XMP[3:]:
        found.packet = content[: content.rfind(b">") + 1]


def _sub_blocks(blocks: _Blocks, *, has_sizes: bool = False) -> bytes:
    """Content of blocks of up to 255 bytes; `has_sizes`: with their sizes, which are bytes of a packet."""
    parts: list[bytes] = []
    n_bytes = 0
    while size := blocks.number(1, "little"):
        content = blocks.read(size)
        n_bytes += size
        if n_bytes <= MOST_BYTES:
            parts += [bytes([size]), content] if has_sizes else [content]
    return b"".join(parts)


def _riff(blocks: _Blocks, found: Found) -> None:
    blocks.skip(8)
    found.format = "wav" if blocks.read(4) == b"WAVE" else "webp"
    while not blocks.at_end():
        if blocks.size - blocks.place() < 8:
            return
        kind, size = blocks.read(4), blocks.number(4, "little")
        if kind == b"data" and size == 0xFFFFFFFF:  # of a stream: samples to the end
            return
        if kind in {b"_PMX", b"XMP "}:
            found.packet = blocks.content(size)
        elif kind == b"LIST":
            found.comment = _info(blocks.content(size)) or found.comment
        else:
            found.has_signature |= kind == b"C2PA"
            blocks.skip(min(size, blocks.size - blocks.place()))
        if size % 2 and blocks.place() < blocks.size:
            blocks.skip(1)


def _info(content: bytes) -> str:
    """Comment of a list INFO."""
    at = content.find(b"ICMT") if content.startswith(b"INFO") else -1
    if at < 0:
        return ""
    size = int.from_bytes(content[at + 4 : at + 8], "little")
    return content[at + 8 : at + 8 + size].rstrip(b"\0").decode("utf-8", "replace")


def _mp4(blocks: _Blocks, found: Found) -> None:
    found.format = "mov" if blocks.read(16)[8:12] == b"qt  " else "mp4"
    blocks.go_to(0)
    for kind, first, last in _boxes(blocks, 0, blocks.size):
        if kind == b"uuid" and last - first >= 16:
            user_type = blocks.read(16)
            found.has_signature |= user_type == C2PA_BOX
            if user_type == XMP_BOX:
                found.packet = blocks.content(last - first - 16)
        elif kind == b"moov":
            _quicktime_packet(blocks, found, (first, last))


def _quicktime_packet(blocks: _Blocks, found: Found, movie: tuple[int, int]) -> None:
    for kind, *data in _boxes(blocks, *movie):
        for inner, first, last in _boxes(blocks, *data) if kind == b"udta" else ():
            if inner == b"XMP_":
                found.packet = blocks.content(last - first)


def _boxes(blocks: _Blocks, at: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Kind, first byte and end of the contents of boxes; the file stands at the first byte."""
    while end - at >= 8 and not blocks.at_end():
        blocks.go_to(at)
        size, kind = blocks.number(4, "big"), blocks.read(4)
        head = 8
        if size == 1:
            size, head = blocks.number(8, "big"), 16
        size = size or end - at
        if size < head or at + size > end:  # a list of udta ends with 32 zero bits
            return
        yield kind, at + head, at + size
        at += size


def _jpeg(blocks: _Blocks, found: Found) -> None:
    found.format = "jpeg"
    blocks.skip(2)
    while not blocks.at_end():
        marker = blocks.read(2)
        if marker[0] != 0xFF or marker[1] in {0xDA, 0xD9}:  # the picture
            return
        if marker[1] in _JPEG_ALONE or marker[1] == 0xFF:
            continue
        content = blocks.content(max(blocks.number(2, "big") - 2, 0))
        if marker[1] == 0xE1 and content.startswith(_JPEG_XMP):
            found.packet = content[len(_JPEG_XMP) :]
        elif marker[1] == 0xFE:
            found.comment = content.decode("utf-8", "replace")
        found.has_signature |= marker[1] == 0xEB and b"c2pa" in content[:100]


def _id3(blocks: _Blocks, found: Found) -> None:
    """Tag of ID3v2, before sound of MP3, AAC or FLAC, whose own name is read elsewhere; C2PA is an object in it."""
    head = blocks.read(10)
    size = sum((byte & 0x7F) << shift for byte, shift in zip(head[6:], (21, 14, 7, 0), strict=True))
    found.has_signature = _ID3_C2PA in blocks.content(size)


def _readers() -> tuple[tuple[Callable[[bytes], bool], Callable[[_Blocks, Found], None]], ...]:
    """Tests of the first 16 bytes of a file, and who reads on."""
    return (
        (lambda head: head.startswith(b"\x89PNG\r\n\x1a\n"), _png),
        (lambda head: head[:6] in {b"GIF87a", b"GIF89a"}, _gif),
        (lambda head: head[:4] == b"RIFF" and head[8:12] in {b"WAVE", b"WEBP"}, _riff),
        (lambda head: head[4:8] in {b"ftyp", b"wide", b"mdat", b"moov", b"free"}, _mp4),
        (lambda head: head.startswith(b"\xff\xd8\xff"), _jpeg),
        (lambda head: head.startswith(b"ID3"), _id3),
    )
