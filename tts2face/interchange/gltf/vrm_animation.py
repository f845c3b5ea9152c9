"""Animation of expressions, head and gaze as the glTF extension VRMC_vrm_animation holds it.

Each expression has a node whose x is its weight, head and neck are nodes of a skeleton that looks along +z, and the
rotation of one more node is the gaze. Source: VRMC_vrm_animation 1.0 of the VRM Consortium.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tts2face.numeric.arrays import FloatArray

EXTENSION, SPEC_VERSION = "VRMC_vrm_animation", "1.0"
ROOT = "tts2face_vrm_animation"
PRESETS = frozenset({
    "aa", "ih", "ou", "ee", "oh", "blink", "blinkLeft", "blinkRight", "happy", "angry", "sad", "relaxed", "surprised",
    "lookUp", "lookDown", "lookLeft", "lookRight", "neutral",
})  # fmt: skip
# The runtime sets these itself, from the gaze.
GAZE_PRESETS = frozenset({"lookUp", "lookDown", "lookLeft", "lookRight"})
# Bones of the skeleton with their parents and places above them in metres: a runtime scales by the height of the hips.
SKELETON: Mapping[str, tuple[str, tuple[float, float, float]]] = {
    "hips": ("", (0.0, 1.0, 0.0)), "spine": ("hips", (0.0, 0.1, 0.0)), "neck": ("spine", (0.0, 0.35, 0.0)),
    "head": ("neck", (0.0, 0.1, 0.0)),
}  # fmt: skip
Track = tuple[int, str, FloatArray]  # node, path and rows of an animation


@dataclass(frozen=True, slots=True, eq=False)
class VrmMotion:
    """Motion of a VRM.

    Parameters
    ----------
    expressions
        Weights (T,) in [0, 1] of each expression.
    bones
        Rotations (T, 4) of some bones of `SKELETON`, relative to their parents; x to the left, z out of the face.
    gaze : (T, 4)
        Rotation of both eyes, or None.
    """

    expressions: Mapping[str, FloatArray]
    bones: Mapping[str, FloatArray] = field(default_factory=dict)
    gaze: FloatArray | None = None


def add_vrm_animation(root: dict[str, Any], motion: VrmMotion, scene: int = 0) -> list[Track]:
    """Add the nodes and the extension of a motion to the JSON of a file; the tracks of its animation.

    These tracks must be the first ones: three-vrm 3.5 counts a channel of the weights of a mesh as one track, three.js
    makes one for each of its materials.
    """
    nodes: list[dict[str, Any]] = root.setdefault("nodes", [])
    shown: list[int] = root["scenes"][scene].setdefault("nodes", [])

    def add(name: str, parent: int | None, **more: Any) -> int:
        nodes.append({"name": name} | more)
        if parent is None:
            shown.append(len(nodes) - 1)
        else:
            nodes[parent].setdefault("children", []).append(len(nodes) - 1)
        return len(nodes) - 1

    top = add(ROOT, None)
    bones: dict[str, int] = {}
    for bone, (parent, place) in SKELETON.items():
        bones[bone] = add(f"{ROOT}_{bone}", bones.get(parent, top), translation=list(place))
    tracks: list[Track] = [(bones[bone], "rotation", turns) for bone, turns in motion.bones.items()]
    stated: dict[str, Any] = {
        "specVersion": SPEC_VERSION,
        "humanoid": {"humanBones": {bone: {"node": node} for bone, node in bones.items()}},
    }
    groups: dict[str, dict[str, Any]] = {"preset": {}, "custom": {}}
    for name, weights in motion.expressions.items():
        node = add(f"{ROOT}_{name}", top)
        groups["preset" if name in PRESETS else "custom"][name] = {"node": node}
        tracks.append((node, "translation", np.clip(weights, 0.0, 1.0)[:, None] * [[1.0, 0.0, 0.0]]))
    stated["expressions"] = {group: named for group, named in groups.items() if named}
    if motion.gaze is not None:
        node = add(f"{ROOT}_gaze", top)
        stated["lookAt"] = {"node": node, "offsetFromHeadBone": [0.0, 0.0, 0.0]}
        tracks.append((node, "rotation", motion.gaze))
    root["extensionsUsed"] = [*root.get("extensionsUsed", []), EXTENSION]
    root.setdefault("extensions", {})[EXTENSION] = stated
    return tracks
