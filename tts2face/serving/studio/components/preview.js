// The motion and sound of a clip in typed arrays, shared by all components of a page.

import { clock } from "./clock.js";

export class Preview {
  revision = null;
  fps = 30;
  nFrames = 0;
  channels = [];
  head = new Float32Array(0); // nFrames x 6: pitch, yaw, roll in radians, x, y, z in mm
  motion = new Float32Array(0); // nFrames x channels
  pcm = new Int16Array(0);
  rate = 24000;
  duration = 0;
  words = []; // [text, begin, end, sentence, is doubtful]
  phones = []; // [label, begin, end, sentence, index]
  sentences = []; // [text, occurrence, begin, end]
  notes = [];
  isComplete = true; // whether nothing more comes for the present state of the project
  #listeners = new Set();
  #queue = Promise.resolve();

  /** Fetch what differs from the revision that is here, and merge it; loads follow each other. */
  load(url) {
    const job = this.#queue.then(() => this.#fetch(url));
    this.#queue = job.catch(() => null);
    return job;
  }

  /** Call a function with {sound, motion} after each change; returns a function that stops it. */
  on(event, listener) {
    if (event !== "change") throw new Error(`there is no event ${event}; choose change`);
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  channel(name) {
    return this.channels.indexOf(name);
  }

  /** Value of a channel, or of a part of the head pose by its index - 6, at a frame. */
  value(frame, column) {
    return column < 0 ? this.head[frame * 6 + column + 6] : this.motion[frame * this.channels.length + column];
  }

  /** Show one pose in place of the clip: weights of channels, and the six values of the head. */
  pose(channels, weights, head) {
    Object.assign(this, { revision: null, nFrames: 1, duration: 0, channels, words: [], phones: [], sentences: [] });
    this.motion = Float32Array.from(weights);
    this.head = Float32Array.from(head);
    this.#emit({ sound: false, motion: true });
  }

  clear() {
    this.revision = null;
    this.nFrames = this.duration = 0;
    this.words = this.phones = this.sentences = [];
    this.#emit({ sound: true, motion: true });
  }

  async #fetch(url) {
    const address = new URL(url, document.baseURI);
    if (this.revision !== null && !address.searchParams.has("have")) address.searchParams.set("have", this.revision);
    const answer = await fetch(address);
    if (!answer.ok) throw new Error(`the preview could not be fetched: ${answer.status} ${answer.statusText}`);
    if (answer.status === 204) return this;
    this.merge(await answer.arrayBuffer());
    return this;
  }

  /** Merge a bundle over what is here. */
  merge(bundle) {
    const size = new DataView(bundle).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bundle, 4, size)));
    const k = header.channels.length, { n } = header, first = header.first_frame;
    let at = 4 + size;
    const floats = (count) => new Float32Array(bundle.slice(at, (at += 4 * count)));
    const motion = floats(n * k), head = floats(n * 6);
    const pcm = new Int16Array(bundle.slice(at, at + 2 * Math.floor((bundle.byteLength - at) / 2)));
    const sameChannels = k === this.channels.length && header.channels.every((name, i) => name === this.channels[i]);
    this.motion = placed(sameChannels ? this.motion : new Float32Array(0), motion, first * k, header.n_frames * k);
    this.head = placed(this.head, head, first * 6, header.n_frames * 6);
    const sound = pcm.length > 0 || header.n_samples !== this.pcm.length || header.rate !== this.rate;
    if (sound) this.pcm = placed(this.pcm, pcm, header.sound_first ?? 0, header.n_samples);
    Object.assign(this, {
      revision: header.revision,
      fps: header.fps,
      nFrames: header.n_frames,
      channels: header.channels,
      rate: header.rate,
      duration: header.duration,
      words: header.words,
      phones: header.phones,
      sentences: header.sentences,
      notes: header.notes ?? [],
      isComplete: header.is_complete ?? true,
    });
    this.#emit({ sound, motion: n > 0 });
  }

  #emit(change) {
    for (const listener of this.#listeners) listener(change);
  }
}

/** `whole` values: old ones before `first`, the fresh ones, and after them the last ones of the old. */
function placed(old, fresh, first, whole) {
  const after = first + fresh.length, rest = whole - after;
  const values = old.length === whole ? old : new fresh.constructor(whole);
  if (values !== old) {
    values.set(old.subarray(0, Math.min(first, whole)));
    if (rest > 0) values.set(old.subarray(Math.max(old.length - rest, 0)), after);
  }
  values.set(fresh.subarray(0, Math.max(whole - first, 0)), first);
  return values;
}

export const preview = new Preview(); // of the project
export const comparison = new Preview(); // its curves are drawn beside those of the project

/** Which of the two is seen and heard: the project, or what it is compared with. */
class Sides {
  shown = preview;
  #heard = null;
  #listeners = new Set();

  /** Call a function after each change; returns a function that stops it. */
  on(listener) {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  toggle() {
    this.show(this.shown === preview ? comparison : preview);
  }

  show(side) {
    this.shown = side.nFrames ? side : preview;
    this.hear(false);
    for (const listener of this.#listeners) listener();
  }

  /** Load the sound of what is shown unless it is loaded; recorded motion has none of its own. */
  hear(isChanged) {
    const { pcm, rate } = this.shown.pcm.length ? this.shown : preview;
    if (!isChanged && this.#heard && isEqual(this.#heard, pcm)) return;
    this.#heard = pcm;
    clock.load(pcm, rate || 1);
  }
}

function isEqual(one, other) {
  return one === other || (one.length === other.length && one.every((value, i) => value === other[i]));
}

export const sides = new Sides();

preview.on("change", ({ sound }) => {
  if (sound) sides.hear(true);
});
comparison.on("change", () => {
  if (sides.shown === comparison) sides.show(comparison);
});

export function loadPreview(url) {
  return preview.load(url);
}
