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
ZEROS_STRIDE = 12  # bytes of three floats
ALIGNMENT = 4  # bytes, of chunks and of what accessors read
LEAST_KEY_FRAMES = 0.01  # between the last frame and a key after it: times of an hour have steps of .0002 s
VERTICES, INDICES = 34962, 34963  # targets of buffer views
COMPONENTS: Mapping[str, int] = {
    "|i1": 5120, "|u1": 5121, "<i2": 5122, "<u2": 5123, "<u4": 5125, "<f4": 5126,
}  # fmt: skip
TYPES: Mapping[int, str] = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def key_times(n_frames: int, fps: float, end_s: float) -> NDArray[np.float32]:
    """Times (n,) of the keys of frames: their instants, and the end of the sound, up to which the last frame holds.

    A loop of the animation then takes as long as the sound; with keys of frames alone it would be a frame ahead.
    """
    times = (np.arange(n_frames) / fps).astype("<f4")
    is_later = end_s > (n_frames - 1 + LEAST_KEY_FRAMES) / fps
    return np.append(times, np.float32(end_s)).astype("<f4") if is_later else times


class GltfBuffer:
    """The binary part of a file, with its buffer views and accessors; of a file that is continued, those it has."""

    def __init__(
        self, views: list[dict[str, Any]] | None = None, accessors: list[dict[str, Any]] | None = None
    ) -> None:
        self.views = [] if views is None else views
        self.accessors = [] if accessors is None else accessors
        self._chunks: list[bytes | Spool] = []
        self._n_bytes = 0
        self._still: dict[tuple[str, int], int] = {}  # accessors of displacements that are all 0, by type and count
        self._zeros: dict[str, Any] = {}
        self._zeros_at = 0

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
        """Index of a sparse accessor for displacements (n, 3), most of which are 0; where all are, of a shared one."""
        moved = np.flatnonzero(values.any(axis=1))
        key = (values.dtype.str, len(values))
        if not len(moved) and key in self._still:
            return self._still[key]
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        accessor = self._accessor(values.dtype, 3, len(values)) | bounds | more
        # Accessors without a view are zeros, too, but Assimp refuses a file for them, and pygltflib writes them with
        # an offset that they must not have (decision 247). Narrower elements would need a padded view.
        if values.dtype.itemsize * 3 == ZEROS_STRIDE:
            accessor["bufferView"] = self._zeros_view(len(values))
        if len(moved):
            kind = "<u2" if len(values) <= 0xFFFF else "<u4"
            indices = {"bufferView": self.add_view(moved.astype(kind).tobytes()), "componentType": COMPONENTS[kind]}
            part = {"bufferView": self.add_view(values[moved].tobytes())}
            accessor["sparse"] = {"count": len(moved), "indices": indices, "values": part}
        self.accessors.append(accessor)
        if not len(moved):
            self._still[key] = len(self.accessors) - 1
        return len(self.accessors) - 1

    def _zeros_view(self, count: int) -> int:
        """Index of the view of zeros that all displacements share, at least `count` elements; its bytes come last."""
        if not self._zeros:
            self._zeros = {"buffer": 0, "byteLength": 0, "byteStride": ZEROS_STRIDE, "target": VERTICES}
            self.views.append(self._zeros)
            self._zeros_at = len(self.views) - 1
        self._zeros["byteLength"] = max(self._zeros["byteLength"], ZEROS_STRIDE * count)
        return self._zeros_at

    def content(self, root: Mapping[str, Any], name: str) -> bytes:
        """Bytes of a file whose parts are all in memory; as `write`."""
        header = self._header(root, name)
        return b"".join([header, *(chunk for chunk in self._chunks if isinstance(chunk, bytes))])

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
        """Bytes of the file `name` before its binary part, at whose end are the zeros that displacements share."""
        if self._zeros:
            self._zeros["byteOffset"] = self.add_content(bytes(self._zeros["byteLength"]))
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
