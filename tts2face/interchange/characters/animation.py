"""Animation of a clip on the file of an imported character: its own morph targets, head and eye bones."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lexicon.errors import InputError
from tts2face.interchange.characters.binding import character_bytes, character_file, read_binding
from tts2face.interchange.characters.bone_tracks import BoneTracks, Track
from tts2face.interchange.characters.character import Character, MorphTarget
from tts2face.interchange.characters.gltf_reader import character_of
from tts2face.interchange.characters.head_mesh import mapped_targets, source_weights
from tts2face.interchange.characters.own_weights import own_weights
from tts2face.interchange.characters.shapes import ShapeMapping, ShapeSource
from tts2face.interchange.characters.vrm_motion import gaze_turns, vrm_motion
from tts2face.interchange.gltf.container import key_times
from tts2face.interchange.gltf.nodes import NodeTree, read_nodes
from tts2face.interchange.gltf.reader import GltfFile, read_gltf
from tts2face.interchange.gltf.vrm_animation import VrmMotion, add_vrm_animation
from tts2face.interchange.gltf.writer import GlbWriter
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray
from tts2face.storage.files import write_atomically
from tts2face.storage.marks import UNKNOWN, Mark, mark_fields, sound_mark
from tts2face.storage.output_paths import refuse_overwriting
from tts2face.storage.wave_files import wave_bytes
from tts2face.types import Clip, Trajectory

ANIMATION = "tts2face"


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
    mark = face.mark.of(UNKNOWN, is_recorded=clip.speech.is_recorded)
    animated = animate_character(clip.motion, clip.head, face, mark, character=character, end_s=end)
    sound, heard = clip.speech.waveform, sound_mark(UNKNOWN, is_recorded=clip.speech.is_recorded)
    write_atomically(out.with_suffix(".wav"), wave_bytes(sound.samples, sound.rate, heard))
    write_atomically(out, animated.content)
    return WrittenCharacter(out, len(clip.motion), animated.n_targets, animated.bones)


def animate_character(
    motion: Trajectory,
    head: Trajectory,
    face: Face,
    mark: Mark | None = None,
    *,
    end_s: float = 0.0,
    character: str | Path | None = None,
) -> AnimatedCharacter:
    """Content of the character's file with an animation by motion (T, K) and head pose (T, 6); as `write_character`.

    The last frame holds up to `end_s`, where the sound ends.
    """
    times = key_times(len(motion), motion.fps, end_s)
    motion, head = (held(trajectory, len(times)) for trajectory in (motion, head))
    binding = read_binding(face)
    path = character_file(binding, character)
    file = read_gltf(path, character_bytes(path))
    source = character_of(file)
    tree = read_nodes(file.root)
    weights = target_weights(motion, face, source, binding.mapping)
    writer = GlbWriter(file)
    bones = BoneTracks(face, binding, source, tree, writer)
    turned = [*bones.eye_tracks(motion), *bones.head_tracks(head, file)]
    driven = mapped_targets(source, binding.mapping)
    tracks = [*turned, *_weight_tracks(file, tree, (weights, driven), len(motion))]
    # its runtime sets bones and bound morph targets anew in each frame, and plays only this
    if source.expressions:
        named = own_weights(motion, face, binding.mapping)
        own = vrm_motion(weights, named, source, head=head, gaze=gaze_turns(motion, face))
        scene = file.root.index("scene", file.count("scenes"), "scenes") or 0
        tracks = [*add_vrm_animation(writer.root, own, scene), *tracks]
    writer.add_animation(ANIMATION, times, tracks)
    writer.add_extras(mark_fields(mark))
    names = dict.fromkeys(bones.name_of(node) for node, _, _ in turned)
    return AnimatedCharacter(writer.content(), len(weights), tuple(names))


def expression_motion(
    motion: Trajectory, head: Trajectory, face: Face, *, character: str | Path | None = None
) -> VrmMotion | None:
    """Motion of the expressions, the head and the gaze of the VRM that a face was imported from; None of other files.

    Raises
    ------
    InputError, DataError
        As `write_character`.
    """
    binding = read_binding(face)
    path = character_file(binding, character)
    source = character_of(read_gltf(path, character_bytes(path)))
    if not source.expressions:
        return None
    weights = target_weights(motion, face, source, binding.mapping)
    named = own_weights(motion, face, binding.mapping)
    return vrm_motion(weights, named, source, head=head, gaze=gaze_turns(motion, face))


def held(trajectory: Trajectory, n_keys: int) -> Trajectory:
    """The trajectory, whose last frame is repeated up to `n_keys` rows."""
    more = np.repeat(trajectory.values[-1:], n_keys - len(trajectory), axis=0)
    return Trajectory(trajectory.channels, np.concatenate([trajectory.values, more]), trajectory.fps)


def target_weights(
    motion: Trajectory, face: Face, character: Character, mapping: ShapeMapping
) -> dict[MorphTarget, FloatArray]:
    """Weights (T,) of each morph target that a motion moves."""
    found: dict[MorphTarget, FloatArray] = {}
    for name, track in own_weights(motion, face, mapping).items():
        for target, weight in source_weights(character, ShapeSource(name)).items():
            found[target] = found.get(target, np.zeros(len(track))) + weight * track
    return found


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
