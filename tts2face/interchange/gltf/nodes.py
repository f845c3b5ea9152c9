"""Nodes of a glTF scene: world matrices, parents, and the bones of head, neck and eyes."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lexicon.errors import DataError
from tts2face.interchange.gltf.fields import Fields
from tts2face.numeric.arrays import FloatArray, quaternion_matrix

MAX_NODES = 100_000
BONES = ("head", "neck", "leftEye", "rightEye")
# Names of bones as Mixamo, Ready Player Me, Unreal, VRoid and Blender's rigs write them, without prefix and case.
_BONE_NAMES = {
    "head": re.compile(r"(?:^|[_.:| -])(?:head|j_bip_c_head)$", re.I),
    "neck": re.compile(r"(?:^|[_.:| -])(?:neck|neck_?0?1|j_bip_c_neck)$", re.I),
    "leftEye": re.compile(r"(?:left_?eye|eye_?left|(?:^|[_.:| -])l_?eye(?:ball)?|eye(?:ball)?[_.]?l)$", re.I),
    "rightEye": re.compile(r"(?:right_?eye|eye_?right|(?:^|[_.:| -])r_?eye(?:ball)?|eye(?:ball)?[_.]?r)$", re.I),
}


@dataclass(frozen=True, slots=True, eq=False)
class NodeTree:
    """Nodes of the scene that is shown.

    Parameters
    ----------
    names
        Name of each node of the file.
    parents
        Parent of each node that has one.
    world
        World matrix (4, 4) of each node of the shown scene.
    """

    names: tuple[str, ...]
    parents: Mapping[int, int]
    world: Mapping[int, FloatArray]


def read_nodes(root: Fields) -> NodeTree:
    """Nodes of the default scene, or all nodes of a file without scenes.

    Raises
    ------
    DataError
        A node has two parents or is its own ancestor, or a transform is damaged.
    """
    nodes = root.children("nodes")
    if len(nodes) > MAX_NODES:
        raise DataError(f"{root.place}: has {len(nodes)} nodes; reduce it to at most {MAX_NODES}")
    children = [node.indices("children", len(nodes), "nodes") for node in nodes]
    parents: dict[int, int] = {}
    for number, below in enumerate(children):
        for child in below:
            # nodes are trees (glTF 2.0, 3.5.2); a circle would never end
            if child in parents or child == number:
                raise DataError(f"{nodes[child].place}: has two parents; export the character again")
            parents[child] = number
    world: dict[int, FloatArray] = {}
    # without recursion: a hostile file may nest deeper than Python's stack
    waiting = [(number, np.eye(4)) for number in _scene_roots(root, len(nodes), parents)]
    while waiting:
        number, above = waiting.pop()
        if number in world:
            raise DataError(f"{nodes[number].place}: is reached twice; export the character again")
        world[number] = above @ local_matrix(nodes[number])
        waiting += [(child, world[number]) for child in children[number]]
    return NodeTree(tuple(node.text("name") for node in nodes), parents, world)


def local_matrix(node: Fields) -> FloatArray:
    """Matrix (4, 4) of a node's transform relative to its parent."""
    matrix = node.numbers("matrix", 16)
    if matrix is not None:
        # glTF stores matrices column by column
        return np.array(matrix).reshape(4, 4).T
    shift = node.numbers("translation", 3, (0.0, 0.0, 0.0))
    scale = node.numbers("scale", 3, (1.0, 1.0, 1.0))
    turn = node.numbers("rotation", 4, (0.0, 0.0, 0.0, 1.0))
    placed = np.eye(4)
    placed[:3, :3] = quaternion_matrix(np.array(turn)) * np.array(scale)
    placed[:3, 3] = shift
    return placed


def find_bones(root: Fields, tree: NodeTree) -> dict[str, int]:
    """Nodes of `BONES`: from the humanoid of a VRM file, otherwise by the names of nodes."""
    found = _humanoid_bones(root, len(tree.names))
    joints = {joint for skin in root.children("skins") for joint in skin.indices("joints", len(tree.names), "nodes")}
    # joints of skins first: meshes are named "head", too
    for number in sorted(tree.world, key=lambda number: (number not in joints, number)):
        for bone, pattern in _BONE_NAMES.items():
            is_possible = number in joints or bone not in BONES[:2]  # a group named head is not its pivot
            if is_possible and bone not in found and pattern.search(tree.names[number]):
                found[bone] = number
    return {bone: number for bone, number in found.items() if number in tree.world}


def _humanoid_bones(root: Fields, n_nodes: int) -> dict[str, int]:
    """Bones that the extensions VRMC_vrm (VRM 1) or VRM (VRM 0) name."""
    found: dict[str, int | None] = {}
    if (recent := root.extension("VRMC_vrm")) is not None:
        named = recent.child("humanoid").child("humanBones")
        found = {bone: named.child(bone).index("node", n_nodes, "nodes") for bone in BONES if named.has(bone)}
    elif (earlier := root.extension("VRM")) is not None:
        for entry in earlier.child("humanoid").children("humanBones"):
            if entry.text("bone") in BONES:
                found[entry.text("bone")] = entry.index("node", n_nodes, "nodes")
    return {bone: node for bone, node in found.items() if node is not None}


def _scene_roots(root: Fields, n_nodes: int, parents: Mapping[int, int]) -> list[int]:
    scenes = root.children("scenes")
    if not scenes:
        return [number for number in range(n_nodes) if number not in parents]
    chosen = root.index("scene", len(scenes), "scenes")
    roots = scenes[chosen or 0].indices("nodes", n_nodes, "nodes")
    if any(number in parents for number in roots) or len(set(roots)) < len(roots):
        raise DataError(f"{root.place}: a root of the scene is the child of another node; export the character again")
    return roots
