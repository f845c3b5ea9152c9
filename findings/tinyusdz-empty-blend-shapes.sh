#!/usr/bin/env bash
# tinyusdz 0.9.4: a mesh of UsdSkel with an empty list of blend shapes (`skel:blendShapes = []` and a relationship
# without targets, which usd-core writes and reads) makes the conversion to a render scene refuse the whole file.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 30 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: tinyusdz==0.9.4 usd-core==26.11 numpy

cat > "$work/look.py" << 'PYTHON'
import sys

import tinyusdz
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt


def write(path, with_list):
    stage = Usd.Stage.CreateNew(path)
    stage.SetDefaultPrim(UsdSkel.Root.Define(stage, "/Root").GetPrim())
    skeleton = UsdSkel.Skeleton.Define(stage, "/Root/Skeleton")
    skeleton.CreateJointsAttr(["joint"])
    still = Vt.Matrix4dArray([Gf.Matrix4d(1)])
    skeleton.CreateBindTransformsAttr(still)
    skeleton.CreateRestTransformsAttr(still)
    mesh = UsdGeom.Mesh.Define(stage, "/Root/Mesh")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([Sdf.Path("/Root/Skeleton")])
    binding.CreateJointIndicesPrimvar(False, 1).Set([0, 0, 0])
    binding.CreateJointWeightsPrimvar(False, 1).Set([1.0, 1.0, 1.0])
    if with_list:
        binding.CreateBlendShapesAttr([])
        binding.CreateBlendShapeTargetsRel().SetTargets([])
    stage.Save()


def meshes(path):
    """Number of meshes of the render scene; None if the file is refused."""
    try:
        return len(tinyusdz.tydra.convert_to_render_scene(tinyusdz.load(path)).meshes())
    except tinyusdz.UsdError as error:
        print("refused:", next(line for line in str(error).splitlines() if "blendShapeTargets" in line)[-80:])
        return None


found = {}
for with_list in (False, True):
    path = f"{sys.argv[1]}/{with_list}.usda"
    write(path, with_list)
    found[with_list] = meshes(path)
    print("with an empty list:" if with_list else "without a list:", found[with_list], "meshes")
if found != {False: 1, True: None}:
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py" "$work"
