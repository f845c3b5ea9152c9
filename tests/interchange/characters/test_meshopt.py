"""Decoding of KHR_meshopt_compression: streams of version 1, by hand and by meshoptimizer; its filter of colours."""

import base64
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lexicon.errors import DataError
from tests.interchange.characters.made import glb
from tests.interchange.exports import programs
from tts2face.interchange.gltf.meshopt import apply_color_filter, decode_buffer
from tts2face.interchange.gltf.reader import read_gltf

COUNT, STRIDE = 20, 8
BYTES, PAIRS, WORDS = 0, 1, 2  # kinds of four bytes
ENCODE = """
const {MeshoptEncoder: encoder} = require('meshoptimizer/encoder'), fs = require('fs');
encoder.ready.then(() => {
  const found = JSON.parse(fs.readFileSync(process.argv[1])).map(({rows, count, size, level, version, colours}) => {
    let bytes = Buffer.from(rows, 'base64');
    if (colours) {
      const values = new Float32Array(new Uint8Array(bytes).buffer);
      bytes = encoder.encodeFilterColor(values, count, size, 2 * size);
    }
    const made = encoder.encodeVertexBufferLevel(new Uint8Array(bytes), count, size, level, version);
    return Buffer.from(made).toString('base64');
  });
  console.log(JSON.stringify(found));
});
"""


def zigzag(values: NDArray[np.int64], bits: int) -> NDArray[np.int64]:
    """Differences of numbers of some bits, with the sign in the lowest bit."""
    steps = np.diff(values, prepend=values[:1])
    steps = (steps + (1 << (bits - 1))) % (1 << bits) - (1 << (bits - 1))
    return np.where(steps < 0, -2 * steps - 1, 2 * steps)


def stream(rows: NDArray[np.uint8], kinds: list[int], turn: int = 0) -> bytes:
    """Rows (N, 4 n) of one block in version 1, whose deltas are stored as they are; `kinds` (n,) of each four bytes."""
    deltas = np.zeros_like(rows)
    for number, kind in enumerate(kinds):
        four = rows[:, 4 * number : 4 * number + 4]
        if kind == WORDS:
            words = np.ascontiguousarray(four).view("<u4")[:, 0].astype(np.int64)
            changed = words ^ np.concatenate([words[:1], words[:-1]])
            turned = ((changed << turn) | (changed >> (32 - turn))) & 0xFFFFFFFF
            made = turned.astype("<u4").view(np.uint8).reshape(-1, 4)
        else:
            numbers = np.ascontiguousarray(four).view("<u2" if kind else np.uint8).astype(np.int64)
            made = np.column_stack([zigzag(column, 16 if kind else 8) for column in numbers.T])
            made = made.astype("<u2" if kind else np.uint8).view(np.uint8).reshape(len(rows), 4)
        deltas[:, 4 * number : 4 * number + 4] = made
    control = bytes([0xFF] * len(kinds))  # each byte of an element as it is
    channels = bytes(kind | (turn << 4 if kind == WORDS else 0) for kind in kinds)
    tail = rows[0].tobytes() + channels
    return b"\xa1" + control + deltas.T.tobytes() + bytes(max(24 - len(tail), 0)) + tail


def made_rows(seed: int = 1) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (COUNT, STRIDE)).astype(np.uint8)


def decoded(content: bytes, count: int = COUNT, stride: int = STRIDE) -> NDArray[np.uint8]:
    return decode_buffer(np.frombuffer(content, np.uint8), "ATTRIBUTES", count, stride).reshape(count, stride)


@pytest.mark.parametrize("kinds", [[BYTES, BYTES], [PAIRS, BYTES], [WORDS, PAIRS], [PAIRS, PAIRS], [WORDS, WORDS]])
@pytest.mark.parametrize("turn", [0, 5, 15])
def test_each_kind_of_channel(kinds: list[int], turn: int) -> None:
    rows = made_rows(turn)
    np.testing.assert_array_equal(decoded(stream(rows, kinds, turn)), rows)


def test_bytes_that_do_not_change_are_not_stored() -> None:
    rows = np.tile(made_rows()[:1], (COUNT, 1))
    content = b"\xa1" + bytes([0xAA, 0xAA]) + bytes(24 - STRIDE - 2) + rows[0].tobytes() + bytes(2)
    np.testing.assert_array_equal(decoded(content), rows)


