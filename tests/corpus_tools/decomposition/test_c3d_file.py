"""C3D files of another program's writer, in the numbers of all processors; that program's reader reads the same."""

import struct
import warnings
from pathlib import Path

import c3d
import numpy as np
import pytest

from corpus_tools.decomposition.c3d_file import BIG_ENDIAN, BLOCK_BYTES, DEC, C3dFile, read_c3d_file
from corpus_tools.decomposition.marker_files import read_c3d, read_markers
from lexicon.errors import DataError
from tests.corpus_tools.decomposition.made_markers import FPS, write_c3d

pytestmark = pytest.mark.formats

NAMES = tuple(f"M{number}" for number in range(7))
SCALE = 0.01  # mm, of files with whole numbers
SOUND = np.sin(np.arange(40 * 100) * 0.1) * 1000.0


def made_points(n_frames: int = 40, n_markers: int = len(NAMES)) -> np.ndarray:
    points = np.random.default_rng(1).uniform(-300.0, 300.0, (n_frames, n_markers, 3)).astype(np.float32)
    points[2, 1] = np.nan
    return points


def read_by_its_writer(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (T, M, 3), NaN where hidden, and channels (T k, C), by py-c3d."""
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frames = [(points, channels.T) for _, points, channels in c3d.Reader(file).read_frames()]
    points = np.array([points for points, _ in frames], float)
    points[points[..., 3] < 0] = np.nan
    return points[..., :3], np.concatenate([channels for _, channels in frames])


def data_start(content: bytes) -> int:
    return BLOCK_BYTES * (struct.unpack_from("<H", content, 16)[0] - 1)


def transcoded(content: bytes, processor: int) -> bytes:
    """A file with Intel's numbers as the other processor writes it."""

    def words(given: bytes) -> bytes:
        return np.frombuffer(given, "<u2").astype(">u2" if processor == BIG_ENDIAN else "<u2").tobytes()

    def floats(given: bytes) -> bytes:
        if processor == BIG_ENDIAN:
            return np.frombuffer(given, "<f4").astype(">f4").tobytes()
        return (np.frombuffer(given, "<f4") * 4).view("<u2").reshape(-1, 2)[:, ::-1].tobytes()

    new, start = bytearray(content), data_start(content)
    changes = [(2, 12, words), (12, 16, floats), (16, 20, words), (20, 24, floats)]
    is_float = struct.unpack_from("<f", content, 12)[0] < 0
    changes.append((start, len(content), floats if is_float else words))
    at, new[BLOCK_BYTES + 3] = BLOCK_BYTES + 4, processor
    while n_characters := content[at]:
        group = struct.unpack_from("b", content, at + 1)[0]
        at += 2 + n_characters
        changes.append((at, at + 2, words))
        if group > 0:
            size, n_dimensions = struct.unpack_from("bB", content, at + 2)
            values = at + 4 + n_dimensions
            n_bytes = size * int(np.prod([1, *content[at + 4 : values]]))
            changes += [(values, values + n_bytes, {2: words, 4: floats}[size])] if size > 1 else []
        at += struct.unpack_from("<H", content, at)[0]
    for first, last, change in changes:
        new[first:last] = change(content[first:last])
    return bytes(new)


@pytest.mark.parametrize("scale", [-1.0, SCALE])
@pytest.mark.parametrize("processor", [84, DEC, BIG_ENDIAN])
def test_numbers_of_all_processors_are_read(tmp_path: Path, processor: int, scale: float) -> None:
    """Floats to their last bit; whole numbers are cut to multiples of their scale by the writer."""
    points = made_points()
    path = write_c3d(tmp_path / "take.c3d", NAMES, points, sound=SOUND, scale=scale)
    if processor in (DEC, BIG_ENDIAN):
        path.write_bytes(transcoded(path.read_bytes(), processor))
    found = read_c3d_file(path)
    others_points, others_channels = read_by_its_writer(path)
    np.testing.assert_allclose(found.points, points, rtol=0, atol=0 if scale < 0 else SCALE)
    np.testing.assert_allclose(found.points, others_points, rtol=1e-6)
    np.testing.assert_array_equal(found.channels, others_channels)
    np.testing.assert_allclose(found.channels[:, 1], SOUND, rtol=1e-6, atol=1e-4 if scale < 0 else 1.0)
    assert found.labels("POINT") == [f"Anna:{name}" for name in NAMES]
    assert found.labels("ANALOG") == ["Force.Fx", "Audio.1"]
    assert (found.number("POINT:RATE"), found.number("ANALOG:RATE")) == (FPS, FPS * 100)


def test_whole_numbers_of_channels_without_a_sign_are_read(tmp_path: Path) -> None:
    """40,000 in 16 bits is negative with a sign: the curve of the sound would be torn."""
    path = write_c3d(tmp_path / "take.c3d", NAMES, made_points(), sound=SOUND, scale=SCALE)
    signed = read_c3d_file(path).channels
    content, width = bytearray(path.read_bytes().replace(b"SIGNED  ", b"UNSIGNED")), 4 * len(NAMES) + signed.size // 40
    frames = np.frombuffer(content, "<u2")[data_start(content) // 2 :][: 40 * width].reshape(40, width).copy()
    frames[:, 4 * len(NAMES) :] += 2**15
    content[data_start(content) :] = frames.tobytes()
    path.write_bytes(content)
    found = read_c3d_file(path).channels
    np.testing.assert_array_equal(found, read_by_its_writer(path)[1])
    assert found[:, 1].min() > 2**15 - 1001
    sound = read_c3d(path).sound
    assert sound is not None
    assert np.abs(np.diff(sound.samples)).max() < 0.2


@pytest.mark.parametrize("n_frames", [65_535, 65_536, 70_000])
@pytest.mark.parametrize("is_wrapped", [False, True])
def test_more_frames_than_16_bits_count(tmp_path: Path, n_frames: int, is_wrapped: bool) -> None:
    """The header has 65,535, or the rest beyond 65,536; fields of the trial have all, in two words, the lower first."""
    path = write_c3d(tmp_path / "take.c3d", ("A",), np.ones((2, 1, 3)))
    content = bytearray(path.read_bytes())
    struct.pack_into("<H", content, 8, n_frames % 2**16 if is_wrapped else 2**16 - 1)
    struct.pack_into("<I", content, content.index(b"ACTUAL_END_FIELD") + 21, n_frames)
    rows = np.repeat(np.arange(1, n_frames + 1, dtype="<f4")[:, None], 4, axis=1)
    path.write_bytes(content[: data_start(content)] + rows.tobytes())
    np.testing.assert_array_equal(read_c3d_file(path).points[:, 0], rows[:, :3])
    with path.open("rb") as file, pytest.warns(UserWarning, match="No analog data"):
        assert c3d.Reader(file).frame_count == n_frames
    path.write_bytes(path.read_bytes()[:-16])
    found = read_c3d_file(path)
    assert (len(found.points), found.n_lost) == (n_frames - 1, 1)


def test_a_long_file_that_does_not_state_its_frames_is_read_to_its_end(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", ("A",), np.ones((2, 1, 3)))
    content = path.read_bytes().replace(b"ACTUAL_END_FIELD", b"ACTUAL_END_OTHER")
    rows = np.ones((70_000, 4), "<f4")
    path.write_bytes(content[:8] + b"\xff\xff" + content[10 : data_start(content)] + rows.tobytes())
    assert len(read_c3d_file(path).points) == 70_000


def test_names_of_more_than_255_markers(tmp_path: Path) -> None:
    names = tuple(f"M{number}" for number in range(600))
    path = write_c3d(tmp_path / "take.c3d", names, made_points(3, 600))
    assert read_c3d(path).names == names


@pytest.mark.parametrize(
    ("place", "value", "reason"),
    [
        (1, 81, "it does not begin as one"),
        (0, 200, "index out of range"),
        (8, 0, "it has 41 of 0 frames"),
        (16, 0, "Invalid argument|negative seek"),
    ],
)
def test_a_damaged_header_is_refused(tmp_path: Path, place: int, value: int, reason: str) -> None:
    path = write_c3d(tmp_path / "take.c3d", NAMES, made_points())
    content = bytearray(path.read_bytes())
    content[place] = value
    path.write_bytes(content)
    with pytest.raises(DataError, match=rf"take\.c3d is damaged, or no C3D file \(.*({reason})"):
        read_markers(path)


def test_a_file_that_states_more_frames_than_it_holds_is_read(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "take.c3d", NAMES, made_points())
    content = bytearray(path.read_bytes())
    content[9] = 200
    path.write_bytes(content)
    take = read_markers(path)
    np.testing.assert_array_equal(take.points[:40], read_by_its_writer(path)[0][:40])
    assert take.notes == (f"the file breaks off: of 51240 frames it has {len(take.points)}",)


def test_a_file_with_wrong_bytes_is_read_or_refused(tmp_path: Path) -> None:
    """Seeded: 400 files with one to four other bytes in header and parameters, or an end anywhere."""
    path = write_c3d(tmp_path / "take.c3d", NAMES, made_points(), sound=SOUND)
    content = np.frombuffer(path.read_bytes(), np.uint8)
    rng, refused = np.random.default_rng(0), 0
    for _ in range(400):
        wrong = content[: rng.integers(len(content)) if rng.random() < 0.2 else None].copy()
        for place in rng.integers(min(len(wrong), 3 * BLOCK_BYTES), size=rng.integers(1, 5)) if len(wrong) else ():
            wrong[place] = rng.integers(256)
        path.write_bytes(wrong.tobytes())
        try:
            with np.errstate(all="ignore"):
                assert isinstance(read_c3d_file(path), C3dFile)
        except (OSError, ValueError, IndexError, KeyError):
            refused += 1
    assert 40 < refused < 400
