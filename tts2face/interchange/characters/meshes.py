"""Meshes of a glTF file as pieces at rest in world coordinates: skins and default morph weights applied."""

from collections.abc import Iterator

import numpy as np

from lexicon.errors import DataError
from tts2face.interchange.characters.character import (
    MaterialPiece,
    MorphTarget,
    affine,
    linear,
)
from tts2face.interchange.gltf.fields import Fields
from tts2face.interchange.gltf.nodes import NodeTree
from tts2face.interchange.gltf.reader import DRACO, GltfFile
from tts2face.numeric.arrays import FloatArray, IntArray

# modes of a primitive (glTF 2.0, 3.7.2.1); lower ones are points and lines
TRIANGLES = 4
STRIP = 5
FAN = 6
MAX_VERTICES = 2_000_000  # of all meshes; a film character has 200,000
MAX_TARGETS = 1000  # morph targets of a mesh


def read_pieces(file: GltfFile, tree: NodeTree) -> Iterator[MaterialPiece]:
    """Pieces of all meshes of the shown scene; points and lines are skipped."""
    nodes, meshes = file.entries("nodes"), file.entries("meshes")
    n_vertices = 0
    for number in sorted(tree.world):
        mesh = nodes[number].index("mesh", len(meshes), "meshes")
        if mesh is None:
            continue
        name = "/".join(filter(None, (tree.names[number], meshes[mesh].text("name"))))
        for primitive in meshes[mesh].children("primitives"):
            piece = _Primitive(file, primitive, number).piece(tree, mesh, name)
            if piece is None:
                continue
            n_vertices += len(piece.vertices)
            if n_vertices > MAX_VERTICES:
                raise DataError(f"{file.path.name} has more than {MAX_VERTICES} vertices; reduce its meshes")
            yield piece


def target_names(mesh: Fields) -> list[str]:
    """Names of a mesh's morph targets: ``extras.targetNames``, or ``target0`` ... without names."""
    primitives = mesh.children("primitives")
    n_targets = max((len(primitive.children("targets")) for primitive in primitives), default=0)
    if n_targets > MAX_TARGETS:
        raise DataError(f"{mesh.place}: has {n_targets} morph targets; reduce them to at most {MAX_TARGETS}")
    holders = [mesh, *primitives]
    for holder in holders:
        extras = holder.content.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list) and len(names) >= n_targets and all(isinstance(name, str) for name in names):
            return [str(name) for name in names[:n_targets]]
    return [f"target{number}" for number in range(n_targets)]


