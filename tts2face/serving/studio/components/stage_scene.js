// The scene of the stage: camera and lamps as in the renderer, and the face at an instant.

import { OrbitControls, THREE } from "nicegui-scene";
import { placeCatchlight } from "./stage_catchlights.js";
import { StageFace } from "./stage_face.js";
import { partMaterial, sharedUniforms, wallMaterial } from "./stage_materials.js";

const RADIAN = Math.PI / 180;
const MM = 0.001;
const WALL_STEPS = [24, 18]; // of the gradient over the canvas
const PHOTO_TURN = 0.3; // radians of the camera around a photograph, which has no sides
const LIGHT_STEP = 0.05; // radians of the camera's yaw between two directions of the lamps

export class StageScene {
  constructor(canvas, onChange) {
    this.isSoftware = drawsInSoftware();
    const options = { antialias: !this.isSoftware, alpha: false, powerPreference: "high-performance" };
    this.renderer = new THREE.WebGLRenderer({ canvas, ...options });
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(22, 1, 0.02, 20);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enablePan: false, enableDamping: false, minDistance: 0.15, maxDistance: 5 });
    this.controls.addEventListener("change", onChange);
    this.face = null;
    this.frame = null;
    this.onChange = onChange;
  }

  /** Show the face of an address; rejects with an AbortError, and changes nothing, once `signal` is aborted. */
  async setFace(url, signal) {
    const face = await StageFace.load(url, signal);
    signal.throwIfAborted();
    this.clear();
    this.face = face;
    this.litYaw = NaN;
    this.shared = sharedUniforms(face.stage);
    this.wall = new THREE.Mesh(new THREE.PlaneGeometry(2, 2, ...WALL_STEPS), wallMaterial(face.stage.wall));
    this.wall.frustumCulled = false;
    this.wall.renderOrder = 1.5; // where neither skin nor clothes hide it
    this.scene.add(this.wall);
    for (const part of face.parts) {
      const mesh = new THREE.Mesh(part.geometry, partMaterial(part, this.shared, !this.isSoftware));
      mesh.frustumCulled = false;
      mesh.renderOrder = part.material.extras.cutout ? 2 : 1;
      this.scene.add(mesh);
    }
    const [low, high] = face.stage.frame.map((corner) => new THREE.Vector3(...corner));
    this.middle = low.clone().add(high).multiplyScalar(0.5);
    this.half = high.clone().sub(low).multiplyScalar(0.5);
    this.weights = new Float32Array(face.names.length);
    this.head = new Float32Array(6);
    const most = face.stage.photo ? PHOTO_TURN : Infinity;
    Object.assign(this.controls, { minAzimuthAngle: -most, maxAzimuthAngle: most });
    this.view(this.viewName ?? "front");
    this.pose();
  }

  /** A named view of the renderer, or an object {yaw, pitch, share} in degrees. */
  view(name) {
    this.viewName = name;
    if (!this.face) return;
    const [yaw, pitch, share] = this.face.stage.views[name] ?? this.face.stage.views.front;
    const a = yaw * RADIAN, b = pitch * RADIAN, { half } = this;
    const ahead = new THREE.Vector3(-Math.sin(a) * Math.cos(b), -Math.sin(b), -Math.cos(a) * Math.cos(b));
    const right = new THREE.Vector3(Math.cos(a), 0, -Math.sin(a)), up = right.clone().cross(ahead);
    const extent = (axis) => Math.abs(axis.x) * half.x + Math.abs(axis.y) * half.y + Math.abs(axis.z) * half.z;
    const tangent = Math.tan(this.face.stage.field_of_view / 2);
    const size = Math.max(extent(up), extent(right) / this.camera.aspect);
    const distance = size / tangent + 0.5 * extent(ahead);
    this.camera.fov = this.face.stage.field_of_view / RADIAN;
    this.camera.zoom = 1 / share;
    this.camera.position.copy(this.middle).addScaledVector(ahead, -distance);
    this.controls.target.copy(this.middle);
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.onChange();
  }

  setBackground(environment) {
    if (!this.wall) return;
    const color = /^#[0-9a-f]{6}$/i.test(environment ?? "") ? environment : null;
    const uniforms = this.wall.material.uniforms;
    const plain = color && [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16));
    const [bright, dark] = plain ? [plain, plain] : this.face.stage.wall;
    uniforms.bright.value.set(...bright).divideScalar(255);
    uniforms.dark.value.set(...dark).divideScalar(255);
    this.onChange();
  }

  /** Fit the canvas; `ratio` is device pixels per pixel of the page. */
  resize(width, height, ratio) {
    this.size = { width, height, ratio: Math.min(ratio, 2) };
    this.setSharpness(this.sharpness ?? 1);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.viewName && !this.moved) this.view(this.viewName);
    if (this.wall) this.wall.material.uniforms.aspect.value = width / height;
  }

  /** Draw with a share of the device's pixels: fewer while a slow device plays, more for a picture at rest. */
  setSharpness(share) {
    this.sharpness = share;
    const { width, height, ratio } = this.size, pixels = Math.min(ratio * share, 2);
    if (this.renderer.getPixelRatio() === pixels && this.drawn?.width === width && this.drawn.height === height) return;
    this.drawn = { width, height };
    this.renderer.setPixelRatio(pixels);
    this.renderer.setSize(width, height, false);
  }

  /** Take the motion of a preview at a time in seconds; between two frames it is interpolated. */
  setMotion(preview, time) {
    if (!this.face || !preview.nFrames) return;
    if (this.columns?.revision !== preview.channels || this.columns.face !== this.face) {
      const columns = this.face.names.map((name) => preview.channels.indexOf(name));
      this.columns = { revision: preview.channels, face: this.face, columns };
    }
    const at = Math.min(Math.max(time * preview.fps, 0), preview.nFrames - 1);
    const first = Math.floor(at), next = Math.min(first + 1, preview.nFrames - 1), share = at - first;
    const k = preview.channels.length, { motion, head } = preview, { columns } = this.columns;
    for (let c = 0; c < columns.length; c++) {
      const column = columns[c];
      this.weights[c] = column < 0 ? 0 : motion[first * k + column] * (1 - share) + motion[next * k + column] * share;
    }
    for (let c = 0; c < 6; c++) this.head[c] = head[first * 6 + c] * (1 - share) + head[next * 6 + c] * share;
    this.pose();
  }

  pose() {
    const { face, shared } = this, { photo } = face.stage;
    const [pitch, yaw, roll, x, y, z] = photo ? bearable(this.head, photo) : this.head;
    face.pose(this.weights);
    shared.opening.value = face.opening();
    const pivot = new THREE.Vector3(...face.stage.pivot);
    const turn = new THREE.Matrix4().makeRotationFromEuler(new THREE.Euler(pitch, yaw, roll, "YXZ"));
    const way = new THREE.Vector3(x, y, z).multiplyScalar(MM);
    if (photo) {
      // the head moves in its own axes, the face lies in those of the camera
      const axes = new THREE.Matrix4().setFromMatrix3(new THREE.Matrix3().set(...photo.turn.flat()));
      way.applyMatrix4(axes);
      turn.premultiply(axes).multiply(axes.clone().transpose());
    }
    const head = about(turn, pivot).premultiply(new THREE.Matrix4().makeTranslation(way));
    const joints = shared.joints.value;
    joints[0].identity();
    joints[1].copy(head);
    const scale = shared.eyeScale.value;
    face.eyes.slice(0, 2).forEach((eye, number) => {
      const vector = new THREE.Vector3();
      for (const [channel, axis] of eye.turns) if (channel >= 0) vector.addScaledVector(axis, this.weights[channel]);
      const angle = vector.length();
      const rolled = new THREE.Matrix4();
      if (angle > 0) rolled.makeRotationAxis(vector.divideScalar(angle), angle);
      const centre = new THREE.Vector3(...eye.centre);
      joints[2 + number].copy(head).multiply(about(rolled, centre));
      shared.eyeCentres.value[number].copy(centre).applyMatrix4(head);
      shared.eyeGaze.value[number].set(0, 0, 1).transformDirection(rolled).transformDirection(turn);
      eye.edges = eye.lids.map((lid, side) =>
        lid.map((vertex, i) => {
          const place = face.place(vertex);
          const across = (place[0] - centre.x) * scale, height = (place[1] - centre.y) * scale;
          shared.lids.value[number * 18 + side * 9 + i].set(across, height);
          return new THREE.Vector3(...place).applyMatrix4(head);
        }),
      );
    });
    shared.eyeAcross.value.set(1, 0, 0).transformDirection(turn);
    shared.eyeUp.value.set(0, 1, 0).transformDirection(turn);
  }

  render() {
    if (!this.face) return;
    const towards = this.camera.position.clone().sub(this.controls.target);
    const yaw = Math.atan2(towards.x, towards.z);
    if (!(Math.abs(yaw - this.litYaw) < LIGHT_STEP)) this.turnLamps((this.litYaw = yaw));
    this.placeCatchlights();
    this.renderer.render(this.scene, this.camera);
  }

  placeCatchlights() {
    const { face: { eyes, stage }, shared } = this;
    this.camera.updateMatrixWorld();
    eyes.slice(0, 2).forEach((eye, number) => {
      const centre = shared.eyeCentres.value[number], gaze = shared.eyeGaze.value[number];
      const lids = (eye.edges ?? []).map((lid) => lid.map((place) => place.clone().sub(centre).divideScalar(eye.radius)));
      const [right, up, spot] = [shared.spotRight, shared.spotUp, shared.eyeSpot].map(({ value }) => value[number]);
      placeCatchlight(this.camera, centre, gaze, lids, eye.iris, eye.catchlight, stage.catchlight, { right, up, spot });
    });
  }

  /** The lamps turn with the camera, as in the renderer. */
  turnLamps(yaw) {
    const { lamps } = this.shared;
    this.face.stage.lamps.forEach(([own, pitch], number) => {
      const a = own * RADIAN + yaw, b = pitch * RADIAN;
      lamps.value[number].set(Math.sin(a) * Math.cos(b), Math.sin(b), Math.cos(a) * Math.cos(b));
    });
    this.face.light(lamps.value);
  }

  clear() {
    for (const mesh of [...this.scene.children]) {
      this.scene.remove(mesh);
      mesh.material.dispose();
    }
    this.wall?.geometry.dispose();
    this.face?.dispose();
    this.face = this.wall = null;
  }

  dispose() {
    this.clear();
    this.controls.dispose();
    this.renderer.dispose();
  }
}

/** Whether the browser draws on the processor, where each sample of a pixel counts. */
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) throw new Error("the browser has no WebGL 2");
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(name);
}

/** The part of a head pose that a photograph bears, as `PhotoView.bearable` has it. */
function bearable(head, { gain, limit, shift }) {
  const turns = head.slice(0, 3).map((angle) => limit * Math.tanh((gain * angle) / limit));
  return [...turns, shift * head[3], shift * head[4], 0];
}

/** A rotation about a point. */
function about(turn, point) {
  const back = new THREE.Matrix4().makeTranslation(-point.x, -point.y, -point.z);
  return new THREE.Matrix4().makeTranslation(point.x, point.y, point.z).multiply(turn).multiply(back);
}
