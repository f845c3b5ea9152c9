"""Reading of glTF 2.0 files (.glb, .gltf, .vrm): the JSON, buffers and accessors, checked against hostile content.

Source: Khronos glTF 2.0 specification, sections 3.6 (binary data) and 4.4 (GLB); extensions KHR_mesh_quantization,
EXT_meshopt_compression and KHR_meshopt_compression.
"""

import base64
import binascii
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.files import check_regular_file, decode_utf8
from lexicon.values.json_text import parse_json
from tts2face.interchange.gltf.container import ALIGNMENT, BINARY_CHUNK, JSON_CHUNK, MAGIC
from tts2face.interchange.gltf.fields import MISSING, Fields
from tts2face.interchange.gltf.meshopt import decode_buffer
from tts2face.interchange.gltf.meshopt_filters import NO_FILTER, apply_filter
from tts2face.numeric.arrays import FloatArray

MAX_FILE_BYTES = 512_000_000  # a film character with 4k textures has about 100 MB
MAX_DECODED_BYTES = 1_000_000_000  # of all compressed or sparse arrays of a file
MAX_COUNT = 30_000_000  # elements of an accessor: 52 shapes of 50,000 vertices are 2.6 million
# glTF allows 252; EXT_meshopt_compression 256
MAX_STRIDE = 256
MAX_VALUE = 1e9  # of positions and other numbers: beyond it no single-precision geometry works
SUFFIXES = (".glb", ".gltf", ".vrm")
COMPONENTS: dict[int, type[np.integer[Any] | np.floating[Any]]] = {
    # componentType (glTF 2.0, 3.6.2.2)
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
UNDO_DRACO = "`npx @gltf-transform/cli copy IN.glb OUT.glb`"
# Extensions that a file may require: they change materials only, or are read here or in other modules of this package.
READABLE = (
    "KHR_mesh_quantization", "EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_texture_transform",
    "KHR_texture_basisu", "EXT_texture_webp", "VRM", "VRMC_vrm", "VRMC_materials_mtoon", "VRMC_springBone",
    "VRMC_node_constraint", "KHR_lights_punctual", "KHR_node_visibility",
)  # fmt: skip
MATERIAL_EXTENSION = "KHR_materials_"


@dataclass(slots=True, eq=False)
class GltfFile:
    """Opened glTF file.

    Parameters
    ----------
    path
        File that was read; other files are looked up beside it.
    root
        The JSON.
    binary
        Binary chunk of a .glb file; None without one.
    """

    path: Path
    root: Fields
    binary: bytes | None
    _buffers: dict[int, NDArray[np.uint8]] = field(default_factory=dict)
    _views: dict[int, NDArray[np.uint8]] = field(default_factory=dict)
    _entries: dict[str, list[Fields]] = field(default_factory=dict)
    _decoded_bytes: int = 0

    def entries(self, kind: str) -> list[Fields]:
        """Entries of a list of the JSON, such as ``nodes``; empty if it is missing."""
        if kind not in self._entries:
            self._entries[kind] = self.root.children(kind)
        return self._entries[kind]

    def count(self, kind: str) -> int:
        """Number of entries of a list of the JSON."""
        return len(self.entries(kind))

    def accessor(self, number: int) -> NDArray[np.float64] | NDArray[np.int64]:
        """Elements (N, width) of an accessor: float64 for floats and normalised integers, otherwise int64.

        Raises
        ------
        DataError
            It reaches beyond its buffer, has an unknown type, or contains numbers that are not finite.
        """
        fields = self.entries("accessors")[number]
        component = self._component(fields)
        kind = fields.text("type")
        if kind not in WIDTHS:
            raise fields.wrong("type", "one of " + ", ".join(WIDTHS), kind)
        count = fields.integer("count", low=1, high=MAX_COUNT)
        shape = (count, WIDTHS[kind])
        view = fields.index("bufferView", self.count("bufferViews"), "buffer views")
        # before the array is made: a small file can declare any count
        self._reserve(8 * count * shape[1], fields)
        if view is None:
            values = np.zeros(shape, component)
        else:
            values = self._elements(view, fields.integer("byteOffset", 0), shape, component).copy()
        if fields.has("sparse"):
            self._apply_sparse(fields.child("sparse"), values, component)
        return _as_numbers(values, fields)

    def view(self, number: int) -> NDArray[np.uint8]:
        """Bytes of a buffer view, decompressed."""
        if number not in self._views:
            fields = self.entries("bufferViews")[number]
            extension = next((found for name in MESHOPT if (found := fields.extension(name))), None)
            self._views[number] = self._slice(fields) if extension is None else self._decode(extension)
        return self._views[number]

    def uri(self, text: str, fields: Fields) -> bytes:
        """Content of a data URI, or of a file beside this one.

        Raises
        ------
        DataError
            The URI is damaged or leads outside the file's folder, or the file cannot be read.
        """
        if text.startswith("data:"):
            head, _, body = text.partition(",")
            try:
                return base64.b64decode(body, validate=True) if head.endswith(";base64") else unquote(body).encode()
            except (binascii.Error, ValueError) as error:
                raise DataError(f"{fields.place}: the data URI is damaged; export the character again") from error
        relative = Path(unquote(text))
        # a stranger's file must not name files outside its folder, or addresses
        if "\0" in text or ":" in text or relative.is_absolute() or ".." in relative.parts:
            raise DataError(
                f"{fields.place}: {text[:60]!r} is not a file beside {self.path.name}; export it as one .glb file"
            )
        return read_bytes(self.path.parent / relative)

    def _reserve(self, n_bytes: int, fields: Fields) -> None:
        self._decoded_bytes += n_bytes
        if self._decoded_bytes > 4 * MAX_DECODED_BYTES:
            raise DataError(f"{fields.place}: the file unpacks to more than 4 GB; reduce its meshes and shapes")

    def _component(self, fields: Fields) -> type[np.integer[Any] | np.floating[Any]]:
        number = fields.integer("componentType")
        if number not in COMPONENTS:
            raise fields.wrong("componentType", "one of " + ", ".join(map(str, COMPONENTS)), number)
        return COMPONENTS[number]

    def _elements(
        self, view: int, offset: int, shape: tuple[int, int], component: type[np.integer[Any] | np.floating[Any]]
    ) -> NDArray[np.generic]:
        """Elements `shape` of a buffer view from a byte offset on; not copied."""
        fields = self.entries("bufferViews")[view]
        content, size = self.view(view), np.dtype(component).itemsize
        packed = shape[1] * size
        stride = fields.integer("byteStride", packed, high=MAX_STRIDE) or packed
        end = offset + (shape[0] - 1) * stride + packed
        if stride < packed or end > len(content):
            raise DataError(f"{fields.place}: has {len(content)} bytes, but {end} are used; export the character again")
        return np.ndarray(shape, np.dtype(component).newbyteorder("<"), content, offset, (stride, size))

    def _apply_sparse(
        self, fields: Fields, values: NDArray[np.generic], component_of: type[np.integer[Any] | np.floating[Any]]
    ) -> None:
        count = fields.integer("count", low=1, high=len(values))
        indices, elements = fields.child("indices"), fields.child("values")
        n_views = self.count("bufferViews")
        views = [part.index("bufferView", n_views, "buffer views") for part in (indices, elements)]
        if views[0] is None or views[1] is None:
            raise DataError(f"{fields.place}: has no buffer views; export the character again")
        component = self._component(indices)
        if not np.issubdtype(component, np.unsignedinteger):
            raise indices.wrong("componentType", "an unsigned integer type", component.__name__)
        rows = self._elements(views[0], indices.integer("byteOffset", 0), (count, 1), component).astype(np.int64)
        if int(rows.max()) >= len(values):
            raise DataError(f"{fields.place}: index {rows.max()} is beyond {len(values)} elements; export it again")
        shape = (count, values.shape[1])
        read = self._elements(views[1], elements.integer("byteOffset", 0), shape, component_of)
        values[rows[:, 0]] = read

    def _slice(self, fields: Fields) -> NDArray[np.uint8]:
        """Bytes of the part of a buffer that a buffer view or a compression extension names."""
        number = fields.index("buffer", self.count("buffers"), "buffers")
        if number is None:
            raise fields.wrong("buffer", "the index of a buffer", MISSING)
        offset, length = fields.integer("byteOffset", 0), fields.integer("byteLength", low=1)
        content = self.buffer(number)
        if offset + length > len(content):
            raise DataError(f"{fields.place}: reaches to byte {offset + length} of {len(content)}; export it again")
        return content[offset : offset + length]

    def _decode(self, fields: Fields) -> NDArray[np.uint8]:
        count, stride = fields.integer("count", low=1, high=MAX_COUNT), fields.integer("byteStride", low=1, high=256)
        self._reserve(count * stride, fields)
        content = decode_buffer(self._slice(fields), fields.text("mode"), count, stride)
        return apply_filter(content, fields.text("filter", NO_FILTER), stride)

    def buffer(self, number: int) -> NDArray[np.uint8]:
        """Bytes of a buffer, from the binary chunk, a data URI or a file beside this one."""
        if number not in self._buffers:
            fields = self.entries("buffers")[number]
            length = fields.integer("byteLength", low=1)
            if fields.has("uri"):
                content = self.uri(fields.text("uri"), fields)
            # only the first buffer may be the binary chunk (glTF 2.0, 4.4.3.3)
            elif number == 0 and self.binary is not None:
                content = self.binary
            else:
                raise DataError(f"{fields.place}: has no content; export the character as one .glb file")
            if length > len(content):
                raise DataError(f"{fields.place}: has {len(content)} of {length} bytes; copy the file again")
            self._buffers[number] = np.frombuffer(content, np.uint8)[:length]
        return self._buffers[number]


def read_gltf(path: Path, content: bytes | None = None) -> GltfFile:
    """Open a .glb, .gltf or .vrm file; of a file within another one, `content` is what it holds.

    Raises
    ------
    DataError
        The file is missing, damaged or too large, of another version, or requires an extension that is not supported.
    """
    content = read_bytes(path) if content is None else content
    text, binary = _split_glb(content, path) if content[:4] == MAGIC else (content, None)
    parsed = parse_json(decode_utf8(text, str(path)), str(path))
    if not isinstance(parsed, dict):
        raise DataError(f"{path} is not a glTF file; give a .glb, .gltf or .vrm file")
    root = Fields(parsed, path.name)
    if root.child("asset").text("version")[:1] != "2":
        raise DataError(f"{path} is not glTF of version 2; export the character again as glTF 2.0 (.glb)")
    _check_extensions(root)
    return GltfFile(path, root, binary)


def read_bytes(path: Path) -> bytes:
    """Content of a file of at most `MAX_FILE_BYTES`.

    Raises
    ------
    DataError
        It is missing, not a file, too large, or cannot be read.
    """
    check_regular_file(path)
    if path.stat().st_size > MAX_FILE_BYTES:
        raise DataError(f"{path} has more than {MAX_FILE_BYTES / 1e6:.0f} MB; reduce its textures and meshes")
    try:
        return path.read_bytes()
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused


def _split_glb(content: bytes, path: Path) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB file."""
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        (length,), kind = struct.unpack_from("<I", content, at), content[at + 4 : at + 8]
        if at + 8 + length > len(content):
            raise DataError(f"{path} ends within a chunk; copy the file again")
        # unknown chunks are ignored, as the standard demands
        chunks.setdefault(kind, content[at + 8 : at + 8 + length])
        # chunks are aligned to 4 bytes, whatever length is stated
        at += 8 + length + (-length % ALIGNMENT)
    if JSON_CHUNK not in chunks:
        raise DataError(f"{path} has no JSON chunk; export the character again")
    return chunks[JSON_CHUNK].rstrip(b"\0"), chunks.get(BINARY_CHUNK)


def _check_extensions(root: Fields) -> None:
    for name in root.texts("extensionsRequired"):
        if name == DRACO:
            raise DataError(
                f"{root.place} is compressed with Draco ({DRACO}); export it again without compression, or run "
                f"{UNDO_DRACO} and import its copy"
            )
        # without an extension of materials a character looks plainer; others change its mesh
        if name not in READABLE and not name.startswith(MATERIAL_EXTENSION):
            raise DataError(f"{root.place} requires the glTF extension {name[:60]}; export it again without it")


def _as_numbers(values: NDArray[Any], fields: Fields) -> NDArray[np.float64] | NDArray[np.int64]:
    if values.dtype.kind == "f":
        if not (np.abs(values) <= MAX_VALUE).all():
            raise DataError(
                f"{fields.place}: contains numbers that are not finite or beyond {MAX_VALUE:g}; export it again"
            )
        return values.astype(np.float64)
    if not fields.flag("normalized"):
        return values.astype(np.int64)
    scaled: FloatArray = values.astype(np.float64) / float(np.iinfo(values.dtype.str).max)
    # signed integers have one more negative value: -128 is -1, too
    return np.maximum(scaled, -1.0)
