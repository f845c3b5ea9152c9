"""Arrays and JSON metadata in one safetensors file, the container of all model files.

Computed arrays in the user's cache folder, by a fingerprint of what they were computed from.

Bytes that are deflated in a file, and arrays that are deflated as one.

Before that, numbers of an array that lie next to each other along one axis are replaced by their steps where it takes
fewer bytes then: steps of indices, and of places and displacements of vertices, are small. Floats count as the whole
numbers that their bits are, so that nothing is lost.
"""

import hashlib
import json
import math
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError
from lexicon.values.checks import Place, choice, list_of, row, text, whole
from lexicon.values.json_text import parse_json
from tts2face.storage.content_store import FolderStore
from tts2face.storage.files import user_cache, write_atomically
from tts2face.storage.schema import ModelPlace, refuse

LEVEL, DRAFT_LEVEL = 9, 1  # of zlib: in files, and to choose between ways to write an array
STRATEGIES = (zlib.Z_DEFAULT_STRATEGY, zlib.Z_FILTERED)  # the second is better for pictures of small numbers
MAX_BYTES = 64_000_000  # of arrays that are deflated as one; a shipped face has 5,000,000, its light 4,000,000
MAX_AXES = 4
FIRST, LAST = 0, -1  # axis of the steps
TYPES = ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "float16", "float32", "float64")
_PLAIN = (text, choice(*TYPES), list_of(whole(0, MAX_BYTES)))


def deflate(content: bytes) -> NDArray[np.uint8]:
    """Deflated bytes (N,)."""

    def compress(strategy: int) -> bytes:
        stream = zlib.compressobj(LEVEL, strategy=strategy)
        return stream.compress(content) + stream.flush()

    with ThreadPoolExecutor(len(STRATEGIES)) as pool:  # zlib lets other threads run
        return np.frombuffer(min(pool.map(compress, STRATEGIES), key=len), np.uint8)


def inflate(content: NDArray[Any], size: int, what: str, path: Path) -> bytes:
    """So many bytes of what `deflate` returned; `what` names them in messages.

    Raises
    ------
    DataError
        The bytes are damaged or of another size.
    """
    try:
        found = zlib.decompressobj().decompress(content.tobytes(), size + 1)
    except zlib.error as error:
        raise DataError(f"{path}: the {what} cannot be inflated ({error}); build or copy the file again") from error
    if not size or len(found) != size:
        raise DataError(f"{path}: the {what} is not of {size} bytes; build or copy the file again")
    return found


def pack_arrays(arrays: Mapping[str, NDArray[Any]]) -> tuple[NDArray[np.uint8], list[list[Any]]]:
    """Arrays deflated as one (N,), and for each its name, type and shape, and the axis of its steps if it has any."""
    contents, listed = [], []
    for name, array in arrays.items():
        ways: dict[tuple[int, ...], bytes] = {(): array.tobytes()}
        ways |= {(axis,): _steps(array, axis) for axis in (FIRST, LAST)}
        way = min(ways, key=lambda one: len(zlib.compress(ways[one], DRAFT_LEVEL)))
        contents.append(ways[way])
        listed.append([name, array.dtype.name, list(array.shape), *way])
    return deflate(b"".join(contents)), listed


def unpack_arrays(content: NDArray[Any], listed: Any, what: str, path: Path) -> dict[str, NDArray[Any]]:
    """Arrays by name, of what `pack_arrays` returned; `what` names them in messages.

    Raises
    ------
    DataError
        They are damaged, or have more bytes than `MAX_BYTES`.
    """
    where = f"{path}: metadata: {what}"
    list_of(_check_entry)(listed, ModelPlace(where))
    names = [name for name, *_ in listed]
    if len(set(names)) < len(names):
        refuse(f"{where} lists two arrays of the same name")
    sizes = [math.prod(shape) * np.dtype(kind).itemsize for _, kind, shape, *_ in listed]
    if sum(sizes) > MAX_BYTES:
        refuse(f"{where} lists arrays of {sum(sizes)} bytes, more than {MAX_BYTES}")
    raw = inflate(content, sum(sizes), what, path)
    found, at = {}, 0
    for (name, kind, shape, *way), size in zip(listed, sizes, strict=True):
        part = np.frombuffer(raw, np.uint8, size, at)
        found[name] = _sums(part, np.dtype(kind), shape, way[0]) if way else part.copy().view(kind).reshape(shape)
        at += size
    return found


