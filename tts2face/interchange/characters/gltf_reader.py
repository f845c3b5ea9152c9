"""Reading of a character from a glTF or VRM file."""

from collections.abc import Mapping
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.characters.character import Character, Material, MorphTarget
from tts2face.interchange.characters.materials import MaterialReader
from tts2face.interchange.characters.meshes import read_pieces, target_names
from tts2face.interchange.gltf.fields import Fields
from tts2face.interchange.gltf.nodes import find_bones, read_nodes
from tts2face.interchange.gltf.reader import GltfFile, read_gltf

MAX_LICENCE = 500  # characters
PAINTING = ("textureTransformBinds", "materialColorBinds")  # of an expression of VRM 1
Expressions = dict[str, Mapping[MorphTarget, float]]


def read_gltf_character(path: Path) -> Character:
    """Character of a .glb, .gltf or .vrm file."""
    return character_of(read_gltf(path))


def character_of(file: GltfFile) -> Character:
    """Character of an opened file."""
    notes: list[str] = []
    tree = read_nodes(file.root)
    pieces = tuple(read_pieces(file, tree))
    if not any(len(piece.triangles) for piece in pieces):
        raise DataError(f"{file.path} has no mesh with triangles in its scene; export the character again")
    materials = (*MaterialReader(file, notes).materials(), Material("plain"))
    names = {
        MorphTarget(number, target): name
        for number, mesh in enumerate(file.entries("meshes"))
        for target, name in enumerate(target_names(mesh))
    }
    expressions, painted, is_vrm0 = _expressions(file)
    bones = find_bones(file.root, tree)
    return Character(
        pieces=pieces,
        materials=materials,
        target_names=names,
        expressions=expressions,
        bones=bones,
        bone_places={bone: tree.world[node][:3, 3] for bone, node in bones.items()},
        parents=tree.parents,
        faces_back=is_vrm0,
        licence=_licence(file.root),
        painted=painted,
        notes=tuple(dict.fromkeys(notes)),
    )


def _expressions(file: GltfFile) -> tuple[Expressions, frozenset[str], bool]:
    """Expressions of a VRM file as weights of morph targets, those that are only painted, and whether it is VRM 0."""
    # VRM 1; VRM 0 has another extension, and weights in percent
    if (recent := file.root.extension("VRMC_vrm")) is not None:
        return *_vrm1_expressions(file, recent.child("expressions")), False
    if (earlier := file.root.extension("VRM")) is not None:
        return *_vrm0_expressions(file, earlier.child("blendShapeMaster")), True
    return {}, frozenset(), False


def _vrm1_expressions(file: GltfFile, fields: Fields) -> tuple[Expressions, frozenset[str]]:
    nodes = file.entries("nodes")
    found, painted = Expressions(), set[str]()
    for group in ("preset", "custom"):
        named = fields.child(group)
        for name in named.content:
            binds: dict[MorphTarget, float] = {}
            for bind in named.child(name).children("morphTargetBinds"):
                node = bind.index("node", len(nodes), "nodes")
                mesh = None if node is None else nodes[node].index("mesh", file.count("meshes"), "meshes")
                if mesh is not None:
                    binds[MorphTarget(mesh, bind.integer("index"))] = bind.number("weight", 1.0)
            found[str(name)] = binds
            if not binds and any(named.child(name).children(kind) for kind in PAINTING):
                painted.add(str(name))
    return found, frozenset(painted)


def _vrm0_expressions(file: GltfFile, fields: Fields) -> tuple[Expressions, frozenset[str]]:
    found, painted = Expressions(), set[str]()
    for group in fields.children("blendShapeGroups"):
        binds: dict[MorphTarget, float] = {}
        for bind in group.children("binds"):
            mesh = bind.index("mesh", file.count("meshes"), "meshes")
            if mesh is not None:
                # VRM 0 states weights from 0 to 100
                binds[MorphTarget(mesh, bind.integer("index"))] = bind.number("weight", 100.0) / 100.0
        preset = group.text("presetName")
        name = preset if preset not in ("", "unknown") else group.text("name")
        found[name] = binds
        if not binds and group.children("materialValues"):
            painted.add(name)
    return found, frozenset(painted)


def _licence(root: Fields) -> str:
    """Licence, author and copyright as the file states them."""
    parts = [root.child("asset").text("copyright")]
    for extension in (root.extension("VRMC_vrm"), root.extension("VRM")):
        if extension is not None:
            meta = extension.child("meta").content
            parts += [
                f"{key} {value}"
                for key, value in meta.items()
                if isinstance(value, str) and value and ("licen" in key.lower() or key in ("author", "title", "name"))
            ]
    return "; ".join(filter(None, parts))[:MAX_LICENCE]
