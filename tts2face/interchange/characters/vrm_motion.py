"""Motion of a face as a VRM's runtime takes it: weights of expressions, rotations of neck and head, gaze."""

from collections.abc import Mapping

import numpy as np

from tts2face.face.deformation import head_rotation, rotation_matrix
from tts2face.interchange.characters.bone_tracks import NECK_SHARE, quaternions, share_of_rotation
from tts2face.interchange.characters.character import Character, MorphTarget
from tts2face.interchange.gltf.vrm_animation import GAZE_PRESETS, VrmMotion
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.types import Trajectory

# Names of VRM 0 as runtimes call them since VRM 1; other names stay.
VRM0_NAMES = {
    "a": "aa", "i": "ih", "u": "ou", "e": "ee", "o": "oh", "blink_l": "blinkLeft", "blink_r": "blinkRight",
    "joy": "happy", "fun": "relaxed", "sorrow": "sad", "lookup": "lookUp", "lookdown": "lookDown",
    "lookleft": "lookLeft", "lookright": "lookRight",
}  # fmt: skip
# Moods may block the mouth (`overrideMouth`), so they hold only what was mapped to them.
MOODS = frozenset({"happy", "angry", "sad", "relaxed", "surprised", "neutral", "joy", "fun", "sorrow"})
RIDGE = 1e-3  # of the mean curvature: of two expressions that do the same, each gets a half


def vrm_motion(
    weights: Mapping[MorphTarget, FloatArray],
    own: Mapping[str, FloatArray],
    character: Character,
    *,
    head: Trajectory,
    gaze: FloatArray | None,
) -> VrmMotion:
    """Motion that a VRM's expressions hold of weights (T,) of its morph targets, with head pose (T, 6) and gaze.

    `own` holds the weights (T,) of its shapes by name, as `own_weights` gives them.
    """
    names = set(character.target_names.values())
    moods = {name: own[name] for name in own if name in MOODS and name in character.expressions and name not in names}
    found = _expressions(weights, moods, character)
    return VrmMotion(found, head_turns(head, with_neck="neck" in character.bones), gaze)


def head_turns(head: Trajectory, *, with_neck: bool) -> dict[str, FloatArray]:
    """Rotations (T, 4) of the head, of which the neck takes a share where there is one."""
    rotations = np.stack([head_rotation(*(float(x) for x in pose[:3])) for pose in head.values])
    if not with_neck:
        return {"head": quaternions(rotations)}
    neck = np.stack([share_of_rotation(rotation, NECK_SHARE) for rotation in rotations])
    return {"neck": quaternions(neck), "head": quaternions(np.einsum("tji,tjk->tik", neck, rotations))}


def gaze_turns(motion: Trajectory, face: Face) -> FloatArray | None:
    """Rotation (T, 4) of both eyes, the mean of what gaze shapes turn them by; None for a face without eyeballs."""
    if not face.eyes:
        return None
    turned = np.zeros((len(motion), 3))
    for eye in face.eyes:
        for name, turn in eye.turns.items():
            if name in motion.channels:
                turned += motion.columns([name]).astype(np.float64) * turn / len(face.eyes)
    return quaternions(np.stack([rotation_matrix(vector) for vector in turned]))


def _expressions(
    weights: Mapping[MorphTarget, FloatArray], moods: Mapping[str, FloatArray], character: Character
) -> dict[str, FloatArray]:
    """Weights (T,) of moods, and of expressions whose targets move most like the rest, by least squares."""
    found = {VRM0_NAMES.get(name, name): track for name, track in moods.items()}
    rest = dict(weights)
    for name, track in moods.items():
        for target, weight in character.expressions[name].items():
            rest[target] = np.maximum(rest[target] - weight * track, 0.0)
    targets = list(weights)
    names = [
        name
        for name, binds in character.expressions.items()
        if binds.keys() & weights.keys() and VRM0_NAMES.get(name, name) not in GAZE_PRESETS and name not in MOODS
    ]
    if not names:
        return found
    size = np.array([_extent(character, target) for target in targets])
    bound = np.array([[character.expressions[name].get(target, 0.0) for target in targets] for name in names]) * size
    wanted = np.stack([rest[target] for target in targets], axis=1) * size
    curvature = bound @ bound.T
    curvature += (RIDGE * float(np.trace(curvature)) / len(names) + 1e-12) * np.eye(len(names))
    solved = bounded_least_squares(curvature, wanted @ bound.T, np.tile([0.0, 1.0], (len(names), 1)))
    return found | {VRM0_NAMES.get(name, name): track for name, track in zip(names, solved.T, strict=True)}


def _extent(character: Character, target: MorphTarget) -> float:
    """Root of the summed squared displacement of a morph target."""
    moved = [piece.morphs[target] for piece in character.pieces if target in piece.morphs]
    return float(np.sqrt(sum(float((morph.astype(np.float64) ** 2).sum()) for morph in moved)))
