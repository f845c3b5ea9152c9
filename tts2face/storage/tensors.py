"""Arrays and JSON metadata in one safetensors file, the container of all model files."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.json_text import parse_json
from tts2face.storage.deflated import MAX_BYTES, pack_arrays, unpack_arrays
from tts2face.storage.files import write_atomically

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
    # a safetensors file begins with the length of its header
    start = 8 + int.from_bytes(content[:8], "little")
    text = json.dumps(json.loads(content[8:start]), ensure_ascii=False, sort_keys=True, separators=(",", ":"))
    header = text.encode()
    # the format aligns its data to 8 bytes
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
