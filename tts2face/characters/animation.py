"""Animation of a clip on the file of an imported character: its own morph targets, head and eye bones."""

import io
import wave
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.characters.character import Character, Target
from tts2face.characters.glb_writer import GlbWriter, matrix_quaternion
from tts2face.characters.gltf import GltfFile, read_gltf
from tts2face.characters.gltf_character import read_gltf_character
from tts2face.characters.head_mesh import source_weights
from tts2face.characters.importing import METADATA_KEY
from tts2face.characters.nodes import NodeTree, read_nodes
from tts2face.characters.shape_mapping import ShapeSource
from tts2face.face.bounded_least_squares import bounded_least_squares
from tts2face.face.deformation import head_rotation, rotation_matrix
from tts2face.face.landmark_fit import landmark_motion
from tts2face.face.mouth_model import SPEECH_SHAPE_PREFIXES
from tts2face.models.face import Face
from tts2face.storage.files import write_atomically
from tts2face.types import Clip, Waveform

ANIMATION = "tts2face"
HEAD_NODE = "tts2face_head"
BOTH_SIDES_SHARE = 0.5  # of each of two shapes that one morph target for both sides gets
RIDGE = 0.02  # of the mean curvature: keeps replaced shapes from adding large opposite weights

FloatArray = NDArray[np.float64]
Track = tuple[int, str, FloatArray]


@dataclass(frozen=True, slots=True)
class WrittenCharacter:
    """Summary of a written character: frames, animated morph targets, and animated bones by name."""

    path: Path
    n_frames: int
    n_targets: int
    bones: tuple[str, ...]


def write_character(
    clip: Clip, face: Face, out: str | Path, *, character: str | Path | None = None
) -> WrittenCharacter:
    """Write the character's own file with the motion of a clip as its first animation, and the sound beside it.

    Parameters
    ----------
    clip
        Clip in the shapes of `face`.
    face
        Face that was imported from the character, with the shapes of all channels (`Session.mesh`).
    out
        .glb file; the sound is written beside it with the suffix .wav.
    character
        File of the character; by default the one that the face was imported from.

    Raises
    ------
    InputError
        The face was not imported from a .glb, .gltf or .vrm file, or the clip is not in its shapes.
    DataError
        The character's file is missing, or has changed since its import.
    BackendError
        The file cannot be written.

    Notes
    -----
    Motion of shapes that the character lacks is carried to its own shapes by least squares on the landmarks. A head
    without a bone is moved by a node above the scene.
    """
    binds = _character_metadata(face)
    if clip.motion.channels != face.shape_names[: len(clip.motion.channels)]:
        raise InputError("the clip's motion is not in the shapes of this face; make the clip with a session of it")
    path = _source(binds, character)
    file, source = read_gltf(path), read_gltf_character(path)
    tree = read_nodes(file.root)
    weights = target_weights(clip, face, source, binds["mapping"])
    writer = GlbWriter(file)
    seconds = np.arange(len(clip.motion)) / clip.fps
    tracks = [*_weight_tracks(file, tree, weights, len(clip.motion))]
    bones = _Bones(face, source, tree, writer, float(binds["yaw_deg"]))
    turned = [*bones.eye_tracks(clip), *bones.head_tracks(clip, file)]
    writer.add_animation(ANIMATION, seconds, [*tracks, *turned])
    out = Path(out)
    write_atomically(out.with_suffix(".wav"), wave_bytes(clip.speech.waveform))
    write_atomically(out, writer.content())
    names = dict.fromkeys(bones.name_of(node) for node, _, _ in turned)
    return WrittenCharacter(out, len(clip.motion), len(weights), tuple(names))


def target_weights(
    clip: Clip, face: Face, character: Character, mapping: Mapping[str, list[list[Any]]]
) -> dict[Target, FloatArray]:
    """Weights (T,) of each morph target that a clip moves, in addition to the file's default weights."""
    channels = clip.motion.channels
    own = [name for name in channels if name in mapping]
    values = dict(zip(own, _own_values(clip, face, own).T, strict=True))
    found: dict[Target, FloatArray] = {}
    for name, track in values.items():
        for source, gain, side in mapping[name]:
            share = BOTH_SIDES_SHARE if side else 1.0
            for target, weight in source_weights(character, ShapeSource(source, gain)).items():
                found[target] = found.get(target, np.zeros(len(track))) + share * weight * track
    return found


