#!/usr/bin/env bash
# @pixiv/three-vrm-animation 3.5.5: it takes the track of a channel by the channel's number, while three.js 0.185.1 makes
# one track for each primitive of an animated mesh. In a file in which a channel of weights of a mesh with two primitives
# stands before the channels of expressions, each expression gets the values of the channel before it: here `aa`, which
# goes to 1, gets weights of the mesh, and its weight is read from every third of them. With that channel last, it is
# right. The order of channels has no meaning in glTF 2.0 (3.11).
# Fails (exit code 1) if the packages behave otherwise. Needs Node 20, npm and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init --yes > /dev/null
npm install --silent --no-audit --no-fund three@0.185.1 @pixiv/three-vrm-animation@3.5.5 gltf-validator@2.0.0-dev.3.10

cat > look.mjs << 'JAVASCRIPT'
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { VRMAnimationLoaderPlugin } from '@pixiv/three-vrm-animation';
import validator from 'gltf-validator';

globalThis.self = globalThis;
globalThis.ProgressEvent = Event; // a browser has it
const numbers = [
  [0, 0, 0, 1, 0, 0, 0, 1, 0], // three places
  [0, 0, .1, 0, 0, .1, 0, 0, .1], // their displacements
  [0, 1, 2], // times
  [.25, .25, .25], // weights of the mesh
  [0, 0, 0, .5, 0, 0, 1, 0, 0], // x is the weight of `aa`
];
const widths = [3, 3, 1, 1, 3];
const binary = new Float32Array(numbers.flat());
let at = 0;
const bufferViews = numbers.map((values) => {
  const view = { buffer: 0, byteOffset: at, byteLength: 4 * values.length };
  at += view.byteLength;
  return view;
});
const accessors = numbers.map((values, bufferView) => {
  const width = widths[bufferView], accessor = { bufferView, componentType: 5126, count: values.length / width };
  const column = (n) => values.filter((_, i) => i % width === n);
  const bounds = bufferView < 3 && {
    min: [...Array(width).keys()].map((n) => Math.fround(Math.min(...column(n)))),
    max: [...Array(width).keys()].map((n) => Math.fround(Math.max(...column(n)))),
  };
  return { ...accessor, type: width === 3 ? 'VEC3' : 'SCALAR', ...bounds };
});
const primitive = { attributes: { POSITION: 0 }, targets: [{ POSITION: 1 }] };

function file(order) {
  const channels = [
    { sampler: 0, target: { node: 0, path: 'weights' } },
    { sampler: 1, target: { node: 1, path: 'translation' } },
  ];
  return {
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0, 1] }], extensionsUsed: ['VRMC_vrm_animation'],
    nodes: [{ name: 'mesh', mesh: 0 }, { name: 'aa' }], meshes: [{ primitives: [primitive, primitive], weights: [0] }],
    buffers: [{ byteLength: at, uri: `data:application/octet-stream;base64,${Buffer.from(binary.buffer).toString('base64')}` }],
    bufferViews, accessors,
    animations: [{ samplers: [{ input: 2, output: 3 }, { input: 2, output: 4 }], channels: order.map((n) => channels[n]) }],
    extensions: { VRMC_vrm_animation: { specVersion: '1.0', expressions: { preset: { aa: { node: 1 } } } } },
  };
}

async function weights(order) {
  const text = JSON.stringify(file(order));
  const { issues } = await validator.validateString(text);
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
  const { userData } = await loader.parseAsync(text, '');
  const track = userData.vrmAnimations[0].expressionTracks.preset.get('aa');
  console.log(`channels ${order}: errors ${issues.numErrors}, weights of aa ${[...track.values]}`);
  return `${issues.numErrors} ${[...track.values]}`;
}

console.warn = () => {}; // of hips, which the file does not need
console.log(`three ${THREE.REVISION}`);
const first = await weights([0, 1]), last = await weights([1, 0]);
if (last !== '0 0,0.5,1' || first === last || !first.startsWith('0 ')) {
  console.log('changed');
  process.exit(1);
}
console.log('as described');
JAVASCRIPT
node look.mjs
