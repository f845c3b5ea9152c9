"""Characters made from the shipped head: glTF files with a known answer, written without the package's own writer."""

import io
import json
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tts2face.face.landmarks import landmark_positions
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face

METRES = 0.001
EYES = ("LeftEye", "RightEye")
CODES = {"float32": 5126, "uint32": 5125, "uint16": 5123, "int16": 5122, "int8": 5120, "uint8": 5121}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
HEAD_BONES = ("Hips", "Neck", "Head", *EYES)
QUANTUM = 0.5 / 32767  # metres of an integer step of quantised positions


@cache
def shipped_head() -> Face:
    """The shipped head."""
    return load_face("head")


@cache
def head_without_mouth() -> Face:
    """Skin and eyes of the shipped head, which are its first parts: a face that is imported in half of the time."""
    head = shipped_head()
    parts = head.parts[: [part.name for part in head.parts].index("teeth_upper")]
    n_triangles, n = parts[-1].first + parts[-1].count, head.eyes[-1].first + head.eyes[-1].count
    return replace(
        head, parts=parts, triangles=head.triangles[:n_triangles], vertices=head.vertices[:n],
        shapes=head.shapes[:, :n], colours=head.colours[:n], uv=None if head.uv is None else head.uv[:n],
        tangents=None if head.tangents is None else head.tangents[:n], hairdo=None, occlusion=None,
    )  # fmt: skip


@dataclass
class Variant:
    """What differs from the plain character: names, missing and merged shapes, and how the file stores them.

    ``merged`` maps a name to shapes that it sums; ``turn_deg`` turns the character about the vertical axis.
    """

    rename: Callable[[str], str] = str
    dropped: frozenset[str] = frozenset()
    merged: Mapping[str, Sequence[str]] = field(default_factory=dict)
    is_skinned: bool = False
    is_quantised: bool = False
    is_dense: bool = False
    turn_deg: float = 0.0
    has_eyes: bool = True
    extensions: Mapping[str, Any] = field(default_factory=dict)


def bounds(rows: NDArray[Any]) -> dict[str, list[float]]:
    """Fields ``min`` and ``max`` that an accessor of positions must have."""
    return {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}


class GltfMaker:
    """JSON and binary chunk of a glTF file while they grow."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "copyright": "made by a test"},
            "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
            "materials": [], "textures": [], "images": [], "buffers": [{}],
        }  # fmt: skip
        self.binary = bytearray()

    def view(self, content: bytes) -> int:
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)})
        self.binary += content
        return len(self.json["bufferViews"]) - 1

    def accessor(self, rows: NDArray[Any], **more: Any) -> int:
        table = rows.reshape(len(rows), -1)
        entry = {
            "componentType": CODES[table.dtype.name], "count": len(table), "type": KINDS[table.shape[1]],
            "bufferView": self.view(np.ascontiguousarray(table).tobytes()),
        }  # fmt: skip
        self.json["accessors"].append(entry | more)
        return len(self.json["accessors"]) - 1

    def sparse_accessor(self, rows: NDArray[Any]) -> int:
        moved = np.flatnonzero(rows.any(axis=1))
        if not len(moved):
            moved = np.zeros(1, np.int64)
        entry = {
            "componentType": 5126, "count": len(rows), "type": KINDS[rows.shape[1]],
            "sparse": {
                "count": len(moved),
                "indices": {"bufferView": self.view(moved.astype("<u4").tobytes()), "componentType": 5125},
                "values": {"bufferView": self.view(rows[moved].astype("<f4").tobytes())},
            },
        }  # fmt: skip
        self.json["accessors"].append(entry | bounds(rows.astype("<f4")))
        return len(self.json["accessors"]) - 1

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        self.json[kind].append(entry)
        return len(self.json[kind]) - 1

    def content(self) -> bytes:
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        kept = {key: value for key, value in self.json.items() if value not in ([], {})}
        return glb(kept, bytes(self.binary))


def glb(root: Mapping[str, Any], binary: bytes) -> bytes:
    """Content of a GLB file."""
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def split_glb(content: bytes) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk of a GLB file."""
    (length,) = struct.unpack_from("<I", content, 12)
    root = json.loads(content[20 : 20 + length])
    return root, content[28 + length :]


