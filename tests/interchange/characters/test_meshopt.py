"""Decoding of KHR_meshopt_compression: streams of version 1 and filters, by hand and by meshoptimizer."""

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
from tts2face.interchange.gltf.meshopt import decode_buffer
from tts2face.interchange.gltf.meshopt_filters import apply_filter
from tts2face.interchange.gltf.reader import read_gltf

COUNT, STRIDE = 20, 8
BYTES, PAIRS, WORDS = 0, 1, 2  # kinds of four bytes
ENCODE = """
const {MeshoptEncoder: encoder} = require('meshoptimizer/encoder'), fs = require('fs');
encoder.ready.then(() => {
  const found = JSON.parse(fs.readFileSync(process.argv[1])).map((asked) => {
    const {rows, count, size, level, version, filter, bits} = asked;
    let bytes = Buffer.from(rows, 'base64');
    if (filter) {
      const values = new Float32Array(new Uint8Array(bytes).buffer);
      bytes = encoder[`encodeFilter${filter}`](values, count, size, bits);
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


def filtered(content: bytes, name: str, stride: int, kind: type[np.generic], width: int = 4) -> NDArray[np.int64]:
    read = apply_filter(np.frombuffer(content, np.uint8), name, stride)
    return np.frombuffer(read.tobytes(), kind).reshape(-1, width).astype(np.int64)


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
    found = filtered(packed, "COLOR", 4, np.uint8)
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
    (tmp_path / "asked.json").write_text(json.dumps(asked))
    answer = json.loads(programs.run_node(ENCODE, packages, str(tmp_path / "asked.json")))
    for one, content in zip(asked, map(base64.b64decode, answer), strict=True):
        assert content[0] == 0xA0 + one["version"]
        found = decoded(content, one["count"], one["size"]).reshape(-1)
        np.testing.assert_array_equal(found, np.frombuffer(base64.b64decode(one["rows"]), np.uint8))


def unit_rows(n: int) -> NDArray[np.float32]:
    rows = np.random.default_rng(n).normal(size=(n, 4)).astype("<f4")
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def test_filters_of_meshoptimizer(tmp_path: Path) -> None:
    """Values come back within the bits that they were written with, at both sizes of elements and of any sign."""
    packages = programs.node_package("meshoptimizer")
    normals = unit_rows(301)
    normals[:, :3] /= np.linalg.norm(normals[:, :3], axis=1, keepdims=True)
    normals[:3, :3] = np.eye(3)
    normals[3:6, :3] = -np.eye(3)
    normals[:, 3] = 1.0
    floats = (unit_rows(77) * [1e-3, 1.0, 40.0, 1e4]).astype("<f4")
    cases = [
        ("Color", "COLOR", abs(unit_rows(50)), 4, 8, np.uint8, 2 / 255),
        ("Color", "COLOR", abs(unit_rows(50)), 8, 16, np.uint16, 1e-4),
        ("Oct", "OCTAHEDRAL", normals, 4, 8, np.int8, 0.02),
        ("Oct", "OCTAHEDRAL", normals, 8, 12, np.int16, 0.001),
        ("Quat", "QUATERNION", unit_rows(200), 8, 16, np.int16, 1e-4),
        ("Quat", "QUATERNION", unit_rows(200), 8, 10, np.int16, 4e-3),
        ("Exp", "EXPONENTIAL", floats, 16, 20, np.float32, 1e-5),
    ]
    asked = [
        {"rows": base64.b64encode(np.ascontiguousarray(rows, "<f4").tobytes()).decode(), "count": len(rows),
         "size": size, "level": 2, "version": 1, "filter": function, "bits": bits}
        for function, _, rows, size, bits, *_ in cases
    ]  # fmt: skip
    (tmp_path / "asked.json").write_text(json.dumps(asked))
    answer = json.loads(programs.run_node(ENCODE, packages, str(tmp_path / "asked.json")))
    for (_, name, rows, size, _, kind, most), content in zip(cases, map(base64.b64decode, answer), strict=True):
        read = apply_filter(decoded(content, len(rows), size).reshape(-1), name, size)
        values = np.frombuffer(read.tobytes(), kind).reshape(-1, 4).astype(np.float64)
        if name == "EXPONENTIAL":
            # the values of a row share an exponent
            assert (np.abs(values - rows) <= most * np.abs(rows).max(axis=1, keepdims=True)).all()
            continue
        values /= np.iinfo(kind).max
        # q and -q are the same turn
        sign = np.sign((values * rows).sum(axis=1, keepdims=True)) if name == "QUATERNION" else 1.0
        np.testing.assert_allclose(sign * values, rows, atol=most)


@pytest.mark.parametrize(
    ("packed", "expected"),
    [
        ((0, 0, 127, 5), (0, 0, 127, 5)),
        ((127, 0, 127, 0), (127, 0, 0, 0)),
        ((127, 127, 127, 1), (0, 0, -127, 1)),
        ((0, -32, 63, 0), (0, -91, 88, 0)),
    ],
)
def test_directions_on_an_octahedron(packed: tuple[int, ...], expected: tuple[int, ...]) -> None:
    found = filtered(struct.pack("4b", *packed), "OCTAHEDRAL", 4, np.int8)[0]
    assert np.abs(found - expected).max() <= 1


@pytest.mark.parametrize("largest", range(4))
def test_rotations_leave_out_their_largest_value(largest: int) -> None:
    found = filtered(struct.pack("<4h", 0, 0, 0, 0x7FFC | largest), "QUATERNION", 8, np.int16)[0]
    assert found.tolist() == [32767 * (place == largest) for place in range(4)]


@pytest.mark.parametrize(("name", "stride"), [("SPHERICAL", 4), ("QUATERNION", 4), ("OCTAHEDRAL", 12)])
def test_a_filter_that_does_not_exist_is_named(name: str, stride: int) -> None:
    with pytest.raises(DataError, match=f"has the filter '{name}' of elements of {stride} bytes"):
        apply_filter(np.zeros(24, np.uint8), name, stride)
