"""Arrays that are deflated as one: without loss, in fewer bytes, and refused where they are damaged."""

import math
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from safetensors.numpy import save_file

from lexicon.errors import DataError
from tts2face.storage import tensors
from tts2face.storage.deflated import FIRST, LAST, MAX_BYTES, TYPES, pack_arrays, unpack_arrays
from tts2face.storage.tensors import PACKED, read_metadata, read_tensors, write_tensors

PATH = Path("a.face")
INDICES = np.array([[3, 9], [4, 9], [1000, 8], [0, 8], [-70000, 2**31 - 1]], np.int32)


def same(found: np.ndarray, wanted: np.ndarray) -> bool:
    return (found.dtype, found.shape, found.tobytes()) == (wanted.dtype, wanted.shape, wanted.tobytes())


@pytest.mark.fuzz
@given(st.lists(st.sampled_from(TYPES).flatmap(lambda kind: arrays(kind, array_shapes(max_dims=4))), min_size=1))
def test_arrays_come_back_bit_by_bit(several: list[np.ndarray]) -> None:
    named = {f"array{number}": array for number, array in enumerate(several)}
    content, listed = pack_arrays(named)
    found = unpack_arrays(content, listed, "light", PATH)
    assert list(found) == list(named)
    for name, array in named.items():
        assert same(found[name], array), name
        assert found[name].flags.aligned
        assert found[name].flags.c_contiguous


def steps_written_out(array: np.ndarray, axis: int) -> bytes:
    """Steps along an axis as docs/file-formats.md has them, number by number."""
    planes: list[list[int]] = [[] for _ in range(array.itemsize)]
    bits = 8 * array.itemsize
    for place in np.ndindex(array.shape[::-1]):
        at = list(place[::-1])
        value = int(array[tuple(at)])
        at[axis] -= 1
        step = value - (int(array[tuple(at)]) if at[axis] >= 0 else 0)
        step = (step + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
        small = 2 * step if step >= 0 else -2 * step - 1
        for number, plane in enumerate(planes):
            plane.append(small >> (8 * number) & 255)
    return b"".join(map(bytes, planes))


@pytest.mark.parametrize("axis", [FIRST, LAST])
def test_steps_are_those_of_the_documented_form(axis: int) -> None:
    cube = np.arange(24, dtype=np.int16).reshape(2, 3, 4) ** 3
    for array in (INDICES, cube):
        content = np.frombuffer(zlib.compress(steps_written_out(array, axis)), np.uint8)
        found = unpack_arrays(content, [["a", array.dtype.name, list(array.shape), axis]], "light", PATH)
        assert same(found["a"], array)


def test_arrays_of_earlier_files_lie_one_after_the_other() -> None:
    flags = np.array([True, False, True])
    content = np.frombuffer(zlib.compress(flags.tobytes() + INDICES.tobytes()), np.uint8)
    found = unpack_arrays(content, [["flags", "bool", [3]], ["rows", "int32", [5, 2]]], "light", PATH)
    assert same(found["flags"], flags)
    assert same(found["rows"], INDICES)


def test_numbers_take_hardly_more_bytes_than_the_information_of_their_steps() -> None:
    rng = np.random.default_rng(0)
    information = 15_000 * math.log2(7) / 8  # bytes: steps from -3 to 3
    walk = np.cumsum(rng.integers(-3, 4, (5000, 3)), axis=0).astype(np.int32)
    for array, axis in ((walk, FIRST), (np.ascontiguousarray(walk.T), LAST)):
        content, ((*_, found_axis),) = pack_arrays({"walk": array})
        assert found_axis == axis
        assert information < len(content) < 1.15 * information
    noise = rng.integers(0, 256, 5000).astype(np.uint8)
    assert pack_arrays({"noise": noise})[1] == [["noise", "uint8", [5000]]]


def entry(place: int, value: Any) -> Callable[[list], None]:
    def change(listed: list) -> None:
        listed[0][place] = value

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (entry(0, 7), r"light\[0\]\[0\] is 7, not a text"),
        (entry(1, "object"), r"light\[0\]\[1\] is 'object', not bool, int8"),
        (entry(2, [3, -2]), r"light\[0\]\[2\]\[1\] is -2, not a whole number"),
        (entry(2, [3, 2.0]), r"light\[0\]\[2\]\[1\] is 2.0, not a whole number"),
        (entry(2, [1] * 100), r"light\[0\] has 100 axes, not 1 to 4"),
        (entry(2, []), r"light\[0\] has 0 axes, not 1 to 4"),
        (entry(2, [5, 3]), "the light is not of 63 bytes"),
        (entry(2, [0, 2]), "the light is not of 3 bytes"),
        (entry(2, [10**7, 2]), f"lists arrays of 80000003 bytes, more than {MAX_BYTES}"),
        (entry(2, [MAX_BYTES] * 4), f"lists arrays of .* bytes, more than {MAX_BYTES}"),
        (entry(3, 1), r"light\[0\]\[3\] is 1, not a whole number from -1 to 0"),
        (entry(3, None), r"light\[0\]\[3\] is None, not a whole number from -1 to 0"),
        (lambda listed: listed[0].append(0), r"light\[0\] is a list of 5, not a list of 4"),
        (lambda listed: listed[1].pop(), r"light\[1\] is a list of 2, not a list of 3"),
        (lambda listed: listed[1].__setitem__(0, "rows"), "lists two arrays of the same name"),
        (lambda listed: listed.clear(), "the light is not of 0 bytes"),
    ],
)
def test_damaged_lists_are_refused(change: Callable[[list], None], reason: str) -> None:
    content, _ = pack_arrays({"rows": INDICES, "flags": np.ones(3, bool)})
    listed: list[list[Any]] = [["rows", "int32", [5, 2], FIRST], ["flags", "bool", [3]]]
    unpack_arrays(content, listed, "light", PATH)
    change(listed)
    with pytest.raises(DataError, match=rf"^a\.face: .*{reason}.*; build or copy the file again$"):
        unpack_arrays(content, listed, "light", PATH)


