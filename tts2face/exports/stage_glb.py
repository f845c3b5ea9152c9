"""Binary glTF of a face for the live preview of the studio: without animation, with one morph target a channel."""

import tempfile
from pathlib import Path

import numpy as np

from tts2face.exports.glb import FIRST_JOINT, GENERATOR, MESH_NODE, _materials, _mesh, _nodes
from tts2face.exports.gltf import GltfBuffer
from tts2face.exports.skeleton import build_skeleton
from tts2face.exports.surfaces import MorphTargets, divide_surface
from tts2face.models.face import Face


def stage_glb(face: Face, channels: tuple[str, ...]) -> bytes:
    """The face as binary glTF whose morph targets are `channels`, its first shapes, at weight 1."""
    n = len(channels)
    targets = MorphTargets(channels, np.arange(n), np.ones(n, np.float32), np.zeros(n, np.bool_))
    buffer, skeleton = GltfBuffer(), build_skeleton(face, n)
    content = {"asset": {"version": "2.0", "generator": GENERATOR}, "scene": 0}
    content |= {"scenes": [{"nodes": [MESH_NODE, FIRST_JOINT]}], **_materials(face, buffer)}
    content["meshes"] = [_mesh(face, divide_surface(face), targets, skeleton, buffer)]
    with tempfile.TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder, "face.glb")
        buffer.write(path, content | _nodes(skeleton, buffer))
        return path.read_bytes()