def wave_bytes(waveform: Waveform) -> bytes:
    """Content of a 16-bit .wav file."""
    content = io.BytesIO()
    with wave.open(content, "wb") as file:
        file.setparams((1, 2, waveform.rate, 0, "NONE", ""))
        file.writeframes(np.rint(np.clip(waveform.samples, -1, 1) * 32767).astype("<i2").tobytes())
    return content.getvalue()


def _own_values(clip: Clip, face: Face, own: list[str]) -> FloatArray:
    """Weights (T, k) of the shapes `own`, which also carry the motion of the shapes that the character lacks."""
    channels = clip.motion.channels
    values = clip.motion.values.astype(np.float64)
    kept = values[:, [channels.index(name) for name in own]]
    turned = {name for eye in face.eyes for name in eye.turns}
    others = [k for k, name in enumerate(channels) if name not in own and name not in turned and values[:, k].any()]
    for is_mouth in (True, False):
        group = [k for k in others if channels[k].startswith(SPEECH_SHAPE_PREFIXES) == is_mouth]
        columns = [
            n
            for n, name in enumerate(own)
            if name.startswith(SPEECH_SHAPE_PREFIXES) == is_mouth and "eyeLook" not in name
        ]
        if group and columns:
            shapes = np.array([channels.index(own[n]) for n in columns])
            missing = (np.array(group), values[:, group])
            kept[:, columns] = _with_replacement(face, shapes, kept[:, columns], missing)
    return kept


def _with_replacement(
    face: Face, shapes: NDArray[np.int64], weights: FloatArray, missing: tuple[NDArray[np.int64], FloatArray]
) -> FloatArray:
    """Weights (T, k) of `shapes` (k,) that move the landmarks most like their `weights` and missing shapes do.

    `missing` holds the indices (m,) of the missing shapes and their weights (T, m). The result is within the limits.
    """
    here = landmark_motion(face, shapes).reshape(-1, len(shapes))
    there = landmark_motion(face, missing[0]).reshape(-1, len(missing[0]))
    curvature = here.T @ here
    curvature += (RIDGE * float(np.trace(curvature)) / len(shapes) + 1e-9) * np.eye(len(shapes))
    limits = face.limits[shapes].astype(np.float64)
    solved = bounded_least_squares(curvature, weights @ curvature + missing[1] @ (there.T @ here), limits)
    is_moved = np.asarray(missing[1].any(axis=1))
    return np.where(is_moved.reshape(-1, 1), solved, weights)


def _weight_tracks(file: GltfFile, tree: NodeTree, weights: Mapping[Target, FloatArray], n_frames: int) -> list[Track]:
    """Tracks of the morph weights (T * targets, 1) of every shown node whose mesh has animated targets."""
    nodes, meshes = file.root.children("nodes"), file.root.children("meshes")
    tracks: list[Track] = []
    for number in sorted(tree.world):
        mesh = nodes[number].index("mesh", len(meshes), "meshes")
        animated = {target.number: track for target, track in weights.items() if target.mesh == mesh}
        if mesh is None or not animated:
            continue
        n_targets = max(len(p.children("targets")) for p in meshes[mesh].children("primitives"))
        holder = nodes[number] if nodes[number].has("weights") else meshes[mesh]
        rest = holder.numbers("weights", n_targets, (0.0,) * n_targets)
        rows = np.tile(np.array(rest), (n_frames, 1))
        for target, track in animated.items():
            if target < n_targets:
                rows[:, target] += track
        tracks.append((number, "weights", rows.reshape(-1, 1)))
    return tracks