def _check_entry(value: Any, place: Place) -> None:
    has_steps = isinstance(value, list) and len(value) > len(_PLAIN)
    row(*_PLAIN, *([whole(LAST, FIRST)] if has_steps else []))(value, place)
    if not 1 <= len(value[2]) <= MAX_AXES:
        refuse(f"{place.name} has {len(value[2])} axes, not 1 to {MAX_AXES}")


def _steps(array: NDArray[Any], axis: int) -> bytes:
    """Steps along an axis, the last axis of the array outermost: their first bytes, their second ones, ..."""
    numbers = array.view(f"u{array.itemsize}")
    steps = np.diff(numbers, axis=axis, prepend=numbers.dtype.type(0)).T.view(f"i{array.itemsize}")
    small = np.ascontiguousarray((steps << 1) ^ (steps >> (8 * array.itemsize - 1)))  # 0, -1, 1, -2, ... as 0, 1, 2
    return small.reshape(-1, 1).view(np.uint8).T.tobytes()


def _sums(content: NDArray[np.uint8], kind: np.dtype[Any], shape: list[int], axis: int) -> NDArray[Any]:
    """The array of what `_steps` returned."""
    unsigned = np.dtype(f"u{kind.itemsize}")
    first, *others = content.reshape(kind.itemsize, -1)
    numbers = first.astype(unsigned)
    for place, plane in enumerate(others, 1):
        if plane.any():
            numbers |= np.left_shift(plane, 8 * place, dtype=unsigned)
    sums = ((numbers >> 1) ^ -(numbers & 1)).reshape(shape[::-1])
    np.cumsum(sums, axis=LAST - axis, out=sums)
    return np.ascontiguousarray(sums.T).view(kind)


MAX_METADATA_CHARACTERS = 32_000_000  # characters; 800 utterances with their words have 150,000
PACKED = "packed"  # array that holds others, and the key of the metadata that lists them
Arrays = Mapping[str, NDArray[Any]]


def write_tensors(
    path: Path, kind: str, version: int, arrays: Arrays, metadata: Mapping[str, Any], *, is_packed: bool = False
) -> None:
    """Write arrays and metadata to a file atomically; equal contents give equal bytes.

    Parameters
    ----------
    is_packed
        Deflate arrays as one, without loss, except bytes, which are coded already, and what is too large for it.

    Raises
    ------
    BackendError
        The folder cannot be written or the disk is full.
    """
    from safetensors.numpy import save

    written = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    several = {name: array for name, array in written.items() if array.ndim > 1 or array.dtype != np.uint8}
    if is_packed and 0 < sum(array.nbytes for array in several.values()) <= MAX_BYTES:
        content, listed = pack_arrays(several)
        written = {name: array for name, array in written.items() if name not in several} | {PACKED: content}
        metadata = {**metadata, PACKED: listed}
    header = {"kind": kind, "version": str(version), "metadata": json.dumps(metadata, ensure_ascii=False)}
    write_atomically(path, _sort_header(save(written, header)))


def _sort_header(content: bytes) -> bytes:
    """File content with the keys of its header sorted; the library writes them in random order."""
    start = 8 + int.from_bytes(content[:8], "little")
    text = json.dumps(json.loads(content[8:start]), ensure_ascii=False, sort_keys=True, separators=(",", ":"))
    header = text.encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + content[start:]