class _Primitive:
    """One primitive of a mesh, shown by one node."""

    def __init__(self, file: GltfFile, fields: Fields, node: int) -> None:
        self._file = file
        self._fields = fields
        self._node = node
        self._attributes = fields.child("attributes")
        if fields.extension(DRACO) is not None:
            raise DataError(f"{fields.place} is compressed with Draco; export the character without compression")

    def piece(self, tree: NodeTree, mesh: int, name: str) -> MaterialPiece | None:
        """The piece, or None for points, lines and empty primitives."""
        mode = self._fields.integer("mode", TRIANGLES, high=6)
        places = self._attribute("POSITION", (3,), None)
        if mode < TRIANGLES or places is None:
            return None
        triangles = self._triangles(mode, len(places))
        targets = [self._accessor(target, "POSITION", (3,), len(places)) for target in self._fields.children("targets")]
        defaults = self._default_weights(mesh, len(targets))
        for number, weight in defaults.items():
            if (moved := targets[number]) is not None:
                places = places + weight * moved
        matrices, bones = self._skinning(tree, len(places))
        # a negative scale turns the order of corners, and the surface inside out
        if np.median(np.linalg.det(matrices[..., :3, :3])) < 0:  # a mirrored mesh
            triangles = triangles[:, ::-1]
        morphs = {
            MorphTarget(mesh, number): linear(moved, matrices).astype(np.float32)
            for number, moved in enumerate(targets)
            if moved is not None and moved.any()
        }
        material = self._fields.index("material", self._file.count("materials"), "materials")
        return MaterialPiece(
            name=name,
            vertices=affine(places, matrices),
            triangles=triangles,
            uv=self._attribute("TEXCOORD_0", (2,), len(places)),
            colours=self._vertex_colours(len(places)),
            material=-1 if material is None else material,
            morphs=morphs,
            bones=bones,
            defaults={MorphTarget(mesh, number): weight for number, weight in defaults.items()},
        )

    def _accessor(self, fields: Fields, key: str, widths: tuple[int, ...], count: int | None) -> FloatArray | None:
        number = fields.index(key, self._file.count("accessors"), "accessors")
        if number is None:
            return None
        values = self._file.accessor(number).astype(np.float64)
        if values.shape[1] not in widths or (count is not None and len(values) != count):
            raise DataError(f"{fields.place}: {key} has the shape {values.shape}; export the character again")
        return values

    def _attribute(self, key: str, widths: tuple[int, ...], count: int | None) -> FloatArray | None:
        return self._accessor(self._attributes, key, widths, count)

    def _vertex_colours(self, count: int) -> FloatArray | None:
        colours = self._attribute("COLOR_0", (3, 4), count)
        return None if colours is None else np.clip(colours[:, :3], 0.0, 1.0)

    def _triangles(self, mode: int, n_vertices: int) -> IntArray:
        number = self._fields.index("indices", self._file.count("accessors"), "accessors")
        corners = np.arange(n_vertices) if number is None else self._file.accessor(number)[:, 0].astype(np.int64)
        if corners.size and not 0 <= int(corners.min()) <= int(corners.max()) < n_vertices:
            raise DataError(f"{self._fields.place}: a triangle uses vertex {corners.max()} of {n_vertices}")
        if mode == TRIANGLES:
            return corners[: len(corners) // 3 * 3].reshape(-1, 3)
        if mode == FAN:
            rows = np.column_stack([np.full(max(len(corners) - 2, 0), corners[0]), corners[1:-1], corners[2:]])
            return rows
        rows = np.column_stack([corners[:-2], corners[1:-1], corners[2:]])
        rows[1::2] = rows[1::2, [1, 0, 2]]
        return rows

    def _default_weights(self, mesh: int, n_targets: int) -> dict[int, float]:
        """Morph weights other than 0 that node or mesh give, by the number of the target."""
        node = self._file.entries("nodes")[self._node]
        holder = node if node.has("weights") else self._file.entries("meshes")[mesh]
        weights = holder.numbers("weights", n_targets, None) if holder.has("weights") else None
        return {number: weight for number, weight in enumerate(weights or ()) if weight}

    def _skinning(self, tree: NodeTree, count: int) -> tuple[FloatArray, IntArray]:
        """Matrix (4, 4) or matrices (N, 4, 4) from mesh to world, and the node that each vertex follows most (N,)."""
        nodes, skins = self._file.entries("nodes"), self._file.entries("skins")
        number = nodes[self._node].index("skin", len(skins), "skins")
        # a second set for vertices that follow more than four bones
        weights = [self._attribute(f"WEIGHTS_{n}", (4,), count) for n in (0, 1)]
        joints = [self._attribute(f"JOINTS_{n}", (4,), count) for n in (0, 1)]
        if number is None or weights[0] is None or joints[0] is None:
            return tree.world[self._node], np.full(count, self._node)
        bones = np.array(skins[number].indices("joints", len(nodes), "nodes"), np.int64)
        matrices = self._joint_matrices(skins[number], bones, tree)
        pairs = [(w, j) for w, j in zip(weights, joints, strict=True) if w is not None and j is not None]
        share = np.concatenate([w for w, _ in pairs], axis=1)
        which = np.concatenate([j for _, j in pairs], axis=1).astype(np.int64)
        which = np.where(share > 0, which, 0)
        if not len(bones) or (which < 0).any() or (which >= len(bones)).any() or (share < 0).any():
            raise DataError(f"{self._fields.place}: a vertex follows a bone beyond the {len(bones)} of its skin")
        share = share / np.maximum(share.sum(axis=1, keepdims=True), 1e-9)
        blended = np.zeros((count, 4, 4))
        for column in range(share.shape[1]):
            blended += share[:, column, None, None] * matrices[which[:, column]]
        return blended, bones[which[np.arange(count), share.argmax(axis=1)]]

    def _joint_matrices(self, skin: Fields, bones: IntArray, tree: NodeTree) -> FloatArray:
        number = skin.index("inverseBindMatrices", self._file.count("accessors"), "accessors")
        inverse = np.tile(np.eye(4), (len(bones), 1, 1))
        if number is not None:
            values = self._file.accessor(number).astype(np.float64)
            if values.shape[1] != 16 or len(values) < len(bones):
                raise DataError(
                    f"{skin.place}: has {len(values)} bind matrices for {len(bones)} bones; export it again"
                )
            # glTF stores matrices column by column
            inverse = values[: len(bones)].reshape(-1, 4, 4).transpose(0, 2, 1)
        missing = [bone for bone in bones if int(bone) not in tree.world]
        if missing:
            raise DataError(f"{skin.place}: bone {missing[0]} is not part of the scene; export the character again")
        return np.stack([tree.world[int(bone)] for bone in bones]) @ inverse if len(bones) else inverse
