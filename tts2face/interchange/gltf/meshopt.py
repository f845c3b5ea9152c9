"""Decoder of EXT_meshopt_compression and KHR_meshopt_compression: attributes, triangles and indices.

Source: the Khronos glTF extensions of these names, bitstreams of versions 0 and 1.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.numeric.kernels import kernel

ATTRIBUTES = "ATTRIBUTES"
TRIANGLES = "TRIANGLES"
INDICES = "INDICES"
GROUP = 16  # elements whose deltas share one width
# bytes and elements of a block (EXT_meshopt_compression, appendix A)
MAX_BLOCK_BYTES, MAX_BLOCK = 8192, 256
TAIL_BYTES = {0: 32, 1: 24}  # least size of the attributes' tail in each version
# first byte of a bitstream: its kind, and its version in the low four bits
ATTRIBUTES_HEADER = 0xA0
TRIANGLES_HEADER = 0xE1
INDICES_HEADER = 0xD1

Bytes = NDArray[np.uint8]


def decode_buffer(content: Bytes, mode: str, count: int, stride: int) -> Bytes:
    """Bytes (count * stride) of a compressed buffer view, before its filter."""
    if mode == ATTRIBUTES and 0 < stride <= 256 and stride % 4 == 0:
        return _decode_attributes(content, count, stride)
    if mode in (TRIANGLES, INDICES) and stride in (2, 4):
        decode = _decode_triangles if mode == TRIANGLES else _decode_indices
        indices = decode(content.tobytes(), count)
        if max(indices, default=0) >= 1 << 8 * stride or min(indices, default=0) < 0:
            raise _damaged()
        return np.frombuffer(np.array(indices, np.uint32 if stride == 4 else np.uint16).tobytes(), np.uint8)
    raise DataError(f"a meshopt stream has the mode {mode!r:.20} with elements of {stride} bytes; export it again")


def _damaged() -> DataError:
    return DataError("a meshopt stream is damaged; export the character again")


def _decode_attributes(content: Bytes, count: int, stride: int) -> Bytes:
    version = int(content[0]) - ATTRIBUTES_HEADER if len(content) else -1
    if version not in TAIL_BYTES:
        raise _damaged()
    # version 1 states how each four bytes of an element are coded
    kinds = stride // 4 if version else 0
    tail = max(stride + kinds, TAIL_BYTES[version])
    if len(content) < 1 + tail:
        raise _damaged()
    block = min(MAX_BLOCK_BYTES // stride // GROUP * GROUP, MAX_BLOCK)
    out = np.zeros((count, stride), np.uint8)
    end = len(content) - kinds
    channels = content[end:].copy() if version else np.zeros(stride // 4, np.uint8)
    first = content[end - stride : end].copy()
    if not _decode_blocks(content[1 : len(content) - tail], (block, version), first, channels, out):
        raise _damaged()
    return out.reshape(-1)


@kernel
def _decode_blocks(data: Any, form: Any, last: Any, channels: Any, out: Any) -> bool:
    """Decode blocks into `out` (count, stride), which begins after the element `last`; False if they are damaged.

    `form` is the size of a block in elements and the version; `channels` the kinds of each four bytes.
    """
    count, stride = out.shape
    block, version = form
    deltas = np.zeros((stride, block), np.uint8)
    at = 0
    for first in range(0, count, block):
        n = min(block, count - first)
        at = _unpack_block(data, at, version, n, deltas)
        if at < 0:
            return False
        for channel in range(stride // 4):
            kind, four = channels[channel] & 3, slice(4 * channel, 4 * channel + 4)
            shown = out[first : first + n, four]
            if kind == 3:
                return False
            if kind == 2:
                _change_bits(deltas[four], channels[channel] >> 4, last[four], shown)
            else:
                _add_differences(deltas[four], 1 + kind, last[four], shown)
    return True


@kernel
def _unpack_block(data: Any, at: int, version: int, n: int, deltas: Any) -> int:  # noqa: C901 - one pass over bits
    """Unpack bytes of `n` elements into rows of `deltas` from a place of the data on; the place behind them, or -1."""
    n_groups = (n + 15) // 16
    control = at
    at += version * (len(deltas) // 4)
    for column in range(len(deltas)):
        if at > len(data):
            return -1
        mode = (int(data[control + column // 4]) >> (2 * (column % 4))) & 3 if version == 1 else 0
        row = deltas[column]
        row[:] = 0
        # all 0; or as they are
        if mode == 2:
            continue
        if mode == 3:
            if at + n > len(data):
                return -1
            row[:n] = data[at : at + n]
            at += n
            continue
        header = at
        at += (n_groups + 3) // 4
        for group in range(n_groups):
            if at > len(data):
                return -1
            step = (int(data[header + group // 4]) >> (2 * (group % 4))) & 3
            # bits of a delta: 0, 2, 4, 8 of version 0; 0, 1, 2, 4 or 1, 2, 4, 8 of version 1
            power = step - 1 + mode if version == 1 else (step if step else -1)
            width = 1 << power if power >= 0 else 0
            packed, extra = at, at + 2 * width
            if extra > len(data):
                return -1
            for i in range(16 if width else 0):
                if width == 8:
                    row[16 * group + i] = data[packed + i]
                    continue
                per_byte = 8 // width
                # single bits from the lowest, others from the highest
                shift = i % 8 if width == 1 else (per_byte - 1 - i % per_byte) * width
                delta = (int(data[packed + i // per_byte]) >> shift) & ((1 << width) - 1)
                # the largest value says that the delta follows as a byte
                if delta == (1 << width) - 1:
                    if extra >= len(data):
                        return -1
                    delta = int(data[extra])
                    extra += 1
                row[16 * group + i] = delta
            at = extra
    return at if at <= len(data) else -1


@kernel
def _add_differences(deltas: Any, size: int, last: Any, out: Any) -> None:
    """Four bytes of `last` and of each element, numbers of `size` bytes that add up."""
    for i in range(len(out)):
        for byte in range(0, 4, size):
            delta, value = np.int64(0), np.int64(0)
            for part in range(size):
                delta |= np.int64(deltas[byte + part, i]) << (8 * part)
                value |= np.int64(last[byte + part]) << (8 * part)
            # the lowest bit is the sign
            value += (delta >> 1) ^ -(delta & 1)
            for part in range(size):
                last[byte + part] = (value >> (8 * part)) & 0xFF
        out[i] = last


@kernel
def _change_bits(deltas: Any, turn: int, last: Any, out: Any) -> None:
    """Four bytes of `last` and of each element, whose changed bits stand turned to the left by some places."""
    for i in range(len(out)):
        word = np.int64(0)
        for byte in range(4):
            word |= np.int64(deltas[byte, i]) << (8 * byte)
        word = (word >> turn) | (word << (32 - turn))
        for byte in range(4):
            last[byte] ^= (word >> (8 * byte)) & 0xFF
        out[i] = last


class _IndexStream:
    """Reader of variable-length differences of indices."""

    def __init__(self, content: bytes, start: int, end: int) -> None:
        self._content = content
        self._at = start
        self._end = end
        self.last = 0

    def byte(self) -> int:
        if self._at >= self._end:
            raise _damaged()
        self._at += 1
        return self._content[self._at - 1]

    def number(self) -> int:
        value = shift = 0
        # five bytes of seven bits hold 32 bits; more are damage
        while shift < 35:
            byte = self.byte()
            # the eighth bit says that another byte follows
            value |= (byte & 127) << shift
            if byte < 128:
                return value
            shift += 7
        raise _damaged()

    def index(self) -> int:
        value = self.number()
        self.last = (self.last + ((value >> 1) ^ -(value & 1))) & 0xFFFFFFFF
        return self.last


class _Recent:
    """Ring buffer of the last 16 entries; entry 1 is the newest."""

    def __init__(self, empty: Any) -> None:
        self._entries, self._next = [empty] * 16, 0

    def push(self, entry: Any) -> None:
        self._entries[self._next & 15] = entry
        self._next += 1

    def __getitem__(self, back: int) -> Any:
        return self._entries[(self._next - back) & 15]


class _TriangleDecoder:
    """State of the decoder of triangles: recent edges and vertices, and the next new vertex."""

    def __init__(self, stream: _IndexStream, table: bytes) -> None:
        self._stream, self._table = stream, table
        self._edges = _Recent((0, 0))
        self._vertices = _Recent(0)
        self._next = 0

    def triangle(self, code: int) -> tuple[int, int, int]:
        return self._on_edge(code >> 4, code & 15) if code < 0xF0 else self._apart(code)

    def _new(self) -> int:
        self._next += 1
        return self._next - 1

    def _on_edge(self, edge: int, vertex: int) -> tuple[int, int, int]:
        a, b = self._edges[1 + edge]
        # codes 13 and 14: the index before or after the last one; 15: written out
        if vertex >= 13:
            c = self._stream.index() if vertex == 15 else self._stream.last + (-1 if vertex == 13 else 1)
            self._stream.last = c
        else:
            c = self._new() if vertex == 0 else self._vertices[1 + vertex]
        if vertex == 0 or vertex >= 13:
            self._vertices.push(c)
        self._edges.push((c, b))
        self._edges.push((a, c))
        return a, b, c

    def _apart(self, code: int) -> tuple[int, int, int]:
        packed = self._table[code & 15] if code < 0xFE else self._stream.byte()
        second, third = packed >> 4, packed & 15
        # 0xFE and 0xFF have a second byte instead of the table
        first = 15 if code == 0xFF else 0
        # the encoder starts numbering again
        if code >= 0xFE and packed == 0:
            self._next = 0
        a = self._new() if first == 0 else 0
        b = self._new() if second == 0 else self._vertices[second]
        c = self._new() if third == 0 else self._vertices[third]
        if code >= 0xFE:
            a = self._stream.index() if first == 15 else a
            b = self._stream.index() if second == 15 else b
            c = self._stream.index() if third == 15 else c
        self._vertices.push(a)
        for kind, vertex in ((second, b), (third, c)):
            if kind == 0 or (kind == 15 and code >= 0xFE):
                self._vertices.push(vertex)
        for edge in ((b, a), (c, b), (a, c)):
            self._edges.push(edge)
        return a, b, c


def _decode_triangles(content: bytes, count: int) -> list[int]:
    n_triangles, tail = count // 3, len(content) - 16
    if count % 3 or tail < 1 + n_triangles or content[0] != TRIANGLES_HEADER:
        raise _damaged()
    decoder = _TriangleDecoder(_IndexStream(content, 1 + n_triangles, tail), content[tail:])
    return [corner for code in content[1 : 1 + n_triangles] for corner in decoder.triangle(code)]


def _decode_indices(content: bytes, count: int) -> list[int]:
    if len(content) < 1 + 4 or content[0] != INDICES_HEADER:
        raise _damaged()
    stream = _IndexStream(content, 1, len(content) - 4)
    last = [0, 0]
    found = []
    for _ in range(count):
        value = stream.number()
        baseline, value = value & 1, value >> 1
        last[baseline] = (last[baseline] + ((value >> 1) ^ -(value & 1))) & 0xFFFFFFFF
        found.append(last[baseline])
    return found