def write_character_file(path: Path, variant: Variant | None = None, face: Face | None = None) -> Path:
    """Write the shipped head, or another face, as a .glb character."""
    variant, face = variant or Variant(), face or shipped_head()
    maker = GltfMaker()
    _add_materials(maker, face)
    shapes = _shapes(face, variant)
    eye_of = np.zeros(len(face.vertices), np.int64)
    for number, eye in enumerate(face.eyes, 1):
        eye_of[eye.first : eye.first + eye.count] = number
    bones = _add_bones(maker, face) if variant.is_skinned else {}
    roots = [bones["Hips"]] if bones else []
    groups = [("Face", 0), *((name, n) for n, name in enumerate(EYES, 1) if variant.has_eyes and n <= len(face.eyes))]
    for name, eye in groups:
        mesh = _add_mesh(maker, face, shapes, (eye_of, eye), variant)
        node: dict[str, Any] = {"name": f"{name}Mesh" if bones else name, "mesh": mesh}
        if bones:
            node["skin"] = 0
        elif variant.is_quantised:
            node |= {"scale": [QUANTUM] * 3}
        roots.append(maker.add("nodes", node))
    turn = np.radians(variant.turn_deg) / 2
    above = {"name": "Armature", "children": roots, "rotation": [0.0, float(np.sin(turn)), 0.0, float(np.cos(turn))]}
    maker.json["scenes"] = [{"nodes": [maker.add("nodes", above)]}]
    if variant.extensions:
        maker.json["extensions"] = dict(variant.extensions)
        maker.json["extensionsUsed"] = list(variant.extensions)
    if variant.is_quantised:
        maker.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    path.write_bytes(maker.content())
    return path


