// <tts2face-head>: a talking head in a page, whose speech and motion a service of tts2face makes (docs/browser.md).

import { LiveHead } from "./live_head.js";
import { Puppet, Stage } from "./puppet.js";

const TICK_MS = 40; // between two looks for words that have been heard; pages in the background draw nothing
const ONLY_DRAWN = ["hair", "hair_color"]; // options of the file, which a stream does not take
const ONLY_SHOWN = ["talker", "face", "identity", ...ONLY_DRAWN];
const LABEL = "Talking face";
const STYLE = `
  :host { display: block; position: relative; aspect-ratio: 1; overflow: hidden; }
  :host([hidden]) { display: none; }
  canvas { display: block; width: 100%; height: 100%; }
  [part=captions] { position: absolute; inset: auto 4% 4%; text-align: center; font: 1rem/1.4 sans-serif; pointer-events: none; }
  [part=captions] span { background: rgb(0 0 0 / .75); color: #fff; padding: .1em .4em; box-decoration-break: clone; -webkit-box-decoration-break: clone; }`;

/** A talking head; attributes, methods and events: docs/browser.md, tts2face-head.d.ts. */
export class Tts2faceHead extends HTMLElement {
  static observedAttributes = ["server", "key", "face", "src", "voice", "language", "talker", "captions"];
  #options = {};
  #key = null;
  #live = null;
  #stage = null;
  #captions;
  #timer = null;
  #frame = null;
  #restarting = null;
  #loaded = null; // {wanted, key, isShown} of the file that is shown, or on its way
  #resume = () => this.#live?.clock.resume();
  #sizes = new ResizeObserver(() => this.#stage?.resize(this.clientWidth, this.clientHeight));
  loader = undefined; // a GLTFLoader of the page, with decoders of its own

  constructor() {
    super();
    const root = this.attachShadow({ mode: "open" });
    // the voice says it: a screen reader would say it twice
    root.innerHTML = `<style>${STYLE}</style><canvas></canvas><div part="captions" aria-hidden="true"></div>`;
    this.#captions = root.querySelector("[part=captions]");
  }

  /** Options of a clip (docs/options.md) for voice, face and gestures, such as {style: "happy", seed: 3}. */
  get options() {
    return this.#options;
  }

  set options(options) {
    this.#options = { ...options };
    this.#restart();
  }

  /** API key, or a function that gives one, also a promise. */
  get key() {
    return this.#key ?? this.getAttribute("key");
  }

  set key(key) {
    this.#key = key;
    this.#restart();
  }

  /** "idle", "speaking", "listening" or "offline". */
  get state() {
    return this.getAttribute("state") ?? "offline";
  }

  /** The scene of three.js, with camera and lamps: {scene, camera, renderer, puppet}. */
  get stage() {
    return this.#stage;
  }

  /** Weights by name as they are drawn. */
  get weights() {
    const pose = this.#live?.pose();
    return pose ? Object.fromEntries(pose.names.map((name, n) => [name, pose.weights[n]])) : {};
  }

