// Materials of the stage: values of the shaders for a face, its parts, and the wall behind it.

import { THREE } from "nicegui-scene";
import { FRAGMENT, LAMPS, VERTEX } from "./stage_shader.js";

const BEHIND_UNITS = 8000; // of a depth of 24 bits: at one metre about 25 mm further back
const BALL_MM = 12; // radius of the eyeball in whose mm the shaders measure lids

/** Values that all materials of a face share; those of the lamps and the eyes follow the camera and the motion. */
export function sharedUniforms(stage) {
  const colours = stage.lamps.map(([, , colour]) => new THREE.Vector3(...colour));
  const vectors = (n, kind = THREE.Vector3) => Array.from({ length: n }, () => new kind());
  return {
    joints: { value: vectors(4, THREE.Matrix4) },
    lamps: { value: vectors(LAMPS) },
    lampColours: { value: colours },
    sky: { value: new THREE.Vector3(...stage.sky) },
    floorLight: { value: new THREE.Vector3(...stage.floor) },
    skull: { value: new THREE.Vector3(...stage.skull) },
    brightness: { value: stage.brightness },
    opening: { value: 0 },
    eyeCentres: { value: vectors(2) },
    eyeGaze: { value: vectors(2) },
    eyeAcross: { value: new THREE.Vector3(1, 0, 0) },
    eyeUp: { value: new THREE.Vector3(0, 1, 0) },
    lids: { value: vectors(36, THREE.Vector2) },
    eyeSpot: { value: vectors(2, THREE.Vector4) },
    spotRight: { value: vectors(2) },
    spotUp: { value: vectors(2) },
    spotSoft: { value: stage.catchlight.soft },
    iris: { value: stage.eyes[0]?.iris ?? 0.868 },
    eyeScale: { value: stage.eyes.length ? BALL_MM / stage.eyes[0].radius : 1 },
    sink: { value: new THREE.Vector2(stage.sink.slope, stage.sink.share * BALL_MM) },
    hasLids: { value: stage.eyes.length === 2 && stage.eyes.every((eye) => eye.lids.length) ? 1 : 0 },
  };
}

/** `samples` is whether a pixel has several samples, which share the coverage of hair, and highlights of its own. */
export function partMaterial(part, shared, samples) {
  const { extras } = part.material;
  const defines = {};
  if (part.texture) defines.TEXTURED = 1;
  if (!samples) defines.COARSE = 1;
  if (extras.cutout) defines.CUTOUT = 1;
  if (extras.kind === "strands") defines.STRANDS = 1;
  if (extras.kind === "eye") defines.EYE = 1;
  if (extras.unlit) defines.UNLIT = 1;
  const layered = extras.cutout && part.material.name.startsWith("hair"); // cards over cards hide each other
  if (layered) defines.SOLID = 1;
  const numbers = { second: extras.second, dark: extras.dark, openSheet: Number(extras.open), opacity: extras.opacity, shine: Math.min(extras.gloss / 0.25, 1.5) };
  const [darkTexel, brightTexel] = (extras.texels ?? [[0, 0, 0], [1, 1, 1]]).map((rgb) => ({ value: new THREE.Vector3(...rgb) }));
  const uniforms = { ...shared, map: { value: part.texture }, darkTexel, brightTexel };
  for (const [name, value] of Object.entries(numbers)) uniforms[name] = { value };
  return new THREE.ShaderMaterial({
    defines,
    uniforms,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    vertexColors: !part.texture,
    polygonOffset: extras.behind,
    polygonOffsetUnits: BEHIND_UNITS,
    side: extras.open || extras.cutout ? THREE.DoubleSide : THREE.FrontSide,
    alphaToCoverage: layered && samples,
    transparent: extras.opacity < 1 || (extras.cutout && !layered),
    depthWrite: !extras.cutout || layered,
  });
}

/** The wall behind the head: a soft radial gradient in display colours, or one colour. */
export function wallMaterial([bright, dark, centre]) {
  const vector = (rgb) => new THREE.Vector3(...rgb).divideScalar(255);
  return new THREE.ShaderMaterial({
    uniforms: {
      bright: { value: vector(bright) },
      dark: { value: vector(dark) },
      centre: { value: new THREE.Vector2(centre[0], 1 - centre[1]) },
      aspect: { value: 1 },
    },
    vertexShader: `
      uniform vec3 bright, dark; uniform vec2 centre; uniform float aspect; varying vec3 vShade;
      void main() {
        vec2 away = (uv - centre) * vec2(clamp(aspect, 1., 1.6), 1.);
        vShade = mix(dark, bright, exp(-2.6 * dot(away, away))) - .5 / 255.;
        gl_Position = vec4(position.xy, .9999, 1.);
      }`,
    fragmentShader: `
      varying vec3 vShade;
      void main() {
        float dither = fract(52.98 * fract(dot(gl_FragCoord.xy, vec2(.0671, .00584))));
        gl_FragColor = vec4(vShade + dither / 255., 1.);
      }`,
    depthWrite: false,
  });
}
