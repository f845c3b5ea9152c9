"""Binary glTF 2.0: buffer views and accessors of a file that is written (Khronos glTF 2.0 specification)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.exports.spool import Spool
from tts2face.storage.glb_container import ALIGNMENT, glb_header

VERTICES, INDICES = 34962, 34963  # targets of buffer views
_COMPONENTS: Mapping[str, int] = {
    "|i1": 5120, "|u1": 5121, "<i2": 5122, "<u2": 5123, "<u4": 5125, "<f4": 5126,
}  # fmt: skip
_TYPES: Mapping[int, str] = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GltfBuffer:
    """The binary part of a file, with its buffer views and accessors."""

    def __init__(self) -> None:
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self._chunks: list[bytes | Spool] = []
        self.n_bytes = 0

    def add_view(self, content: bytes | Spool, target: int | None = None) -> int:
        """Index of a new buffer view."""
        size = content.n_bytes if isinstance(content, Spool) else len(content)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self.n_bytes, "byteLength": size}
        if target is not None:
            view["target"] = target
        self.views.append(view)
        padding = -size % ALIGNMENT
        self._chunks += [content, bytes(padding)]
        self.n_bytes += size + padding
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
                    "componentType": _COMPONENTS[kind],
                },
                "values": {"bufferView": self.add_view(values[moved].tobytes())},
            }
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def described(self, content: dict[str, Any]) -> dict[str, Any]:
        """The content of the JSON part with buffer, views and accessors."""
        return content | {
            "buffers": [{"byteLength": self.n_bytes}],
            "bufferViews": self.views,
            "accessors": self.accessors,
        }

    def chunks(self) -> list[bytes]:
        """The binary part of a file whose parts are all in memory."""
        return [chunk for chunk in self._chunks if isinstance(chunk, bytes)]

    def write(self, path: Path, content: dict[str, Any]) -> None:
        """Write the container; `content` receives buffer, views and accessors.

        Raises
        ------
        InputError
            The file would be larger than the format allows.
        """
        header = glb_header(self.described(content), self.n_bytes, path.name)
        with path.open("wb") as file:
            file.write(header)
            for chunk in self._chunks:
                if isinstance(chunk, Spool):
                    chunk.copy_to(file)
                else:
                    file.write(chunk)

    @staticmethod
    def _accessor(dtype: np.dtype[Any], width: int, count: int) -> dict[str, Any]:
        return {"componentType": _COMPONENTS[dtype.str], "type": _TYPES[width], "count": count}
