// A head of a .glb file in three.js: morph targets and expressions by their own names, bones of neck, head and eyes.

import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";

const NECK_SHARE = 0.4; // of the head's turn, as in the files that the service animates (decision 080)
const EYE_UP = 0.349, EYE_SIDE = 0.436; // radians of an eye's bone at weight 1: 20 and 25 degrees
const BONES = { // as tts2face/interchange/gltf/nodes.py finds them
  head: /(?:^|[_.:| -])(?:head|j_bip_c_head)$/i,
  neck: /(?:^|[_.:| -])(?:neck|neck_?0?1|j_bip_c_neck)$/i,
  leftEye: /(?:left_?eye|eye_?left|(?:^|[_.:| -])l_?eye(?:ball)?|eye(?:ball)?[_.]?l)$/i,
  rightEye: /(?:right_?eye|eye_?right|(?:^|[_.:| -])r_?eye(?:ball)?|eye(?:ball)?[_.]?r)$/i,
};
const FIELD = 22; // degrees of the camera's height
const MARGIN = 1.25; // of the picture around the head
const MM = 0.001;

/** A head, its lamps and its camera. */
export class Puppet {
  #bones = {}; // name -> {bone, above: rotation of its parent at rest, turn and place of its own}
  #binds = new Map(); // name of a weight -> [[influences, index, gain], ...]
  #influences = []; // all that are set

  /** Read a file (ArrayBuffer) by a loader of three.js. */
  static async read(content, loader = new GLTFLoader()) {
    const { scene, parser } = await loader.parseAsync(content, "");
    const puppet = new Puppet(scene, parser.json);
    await puppet.#bindExpressions(parser);
    await puppet.#findBones(parser);
    return puppet;
  }

  constructor(scene, { asset, extensions }) {
    this.model = scene;
    this.isOwn = asset?.generator === "tts2face"; // its head's bone moves by the millimetres of the curves
    this.looksBack = Boolean(extensions?.VRM); // VRM 0 looks along -z, all else along +z
    scene.updateMatrixWorld(true);
    scene.traverse((node) => {
      if (node.morphTargetInfluences) this.#bindTargets(node);
    });
  }

  /** Names of the weights that move something. */
  get names() {
    return [...this.#binds.keys()];
  }

  /** Set weights by name, and the head's pose {pitch, yaw, roll, x, y, z} in radians and mm. */
  pose(names, weights, head) {
    for (const [influences] of this.#influences) influences.fill(0);
    names.forEach((name, n) => {
      for (const [influences, index, gain] of this.#binds.get(name) ?? []) influences[index] += gain * weights[n];
    });
    this.#turnEyes(Object.fromEntries(names.map((name, n) => [name, weights[n]])));
    if (head) this.#turnHead(head);
  }

  /** Box around what follows the head. */
  box() {
    const box = new THREE.Box3(), place = new THREE.Vector3(), bone = this.#bones.head?.bone;
    const inside = new Set();
    bone?.traverse((node) => inside.add(node));
    this.model.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const { position, skinIndex, skinWeight } = mesh.geometry.attributes;
      if (!mesh.isSkinnedMesh && !mesh.morphTargetInfluences && !inside.has(mesh)) return;
      for (let v = 0; v < position.count; v += 7) {
        if (mesh.isSkinnedMesh && !inside.has(mesh.skeleton.bones[strongest(skinIndex, skinWeight, v)])) continue;
        box.expandByPoint(mesh.getVertexPosition(v, place).applyMatrix4(mesh.matrixWorld));
      }
    });
    return box.isEmpty() ? box.setFromObject(this.model) : box;
  }

  dispose() {
    this.model.traverse((mesh) => {
      mesh.geometry?.dispose();
      for (const material of [mesh.material ?? []].flat()) {
        for (const value of Object.values(material)) if (value?.isTexture) value.dispose();
        material.dispose();
      }
    });
  }

  #bind(name, mesh, index, gain) {
    if (!this.#binds.has(name)) this.#binds.set(name, []);
    this.#binds.get(name).push([mesh.morphTargetInfluences, index, gain]);
  }

  #bindTargets(mesh) {
    this.#influences.push([mesh.morphTargetInfluences]);
    for (const [name, index] of Object.entries(mesh.morphTargetDictionary ?? {})) this.#bind(name, mesh, index, 1);
  }

  /** Bind the expressions of a VRM, 1 or 0, which stand for morph targets. */
  async #bindExpressions(parser) {
    const { extensions = {}, nodes = [] } = parser.json;
    const { preset = {}, custom = {} } = extensions.VRMC_vrm?.expressions ?? {};
    const found = Object.entries({ ...preset, ...custom }).map(([name, one]) => [name, one.morphTargetBinds ?? []]);
    for (const { name, presetName, binds = [] } of extensions.VRM?.blendShapeMaster?.blendShapeGroups ?? []) {
      const all = binds.flatMap(({ mesh, index, weight = 100 }) =>
        nodes.flatMap((node, at) => (node.mesh === mesh ? [{ node: at, index, weight: weight / 100 }] : [])));
      found.push([presetName && presetName !== "unknown" ? presetName : name, all]);
    }
    for (const [name, binds] of found) {
      if (this.#binds.has(name)) continue; // a morph target has this name itself
      for (const { node, index, weight = 1 } of binds) {
        const object = await parser.getDependency("node", node);
        object.traverse((mesh) => {
          if (mesh.morphTargetInfluences) this.#bind(name, mesh, index, weight);
        });
      }
    }
  }

