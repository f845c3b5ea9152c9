#!/usr/bin/env bash
# bpy 5.0.1 (Blender): the importer of USD leaves the inbetweens of blend shapes out, without a word. A point that moves
# by 5 at weight .5 and by 2 at weight 1 (UsdSkel interpolates between inbetweens) moves by 1 at weight .5.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 374 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: bpy==5.0.1 usd-core==26.11

cat > "$work/shape.usda" << 'USD'
#usda 1.0
(
    defaultPrim = "Root"
    metersPerUnit = 1
    upAxis = "Z"
)
def SkelRoot "Root"
{
    def Skeleton "Skeleton" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        uniform token[] joints = ["joint"]
        uniform matrix4d[] bindTransforms = [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))]
        uniform matrix4d[] restTransforms = [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))]
        rel skel:animationSource = </Root/Skeleton/Animation>
        def SkelAnimation "Animation"
        {
            uniform token[] blendShapes = ["up"]
            float[] blendShapeWeights.timeSamples = { 0: [0], 1: [0.5], 2: [1] }
        }
    }
    def Mesh "Mesh" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        rel skel:skeleton = </Root/Skeleton>
        int[] primvars:skel:jointIndices = [0, 0, 0] (
            elementSize = 1
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [1, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        uniform token[] skel:blendShapes = ["up"]
        rel skel:blendShapeTargets = </Root/Mesh/up>
        def BlendShape "up"
        {
            uniform vector3f[] offsets = [(0, 0, 2), (0, 0, 0), (0, 0, 0)]
            uniform vector3f[] inbetweens:half = [(0, 0, 5), (0, 0, 0), (0, 0, 0)] (
                weight = 0.5
            )
        }
    }
}
USD

cat > "$work/baked.py" << 'PYTHON'
import sys

from pxr import Usd, UsdSkel

stage = Usd.Stage.Open(sys.argv[1])
UsdSkel.BakeSkinning(UsdSkel.Root.Get(stage, "/Root"))
points = stage.GetPrimAtPath("/Root/Mesh").GetAttribute("points")
places = [round(points.Get(time)[0][2], 3) for time in (0, 1, 2)]
print("usd-core, height at weights 0, .5, 1:", places)
sys.exit(places != [0, 5, 2])
PYTHON
cat > "$work/look.py" << 'PYTHON'
import sys

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.usd_import(filepath=sys.argv[-1])
mesh = next(one for one in bpy.data.objects if one.type == "MESH")
print("bpy", bpy.app.version_string, "shape keys:", [key.name for key in mesh.data.shape_keys.key_blocks])
places = []
for frame in (0, 1, 2):
    bpy.context.scene.frame_set(frame)
    shown = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    places.append(round((shown.matrix_world @ shown.data.vertices[0].co).z, 3))
print("Blender, height at weights 0, .5, 1:", places)
if places != [0, 1, 2] or len(mesh.data.shape_keys.key_blocks) != 2:
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/baked.py" "$work/shape.usda"
"$work/environment/bin/python" "$work/look.py" -- "$work/shape.usda" | grep -v '^\(USD import\|import\|\s\|$\)'