def read_tensors(path: Path, kind: str, version: int) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays and the metadata of a file that `write_tensors` wrote.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is truncated, of another kind, or of another version.
    """
    with _opened(path, kind, version) as (file, metadata):
        arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    if PACKED in metadata:
        if PACKED not in arrays:
            raise DataError(f"{path} lacks the array {PACKED}; build or copy it again")
        several = unpack_arrays(arrays.pop(PACKED), metadata.pop(PACKED), PACKED, path)
        if twice := sorted(several.keys() & arrays.keys()):
            raise DataError(f"{path} holds the array {twice[0]} twice; build or copy it again")
        arrays |= several
    return arrays, metadata


def read_metadata(path: Path, kind: str, version: int) -> dict[str, Any]:
    """The metadata alone; raises as `read_tensors`."""
    with _opened(path, kind, version) as (_, metadata):
        return metadata


@contextmanager
def _opened(path: Path, kind: str, version: int) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Memory-mapped file and its metadata."""
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise InputError(f"there is no {kind} file {path}; check the path")
    try:
        with safe_open(str(path), framework="numpy") as file:
            header = file.metadata() or {}
            if header.get("kind") != kind:
                raise DataError(f"{path} is not a {kind} file; give one that tts2face wrote")
            if header.get("version") != str(version):
                raise DataError(
                    f"{path} is a {kind} file of version {header.get('version')}, not {version}; build it again"
                )
            yield file, _metadata(header["metadata"], path)
    except (SafetensorError, KeyError, OSError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{path} is damaged or not a {kind} file; build or copy it again") from error


def _metadata(text: str, path: Path) -> dict[str, Any]:
    """Parsed metadata, a JSON object."""
    if len(text) > MAX_METADATA_CHARACTERS:
        raise DataError(
            f"{path}: the metadata have {len(text)} characters, more than {MAX_METADATA_CHARACTERS}; build it again"
        )
    try:
        found = parse_json(text, "the metadata")
    except DataError as broken:
        raise DataError(f"{path}: the metadata cannot be read as JSON ({broken}); build or copy it again") from broken
    if not isinstance(found, dict):
        raise DataError(f"{path}: the metadata are a {type(found).__name__}, not an object; build or copy it again")
    return found


MAX_FILES = 64  # of one kind
Built = TypeVar("Built")


def fingerprint(parts: Iterable[NDArray[Any] | str]) -> str:
    """SHA-256 of arrays (their type, shape and values) and texts, in their order."""
    content = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            content.update(f"text {len(part)} {part}".encode())
        else:
            content.update(f"array {part.dtype.str} {part.shape} ".encode())
            content.update(np.ascontiguousarray(part).tobytes())
    return content.hexdigest()


def computed_once(
    kind: str,
    version: int,
    parts: Iterable[NDArray[Any] | str],
    compute: Callable[[], Arrays],
    fits: Callable[[Arrays], bool],
) -> Arrays:
    """Arrays that follow from `parts` alone: those of the cache folder if they fit, else computed and kept there.

    `version` is raised when `compute` changes its result.
    """
    name = fingerprint(parts)
    found: Arrays | None = read_cached(kind, version, name)
    if found is None or not fits(found):
        found = compute()
        write_cached(kind, version, name, found)
    return found


def read_cached(kind: str, version: int, name: str) -> dict[str, NDArray[Any]] | None:
    """Arrays that `write_cached` kept under a name; None without them, or if they are damaged or of another version."""
    return read_kept(
        _cache(kind).path(name), kind, version,
        lambda arrays, metadata: arrays if metadata.get("checksum") == _checksum(arrays) else None,
    )  # fmt: skip


def write_cached(kind: str, version: int, name: str, arrays: Arrays) -> None:
    """Keep arrays under a name; a folder that cannot be written costs the next run the same time."""
    cache = _cache(kind)
    with suppress(BackendError, OSError):
        cache.folder.mkdir(parents=True, exist_ok=True)
        write_tensors(cache.path(name), kind, version, arrays, {"checksum": _checksum(arrays)})
        cache.touch(name)
        cache.prune(max_files=MAX_FILES)


def read_kept(
    path: Path, kind: str, version: int, build: Callable[[dict[str, NDArray[Any]], dict[str, Any]], Built | None]
) -> Built | None:
    """What `build` makes of a file's arrays and metadata; None if there is none, or it is damaged, so that it is made.

    A DataError or KeyError of `build` tells that it is damaged.
    """
    with suppress(InputError, DataError, KeyError):
        return build(*read_tensors(path, kind, version))
    return None


def _checksum(arrays: Arrays) -> int:
    """CRC-32 of the bytes of arrays, by which a damaged file is noticed."""
    found = 0
    for name in sorted(arrays):
        found = zlib.crc32(np.ascontiguousarray(arrays[name]).reshape(-1).view(np.uint8).data, found)
    return found


def _cache(kind: str) -> FolderStore:
    return FolderStore(user_cache() / kind)
