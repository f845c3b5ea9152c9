"""Animation of a clip on the file of an imported character: its own morph targets, head and eye bones."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.landmarks import landmark_motion
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.stand_in import stand_in
from tts2face.interchange.characters.binding import character_file, read_binding
from tts2face.interchange.characters.bone_tracks import BoneTracks, Track
from tts2face.interchange.characters.character import Character, MorphTarget
from tts2face.interchange.characters.gltf_reader import read_gltf_character
from tts2face.interchange.characters.head_mesh import mapped_targets, source_weights
from tts2face.interchange.characters.shapes import ShapeMapping
from tts2face.interchange.gltf.container import key_times
from tts2face.interchange.gltf.nodes import NodeTree, read_nodes
from tts2face.interchange.gltf.reader import GltfFile, read_gltf
from tts2face.interchange.gltf.writer import GlbWriter
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.storage.files import write_atomically
from tts2face.storage.output_paths import refuse_overwriting
from tts2face.storage.wave_files import wave_bytes
from tts2face.types import Clip, Trajectory

ANIMATION = "tts2face"
BOTH_SIDES_SHARE = 0.5  # of each of two shapes that one morph target for both sides gets
RIDGE = 0.02  # of the mean curvature: keeps replaced shapes from adding large opposite weights


@dataclass(frozen=True, slots=True)
class WrittenCharacter:
    """Summary of a written character: frames, animated morph targets, and animated bones by name."""

    path: Path
    n_frames: int
    n_targets: int
    bones: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class AnimatedCharacter:
    """Content of a .glb file with an animation, the number of its animated morph targets, and its animated bones."""

    content: bytes
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
        The face was not imported from a .glb, .gltf or .vrm file, the clip is not in its shapes, or the output is the
        character's file.
    DataError
        The character's file is missing, or has changed since its import.
    BackendError
        The file cannot be written.

    Notes
    -----
    Motion of shapes that the character lacks is carried to its own shapes by least squares on the landmarks. A head
    without a bone is moved by a node above the scene.
    """
    if clip.motion.channels != face.shape_names[: len(clip.motion.channels)]:
        raise InputError("the clip's motion is not in the shapes of this face; make the clip with a session of it")
    out = Path(out)
    refuse_overwriting({"the output": out}, {"the character": character_file(read_binding(face), character)})
    end = clip.speech.waveform.duration
    animated = animate_character(clip.motion, clip.head, face, character=character, end_s=end)
    write_atomically(out.with_suffix(".wav"), wave_bytes(clip.speech.waveform.samples, clip.speech.waveform.rate))
    write_atomically(out, animated.content)
    return WrittenCharacter(out, len(clip.motion), animated.n_targets, animated.bones)


def animate_character(
    motion: Trajectory, head: Trajectory, face: Face, *, end_s: float = 0.0, character: str | Path | None = None
) -> AnimatedCharacter:
    """Content of the character's file with an animation by motion (T, K) and head pose (T, 6); as `write_character`.

    The last frame holds up to `end_s`, where the sound ends.
    """
    times = key_times(len(motion), motion.fps, end_s)
    motion, head = (_held(trajectory, len(times)) for trajectory in (motion, head))
    binding = read_binding(face)
    path = character_file(binding, character)
    file, source = read_gltf(path), read_gltf_character(path)
    tree = read_nodes(file.root)
    weights = target_weights(motion, face, source, binding.mapping)
    writer = GlbWriter(file)
    bones = BoneTracks(face, binding, source, tree, writer)
    turned = [*bones.eye_tracks(motion), *bones.head_tracks(head, file)]
    driven = mapped_targets(source, binding.mapping)
    tracks = [*_weight_tracks(file, tree, (weights, driven), len(motion)), *turned]
    writer.add_animation(ANIMATION, times, tracks)
    names = dict.fromkeys(bones.name_of(node) for node, _, _ in turned)
    return AnimatedCharacter(writer.content(), len(weights), tuple(names))


def _held(trajectory: Trajectory, n_keys: int) -> Trajectory:
    """The trajectory, whose last frame is repeated up to `n_keys` rows."""
    more = np.repeat(trajectory.values[-1:], n_keys - len(trajectory), axis=0)
    return Trajectory(trajectory.channels, np.concatenate([trajectory.values, more]), trajectory.fps)


def target_weights(
    motion: Trajectory, face: Face, character: Character, mapping: ShapeMapping
) -> dict[MorphTarget, FloatArray]:
    """Weights (T,) of each morph target that a motion moves."""
    channels = motion.channels
    own = [name for name in channels if name in mapping]
    values = dict(zip(own, _own_values(motion, face, own).T, strict=True))
    found: dict[MorphTarget, FloatArray] = {}
    for name, track in values.items():
        for source in mapping[name]:
            share = BOTH_SIDES_SHARE if source.side else 1.0
            for target, weight in source_weights(character, source).items():
                found[target] = found.get(target, np.zeros(len(track))) + share * weight * track
    return found


def _own_values(motion: Trajectory, face: Face, own: list[str]) -> FloatArray:
    """Weights (T, k) of the shapes `own`, which also carry the motion of the shapes that the character lacks."""
    channels = motion.channels
    values = motion.values.astype(np.float64)
    kept = motion.columns(own).astype(np.float64)
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
            kept[:, columns] = _with_replacement(stand_in(face), shapes, kept[:, columns], missing)
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


def _weight_tracks(
    file: GltfFile,
    tree: NodeTree,
    animated_targets: tuple[Mapping[MorphTarget, FloatArray], set[MorphTarget]],
    n_frames: int,
) -> list[Track]:
    """Tracks of the morph weights (T * targets, 1) of every shown node whose mesh has animated targets.

    `animated_targets` holds the weights (T,), and all targets that the face drives: those without motion are 0, and
    other targets keep the file's default weights.
    """
    weights, driven = animated_targets
    nodes, meshes = file.entries("nodes"), file.entries("meshes")
    tracks: list[Track] = []
    for number in sorted(tree.world):
        mesh = nodes[number].index("mesh", len(meshes), "meshes")
        animated = {target.number: track for target, track in weights.items() if target.mesh == mesh}
        if mesh is None or not animated:
            continue
        n_targets = max(len(p.children("targets")) for p in meshes[mesh].children("primitives"))
        holder = nodes[number] if nodes[number].has("weights") else meshes[mesh]
        rest = holder.numbers("weights", n_targets, (0.0,) * n_targets)
        kept = [0.0 if MorphTarget(mesh, number) in driven else weight for number, weight in enumerate(rest or ())]
        rows = np.tile(np.array(kept), (n_frames, 1))
        for target, track in animated.items():
            if target < n_targets:
                rows[:, target] += track
        tracks.append((number, "weights", rows.reshape(-1, 1)))
    return tracks
