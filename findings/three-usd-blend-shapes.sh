#!/usr/bin/env bash
# three 0.187 (npm): USDLoader reads meshes and skins of UsdSkel, but no blend shapes, without a word: the mesh has no
# morph attributes, and no track moves weights.
# Fails (exit code 1) if the package behaves otherwise. Needs Node.js 20, npm and a package index; loads 40 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

npm install --silent --no-audit --no-fund three@0.187 > /dev/null

cat > shape.usda << 'USD'
#usda 1.0
(
    defaultPrim = "Root"
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
            float[] blendShapeWeights.timeSamples = { 0: [0], 24: [1] }
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
        }
    }
}
USD

cat > look.mjs << 'JAVASCRIPT'
import fs from 'fs';
import { REVISION } from 'three';
import { USDLoader } from 'three/examples/jsm/loaders/USDLoader.js';

const scene = new USDLoader().parse(fs.readFileSync('shape.usda', 'utf8'));
const meshes = [];
scene.traverse((one) => one.isMesh && meshes.push(one));
const [mesh] = meshes;
const shapes = Object.keys(mesh.geometry.morphAttributes).length;
const tracks = scene.animations.flatMap((one) => one.tracks.map((track) => track.name));
console.log(`three ${REVISION}: ${mesh.type}, morph attributes: ${shapes}, tracks of shapes: ${tracks.filter((name) => name.includes('morph')).length}`);
const described = mesh.isSkinnedMesh && shapes === 0 && !tracks.some((name) => name.includes('morph'));
console.log(described ? 'as described' : 'changed');
process.exit(described ? 0 : 1);
JAVASCRIPT
node look.mjs
