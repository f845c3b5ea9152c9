// Curves of a live stream on the clock of a head: frames as they come, and the pose between two of them.

const REST_S = 0.15; // in which a face without further frames comes to rest
const JOIN_S = 0.3; // in which a jump between two poses fades

/** Frames of one stream. `origin` is the clock's time at which the stream began; null before the first message. */
export class CurveTrack {
  origin = null;
  names = [];
  headNames = [];
  #frames = []; // {time on the stream, weights, head}, in their order
  #shown = null; // the last pose {weights, head}
  #jump = null; // {from: pose, began: time of the clock, null before the next pose}
  #rest = null; // likewise, towards rest

  /** Take a message `curves`. */
  add({ begin, fps, names, head_names: headNames, weights, head }) {
    if (names) this.names = names;
    if (headNames) this.headNames = headNames;
    weights.forEach((row, n) => this.#frames.push({ time: begin + n / fps, weights: row, head: head?.[n] ?? null }));
    if (this.#rest) this.#jump = { from: this.#shown, began: null };
    this.#rest = null;
  }

  /** Time of the last frame on the stream. */
  get end() {
    return this.#frames.at(-1)?.time ?? -Infinity;
  }

  /** Let the next pose begin at the last one: what lies between them is left out. */
  join(now) {
    if (this.#shown) this.#jump = { from: this.#shown, began: now };
  }

  /** Forget all frames: the face comes to rest, with its head where it is, until others come. */
  clear(now) {
    this.#frames = [];
    this.origin = null;
    if (this.#shown) this.#rest = { from: this.#shown, began: now };
  }

  /** Pose {weights, head} at a time of the clock, interpolated between two frames; null before the first one. */
  at(now) {
    if (this.#rest) return (this.#shown = resting(this.#rest, now));
    if (this.origin === null || !this.#frames.length) return this.#shown;
    if (!this.#shown && now - this.origin < this.#frames[0].time) return null;
    const frames = this.#frames, time = now - this.origin;
    while (frames.length > 1 && frames[1].time <= time) frames.shift();
    const [one, next] = frames;
    const share = next ? clip((time - one.time) / (next.time - one.time)) : 0;
    const pose = share ? mixed(one, next, share) : one;
    return (this.#shown = this.#jump ? this.#joined(pose, now) : pose);
  }

  #joined(pose, now) {
    const { from } = this.#jump, at = clip((now - (this.#jump.began ??= now)) / JOIN_S);
    if (at === 1) this.#jump = null;
    return mixed(from, pose, at * at * (3 - 2 * at));
  }
}

function resting({ from, began }, now) {
  const left = 1 - clip((now - began) / REST_S);
  return { weights: from.weights.map((weight) => weight * left), head: from.head };
}

function mixed(one, other, share) {
  const rows = (a, b) => a.map((value, n) => value + share * (b[n] - value));
  const head = one.head && other.head ? rows(one.head, other.head) : other.head ?? one.head;
  return { weights: rows(one.weights, other.weights), head };
}

function clip(share) {
  return Math.min(Math.max(share, 0), 1);
}