class _Bones:
    """Tracks of the rotations of eye and head bones."""

    def __init__(self, face: Face, character: Character, tree: NodeTree, writer: GlbWriter, yaw_deg: float) -> None:
        self._face, self._character, self._tree, self._writer = face, character, tree, writer
        self._turn = head_rotation(0.0, float(np.radians(yaw_deg)), 0.0)  # from the file's axes to the face's
        self._names: dict[int, str] = {}

    def name_of(self, node: int) -> str:
        """Name of an animated bone."""
        return self._names.get(node, HEAD_NODE)

    def eye_tracks(self, clip: Clip) -> list[Track]:
        """Rotations of the bones of the eyeballs, which gaze shapes turn."""
        places = {
            bone: self._turn @ place for bone, place in self._character.bone_places.items() if bone.endswith("Eye")
        }
        if len(places) < 2:
            return []
        tracks = []
        for eye in self._face.eyes:
            is_left = eye.centre[0] > 0
            bone = (max if is_left else min)(places, key=lambda name: float(places[name][0]))
            vectors = np.zeros((len(clip.motion), 3))
            for name, turn in eye.turns.items():
                if name in clip.motion.channels:
                    vectors += clip.motion.values[:, clip.motion.channels.index(name), None] * turn
            rotations = np.stack([rotation_matrix(vector) for vector in vectors])
            tracks.append(self._rotation_track(bone, rotations))
        return tracks

    def head_tracks(self, clip: Clip, file: GltfFile) -> list[Track]:
        """Rotation of the head's bone; without one, rotation and translation of a node above the scene."""
        rotations = np.stack([head_rotation(*(float(x) for x in pose[:3])) for pose in clip.head.values])
        if "head" in self._character.bones:
            return [self._rotation_track("head", rotations)]
        scenes = file.root.children("scenes")
        if not scenes:
            return []
        node = self._writer.add_node_above(HEAD_NODE, file.root.index("scene", len(scenes), "scenes") or 0)
        binds = self._face.metadata[METADATA_KEY]
        origin, scale = np.array(binds["origin"], np.float64), float(binds["scale"])
        pivot = origin + self._face.pivot.astype(np.float64) / scale
        shift = clip.head.values[:, 3:].astype(np.float64) / scale
        moved = (pivot - np.einsum("tij,j->ti", rotations, pivot) + shift) @ self._turn
        turned = np.einsum("ji,tjk,kl->til", self._turn, rotations, self._turn)
        return [(node, "rotation", _quaternions(turned)), (node, "translation", moved)]

    def _rotation_track(self, bone: str, rotations: FloatArray) -> Track:
        """Local rotations (T, 4) of a bone turned by rotations (T, 3, 3) in the face's axes."""
        node = self._character.bones[bone]
        self._writer.divide_matrix(node)
        self._names[node] = bone
        world = _orthonormal(self._tree.world[node])
        parent = self._character.parents.get(node)
        above = np.eye(3) if parent is None else _orthonormal(self._tree.world[parent])
        turned = np.einsum("ji,tjk,kl->til", self._turn, rotations, self._turn)
        return node, "rotation", _quaternions(np.einsum("ji,tjk,kl->til", above, turned, world))


def _quaternions(rotations: FloatArray) -> FloatArray:
    """Quaternions (T, 4) of rotation matrices (T, 3, 3), each with the sign nearest to the one before."""
    rows = np.stack([matrix_quaternion(rotation) for rotation in rotations])
    signs = np.where((rows[1:] * rows[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    rows[1:] *= np.cumprod(signs)[:, None]
    return rows


def _orthonormal(matrix: FloatArray) -> FloatArray:
    scaled = matrix[:3, :3] / np.maximum(np.linalg.norm(matrix[:3, :3], axis=0), 1e-12)
    return np.asarray(scaled, np.float64)


def _character_metadata(face: Face) -> dict[str, Any]:
    binds = face.metadata.get(METADATA_KEY)
    if not isinstance(binds, dict) or not isinstance(binds.get("mapping"), dict):
        raise InputError("the face was not imported from a character's file; import one with `tts2face face import`")
    if not binds.get("sha256"):
        raise InputError("the face was imported from .obj files, which hold no animation; import a .glb file instead")
    return binds


def _source(binds: Mapping[str, Any], character: str | Path | None) -> Path:
    path = Path(str(binds["file"]) if character is None else character)
    if not path.is_file():
        raise DataError(f"there is no character {path}, from which the face was imported; give its path as --character")
    if sha256(path.read_bytes()).hexdigest() != binds["sha256"]:
        raise DataError(f"{path} is not the file from which the face was imported; import it again, or give that file")
    return path