def test_damaged_bytes_are_refused() -> None:
    content, listed = pack_arrays({"rows": INDICES})
    with pytest.raises(DataError, match="the light is not of 40 bytes"):
        unpack_arrays(content[:-9], listed, "light", PATH)
    with pytest.raises(DataError, match="the light cannot be inflated"):
        unpack_arrays(content[3:], listed, "light", PATH)
    with pytest.raises(DataError, match="metadata: light is None, not a list"):
        unpack_arrays(content, None, "light", PATH)


@pytest.fixture
def contents() -> dict[str, np.ndarray]:
    return {"rows": INDICES, "place": np.float32([0.5, -0.0, np.nan]), "picture": np.arange(9, dtype=np.uint8)}


@pytest.mark.parametrize("is_packed", [False, True])
def test_a_file_has_the_same_arrays_packed_and_as_they_lie(
    is_packed: bool, contents: dict[str, np.ndarray], tmp_path: Path
) -> None:
    write_tensors(tmp_path / "a.face", "face", 1, contents, {"fps": 25}, is_packed=is_packed)
    found, metadata = read_tensors(tmp_path / "a.face", "face", 1)
    assert found.keys() == contents.keys()
    assert all(same(found[name], array) for name, array in contents.items())
    assert metadata == {"fps": 25}
    assert (PACKED in read_metadata(tmp_path / "a.face", "face", 1)) == is_packed


def test_arrays_too_large_to_be_packed_lie_in_the_file(
    contents: dict[str, np.ndarray], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tensors, "MAX_BYTES", 51)  # of 52
    write_tensors(tmp_path / "a.face", "face", 1, contents, {}, is_packed=True)
    assert PACKED not in read_metadata(tmp_path / "a.face", "face", 1)
    assert same(read_tensors(tmp_path / "a.face", "face", 1)[0]["rows"], INDICES)


@pytest.mark.parametrize(
    ("written", "reason"),
    [
        ({"picture": np.zeros(3, np.uint8)}, r"a\.face lacks the array packed"),
        ({"rows": INDICES, PACKED: pack_arrays({"rows": INDICES})[0]}, r"a\.face holds the array rows twice"),
    ],
)
def test_a_packed_file_that_contradicts_itself_is_refused(
    written: dict[str, np.ndarray], reason: str, tmp_path: Path
) -> None:
    metadata = '{"packed": [["rows", "int32", [5, 2], 0]]}'
    save_file(written, tmp_path / "a.face", {"kind": "face", "version": "1", "metadata": metadata})
    with pytest.raises(DataError, match=reason):
        read_tensors(tmp_path / "a.face", "face", 1)
