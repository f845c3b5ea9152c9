// Reading a binary glTF of tts2face/interchange/exports/stage_glb.py: accessors, sparse targets, textures.

import { THREE } from "nicegui-scene";

const ARRAYS = { 5120: Int8Array, 5121: Uint8Array, 5122: Int16Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
const FULL_SHORT = 32767;

/** JSON and binary part of a .glb file. */
export function readContainer(bytes) {
  const view = new DataView(bytes);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error("the face is not a .glb file");
  const size = view.getUint32(12, true);
  return { json: JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 20, size))), bytes, start: 28 + size };
}

function readView({ json, bytes, start }, index, type, count, offset = 0) {
  const view = json.bufferViews[index];
  const at = start + (view.byteOffset ?? 0) + offset;
  return new type(bytes.slice(at, at + count * type.BYTES_PER_ELEMENT));
}

export function readAccessor(file, index) {
  const accessor = file.json.accessors[index];
  const width = WIDTHS[accessor.type];
  const array = readView(file, accessor.bufferView, ARRAYS[accessor.componentType], accessor.count * width);
  return { array, width, normalized: accessor.normalized === true };
}

/** Moved vertices of a target, and their displacements in metres at weight 1. */
export function readTarget(file, index) {
  const sparse = file.json.accessors[index].sparse;
  if (!sparse) return { at: new Uint32Array(0), moves: new Float32Array(0) };
  const at = readView(file, sparse.indices.bufferView, ARRAYS[sparse.indices.componentType], sparse.count);
  const steps = readView(file, sparse.values.bufferView, Int16Array, sparse.count * 3);
  return { at, moves: Float32Array.from(steps, (step) => step / FULL_SHORT) };
}

export async function readTextures(file) {
  const images = file.json.images ?? [];
  return Promise.all(
    images.map(async (image) => {
      const view = file.json.bufferViews[image.bufferView];
      const blob = new Blob([readView(file, image.bufferView, Uint8Array, view.byteLength)], { type: image.mimeType });
      const options = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
      const texture = new THREE.Texture(await createImageBitmap(blob, options));
      Object.assign(texture, { flipY: false, minFilter: THREE.LinearMipmapNearestFilter });
      texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
      texture.needsUpdate = true;
      return texture;
    }),
  );
}

/** Primitives that are drawn alike as one: fewer draws, each of which costs time on a processor. */
export function mergePrimitives(file, mesh) {
  const groups = new Map();
  for (const primitive of mesh.primitives) {
    const { extras, pbrMetallicRoughness, name } = file.json.materials[primitive.material];
    const texture = pbrMetallicRoughness.baseColorTexture?.index ?? -1;
    const key = JSON.stringify([texture, extras.kind, extras.open, extras.cutout, extras.opacity, extras.second, extras.unlit, extras.behind, name === "hair"]);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(primitive);
  }
  return [...groups.values()].map((primitives) => mergeGroup(file, mesh, primitives));
}

function mergeGroup(file, mesh, primitives) {
  const materials = primitives.map((one) => file.json.materials[one.material]);
  const counts = primitives.map((one) => file.json.accessors[one.attributes.POSITION].count);
  const starts = counts.map((_, i) => counts.slice(0, i).reduce((sum, n) => sum + n, 0));
  const attributes = {};
  for (const name of Object.keys(primitives[0].attributes)) {
    const read = primitives.map((one) => readAccessor(file, one.attributes[name]));
    attributes[name] = { ...read[0], array: joined(read.map((one) => one.array)) };
  }
  const triangles = joined(primitives.map((one, i) => Uint32Array.from(readAccessor(file, one.indices).array, (v) => v + starts[i])));
  const targets = mesh.extras.targetNames.map((_, k) => {
    const read = primitives.map((one) => readTarget(file, one.targets[k].POSITION));
    const at = joined(read.map((one, i) => Uint32Array.from(one.at, (v) => v + starts[i])));
    return { at, moves: joined(read.map((one) => one.moves)) };
  });
  const surface = joined(
    materials.map(({ extras }, i) => {
      const values = new Float32Array(3 * counts[i]);
      for (let v = 0; v < counts[i]; v++) values.set([extras.gloss, extras.rough, extras.wrap], 3 * v);
      return values;
    }),
  );
  return { material: materials[0], attributes, triangles, targets, surface };
}

function joined(arrays) {
  if (arrays.length === 1) return arrays[0];
  const whole = new arrays[0].constructor(arrays.reduce((sum, one) => sum + one.length, 0));
  let at = 0;
  for (const one of arrays) {
    whole.set(one, at);
    at += one.length;
  }
  return whole;
}
