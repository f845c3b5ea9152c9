#!/usr/bin/env bash
# bpy 5.0.1 (Blender): a new scene has 24 frames a second, and the importer of USD takes timeCodesPerSecond and
# framesPerSecond neither into the scene nor into the keys: 90 codes at 30 a second, which are 3 s, play for 3.75 s. It
# has no option for it (`set_frame_range` sets the range alone). The importer of BVH does the same unless
# `update_scene_fps` or `use_fps_scale` is given.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 374 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: bpy==5.0.1

cat > "$work/moved.usda" << 'USD'
#usda 1.0
(
    startTimeCode = 0
    endTimeCode = 90
    timeCodesPerSecond = 30
    framesPerSecond = 30
    upAxis = "Y"
)
def Cube "Box"
{
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 90: (9, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
USD
{
    printf 'HIERARCHY\nROOT Box\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n'
    printf 'MOTION\nFrames: 91\nFrame Time: 0.0333333333\n'
    for frame in $(seq 0 90); do printf '%s 0 0\n' "$frame"; done
} > "$work/moved.bvh"

cat > "$work/look.py" << 'PYTHON'
import sys

import bpy


def seconds(name, load):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    load()
    scene, render = bpy.context.scene, bpy.context.scene.render
    rate = render.fps / render.fps_base
    ranges = [action.frame_range for action in bpy.data.actions]
    if ranges:
        frames = max(last - first for first, last in ranges)
    else:  # a cache that is read at each frame
        box = next(one for one in bpy.data.objects if one.name.startswith("Box"))
        places = []
        for frame in range(200):
            scene.frame_set(frame)
            places.append(box.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation.length)
        frames = places.index(max(places))
    print(f"{name}: scene at {rate:g} frames a second, {frames:g} frames, {frames / rate:.2f} s")
    return round(frames / rate, 2)


folder = sys.argv[-1]
print("bpy", bpy.app.version_string)
usd = seconds("usd", lambda: bpy.ops.wm.usd_import(filepath=f"{folder}/moved.usda"))
bvh = seconds("bvh", lambda: bpy.ops.import_anim.bvh(filepath=f"{folder}/moved.bvh"))
told = seconds("bvh, update_scene_fps", lambda: bpy.ops.import_anim.bvh(filepath=f"{folder}/moved.bvh", update_scene_fps=True))
named = {one.identifier for one in bpy.ops.wm.usd_import.get_rna_type().properties}
print("options of the importer of USD about rates:", sorted(one for one in named if "fps" in one or "rate" in one.split("_")))
if (usd, bvh, told) != (3.75, 3.75, 3.0):
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py" -- "$work" | grep -v '^\(USD import\|import\|\s\|$\)'