@pytest.mark.parametrize("cut", [1, 30, 100])
def test_a_stream_that_is_cut_is_damaged(cut: int) -> None:
    with pytest.raises(DataError, match="a meshopt stream is damaged"):
        decoded(stream(made_rows(), [BYTES, BYTES])[:-cut])


@pytest.mark.parametrize(("place", "value"), [(0, 0xA2), (0, 0x00), (-1, 3)])
def test_an_unknown_version_or_kind_is_damaged(place: int, value: int) -> None:
    content = bytearray(stream(made_rows(), [BYTES, BYTES]))
    content[place] = value
    with pytest.raises(DataError, match="a meshopt stream is damaged"):
        decoded(bytes(content))


def test_positions_of_a_file(tmp_path: Path) -> None:
    places = np.random.default_rng(3).normal(size=(COUNT, 3)).astype("<f4")
    binary = stream(places.view(np.uint8).reshape(COUNT, 12), [WORDS] * 3, 4)
    extension = {"buffer": 0, "byteLength": len(binary), "byteStride": 12, "count": COUNT, "mode": "ATTRIBUTES"}
    name = "KHR_meshopt_compression"
    view = {"buffer": 1, "byteLength": 12 * COUNT, "byteStride": 12, "extensions": {name: extension}}
    root = {
        "asset": {"version": "2.0"}, "extensionsUsed": [name], "extensionsRequired": [name],
        "buffers": [{"byteLength": len(binary)}, {"byteLength": 12 * COUNT}], "bufferViews": [view],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": COUNT}],
    }  # fmt: skip
    (tmp_path / "a.glb").write_bytes(glb(root, binary))
    np.testing.assert_array_equal(read_gltf(tmp_path / "a.glb").accessor(0), places.astype(np.float64))


def test_colours_of_eight_bits() -> None:
    # white, and red of half alpha: luma, orange, green; the highest bit of the fourth says that all have 8
    packed = struct.pack("BbbBBbbB", 255, 0, 0, 0xFF, 64, 127, -64, 0xC0)
    found = np.frombuffer(apply_color_filter(np.frombuffer(packed, np.uint8), 4).tobytes(), np.uint8).reshape(-1, 4)
    assert np.abs(found.astype(int) - [[255, 255, 255, 255], [255, 0, 1, 128]]).max() <= 1


def test_streams_of_meshoptimizer(tmp_path: Path) -> None:
    packages = programs.node_package("meshoptimizer")
    random = np.random.default_rng(5)
    made = {
        "noise": random.integers(0, 256, (255, 16)).astype(np.uint8),
        "steps": np.cumsum(random.integers(-3, 4, (3000, 4)), axis=0).astype("<i2").view(np.uint8),
        "floats": np.sin(np.arange(700)[:, None] / [30.0, 41.0, 57.0]).astype("<f4").view(np.uint8),
        "rare": (random.random((257, 8)) < 0.05).astype(np.uint8),
        "one": np.array([[1, 2, 3, 4]], np.uint8),
        "wide": random.integers(0, 9, (100, 256)).astype(np.uint8),
    }
    asked = [
        {"rows": base64.b64encode(rows.tobytes()).decode(), "count": len(rows), "size": rows.shape[1], "level": level,
         "version": version}
        for rows in made.values() for level, version in ((2, 0), (0, 1), (2, 1), (3, 1))
    ]  # fmt: skip
    colours = random.random((50, 4)).astype("<f4")
    plain = {"rows": base64.b64encode(colours.tobytes()).decode(), "count": 50, "level": 2, "version": 1}
    asked += [plain | {"size": size, "colours": True} for size in (4, 8)]
    (tmp_path / "asked.json").write_text(json.dumps(asked))
    answer = json.loads(programs.run_node(ENCODE, packages, str(tmp_path / "asked.json")))
    for one, content in zip(asked, map(base64.b64decode, answer), strict=True):
        assert content[0] == 0xA0 + one["version"]
        found = decoded(content, one["count"], one["size"]).reshape(-1)
        if "colours" not in one:
            np.testing.assert_array_equal(found, np.frombuffer(base64.b64decode(one["rows"]), np.uint8))
            continue
        kind = np.uint8 if one["size"] == 4 else np.uint16
        shown = np.frombuffer(apply_color_filter(found, one["size"]).tobytes(), kind).reshape(-1, 4)
        np.testing.assert_allclose(shown / np.iinfo(kind).max, colours, atol=2 / 255 if one["size"] == 4 else 1e-4)
