"""Binary glTF 2.0 as it is written: the container, and the buffer views and accessors of its binary chunk.

Source: Khronos glTF 2.0 specification; the container is section 4.4: a header, a JSON chunk and a binary chunk.
"""

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.storage.spool import Spool

# of the header (glTF 2.0, 4.4.2)
MAGIC, VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
MAX_FILE_BYTES = 2**32 - 1  # the container states its size in 32 bits
ALIGNMENT = 4  # bytes, of chunks and of what accessors read
VERTICES, INDICES = 34962, 34963  # targets of buffer views
COMPONENTS: Mapping[str, int] = {
    "|i1": 5120, "|u1": 5121, "<i2": 5122, "<u2": 5123, "<u4": 5125, "<f4": 5126,
}  # fmt: skip
TYPES: Mapping[int, str] = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GltfBuffer:
    """The binary part of a file, with its buffer views and accessors; of a file that is continued, those it has."""

    def __init__(
        self, views: list[dict[str, Any]] | None = None, accessors: list[dict[str, Any]] | None = None
    ) -> None:
        self.views = [] if views is None else views
        self.accessors = [] if accessors is None else accessors
        self._chunks: list[bytes | Spool] = []
        self._n_bytes = 0

    def add_content(self, content: bytes | Spool) -> int:
        """Append content to the binary part; its place in bytes."""
        place, size = self._n_bytes, content.n_bytes if isinstance(content, Spool) else len(content)
        padding = -size % ALIGNMENT
        self._chunks += [content, bytes(padding)]
        self._n_bytes += size + padding
        return place

    def add_view(self, content: bytes | Spool, target: int | None = None) -> int:
        """Index of a new buffer view."""
        size = content.n_bytes if isinstance(content, Spool) else len(content)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self.add_content(content), "byteLength": size}
        if target is not None:
            view["target"] = target
        self.views.append(view)
        return len(self.views) - 1

    def add_accessor(self, values: NDArray[Any], target: int | None = None, **more: Any) -> int:
        """Index of an accessor for rows (n, d) of one of the component types."""
        rows = values.reshape(len(values), -1)
        accessor = self._accessor(rows.dtype, rows.shape[1], len(rows))
        self.accessors.append(accessor | {"bufferView": self.add_view(rows.tobytes(), target)} | more)
        return len(self.accessors) - 1

    def add_spooled_accessor(self, spool: Spool, width: int, **more: Any) -> int:
        """Index of an accessor of elements of `width` numbers for spooled rows."""
        count = spool.n_rows * spool.width // width
        accessor = self._accessor(spool.dtype, width, count)
        self.accessors.append(accessor | {"bufferView": self.add_view(spool)} | more)
        return len(self.accessors) - 1

    def add_sparse_accessor(self, values: NDArray[Any], **more: Any) -> int:
        """Index of a sparse accessor for displacements (n, 3), most of which are 0."""
        moved = np.flatnonzero(values.any(axis=1))
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        accessor = self._accessor(values.dtype, 3, len(values)) | bounds | more
        if len(moved):
            kind = "<u2" if len(values) <= 0xFFFF else "<u4"
            accessor["sparse"] = {
                "count": len(moved),
                "indices": {
                    "bufferView": self.add_view(moved.astype(kind).tobytes()),
                    "componentType": COMPONENTS[kind],
                },
                "values": {"bufferView": self.add_view(values[moved].tobytes())},
            }
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def content(self, root: Mapping[str, Any], name: str) -> bytes:
        """Bytes of a file whose parts are all in memory; as `write`."""
        chunks = (chunk for chunk in self._chunks if isinstance(chunk, bytes))
        return b"".join([self._header(root, name), *chunks])

    def write(self, path: Path, root: Mapping[str, Any]) -> None:
        """Write the file; `root`, its JSON, receives buffer, views and accessors.

        Raises
        ------
        InputError
            The file would be larger than the format allows.
        """
        header = self._header(root, path.name)
        with path.open("wb") as file:
            file.write(header)
            for chunk in self._chunks:
                if isinstance(chunk, Spool):
                    chunk.copy_to(file)
                else:
                    file.write(chunk)

    def _header(self, root: Mapping[str, Any], name: str) -> bytes:
        """Bytes of the file `name` before its binary part."""
        buffers = [{"byteLength": self._n_bytes}, *root.get("buffers", [])[1:]]
        whole = {**root, "buffers": buffers, "bufferViews": self.views, "accessors": self.accessors}
        text = json.dumps(whole, ensure_ascii=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % ALIGNMENT)
        # header, and the heads of both chunks
        size = 12 + 8 + len(text) + 8 + self._n_bytes
        if size > MAX_FILE_BYTES:
            raise InputError(f"{name} would have {size / 1e9:.1f} GB; a .glb file holds 4 GB, export shorter clips")
        chunks = struct.pack("<I", len(text)) + JSON_CHUNK + text + struct.pack("<I", self._n_bytes) + BINARY_CHUNK
        return MAGIC + struct.pack("<II", VERSION, size) + chunks

    @staticmethod
    def _accessor(dtype: np.dtype[Any], width: int, count: int) -> dict[str, Any]:
        return {"componentType": COMPONENTS[dtype.str], "type": TYPES[width], "count": count}
