"""Writing of a glTF file as one .glb file with further data: buffers joined, images embedded, animations added."""

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.gltf.container import COMPONENTS, TYPES, GltfBuffer
from tts2face.interchange.gltf.nodes import local_matrix
from tts2face.interchange.gltf.reader import MESHOPT, GltfFile
from tts2face.numeric.arrays import FloatArray, matrix_quaternion


class GlbWriter:
    """Copy of a glTF file to which animations are added.

    Parameters
    ----------
    file
        The file; its meshes, materials and extensions are copied unchanged.
    """

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self.root: dict[str, Any] = copy.deepcopy(dict(file.root.content))
        self._buffer = GltfBuffer(self.root.setdefault("bufferViews", []), self.root.setdefault("accessors", []))
        self._join_buffers()
        self._embed_images()

    def add_accessor(self, values: NDArray[np.floating]) -> int:
        """Add an accessor of float32 rows (N, width), with the limits that times need; its index."""
        rows = np.ascontiguousarray(values, "<f4")
        view = self._buffer.add_view(rows.tobytes())
        accessor: dict[str, Any] = {
            "bufferView": view, "componentType": COMPONENTS["<f4"], "count": len(rows), "type": TYPES[rows.shape[1]],
        }  # fmt: skip
        if rows.shape[1] == 1:
            # glTF demands limits of times
            accessor |= {"min": [float(rows.min())], "max": [float(rows.max())]}
        return self._append("accessors", accessor)

    def add_animation(
        self, name: str, seconds: NDArray[np.floating], tracks: list[tuple[int, str, FloatArray]]
    ) -> None:
        """Add an animation as the first one: node, path (``weights``, ``rotation``, ``translation``) and rows."""
        times = self.add_accessor(seconds[:, None])
        samplers = [
            {"input": times, "output": self.add_accessor(values), "interpolation": "LINEAR"} for _, _, values in tracks
        ]
        channels = [
            {"sampler": number, "target": {"node": node, "path": path}} for number, (node, path, _) in enumerate(tracks)
        ]
        animation = {"name": name, "samplers": samplers, "channels": channels}
        self.root["animations"] = [animation, *self.root.get("animations", [])]

    def add_extras(self, fields: Mapping[str, str]) -> None:
        """Add fields to ``asset.extras``; of another type than an object, as glTF allows (2.0, 5.9), it stays."""
        asset = self.root.setdefault("asset", {"version": "2.0"})
        if isinstance(asset.get("extras", {}), dict):
            asset["extras"] = {**asset.get("extras", {}), **fields}

    def add_node_above(self, name: str, scene: int) -> int:
        """Add a node above all nodes of a scene; its index."""
        shown = self.root["scenes"][scene]
        number = self._append("nodes", {"name": name, "children": list(shown["nodes"])})
        shown["nodes"] = [number]
        return number

    def divide_matrix(self, node: int) -> None:
        """Replace the matrix of a node by translation, rotation and scale, as animations require."""
        fields = self._file.entries("nodes")[node]
        if not fields.has("matrix"):
            return
        matrix = local_matrix(fields)
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        written = self.root["nodes"][node]
        del written["matrix"]
        written |= {
            "translation": matrix[:3, 3].tolist(),
            "rotation": matrix_quaternion(matrix[:3, :3] / np.maximum(scale, 1e-12)).tolist(),
            "scale": scale.tolist(),
        }

    def content(self) -> bytes:
        """Bytes of the .glb file."""
        return self._buffer.content(self.root, self._file.path.name)

    def _append(self, kind: str, entry: dict[str, Any]) -> int:
        entries = self.root.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1

    def _join_buffers(self) -> None:
        """Move the content of all buffers into the first one; buffers without content stay as fallbacks."""
        places: dict[int, tuple[int, int]] = {}
        kept: list[dict[str, Any]] = []
        for number, fields in enumerate(self._file.entries("buffers")):
            is_embedded = number == 0 and self._file.binary is not None
            # without content: the fallback of compressed views
            if not fields.has("uri") and not is_embedded:
                kept.append(dict(fields.content))
                places[number] = (len(kept), 0)
                continue
            places[number] = (0, self._buffer.add_content(self._file.buffer(number).tobytes()))
        self.root["buffers"] = [{"byteLength": 0}, *kept]
        for view in self.root["bufferViews"]:
            extensions = view.get("extensions", {})
            for holder in (view, *(extensions[name] for name in MESHOPT if name in extensions)):
                number, shift = places[holder["buffer"]]
                holder["buffer"] = number
                holder["byteOffset"] = holder.get("byteOffset", 0) + shift

    def _embed_images(self) -> None:
        for number, image in enumerate(self.root.get("images", [])):
            uri = image.get("uri", "")
            if uri and not uri.startswith("data:"):
                content = self._file.uri(uri, self._file.entries("images")[number])
                kind = "image/png" if content[:4] == b"\x89PNG" else "image/jpeg"
                image.pop("uri")
                image |= {"bufferView": self._buffer.add_view(content), "mimeType": kind}