  connectedCallback() {
    if (!this.hasAttribute("role")) this.setAttribute("role", "img");
    if (!this.hasAttribute("aria-label")) this.setAttribute("aria-label", LABEL);
    this.#stage = new Stage(this.shadowRoot.querySelector("canvas"));
    this.#sizes.observe(this);
    for (const type of ["pointerdown", "keydown"]) addEventListener(type, this.#resume);
    this.#timer = setInterval(() => this.#live?.tick(), TICK_MS);
    this.#draw();
    this.#restart();
  }

  disconnectedCallback() {
    for (const type of ["pointerdown", "keydown"]) removeEventListener(type, this.#resume);
    clearInterval(this.#timer);
    cancelAnimationFrame(this.#frame);
    this.#sizes.disconnect();
    this.#live?.close();
    this.#stage?.dispose();
    this.#live = this.#stage = null;
    this.#loaded = null;
  }

  attributeChangedCallback(name, before, now) {
    if (before !== now && name !== "captions") this.#restart();
  }

  /** Speak a text, or a stream of its parts; resolves to {interrupted, seconds} when it has been heard. */
  speak(text) {
    return this.#talking().speak(text);
  }

  /** Speak sound: blocks of 16-bit or float samples at a rate in Hz until `endSound`, a stream of them, a MediaStream. */
  push(sound, rate) {
    return this.#talking().push(sound, rate);
  }

  /** End the utterance of pushed blocks. */
  endSound() {
    this.#talking().endSound();
  }

  /** Listen until the next speech; to a MediaStream, or a stream of blocks at a rate, where it is given. */
  listen(sound, rate) {
    return this.#talking().listen(sound, rate);
  }

  /** Be silent at once; returns the seconds that were heard. */
  interrupt() {
    return this.#talking().interrupt();
  }

  /** Make a gesture: nod, shake, wink left, ... with {size, seconds} where wanted. */
  gesture(name, how = {}) {
    this.#talking().send({ ...how, type: "gesture", name });
  }

  /** Change the style of face and voice. */
  changeStyle(style) {
    this.#talking().send({ type: "style", style });
  }

  #talking() {
    if (this.#restarting) this.#begin();
    if (!this.#live) throw new Error("the head is in no document; append it first");
    return this.#live;
  }

  /** Begin anew once all attributes of the present task are set. */
  #restart() {
    if (this.#restarting || !this.#stage) return;
    this.#restarting = {};
    const { task } = { task: this.#restarting };
    queueMicrotask(() => this.#restarting === task && this.#begin());
  }

  #begin() {
    this.#restarting = null;
    if (!this.#stage) return;
    this.#live?.close();
    const server = new URL(this.getAttribute("server") ?? location.origin, document.baseURI), { key } = this;
    const named = ["face", "voice", "language", "talker"].map((name) => [name, this.getAttribute(name)]);
    const options = { ...Object.fromEntries(named.filter(([, value]) => value)), ...this.#options };
    const start = { with_idle: !matchMedia("(prefers-reduced-motion: reduce)").matches, ...without(options, ONLY_DRAWN) };
    this.#live = new LiveHead({ server, key, start }, (type, detail) => this.#tell(type, detail));
    this.#load(server, key, options).catch((wrong) => this.#tell("error", { message: wrong.message }));
  }

  /** Show the file of `src`, or the service's face. */
  async #load(server, key, options) {
    const src = this.getAttribute("src"), stage = this.#stage;
    const shown = Object.fromEntries(ONLY_SHOWN.filter((name) => options[name]).map((name) => [name, options[name]]));
    const wanted = src ?? JSON.stringify([server, shown]);
    if (wanted === this.#loaded?.wanted && (this.#loaded.isShown || key === this.#loaded.key)) return;
    const load = (this.#loaded = { wanted, key, isShown: false });
    try {
      const answer = await (src ? fetch(new URL(src, document.baseURI)) : fetchFace(server, key, shown));
      if (!answer.ok) throw new Error(await reason(answer));
      const puppet = await Puppet.read(await answer.arrayBuffer(), this.loader);
      if (load !== this.#loaded || stage !== this.#stage) return puppet.dispose();
      stage.show(puppet);
      load.isShown = true;
    } catch (wrong) {
      if (load !== this.#loaded) return; // another one is on its way
      this.#loaded = null;
      throw wrong;
    }
    this.#tell("ready", { names: stage.puppet.names });
  }

  #draw() {
    this.#frame = requestAnimationFrame(() => this.#draw());
    if (!this.#stage.puppet) return;
    const pose = this.#live?.pose(), { puppet } = this.#stage;
    if (pose) puppet.pose(pose.names, pose.weights, pose.head);
    if (pose && !puppet.isChecked) this.#check(puppet, pose.names);
    this.#stage.render();
  }

  /** Tell the page if the file that is shown has none of the shapes that the service moves. */
  #check(puppet, names) {
    puppet.isChecked = true;
    if (names.some((name) => !name.startsWith("eyeLook") && puppet.names.includes(name))) return;
    const message = `the shown file has no shape named as the service's weights (${names.slice(0, 3).join(", ")}, ...); ` +
      "give the character's own file as src, and its face at the service as face";
    this.#tell("error", { message });
  }

  #tell(type, detail) {
    if (type === "state") this.setAttribute("state", detail.state);
    if (type === "caption" || type === "end") this.#write(type === "end" ? "" : detail.text);
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #write(text) {
    const line = document.createElement("span");
    line.textContent = this.hasAttribute("captions") ? text : "";
    this.#captions.replaceChildren(line);
  }
}

function fetchFace(server, key, shown) {
  const body = JSON.stringify({ ...shown, idle: 0.1, format: "glb" });
  return Promise.resolve(typeof key === "function" ? key() : key).then((secret) => {
    const headers = { "Content-Type": "application/json", ...(secret && { Authorization: `Bearer ${secret}` }) };
    return fetch(new URL("/v1/clips", server), { method: "POST", headers, body });
  });
}

async function reason(answer) {
  const content = await answer.json().catch(() => null);
  return content?.error?.message ?? `the face could not be fetched: ${answer.status} ${answer.statusText}`;
}

function without(options, names) {
  return Object.fromEntries(Object.entries(options).filter(([name]) => !names.includes(name)));
}

if (!customElements.get("tts2face-head")) customElements.define("tts2face-head", Tts2faceHead);
