// Shading of the renderer (tts2face/picture: shade.py, strand_light.py, eyes.py) in GLSL: diffuse light at the vertices,
// highlights at the fragments, the same lamps and tone curve. Light does not scatter between vertices here.

export const LAMPS = 4;

/** Statements for each lamp: SwiftShader reads what a loop indexes one number at a time. */
const eachLamp = (statements) => Array.from({ length: LAMPS }, (_, k) => statements(k)).join("");

const TONE = `
  uniform float brightness;
  float curve(float light) {
    float x = light * brightness;
    return min((x * (2.51 * x + .03)) / (x * (2.43 * x + .59) + .14), 1.);
  }
  vec3 display(vec3 light) {
    float strongest = max(max(light.r, light.g), max(light.b, 1e-6)), shown = curve(strongest);
    float kept = .75 * (1. - shown);
    vec3 mixed = kept * shown / strongest * light + (1. - kept) * vec3(curve(light.r), curve(light.g), curve(light.b));
    mixed = clamp(mixed, 0., 1.);
    vec3 a = sqrt(mixed), b = sqrt(a), c = sqrt(b); // sRGB within 0.002 without a power
    return clamp(.662002687 * a + .68412206 * b - .323583601 * c - .022541147 * mixed, 0., 1.);
  }`;

// Without highlights of its own, a fragment takes its colour from two colours that its vertices have at two texels;
// where light is baked, these are the texels themselves.
const COARSE_COLOUR = `
  #if defined(UNLIT) || (defined(COARSE) && !defined(EYE))
  #define FLAT 1
  varying vec3 vBase, vSlope;
  #endif`;

// Edges of the lids around both eyes, from the centres of eyeballs of 12 mm, in mm across and up the head.
const LIDS = `
  uniform vec3 eyeCentres[2], eyeAcross, eyeUp;
  uniform vec2 lids[36];
  uniform float eyeScale, hasLids;
  float lidHeight(int begin, float across) {
    for (int k = 0; k < 8; k++) {
      vec2 a = lids[begin + k], b = lids[begin + k + 1];
      if (across <= b.x || k == 7) return mix(a.y, b.y, b.x > a.x ? clamp((across - a.x) / (b.x - a.x), 0., 1.) : 0.);
    }
    return 0.;
  }`;

// As tts2face.face.eyeballs.EyeOpenings.sink.
const SINK = `
  ${LIDS}
  uniform vec2 sink; // of the way beyond the edge of a lid, and at most, in mm of an eyeball of 12 mm
  vec3 sunk(vec3 place, int eye) {
    vec3 offset = place - eyeCentres[eye], ahead = cross(eyeAcross, eyeUp);
    if (hasLids < .5 || dot(offset, ahead) <= 0.) return place;
    float across = dot(offset, eyeAcross) * eyeScale, height = dot(offset, eyeUp) * eyeScale;
    int upper = eye * 18, lower = upper + 9;
    float beyond = max(height - lidHeight(upper, across), lidHeight(lower, across) - height);
    beyond = max(beyond, min(lids[upper].x, lids[lower].x) - across);
    beyond = max(beyond, across - max(lids[upper + 8].x, lids[lower + 8].x));
    return place - ahead * clamp(sink.x * beyond, 0., sink.y) / eyeScale;
  }`;

