"""Head mesh with morph targets, skeleton and animation as binary glTF 2.0.

Metres; y up, the face looks along +z, x to its own left, as glTF prescribes. The first shapes of the face are the morph
targets, in the order of the clip's channels; head pose and gaze are rotations of joints.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.interchange.exports.parts import Part, Target
from tts2face.interchange.exports.plain_face import plain_face
from tts2face.interchange.exports.skeleton import HEAD, Skeleton, build_skeleton
from tts2face.interchange.exports.surfaces import (
    MM_PER_M,
    ExportSurface,
    MorphTargets,
    divide_surface,
    linear_colours,
    morph_targets,
    reflection,
    roughness,
    texture_jpeg,
    texture_png,
    vertex_normals,
)
from tts2face.interchange.gltf.container import INDICES, VERTICES, GltfBuffer, key_times
from tts2face.models.face import Face
from tts2face.numeric.arrays import continuous_quaternions
from tts2face.storage.marks import PROGRAM, mark_fields
from tts2face.storage.spool import Spool

MESH_NODE, FIRST_JOINT = 0, 1
SPECULAR = "KHR_materials_specular"


class FaceGlbWriter:
    """Keeps frames in temporary files, and writes mesh and animation when their number is known."""

    def __init__(self, target: Target) -> None:
        if target.face is None:
            raise InputError(f"{target.name} holds the mesh of the face; give the face, as in face=session.face")
        self._target, self._face = target, plain_face(target.face)
        self._skeleton = build_skeleton(target.face, len(target.channels))
        self._targets = morph_targets(target.face, target.channels)
        self._weights, self._shift = Spool(len(self._targets.names)), Spool(3)
        n_eyes = len(self._skeleton.names) - HEAD - 1
        self._turns = [Spool(4) for _ in range(1 + n_eyes)]  # of the head and the eyes
        self._last: list[NDArray[np.float64] | None] = [None] * len(self._turns)
        self._held: Part | None = None  # the last frame
        self._end = 0.0

    def add(self, part: Part) -> None:
        """Append frames."""
        self._end = max(self._end, part.end)
        if not len(part.motion):
            return
        self._weights.add(self._targets.weights(part.motion))
        self._shift.add(self._skeleton.head_places(part.head) / MM_PER_M)
        turns = [self._skeleton.head_rotations(part.head)]
        turns += [self._skeleton.eye_rotations(part.motion, eye) for eye in range(len(self._turns) - 1)]
        for number, (spool, values) in enumerate(zip(self._turns, turns, strict=True)):
            signed = continuous_quaternions(values, self._last[number])
            spool.add(signed)
            self._last[number] = signed[-1]
        self._held = Part(part.motion[-1:], part.head[-1:])

    def finish(self) -> None:
        """Write the file."""
        times = key_times(self._weights.n_rows, float(self._target.fps), self._end)
        if self._held is not None and len(times) > self._weights.n_rows:
            self.add(self._held)
        buffer = GltfBuffer()
        content = _asset(self._target, self._face)
        content |= _materials(self._face, buffer)
        surfaces = divide_surface(self._face)
        content["meshes"] = [_mesh(self._face, surfaces, self._targets, self._skeleton, buffer)]
        content |= _nodes(self._skeleton, buffer)
        content["animations"] = [self._animation(times, buffer)]
        buffer.write(self._target.path, content)

    def close(self) -> None:
        """Remove the temporary files."""
        for spool in (self._weights, self._shift, *self._turns):
            spool.close()

    def _animation(self, times: NDArray[np.float32], buffer: GltfBuffer) -> dict[str, Any]:
        clock = buffer.add_accessor(times, min=[float(times[0])], max=[float(times[-1])])
        channels: list[dict[str, Any]] = []
        samplers: list[dict[str, Any]] = []

        def animate(node: int, path: str, values: Spool, width: int) -> None:
            channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
            samplers.append(
                {"input": clock, "output": buffer.add_spooled_accessor(values, width), "interpolation": "LINEAR"}
            )

        animate(MESH_NODE, "weights", self._weights, 1)
        animate(FIRST_JOINT + HEAD, "translation", self._shift, 3)
        for number, turns in enumerate(self._turns):
            animate(FIRST_JOINT + HEAD + number, "rotation", turns, 4)
        return {"name": "clip", "channels": channels, "samplers": samplers}


def _asset(target: Target, face: Face) -> dict[str, Any]:
    extras = {"fps": float(target.fps), "sound": target.sound_name, **mark_fields(target.mark)}
    asset: dict[str, Any] = {"version": "2.0", "generator": PROGRAM, "extras": extras}
    notes = [str(face.metadata[key]) for key in ("attribution", "licence") if face.metadata.get(key)]
    if notes:
        asset["copyright"] = ", ".join(notes)
    return {"asset": asset, "scene": 0, "scenes": [{"nodes": [MESH_NODE, FIRST_JOINT]}]}


def _materials(face: Face, buffer: GltfBuffer) -> dict[str, Any]:
    """Textures and one material for each surface."""
    content: dict[str, Any] = {"materials": []}
    if face.textures:
        content["images"] = [_image(face, number, buffer) for number in range(len(face.textures))]
        content["samplers"] = [{}]
        content["textures"] = [{"source": number, "sampler": 0} for number in range(len(face.textures))]
    for surface in divide_surface(face):
        part = surface.part
        shading: dict[str, Any] = {
            "baseColorFactor": [1, 1, 1, part.opacity],
            "metallicFactor": 0,
            "roughnessFactor": round(roughness(part), 4),
        }
        if part.is_textured:
            shading["baseColorTexture"] = {"index": part.texture}
        material: dict[str, Any] = {"name": part.name, "doubleSided": True, "pbrMetallicRoughness": shading}
        if reflection(part) < 1:
            material["extensions"] = {SPECULAR: {"specularFactor": reflection(part)}}
            content["extensionsUsed"] = [SPECULAR]
        if part.opacity < 1:
            material["alphaMode"] = "BLEND"
        elif part.cutout:
            material["alphaMode"] = "MASK"
        content["materials"].append(material)
    return content


def _image(face: Face, number: int, buffer: GltfBuffer) -> dict[str, Any]:
    texture = face.textures[number]
    name = next((part.name for part in face.parts if part.texture == number), f"texture{number}")
    if texture.alpha is None:
        return {"bufferView": buffer.add_view(texture_jpeg(texture.pixels)), "mimeType": "image/jpeg", "name": name}
    content = texture_png(texture.pixels, texture.alpha)
    return {"bufferView": buffer.add_view(content), "mimeType": "image/png", "name": name}


def _mesh(
    face: Face, surfaces: list[ExportSurface], targets: MorphTargets, skeleton: Skeleton, buffer: GltfBuffer
) -> dict[str, Any]:
    normals, colours = vertex_normals(face), linear_colours(face)
    primitives = []
    for number, surface in enumerate(surfaces):
        own = surface.vertices
        places = (face.vertices[own] / MM_PER_M).astype("<f4")
        bounds = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
        attributes = {
            "POSITION": buffer.add_accessor(places, VERTICES, **bounds),
            "NORMAL": buffer.add_accessor(normals[own].astype("<f4"), VERTICES),
            "JOINTS_0": buffer.add_accessor(_four(skeleton.joints[own]), VERTICES),
            "WEIGHTS_0": buffer.add_accessor(_four(skeleton.weights[own]), VERTICES),
        }
        if surface.part.is_textured and face.uv is not None:
            attributes["TEXCOORD_0"] = buffer.add_accessor(face.uv[own].astype("<f4"), VERTICES)
        else:
            opaque = np.column_stack([colours[own], np.ones(len(own))])
            steps = np.rint(opaque * 0xFFFF).astype("<u2")
            attributes["COLOR_0"] = buffer.add_accessor(steps, VERTICES, normalized=True)
        # glTF reserves the largest index of a type (primitive restart)
        kind = "<u2" if len(own) < 0xFFFF else "<u4"
        shapes = [(shape / MM_PER_M).astype("<f4") for shape in targets.displacements(face, own)]
        primitives.append({
            "attributes": attributes,
            "indices": buffer.add_accessor(surface.triangles.ravel().astype(kind), INDICES),
            "material": number,
            "targets": [{"POSITION": buffer.add_sparse_accessor(shape)} for shape in shapes],
        })  # fmt: skip
    return {
        "name": "face",
        "primitives": primitives,
        "weights": [0] * len(targets.names),
        "extras": {"targetNames": list(targets.names)},
    }


def _four(values: NDArray[Any]) -> NDArray[Any]:
    """Rows (n, 2) with two zeros appended; joints of weight 0 must be 0."""
    rows = np.zeros((len(values), 4), values.dtype)
    rows[:, :2] = values
    if values.dtype == np.uint8:
        return rows
    return rows.astype("<f4")


def _nodes(skeleton: Skeleton, buffer: GltfBuffer) -> dict[str, Any]:
    """Nodes of mesh and joints, and the skin that ties them."""
    places = skeleton.places / MM_PER_M
    inverse = np.tile(np.eye(4, dtype="<f4").ravel(), (len(places), 1))
    # joints have no rotation at rest: the inverse is a shift
    inverse[:, 12:15] = -places  # column-major
    joints = list(range(FIRST_JOINT, FIRST_JOINT + len(places)))
    nodes: list[dict[str, Any]] = [{"name": "face", "mesh": 0, "skin": 0}]
    for number, name in enumerate(skeleton.names):
        parent = np.zeros(3) if number <= HEAD else places[HEAD]
        nodes.append({"name": name, "translation": (places[number] - parent).tolist()})
    nodes[FIRST_JOINT]["children"] = [FIRST_JOINT + HEAD]
    if len(joints) > HEAD + 1:
        nodes[FIRST_JOINT + HEAD]["children"] = joints[HEAD + 1 :]
    skin = {
        "name": "head",
        "joints": joints,
        "skeleton": FIRST_JOINT,
        "inverseBindMatrices": buffer.add_accessor(inverse),
    }
    return {"nodes": nodes, "skins": [skin]}
