#!/usr/bin/env bash
# bpy 5.0.1 (Blender): the exporter of FBX writes the animation of shape keys only where some object has an action, and
# cuts it to the frames of that object's action. Keys from 0 to 40 of a mesh without an action, alone: no animation is
# written; beside an object with an action of 0 to 10: the shapes move for 10 frames; of 0 to 40: for all 40.
# `bake_anim_use_all_actions` is on, as by default.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 374 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: bpy==5.0.1

cat > "$work/look.py" << 'PYTHON'
import sys

import bpy

LAST = 40


def frames_read(path, object_frames):
    """Frames of the animation of a shape key after a round trip; 0 for none."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="up")
    key.data[0].co.z += 1
    for frame in (0, LAST):
        key.value = frame / LAST
        key.keyframe_insert("value", frame=frame)
    if object_frames:
        other = bpy.data.objects.new("other", None)
        bpy.context.scene.collection.objects.link(other)
        for frame in (0, object_frames):
            other.location.x = frame
            other.keyframe_insert("location", frame=frame)
    bpy.ops.export_scene.fbx(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.fbx_import(filepath=path)
    animated = [keys.animation_data for keys in bpy.data.shape_keys if keys.animation_data]
    actions = [one.action for one in animated if one.action]
    return round(max((end - start for start, end in (one.frame_range for one in actions)), default=0))


print("bpy", bpy.app.version_string)
found = {n: frames_read(f"{sys.argv[-1]}/{n}.fbx", n) for n in (0, 10, LAST)}
for n, frames in found.items():
    print(f"an object with {n} frames: {frames} frames of the shape's {LAST}")
if found != {0: 0, 10: 10, LAST: LAST}:
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py" -- "$work" | grep -v '^\(FBX\|export\|import\|(bpy\|\s\|$\)'
