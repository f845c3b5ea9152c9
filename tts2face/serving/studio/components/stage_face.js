// A face from its binary glTF, and its shape at an instant. Shapes are sums of few moved vertices on the processor:
// a weight that does not change costs nothing, while a morph texture costs all targets at all vertices.

import { THREE } from "nicegui-scene";
import { mergePrimitives, readContainer, readTextures } from "./stage_glb.js";

const LEAST_CHANGE_M = 2e-5; // of the farthest vertex of a shape: a twentieth of a pixel
const N_FIELDS = 5, N_GAIN = 10; // attributes of four numbers each of a light field; first number of its change
const FIELD_UNIT = 2 / 127;
const REFRESH_FRAMES = 600; // sums are made anew so often, against rounding errors that add up

/** Index of the first vertex at the same place that moves alike, for each vertex, so that seams do not show. */
function weldVertices(places, targets) {
  const n = places.length / 3, mark = new Float64Array(n), first = new Map(), weld = new Uint32Array(n);
  targets.forEach(({ at, moves }, k) => {
    const share = Math.cos(k + 1);
    for (let i = 0; i < at.length; i++) mark[at[i]] += share * (moves[3 * i] + 2 * moves[3 * i + 1] + 3 * moves[3 * i + 2]);
  });
  const step = (value) => Math.round(value * 1e6);
  for (let v = 0; v < n; v++) {
    const key = `${step(places[3 * v])},${step(places[3 * v + 1])},${step(places[3 * v + 2])},${Math.round(mark[v] * 1e4)}`;
    if (!first.has(key)) first.set(key, v);
    weld[v] = first.get(key);
  }
  return weld;
}

const corner = (values, v) => [values[3 * v], values[3 * v + 1], values[3 * v + 2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** A part of the surface: places and normals at rest, and how each channel changes them (first order). */
class Part {
  constructor(places, triangles, targets, scales) {
    this.places = places;
    this.triangles = triangles;
    const n = places.length / 3;
    this.weld = weldVertices(places, targets);
    this.members = Array.from({ length: n }, () => []);
    for (let v = 0; v < n; v++) this.members[this.weld[v]].push(v);
    this.#findTriangles(n);
    const normals = this.#restNormals(n);
    this.rest = new Float32Array(6 * n);
    for (let v = 0; v < n; v++) {
      this.rest.set(places.subarray(3 * v, 3 * v + 3), 6 * v);
      for (let c = 0; c < 3; c++) this.rest[6 * v + 3 + c] = normals[3 * this.weld[v] + c] / this.lengths[this.weld[v]];
    }
    this.shapes = targets.map((target, k) => this.#shape(target, scales[k]));
    this.posed = Float32Array.from(this.rest);
    this.buffer = new THREE.InterleavedBuffer(this.posed, 6);
    this.buffer.setUsage(THREE.DynamicDrawUsage);
  }

  #findTriangles(n) {
    this.around = Array.from({ length: n }, () => []);
    for (let t = 0; t < this.triangles.length; t++) this.around[this.weld[this.triangles[t]]].push(Math.floor(t / 3));
  }

  #restNormals(n) {
    const normals = new Float64Array(3 * n), { places, triangles, weld } = this;
    this.sides = new Float32Array(2 * triangles.length);
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [triangles[t], triangles[t + 1], triangles[t + 2]];
      const p = minus(corner(places, b), corner(places, a)), q = minus(corner(places, c), corner(places, a));
      this.sides.set([...p, ...q], 2 * t);
      const normal = cross(p, q);
      for (const v of [a, b, c]) for (let k = 0; k < 3; k++) normals[3 * weld[v] + k] += normal[k];
    }
    this.lengths = new Float64Array(n);
    for (let v = 0; v < n; v++) this.lengths[v] = Math.hypot(...corner(normals, v)) || 1;
    return normals;
  }

  /** Rows of six numbers (place, normal) per unit of a channel at the vertices that it changes. */
  #shape({ at, moves }, scale) {
    const { weld, triangles, sides } = this, move = new Map(), touched = new Set();
    for (let i = 0; i < at.length; i++) {
      move.set(at[i], i);
      for (const t of this.around[weld[at[i]]]) touched.add(t);
    }
    const turned = new Map(), still = [0, 0, 0];
    const of = (v) => (move.has(v) ? corner(moves, move.get(v)) : still);
    for (const t of touched) {
      const [a, b, c] = [triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]];
      const p = sides.subarray(6 * t, 6 * t + 3), q = sides.subarray(6 * t + 3, 6 * t + 6), from = of(a);
      const left = cross(minus(of(b), from), q), right = cross(p, minus(of(c), from));
      for (const v of [weld[a], weld[b], weld[c]]) {
        const sum = turned.get(v) ?? [0, 0, 0];
        for (let k = 0; k < 3; k++) sum[k] += left[k] + right[k];
        turned.set(v, sum);
      }
    }
    const changed = [];
    for (const v of turned.keys()) changed.push(...this.members[v]);
    const rows = new Float32Array(6 * changed.length);
    let largest = 0;
    changed.forEach((v, i) => {
      const normal = turned.get(weld[v]), place = of(v), length = this.lengths[weld[v]];
      for (let k = 0; k < 3; k++) {
        rows[6 * i + k] = place[k] / scale;
        rows[6 * i + 3 + k] = normal[k] / length / scale;
        largest = Math.max(largest, Math.abs(rows[6 * i + k]));
      }
    });
    return { at: Uint32Array.from(changed), rows, largest };
  }

  /** Add `change` units of a channel; returns whether a vertex moves. */
  add(channel, change) {
    const { at, rows } = this.shapes[channel];
    if (!at.length) return false;
    const posed = this.posed;
    for (let i = 0, r = 0; i < at.length; i++, r += 6) {
      const v = 6 * at[i];
      posed[v] += change * rows[r];
      posed[v + 1] += change * rows[r + 1];
      posed[v + 2] += change * rows[r + 2];
      posed[v + 3] += change * rows[r + 3];
      posed[v + 4] += change * rows[r + 4];
      posed[v + 5] += change * rows[r + 5];
    }
    return true;
  }
}

