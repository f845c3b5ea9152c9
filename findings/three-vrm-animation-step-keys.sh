#!/usr/bin/env bash
# @pixiv/three-vrm-animation 3.5.5 with three.js 0.185.1: keys of an expression whose sampler has the interpolation
# STEP are played as LINEAR: a blink that holds 0 until 1 s and then is 1 closes slowly over the whole second. Of
# CUBICSPLINE it takes the tangents for values, two for each key: the weight goes to 0 instead of 0.5 at half of the
# time. The track that three.js itself makes of the same node is right. All three files are free of errors for
# gltf-validator.
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
const zero = [0, 0, 0], one = [1, 0, 0];
const columns = [
  [0, 1], // times
  [...zero, ...one], // x is the weight
  [...zero, ...zero, ...zero, ...zero, ...one, ...zero], // each key between its tangents
];
const binary = new Float32Array(columns.flat());
const base64 = Buffer.from(binary.buffer).toString('base64');
let at = 0;
const bufferViews = columns.map((values) => {
  const view = { buffer: 0, byteOffset: at, byteLength: 4 * values.length };
  at += view.byteLength;
  return view;
});
const accessors = [
  { bufferView: 0, componentType: 5126, count: 2, type: 'SCALAR', min: [0], max: [1] },
  { bufferView: 1, componentType: 5126, count: 2, type: 'VEC3' },
  { bufferView: 2, componentType: 5126, count: 6, type: 'VEC3' },
];

async function play(interpolation) {
  const output = interpolation === 'CUBICSPLINE' ? 2 : 1;
  const text = JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ name: 'blink' }],
    extensionsUsed: ['VRMC_vrm_animation'], bufferViews, accessors,
    buffers: [{ byteLength: at, uri: `data:application/octet-stream;base64,${base64}` }],
    animations: [{
      samplers: [{ input: 0, output, interpolation }],
      channels: [{ sampler: 0, target: { node: 0, path: 'translation' } }],
    }],
    extensions: { VRMC_vrm_animation: { specVersion: '1.0', expressions: { preset: { blink: { node: 0 } } } } },
  });
  const { issues } = await validator.validateString(text);
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
  const { animations, userData } = await loader.parseAsync(text, '');
  const values = (track) => [0.25, 0.5, 0.75].map((time) => track.createInterpolant().evaluate(time)[0]);
  const node = values(animations[0].tracks[0]);
  const weight = values(userData.vrmAnimations[0].expressionTracks.preset.get('blink'));
  console.log(`${interpolation}: errors ${issues.numErrors}, at .25, .5, .75 s: node ${node}, weight ${weight}`);
  return `${issues.numErrors} ${node} ${weight}`;
}

console.warn = () => {}; // of hips, which the file does not need
console.log(`three ${THREE.REVISION}`);
const found = [await play('LINEAR'), await play('STEP'), await play('CUBICSPLINE')].join('; ');
if (found !== '0 0.25,0.5,0.75 0.25,0.5,0.75; 0 0,0,0 0.25,0.5,0.75; 0 0.15625,0.5,0.84375 0,0,0') {
  console.log('changed');
  process.exit(1);
}
console.log('as described');
JAVASCRIPT
node look.mjs
