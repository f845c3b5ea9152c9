#!/usr/bin/env bash
# pygltflib 1.16.5: accessors without `bufferView`, whose values are zeros (glTF 2.0, 3.6.2.2), and sparse accessors over
# zeros get `"byteOffset": 0` when a file is loaded and saved. `byteOffset` must not be there without `bufferView`
# (5.1.2), so that the copy of a valid file has an error of gltf-validator for each of them. With a view of zeros they
# are valid.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11, pip, Node 20, npm and package indexes.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv environment
environment/bin/pip install --quiet pygltflib==1.16.5
npm init --yes > /dev/null
npm install --silent --no-audit --no-fund gltf-validator@2.0.0-dev.3.10

cat > make.py << 'PYTHON'
import base64
import struct

import pygltflib

floats = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + bytes(36)
content = floats + struct.pack("<H2x", 1) + struct.pack("<3f", 0, 0, 0.5)
uri = "data:application/octet-stream;base64," + base64.b64encode(content).decode()
bounds = '"min": [0, 0, 0], "max": [0, 0, 0.5]'
views = [(0, 36, ""), (36, 36, ', "byteStride": 12, "target": 34962'), (72, 2, ""), (76, 12, "")]
sparse = '"sparse": {"count": 1, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 3}}'
for name, base in (("without", ""), ("with", '"bufferView": 1,')):
    moved = f'{{{base} "componentType": 5126, "type": "VEC3", "count": 3, {bounds}, {sparse}}}'
    still = f'{{{base} "componentType": 5126, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [0, 0, 0]}}'
    text = f"""{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
    "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "targets": [{{"POSITION": 1}}, {{"POSITION": 2}}]}}]}}],
    "buffers": [{{"byteLength": {len(content)}, "uri": "{uri}"}}],
    "bufferViews": [{", ".join(f'{{"buffer": 0, "byteOffset": {at}, "byteLength": {n}{more}}}' for at, n, more in views)}],
    "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [1, 1, 0]}},
    {moved}, {still}]}}"""
    with open(f"{name}.gltf", "w") as file:
        file.write(text)
    pygltflib.GLTF2().load(f"{name}.gltf").save(f"{name}-copy.gltf")
PYTHON
environment/bin/python make.py

cat > look.js << 'JAVASCRIPT'
const validator = require('gltf-validator'), fs = require('fs');
(async () => {
  const found = {};
  for (const name of ['without', 'without-copy', 'with', 'with-copy']) {
    const { issues } = await validator.validateString(fs.readFileSync(`${name}.gltf`, 'utf8'));
    const errors = issues.messages.filter((message) => message.severity === 0);
    found[name] = errors.length;
    console.log(`${name}: ${errors.length} errors`, errors.map(({ code, pointer }) => `${code} ${pointer}`).join(', '));
  }
  if (JSON.stringify(found) !== '{"without":0,"without-copy":2,"with":0,"with-copy":0}') {
    console.log('changed');
    process.exit(1);
  }
  console.log('as described');
})();
JAVASCRIPT
environment/bin/pip list 2> /dev/null | grep pygltflib
node look.js