export class StageFace {
  constructor(file, textures) {
    const mesh = file.json.meshes[0];
    this.stage = file.json.asset.extras;
    this.names = mesh.extras.targetNames;
    this.textures = textures;
    this.weights = new Float32Array(this.names.length);
    this.parts = mergePrimitives(file, mesh).map((group) => this.#part(file, group, mesh.extras.scales));
    this.largest = this.names.map((_, k) => Math.max(...this.parts.map((part) => part.shapes[k].largest)));
    this.sinceRefresh = 0;
    this.eyes = this.stage.eyes.map((eye) => ({
      ...eye,
      turns: Object.entries(eye.turns).map(([name, turn]) => [this.names.indexOf(name), new THREE.Vector3(...turn)]),
      lids: eye.lids.map((lid) => lid.map((place) => this.#nearest(place))),
    }));
  }

  static async load(url, signal) {
    const answer = await fetch(url, { signal });
    if (!answer.ok) throw new Error(`the face could not be fetched: ${answer.status} ${answer.statusText}`);
    const file = readContainer(await answer.arrayBuffer());
    if (!file.json.asset.extras?.lamps) throw new Error("the face lacks the values of the preview; make it with stage_glb");
    return new StageFace(file, await readTextures(file));
  }

  #part(file, { material, attributes, triangles, targets, surface }, scales) {
    const places = attributes.POSITION.array, part = new Part(places, triangles, targets, scales);
    const geometry = (part.geometry = new THREE.BufferGeometry());
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    geometry.setAttribute("position", new THREE.InterleavedBufferAttribute(part.buffer, 3, 0));
    geometry.setAttribute("normal", new THREE.InterleavedBufferAttribute(part.buffer, 3, 3));
    geometry.setAttribute("surface", new THREE.BufferAttribute(surface, 3));
    part.field = Array.from({ length: N_FIELDS }, (_, k) => attributes[`_LIGHT${k}`].array);
    for (const [name, width] of [["restLight", 4], ["openLight", 4], ["skyLight", 2]]) {
      const values = new THREE.BufferAttribute(new Float32Array((places.length / 3) * width), width);
      geometry.setAttribute(name, values.setUsage(THREE.DynamicDrawUsage));
    }
    const names = { TEXCOORD_0: "uv", COLOR_0: "color", _SKIN: "_skin", _TANGENT: "_tangent" };
    for (const [name, { array, width, normalized }] of Object.entries(attributes)) {
      if (name in names) geometry.setAttribute(names[name], new THREE.BufferAttribute(array, width, normalized));
    }
    part.material = material;
    const base = material.pbrMetallicRoughness.baseColorTexture;
    part.texture = base ? this.textures[file.json.textures[base.index].extensions.EXT_texture_webp.source] : null;
    return part;
  }

  /** The vertex next to a place at rest. */
  #nearest(place) {
    let best = [0, 0], least = Infinity;
    this.parts.forEach((part, p) => {
      if (part.material.extras.kind !== "skin") return;
      for (let v = 0; v < part.places.length / 3; v++) {
        const d = Math.hypot(...minus(corner(part.places, v), place));
        if (d < least) [best, least] = [[p, v], d];
      }
    });
    return best;
  }

  /** Place of a vertex given by part and number, before the head's motion. */
  place([part, v]) {
    return this.parts[part].posed.subarray(6 * v, 6 * v + 3);
  }

  /** Take the weights of all channels; returns whether the surface changed. */
  pose(weights) {
    const changed = new Set(), whole = ++this.sinceRefresh > REFRESH_FRAMES;
    if (whole) {
      this.sinceRefresh = 0;
      this.weights.fill(0);
      this.parts.forEach((part) => part.posed.set(part.rest));
    }
    for (let k = 0; k < weights.length; k++) {
      const change = weights[k] - this.weights[k];
      if (Math.abs(change) * this.largest[k] < LEAST_CHANGE_M && !whole) continue;
      this.weights[k] = weights[k];
      for (const part of this.parts) if (part.add(k, change)) changed.add(part);
    }
    for (const part of whole ? this.parts : changed) part.buffer.needsUpdate = true;
    return changed.size > 0;
  }

  /** Take the directions of the lamps: how much of their light reaches each vertex, by its light field. */
  light(lamps) {
    const bases = lamps.map(({ x, y, z }) => [1, x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1]);
    for (const { field, geometry } of this.parts) {
      const { restLight, openLight, skyLight } = geometry.attributes;
      const own = new Float32Array(4 * N_FIELDS);
      for (let v = 0; v < skyLight.count; v++) {
        for (let c = 0; c < own.length; c++) own[c] = field[c >> 2][4 * v + (c & 3)] * FIELD_UNIT;
        skyLight.array[2 * v] = own[0];
        skyLight.array[2 * v + 1] = own[N_GAIN];
        for (let k = 0; k < 4; k++) {
          let rest = 0, gain = 0;
          for (let c = 0; c < 9; c++) {
            rest += bases[k][c] * own[1 + c];
            gain += bases[k][c] * own[N_GAIN + 1 + c];
          }
          restLight.array[4 * v + k] = rest;
          openLight.array[4 * v + k] = gain;
        }
      }
      for (const attribute of [restLight, openLight, skyLight]) attribute.needsUpdate = true;
    }
  }

  /** Share from 0 to 1 of the light that enters with an open mouth. */
  opening() {
    let opened = 0;
    for (const [name, share] of Object.entries(this.stage.opening)) opened += share * this.weights[this.names.indexOf(name)];
    return Math.sqrt(Math.min(Math.max(opened, 0), 1));
  }

  dispose() {
    for (const part of this.parts) part.geometry.dispose();
    for (const texture of this.textures) texture.dispose();
  }
}
