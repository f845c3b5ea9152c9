"""VRM files made of the shipped head: expressions over its shapes, a humanoid with all bones that runtimes require."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.interchange.characters.made import EYES, Variant, glb, split_glb, write_character_file

# Weights of the head's shapes in each expression; names are those of VRM 1.
EXPRESSIONS: Mapping[str, Mapping[str, float]] = {
    "aa": {"jawOpen": 1.0},
    "ih": {"mouthSmileLeft": 0.5, "mouthSmileRight": 0.5},
    "ou": {"mouthPucker": 1.0},
    "ee": {"mouthStretchLeft": 1.0, "mouthStretchRight": 1.0},
    "oh": {"mouthFunnel": 1.0},
    "blink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
    "blinkLeft": {"eyeBlinkLeft": 1.0},
    "blinkRight": {"eyeBlinkRight": 1.0},
    "happy": {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
    "lookUp": {"eyeLookUpLeft": 1.0, "eyeLookUpRight": 1.0},
}
CUSTOM = {"brows": {"browInnerUp": 1.0}}
VRM0 = {
    "aa": "a", "ih": "i", "ou": "u", "ee": "e", "oh": "o", "blinkLeft": "blink_l", "blinkRight": "blink_r",
    "happy": "joy", "lookUp": "lookup",
}  # fmt: skip
BONES = {"hips": "Hips", "neck": "Neck", "head": "Head", "leftEye": EYES[0], "rightEye": EYES[1]}
LIMBS = ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")  # of each side; runtimes refuse less
TURN_DEG = {0: 180.0, 1: 0.0}  # VRM 0 looks along -z


def write_vrm(path: Path, version: int) -> Path:
    """Write the shipped head as a VRM of a version, 0 or 1."""
    write_character_file(path, Variant(is_skinned=True, turn_deg=TURN_DEG[version]))
    root, binary = split_glb(path.read_bytes())
    nodes: list[dict[str, Any]] = root["nodes"]
    numbers = {node["name"].removeprefix("mixamorig:"): number for number, node in enumerate(nodes)}
    bones = {bone: numbers[name] for bone, name in BONES.items()}
    limbs = ["spine", *(f"{side}{limb}" for side in ("left", "right") for limb in LIMBS)]
    for name in limbs:
        nodes.append({"name": name})
        bones[name] = len(nodes) - 1
    nodes[bones["hips"]].setdefault("children", []).extend(bones[name] for name in limbs)
    mesh = next(number for number, node in enumerate(nodes) if node["name"] == "FaceMesh")
    names = list(root["meshes"][nodes[mesh]["mesh"]]["extras"]["targetNames"])
    made = (_vrm1 if version else _vrm0)(bones, mesh, nodes[mesh]["mesh"], names)
    root |= {"extensions": made, "extensionsUsed": list(made)}
    path.write_bytes(glb(root, binary))
    return path


def _vrm1(bones: Mapping[str, int], node: int, _: int, names: list[str]) -> dict[str, Any]:
    def bound(weights: Mapping[str, float]) -> dict[str, Any]:
        binds = [{"node": node, "index": names.index(name), "weight": weight} for name, weight in weights.items()]
        return {"morphTargetBinds": binds}

    preset = {name: bound(weights) for name, weights in EXPRESSIONS.items()}
    custom = {name: bound(weights) for name, weights in CUSTOM.items()}
    span = {"inputMaxValue": 90.0, "outputScale": 90.0}
    kinds = ("rangeMapHorizontalInner", "rangeMapHorizontalOuter", "rangeMapVerticalDown", "rangeMapVerticalUp")
    return {
        "VRMC_vrm": {
            "specVersion": "1.0",
            "meta": {"name": "made", "authors": ["a test"], "licenseUrl": "https://vrm.dev/licenses/1.0/"},
            "humanoid": {"humanBones": {bone: {"node": number} for bone, number in bones.items()}},
            "expressions": {"preset": preset, "custom": custom},
            "lookAt": {"offsetFromHeadBone": [0, 0, 0], "type": "bone", **dict.fromkeys(kinds, span)},
        }
    }


def _vrm0(bones: Mapping[str, int], _: int, mesh: int, names: list[str]) -> dict[str, Any]:
    def bound(name: str, preset: str, weights: Mapping[str, float]) -> dict[str, Any]:
        binds = [{"mesh": mesh, "index": names.index(shape), "weight": 100 * weights[shape]} for shape in weights]
        return {"name": name, "presetName": preset, "binds": binds, "materialValues": []}

    groups = [bound(name, VRM0.get(name, name), weights) for name, weights in EXPRESSIONS.items()]
    groups += [bound(name, "unknown", weights) for name, weights in CUSTOM.items()]
    span = {"curve": [0, 0, 0, 1, 1, 1, 1, 0], "xRange": 90, "yRange": 90}
    kinds = ("lookAtHorizontalInner", "lookAtHorizontalOuter", "lookAtVerticalDown", "lookAtVerticalUp")
    return {
        "VRM": {
            "exporterVersion": "made", "specVersion": "0.0", "meta": {"title": "made", "author": "a test"},
            "humanoid": {"humanBones": [{"bone": bone, "node": number} for bone, number in bones.items()]},
            "blendShapeMaster": {"blendShapeGroups": groups},
            "firstPerson": {"lookAtTypeName": "Bone", **dict.fromkeys(kinds, span)},
            "materialProperties": [],
        }
    }  # fmt: skip
