#!/usr/bin/env bash
# tinyusdz 0.9.4: a UsdPreviewSurface whose diffuseColor is read from the vertices (UsdPrimvarReader_float3 of
# displayColor, which the specification allows) makes the conversion to a render scene refuse the whole file; a constant
# colour is read.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip and a package index; loads 30 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3.11 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: tinyusdz==0.9.4 usd-core==26.11 numpy

cat > "$work/look.py" << 'PYTHON'
import sys

import tinyusdz
from pxr import Sdf, Usd, UsdGeom, UsdShade


def write(path, from_vertices):
    types = Sdf.ValueTypeNames
    stage = Usd.Stage.CreateNew(path)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Root").GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, "/Root/Mesh")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex).Set([(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    material = UsdShade.Material.Define(stage, "/Root/Material")
    surface = UsdShade.Shader.Define(stage, "/Root/Material/Surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    colour = surface.CreateInput("diffuseColor", types.Color3f)
    if from_vertices:
        reader = UsdShade.Shader.Define(stage, "/Root/Material/Reader")
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", types.String).Set("displayColor")
        colour.ConnectToSource(reader.CreateOutput("result", types.Float3))
    else:
        colour.Set((0.5, 0.5, 0.5))
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", types.Token))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.Save()


def materials(path):
    """Number of materials of the render scene; None if the file is refused."""
    try:
        return len(tinyusdz.tydra.convert_to_render_scene(tinyusdz.load(path)).materials())
    except tinyusdz.UsdError as error:
        print("refused:", next(line for line in str(error).splitlines() if "outputs:result" in line)[-150:])
        return None


found = {}
for from_vertices in (False, True):
    path = f"{sys.argv[1]}/{from_vertices}.usda"
    write(path, from_vertices)
    found[from_vertices] = materials(path)
    print("colours of vertices:" if from_vertices else "a constant colour:", found[from_vertices], "materials")
if found != {False: 1, True: None}:
    sys.exit("changed")
print("as described")
PYTHON
"$work/environment/bin/python" "$work/look.py" "$work"