def _add_materials(maker: GltfMaker, face: Face) -> None:
    for number, texture in enumerate(face.textures):
        pixels = texture.pixels if texture.alpha is None else np.dstack([texture.pixels, texture.alpha])
        content = io.BytesIO()
        Image.fromarray(pixels).save(content, "PNG", compress_level=1)
        view = maker.view(content.getvalue())
        maker.add("images", {"bufferView": view, "mimeType": "image/png"})
        maker.add("textures", {"source": number})
    for part in face.parts:
        rough: dict[str, Any] = {"roughnessFactor": 0.6, "metallicFactor": 0.0}
        entry: dict[str, Any] = {"name": part.name, "pbrMetallicRoughness": rough}
        if part.is_textured:
            rough["baseColorTexture"] = {"index": part.texture}
            if face.textures[part.texture].alpha is not None:
                entry |= {"alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True}
        maker.add("materials", entry)


def _shapes(face: Face, variant: Variant) -> dict[str, NDArray[np.float32]]:
    by_name = dict(zip(face.shape_names, face.shapes, strict=True))
    within = {shape for shapes in variant.merged.values() for shape in shapes}
    found = {variant.rename(name): shape for name, shape in by_name.items() if name not in variant.dropped | within}
    for name, shapes in variant.merged.items():
        found[name] = np.sum([by_name[shape] for shape in shapes], axis=0).astype(np.float32)
    return found


def _add_mesh(
    maker: GltfMaker,
    face: Face,
    shapes: Mapping[str, NDArray[np.float32]],
    which: tuple[NDArray[np.int64], int],
    variant: Variant,
) -> int:
    eye_of, eye = which
    rows = np.flatnonzero(eye_of == eye)
    rank = np.zeros(len(eye_of), np.int64)
    rank[rows] = np.arange(len(rows))
    has_targets = eye == 0
    attributes = {"POSITION": _positions(maker, face.vertices[rows] * METRES, variant)}
    light = (face.colours[rows] / 255.0) ** 2.2
    attributes["COLOR_0"] = maker.accessor(light.astype("<f4"))
    if face.uv is not None:
        attributes["TEXCOORD_0"] = maker.accessor(face.uv[rows].astype("<f4"))
    if variant.is_skinned:
        joints, weights = _skin_of(face, rows, eye)
        attributes |= {"JOINTS_0": maker.accessor(joints), "WEIGHTS_0": maker.accessor(weights)}
    targets = []
    for shape in shapes.values() if has_targets else ():
        moved = shape[rows] * np.float32(METRES)
        if variant.is_quantised or variant.is_dense:
            targets.append({"POSITION": _positions(maker, moved, variant)})
        else:
            targets.append({"POSITION": maker.sparse_accessor(moved)})
    primitives = []
    for number, part in enumerate(face.parts):
        corners = face.triangles[part.first : part.first + part.count]
        corners = corners[(eye_of[corners] == eye).all(axis=1)]
        if len(corners):
            primitive = {
                "attributes": attributes, "material": number,
                "indices": maker.accessor(rank[corners].reshape(-1, 1).astype("<u4")),
            }  # fmt: skip
            primitives.append(primitive | ({"targets": targets} if targets else {}))
    mesh: dict[str, Any] = {"name": "Face" if eye == 0 else EYES[eye - 1], "primitives": primitives}
    if targets:
        mesh["extras"] = {"targetNames": list(shapes)}
    return maker.add("meshes", mesh)


def _positions(maker: GltfMaker, metres: NDArray[np.floating], variant: Variant) -> int:
    if variant.is_quantised:
        steps = np.rint(metres / QUANTUM).astype("<i2")
        padded = np.zeros((len(steps), 4), "<i2")
        padded[:, :3] = steps
        view = maker.view(padded.tobytes())
        maker.json["bufferViews"][view]["byteStride"] = 8
        entry = {"componentType": 5122, "count": len(steps), "type": "VEC3", "bufferView": view}
        return maker.add("accessors", entry | bounds(steps))
    return maker.accessor(metres.astype("<f4"), **bounds(metres.astype("<f4")))


def _add_bones(maker: GltfMaker, face: Face) -> dict[str, int]:
    """Bones with transforms of their own; at rest the skinned mesh lies where the plain one does."""
    places = {
        "Hips": np.array([0.0, -0.6, 0.0]),
        "Neck": np.array([0.0, -0.12, -0.09]),
        "Head": face.pivot.astype(np.float64) * METRES,
        EYES[0]: face.eyes[0].centre.astype(np.float64) * METRES,
        EYES[1]: face.eyes[1].centre.astype(np.float64) * METRES,
    }
    parents = {"Neck": "Hips", "Head": "Neck", EYES[0]: "Head", EYES[1]: "Head"}
    nodes, inverse = {}, []
    for name in HEAD_BONES:
        above = places[parents[name]] if name in parents else np.zeros(3)
        nodes[name] = maker.add("nodes", {"name": f"mixamorig:{name}", "translation": (places[name] - above).tolist()})
        matrix = np.eye(4)
        matrix[:3, 3] = -places[name]
        inverse.append(matrix.T.reshape(-1))
    for name, parent in parents.items():
        maker.json["nodes"][nodes[parent]].setdefault("children", []).append(nodes[name])
    bind = maker.accessor(np.array(inverse, "<f4"))
    maker.json["skins"] = [{"joints": [nodes[name] for name in HEAD_BONES], "inverseBindMatrices": bind}]
    return nodes


def _skin_of(face: Face, rows: NDArray[np.int64], eye: int) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    joints, weights = np.zeros((len(rows), 4), "<u2"), np.zeros((len(rows), 4), "<f4")
    weights[:, 0] = 1.0
    if eye:
        joints[:, 0] = HEAD_BONES.index(EYES[eye - 1])
        return joints, weights
    height = face.vertices[rows, 1]
    share = np.clip((height + 200.0) / 80.0, 0.0, 1.0)
    joints[:, 0], joints[:, 1] = HEAD_BONES.index("Head"), HEAD_BONES.index("Neck")
    weights[:, 0], weights[:, 1] = share, 1.0 - share
    return joints, weights


def write_landmarks(path: Path, turn_deg: float = 0.0, face: Face | None = None) -> Path:
    """Write the true landmarks of the shipped head in the coordinates of its character file."""
    face = face or shipped_head()
    angle = np.radians(turn_deg)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    places = landmark_positions(face) * METRES @ turn.T
    rows = [f"{number}\t{x:.7g}\t{y:.7g}\t{z:.7g}" for number, (x, y, z) in zip(face.landmarks, places, strict=True)]
    path.write_text("landmark\tx\ty\tz\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path
