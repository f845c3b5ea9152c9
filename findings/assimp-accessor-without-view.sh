#!/usr/bin/env bash
# assimpjs 0.0.10 (Assimp): a morph target whose accessor has neither `bufferView` nor `sparse`, which are zeros by glTF
# 2.0 (3.6.2.2), makes it refuse the whole file ("import_error"), which gltf-validator finds free of errors. The same file
# with a view of zeros is read.
# Fails (exit code 1) if the package behaves otherwise. Needs Node 20, npm and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init --yes > /dev/null
npm install --silent --no-audit --no-fund assimpjs@0.0.10 gltf-validator@2.0.0-dev.3.10

cat > look.js << 'JAVASCRIPT'
const validator = require('gltf-validator'), assimpjs = require('assimpjs');
const places = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, ...Array(9).fill(0)]);
const uri = `data:application/octet-stream;base64,${Buffer.from(places.buffer).toString('base64')}`;

function file(view) {
  const still = { ...view, componentType: 5126, type: 'VEC3', count: 3, min: [0, 0, 0], max: [0, 0, 0] };
  const place = { bufferView: 0, componentType: 5126, type: 'VEC3', count: 3, min: [0, 0, 0], max: [1, 1, 0] };
  return JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, targets: [{ POSITION: 1 }] }] }],
    buffers: [{ byteLength: 72, uri }],
    bufferViews: [36, 36].map((byteLength, n) => ({ buffer: 0, byteOffset: 36 * n, byteLength, target: 34962 })),
    accessors: [place, still],
  });
}

(async () => {
  const assimp = await assimpjs(), found = [];
  for (const [name, view] of [['without view', {}], ['with view', { bufferView: 1 }]]) {
    const text = file(view), { issues } = await validator.validateString(text), files = new assimp.FileList();
    files.AddFile('a.gltf', new TextEncoder().encode(text));
    const read = assimp.ConvertFileList(files, 'assjson');
    console.log(`${name}: errors ${issues.numErrors}, ${read.IsSuccess() ? 'read' : read.GetErrorCode()}`);
    found.push(`${issues.numErrors} ${read.IsSuccess()}`);
  }
  if (found.join() !== '0 false,0 true') {
    console.log('changed');
    process.exit(1);
  }
  console.log('as described');
})();
JAVASCRIPT
echo "assimpjs $(node -p "require('assimpjs/package.json').version")"
node look.js