  /** The humanoid's bones of a VRM, else bones by their names, joints of skins first: meshes are named "head", too. */
  async #findBones(parser) {
    const { VRMC_vrm: recent, VRM: earlier } = parser.json.extensions ?? {};
    const named = Object.entries(recent?.humanoid?.humanBones ?? {}).map(([bone, { node }]) => [bone, node]);
    for (const { bone, node } of earlier?.humanoid?.humanBones ?? []) named.push([bone, node]);
    for (const [bone, node] of named) if (bone in BONES) this.#addBone(bone, await parser.getDependency("node", node));
    const nodes = [];
    this.model.traverse((node) => nodes.push(node));
    for (const node of [...nodes.filter((one) => one.isBone), ...nodes.filter((one) => !one.isBone)]) {
      for (const [bone, pattern] of Object.entries(BONES)) {
        const isPossible = node.isBone || bone.endsWith("Eye"); // a group named head is not its pivot
        if (isPossible && !this.#bones[bone] && pattern.test(node.userData.name ?? node.name)) this.#addBone(bone, node);
      }
    }
    if (!this.#bones.head) this.#addPivot();
  }

  #addBone(name, bone) {
    const above = bone.parent.getWorldQuaternion(new THREE.Quaternion());
    this.#bones[name] = { bone, above, turn: bone.quaternion.clone(), place: bone.position.clone() };
  }

  /** Turn the whole model about the middle of the head where no bone does. */
  #addPivot() {
    const pivot = new THREE.Group(), middle = this.box().getCenter(new THREE.Vector3());
    const whole = new THREE.Group();
    pivot.position.copy(middle);
    this.model.position.sub(middle);
    pivot.add(this.model);
    whole.add(pivot);
    this.model = whole;
    whole.updateMatrixWorld(true);
    this.#addBone("head", pivot);
  }

  /** Turn a bone by a rotation in the axes of the model. */
  #turn(name, rotation) {
    const { bone, above, turn } = this.#bones[name];
    const turned = this.looksBack ? new THREE.Quaternion(-rotation.x, rotation.y, -rotation.z, rotation.w) : rotation;
    bone.quaternion.copy(above).invert().multiply(turned).multiply(above).multiply(turn);
  }

  #turnHead({ pitch = 0, yaw = 0, roll = 0, x = 0, y = 0, z = 0 }) {
    const { head, neck } = this.#bones;
    const whole = new THREE.Quaternion().setFromEuler(new THREE.Euler(pitch, yaw, roll, "YXZ"));
    let rest = whole;
    if (neck && isAbove(neck.bone, head.bone)) {
      const share = new THREE.Quaternion().slerp(whole, NECK_SHARE);
      this.#turn("neck", share);
      rest = share.invert().multiply(whole);
    }
    this.#turn("head", rest);
    if (this.isOwn) head.bone.position.set(x, y, z).multiplyScalar(MM).add(head.place);
  }

  #turnEyes(weights) {
    for (const [name, side, out] of [["leftEye", "Left", 1], ["rightEye", "Right", -1]]) {
      if (!this.#bones[name]) continue;
      const [up, down, outwards, inwards] = ["Up", "Down", "Out", "In"].map((way) => weights[`eyeLook${way}${side}`] ?? 0);
      const vector = new THREE.Vector3(EYE_UP * (down - up), out * EYE_SIDE * (outwards - inwards), 0);
      const angle = vector.length();
      this.#turn(name, new THREE.Quaternion().setFromAxisAngle(angle ? vector.divideScalar(angle) : vector, angle));
    }
  }
}

/** A canvas on which a puppet is drawn, framed by its head. */
export class Stage {
  puppet = null;

  constructor(canvas) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.toneMapping = THREE.ACESFilmicToneMapping;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FIELD, 1, 0.01, 100);
    const rooms = new THREE.PMREMGenerator(this.renderer);
    this.scene.environment = rooms.fromScene(new RoomEnvironment(), 0.04).texture;
    this.scene.environmentIntensity = 0.6;
    rooms.dispose();
    this.lamp = new THREE.DirectionalLight(0xffffff, 1.5);
    this.scene.add(this.lamp, this.lamp.target);
  }

  /** Show a puppet in place of the one before. */
  show(puppet) {
    this.clear();
    this.puppet = puppet;
    this.scene.add(puppet.model);
    this.#frame();
  }

  resize(width, height) {
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.#frame();
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }

  clear() {
    if (!this.puppet) return;
    this.scene.remove(this.puppet.model);
    this.puppet.dispose();
    this.puppet = null;
  }

  dispose() {
    this.clear();
    this.scene.environment.dispose();
    this.renderer.dispose();
  }

  #frame() {
    this.camera.updateProjectionMatrix();
    if (!this.puppet) return;
    this.puppet.model.updateMatrixWorld(true);
    const box = this.puppet.box(), size = box.getSize(new THREE.Vector3()), middle = box.getCenter(new THREE.Vector3());
    const tangent = Math.tan((FIELD * Math.PI) / 360), ahead = this.puppet.looksBack ? -1 : 1;
    const distance = (MARGIN * Math.max(size.y, size.x / this.camera.aspect)) / (2 * tangent) + size.z / 2;
    this.camera.position.copy(middle).add({ x: 0, y: 0, z: ahead * distance });
    this.camera.near = distance / 100;
    this.camera.far = 100 * distance;
    this.camera.lookAt(middle);
    this.camera.updateProjectionMatrix();
    this.lamp.target.position.copy(middle);
    this.lamp.position.copy(middle).add({ x: distance / 2, y: distance / 2, z: ahead * distance });
  }
}

function strongest(indices, weights, vertex) {
  let best = 0;
  for (let k = 1; k < 4; k++) if (weights.getComponent(vertex, k) > weights.getComponent(vertex, best)) best = k;
  return indices.getComponent(vertex, best);
}

function isAbove(node, below) {
  let found = false;
  below.traverseAncestors((one) => (found ||= one === node));
  return found;
}