export const VERTEX = `
  ${COARSE_COLOUR}
  uniform mat4 joints[4];
  uniform vec3 lamps[${LAMPS}], lampColours[${LAMPS}], sky, floorLight, skull;
  uniform float opening, openSheet, second;
  attribute vec3 surface; // strength and squared width of the highlight, wrap of diffuse light
  #define gloss surface.x
  #define rough surface.y
  #define wrap surface.z
  attribute vec2 _skin;
  attribute vec4 restLight, openLight; // visibility of the lamps at rest, and how it changes with an open mouth
  attribute vec2 skyLight; // the same of the sky
  #ifdef STRANDS
  attribute vec4 _tangent;
  varying vec3 vTangent;
  #endif
  varying vec3 vNormal, vPlace, vLight, vShine, vColour;
  varying vec4 vExposure;
  varying vec2 vUv, vSurface;
  #ifdef EYE
  ${SINK}
  #endif
  #ifdef FLAT
  uniform float dark, shine;
  uniform vec3 darkTexel, brightTexel;
  ${TONE}
  vec3 linear(vec3 texel) {
    return texel * (texel * (texel * .305306 + .682171) + .012523);
  }
  vec3 shade(vec3 albedo, vec3 wide, vec3 narrow) {
    #ifdef STRANDS
    return display(albedo * (vLight + wide) + narrow);
    #else
    float hidden = 1. - vExposure.x, tone = .5 * (albedo.r + albedo.g);
    float spec = 1. - dark * (1. - clamp((tone - .03) / .27, 0., 1.));
    return display(vLight * albedo / (1. - hidden * hidden * albedo * .8) + vShine * spec);
    #endif
  }
  #endif

  /** Highlight of a lamp: one lobe, for lamps whose highlights change slowly over the surface. */
  float highlight(vec3 n, vec3 lamp, vec3 towards) {
    float to = max(dot(n, lamp), 0.), facing = max(dot(n, towards), .05);
    vec3 h = normalize(lamp + towards);
    float middle = max(dot(n, h), 0.), away = 1. - min(dot(lamp, h), 1.), away2 = away * away;
    float fresnel = 1. + (1. / .03 - 1.) * away2 * away2 * away, lobe = rough / (middle * middle * (rough - 1.) + 1.);
    float depth = sqrt(rough) * .5;
    return fresnel * to * lobe * lobe / ((to * (1. - depth) + depth) * (facing * (1. - depth) + depth));
  }

  void main() {
    #ifdef EYE
    mat4 joint = joints[int(_skin.x + .5)];
    float follow = _skin.y / 65535.;
    #else
    mat4 joint = joints[1]; // the head; what belongs to the body does not follow
    float follow = _skin.x > .5 ? _skin.y / 65535. : 0.;
    #endif
    vec4 place = vec4(mix(position, (joint * vec4(position, 1.)).xyz, follow), 1.);
    #ifdef EYE
    if (_skin.x > 1.5) place.xyz = sunk(place.xyz, int(_skin.x + .5) - 2);
    #endif
    vec3 n = normalize(normal);
    vNormal = normalize(mix(n, mat3(joint) * n, follow));
    vPlace = place.xyz;
    vSurface = surface.xy;
    gl_Position = projectionMatrix * viewMatrix * place;
    #ifdef TEXTURED
    vUv = uv;
    #else
    vColour = color.rgb;
    #endif
    vec3 towards = normalize(cameraPosition - place.xyz), m = vNormal;
    float around = clamp(skyLight.x + opening * skyLight.y, 0., 1.);
    vec4 seen = clamp(restLight + opening * openLight, 0., 1.);
    #ifdef STRANDS
    vTangent = normalize(mat3(joint) * _tangent.xyz);
    vec3 outward = normalize(mat3(joint) * (position - skull));
    m = normalize((dot(m, outward) > 0. ? .55 : -.55) * m + .5 * outward);
    vNormal = m;
    #else
    if (openSheet > .5 && dot(m, towards) < 0.) m = -m;
    #endif
    vLight = mix(floorLight, sky, .5 + .5 * m.y) * around;
    #ifdef STRANDS
    vLight *= 1.4;
    #endif
    float facing, turned, across, along, matt;
    vec3 reach = wrap * vec3(1., .75, .65), soaked;
    vec4 visible;
    ${eachLamp((k) => `
      facing = dot(n, lamps[${k}]), turned = clamp((facing + .15) / .4, 0., 1.);
      visible[${k}] = 1. - turned + turned * seen[${k}];
      #ifdef STRANDS
      across = dot(m, lamps[${k}]), along = dot(vTangent, lamps[${k}]);
      matt = .55 * sqrt(max(1. - along * along, 0.)) * max(.25 + .75 * across, 0.) + .45 * max(across, 0.);
      vLight += matt * visible[${k}] * lampColours[${k}];
      #else
      soaked = visible[${k}] + reach * visible[${k}] * (1. - visible[${k}]);
      vLight += lampColours[${k}] * soaked * max(dot(m, lamps[${k}]) + reach, 0.) / (1. + reach);
      #endif`)}
    vExposure = vec4(around, visible[0], visible[2], visible[3]);
    #ifndef STRANDS
    facing = max(dot(m, towards), 0.);
    float edge = 1. - facing, edge2 = edge * edge;
    float grazing = (.25 * gloss + (1. - sqrt(sqrt(rough))) * edge2 * edge2 * edge) * .35 * min(gloss * 8., 1.);
    vShine = grazing * around * around * (.7 + .3 * m.y) * sky;
    float lit = gloss * min(around * 1.3, 1.);
    vShine += lit * visible[2] * highlight(m, lamps[2], towards) * lampColours[2];
    #ifndef COARSE
    vShine += lit * visible[3] * highlight(m, lamps[3], towards) * lampColours[3];
    vShine += lit * around * highlight(m, lamps[1], towards) * lampColours[1];
    #else
    vShine += lit * visible[0] * highlight(m, lamps[0], towards) * (1. + .5 * second) * lampColours[0];
    #endif
    #endif
    #ifdef FLAT
    vec3 wide = vec3(0.), narrow = vec3(0.);
    #ifdef STRANDS
    vec3 h = normalize(lamps[0] + towards);
    float shift = -.03; // of brown hair
    along = dot(vTangent, h), across = dot(m, h);
    float arrives = clamp(1.6 * dot(m, lamps[0]) + .35, 0., 1.) * visible[0] * shine;
    float first = along + (shift - .08) * across, other = along + (shift + .14) * across;
    narrow = lampColours[0] * arrives * .05 * pow(max(1. - first * first, 1e-4), 32.);
    wide = lampColours[0] * arrives * .72 * pow(max(1. - other * other, 1e-4), 8.);
    #endif
    #ifdef UNLIT
    vSlope = vec3(1.);
    vBase = vec3(0.);
    #ifndef TEXTURED
    vBase = mix(12.92 * color.rgb, 1.055 * pow(color.rgb, vec3(1. / 2.4)) - .055, step(.0031308, color.rgb));
    #endif
    #elif defined(TEXTURED)
    vec3 low = shade(linear(darkTexel), wide, narrow), high = shade(linear(brightTexel), wide, narrow);
    vSlope = (high - low) / (brightTexel - darkTexel);
    vBase = low - darkTexel * vSlope;
    #else
    vBase = shade(color.rgb, wide, narrow);
    #endif
    #endif
  }`;

const EYES = `
  ${LIDS}
  uniform vec3 eyeGaze[2];
  uniform float iris, spotSoft;
  uniform vec4 eyeSpot[2];
  uniform vec3 spotRight[2], spotUp[2];
  float lightEye(vec3 place, vec3 towards, inout vec3 albedo, inout vec3 diffuse, inout vec4 exposure, inout vec3 n) {
    int best = distance(place, eyeCentres[0]) < distance(place, eyeCentres[1]) ? 0 : 1;
    vec3 offset = place - eyeCentres[best], gaze = eyeGaze[best];
    vec3 out_ = normalize(offset);
    float ahead = dot(out_, gaze);
    mat3 level = mat3(viewMatrix);
    vec3 key = level * lamps[0], from = level * out_;
    vec4 spot = eyeSpot[best];
    float off = length(vec2(dot(out_, spotRight[best]), dot(out_, spotUp[best])) - spot.xy) * spot.z;
    float glow = 1.2 * spot.w * (1. - smoothstep(1. - spotSoft, 1. + spotSoft, off));
    float edge = (ahead - iris - .006) * 80., ring = 1. - .6 * exp(-edge * edge);
    bool inside = ahead > iris;
    float lateral = dot(level * (out_ - gaze * ahead), vec3(key.xy, 0.));
    float focus = inside ? 1.15 + 1.6 * max(-lateral, 0.) : 1.;
    float inner = inside ? 0. : clamp((1. - ahead) * 1.6, 0., 1.), shade = 1.;
    if (hasLids > .5) {
      float across = dot(offset, eyeAcross) * eyeScale, height = dot(offset, eyeUp) * eyeScale;
      float under = max(lidHeight(best * 18, across) - height, 0.), over = max(height - lidHeight(best * 18 + 9, across), 0.);
      shade -= .55 * exp(-under / 1.5) + .18 * exp(-over * 1.6);
      float line = (over - .3) / .22;
      glow += .10 * exp(-line * line) * max(from.z - from.y * key.y + .3, 0.) * shade;
    }
    shade = max(shade, .1);
    albedo *= ring * focus * (inside ? 1. : .6) * (1. - inner * vec3(.05, .11, .17));
    diffuse *= shade;
    exposure *= shade;
    if (inside) n = out_;
    return glow * shade;
  }`;

const FLAT = `
  uniform float opacity;
  #ifdef TEXTURED
  uniform sampler2D map;
  varying vec2 vUv;
  #endif
  void main() {
    vec3 colour = vBase;
    float cover = opacity;
    #ifdef TEXTURED
    vec4 texel = texture2D(map, vUv);
    colour += texel.rgb * vSlope;
    #ifdef CUTOUT
    cover *= texel.a;
    #ifdef SOLID
    if (cover < .4) discard;
    cover = 1.;
    #else
    cover *= sqrt(cover);
    #endif
    #endif
    #endif
    gl_FragColor = vec4(colour, cover);
  }`;

export const FRAGMENT = `
  ${COARSE_COLOUR}
  #ifdef FLAT
  ${FLAT}
  #else
  uniform vec3 lamps[${LAMPS}], lampColours[${LAMPS}], sky;
  uniform float second, dark, opacity;
  #define gloss vSurface.x
  #define rough vSurface.y
  #ifdef TEXTURED
  uniform sampler2D map;
  #endif
  varying vec3 vNormal, vPlace, vLight, vShine, vColour;
  varying vec4 vExposure;
  varying vec2 vUv, vSurface;
  ${TONE}
  #ifdef EYE
  ${EYES}
  #endif
  #ifdef STRANDS
  varying vec3 vTangent;
  uniform float shine;
  #endif

  void main() {
    float cover = opacity;
    #ifdef TEXTURED
    vec4 texel = texture2D(map, vUv);
    vec3 albedo = texel.rgb * (texel.rgb * (texel.rgb * .305306 + .682171) + .012523); // sRGB to linear light
    #ifdef CUTOUT
    cover *= texel.a;
    #ifdef SOLID
    if (cover < .04) discard;
    #endif
    #ifndef SOLID
    cover *= sqrt(cover); // blended in display light here, in linear light by the renderer
    #endif
    #endif
    #else
    vec3 albedo = vColour;
    #endif
    vec3 light = vLight;
    vec3 towards = normalize(cameraPosition - vPlace), n = normalize(vNormal);
    vec4 exposure = vExposure;
    #ifdef STRANDS
    vec3 t = normalize(vTangent), colour = light * albedo;
    float shift = .12 * (dot(albedo, vec3(.333)) * 4. - .5);
    for (int k = 0; k < 3; k += 2) {
      vec3 h = normalize(lamps[k] + towards);
      float along = dot(t, h), normal = dot(n, h);
      float arrives = clamp(1.6 * dot(n, lamps[k]) + .35, 0., 1.) * (k == 0 ? exposure.y : exposure.z) * shine;
      float first = along + (shift - .08) * normal, other = along + (shift + .14) * normal;
      float narrow = max(1. - first * first, 0.), wide = max(1. - other * other, 0.);
      narrow *= narrow; narrow *= narrow; narrow *= narrow; narrow *= narrow; narrow *= narrow;
      wide *= wide; wide *= wide; wide *= wide;
      colour += lampColours[k] * arrives * (.05 * narrow + .72 * wide * albedo);
    }
    #else
    #ifndef COARSE
    if (!gl_FrontFacing) n = -n;
    #endif
    float glow = 0.;
    #ifdef EYE
    glow = lightEye(vPlace, towards, albedo, light, exposure, n);
    #endif
    float tone = .5 * (albedo.r + albedo.g);
    float spec = gloss * (1. - dark * (1. - clamp((tone - .03) / .27, 0., 1.)));
    vec3 shine = vShine * (spec / max(gloss, .001)) + glow * lampColours[0];
    #ifndef COARSE
    float facing = max(dot(n, towards), 1e-3), to = dot(n, lamps[0]);
    if (to > 0.) {
      float depth = sqrt(rough) * .5;
      vec3 h = normalize(lamps[0] + towards);
      float middle = max(dot(n, h), 0.), away = 1. - min(dot(lamps[0], h), 1.), away2 = away * away;
      float fresnel = 1. + (1. / .03 - 1.) * away2 * away2 * away, squared = middle * middle;
      float first = rough / (squared * (rough - 1.) + 1.), tight = rough * .24, other = tight / (squared * (tight - 1.) + 1.);
      float shadow = (to * (1. - depth) + depth) * (facing * (1. - depth) + depth);
      shine += lampColours[0] * spec * fresnel * to * (first * first + second * other * other) / shadow
        * exposure.y * min(exposure.x * 1.3, 1.);
    }
    #endif
    float hidden = 1. - exposure.x;
    vec3 colour = light * albedo / (1. - hidden * hidden * albedo * .8) + shine;
    #endif
    #ifdef SOLID
    cover = clamp((cover - .4) / max(fwidth(cover), .2) + .5, 0., 1.);
    if (cover < .02) discard;
    #endif
    gl_FragColor = vec4(display(colour), cover);
  }
  #endif`;
