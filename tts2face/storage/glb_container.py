"""Container of .glb files: a header, a JSON chunk and a binary chunk (Khronos glTF 2.0 specification, section 4.4)."""

import json
import struct
from collections.abc import Mapping
from typing import Any

from lexicon.errors import InputError

MAGIC, VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
MAX_FILE_BYTES = 2**32 - 1  # the container states its size in 32 bits
ALIGNMENT = 4  # bytes, of chunks and of what accessors read


def glb_header(root: Mapping[str, Any], n_bytes: int, name: str) -> bytes:
    """Bytes of the .glb file `name` before its binary content of `n_bytes`, a multiple of `ALIGNMENT`.

    Raises
    ------
    InputError
        The file would be larger than the format allows.
    """
    text = json.dumps(root, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % ALIGNMENT)
    size = 12 + 8 + len(text) + 8 + n_bytes
    if size > MAX_FILE_BYTES:
        raise InputError(f"{name} would have {size / 1e9:.1f} GB; a .glb file holds 4 GB, export shorter clips")
    chunks = struct.pack("<I", len(text)) + JSON_CHUNK + text + struct.pack("<I", n_bytes) + BINARY_CHUNK
    return MAGIC + struct.pack("<II", VERSION, size) + chunks
