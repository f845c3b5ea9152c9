// A head that speaks, listens and rests by the service: its poses, and its events when they are heard. Draws nothing.

import { CurveTrack } from "./curves.js";
import { LiveStream } from "./live_stream.js";
import { PushedSound } from "./pushed_sound.js";
import { blocksOf, capture, floats, isBlock, shorts } from "./samples.js";
import { SoundClock } from "./sound_clock.js";

const AHEAD_S = 0.1; // between a message and its first frame
const MOST_AHEAD_S = 1; // of idle motion: the clocks of service and device differ
const PART = 8000; // characters of a message
const LOST = new Set(["speech", "sound", "curves", "gesture", "style", "note", "flushed"]); // between cancel and answer
const LIPS = /^(?:jaw|mouth|tongue|viseme)/i;

export class LiveHead {
  clock = new SoundClock();
  #target;
  #emit;
  #stream;
  #motion = new CurveTrack(); // of text, idle and listening
  #lips = new CurveTrack(); // of pushed sound
  #marks = []; // {time on the stream of #motion, type, detail}
  #pieces = [];
  #spans = []; // [begin, end] of speech on that stream
  #next = null; // the speech whose sound comes
  #utterances = new Map(); // id -> function that ends it
  #n = 0;
  #cancels = 0; // that have not been answered
  #pushed = null;
  #listening = null;
  #isOpen = false;
  #state = "";

  /** `target`: {server, key, start}, the first message of the stream; `emit` gets (type, detail). */
  constructor(target, emit) {
    this.#target = target;
    this.#emit = emit;
    this.#stream = new LiveStream(target.server, target.key, target.start, (event) => this.#follow(event));
  }

  /** Speak a text, or a stream of its parts as a model writes them; resolves when it has been heard, or interrupted. */
  async speak(text) {
    this.#endListening();
    const id = String(++this.#n), end = this.#begin(id);
    this.#sound();
    for await (const part of typeof text === "string" ? [text] : blocksOf(text)) {
      if (!this.#utterances.has(id)) break; // interrupted
      for (let at = 0; at < (part?.length ?? 0); at += PART) this.#stream.send({ type: "text", text: part.slice(at, at + PART) });
    }
    if (this.#utterances.has(id)) this.#stream.send({ type: "flush", id });
    return end;
  }

  /** Speak sound: a block of one utterance, which `endSound` ends, or a stream of blocks or a MediaStream. */
  async push(sound, rate) {
    this.#endListening();
    this.#sound();
    const { context } = this.clock, isMedia = globalThis.MediaStream && sound instanceof MediaStream;
    this.#pushed ??= this.#beginSound(isMedia ? context.sampleRate : rate);
    const { pushed, end } = this.#pushed;
    if (isMedia) {
      this.#pushed.release = await capture(context, sound, (block) => pushed.add(block));
      sound.addEventListener("inactive", () => this.#pushed?.pushed === pushed && this.endSound());
    } else if (isBlock(sound)) pushed.add(sound);
    else {
      for await (const block of blocksOf(sound)) {
        if (this.#pushed?.pushed !== pushed) break; // interrupted
        pushed.add(block);
      }
      if (this.#pushed?.pushed === pushed) this.endSound();
    }
    return end;
  }

  endSound() {
    this.#pushed?.release?.();
    this.#pushed?.pushed.end();
  }

  /** Listen to somebody, until the next speech: to no sound, a MediaStream, or a stream of blocks at a rate. */
  async listen(sound, rate) {
    this.#endListening();
    const listening = (this.#listening = { release: null });
    const hear = (block) => this.#listening === listening && this.#isOpen && this.#stream.send(shorts(block));
    if (!sound) return this.#stream.send({ type: "listen", rate: null });
    if (globalThis.MediaStream && sound instanceof MediaStream) {
      this.#stream.send({ type: "listen", rate: this.clock.context.sampleRate });
      listening.release = await capture(this.clock.context, sound, hear);
      if (this.#listening !== listening) listening.release();
      return;
    }
    this.#stream.send({ type: "listen", rate });
    for await (const block of blocksOf(sound)) if (hear(block) === false) return;
  }

  /** Send another message of docs/http.md, such as a gesture or a style. */
  send(message) {
    this.#stream.send(message);
  }

  /** Be silent at once, forget what waits; returns the seconds that were heard of what is spoken. */
  interrupt() {
    const { now } = this.clock, time = now - this.#motion.origin;
    const span = this.#spans.find(([begin, end]) => begin <= time && time < end);
    const seconds = this.#pushed ? this.#pushed.pushed.heard(now) : span ? time - span[0] : 0;
    if (this.#isOpen) {
      this.#stream.send({ type: "cancel" });
      this.#cancels += 1;
    }
    this.#silence();
    for (const end of [...this.#utterances.values()]) end({ interrupted: true, seconds });
    return seconds;
  }

  /** Emit what has been heard since the last call. */
  tick() {
    const { now } = this.clock, time = now - this.#motion.origin;
    while (this.#marks.length && this.#motion.origin !== null && this.#marks[0].time <= time) {
      const { type, detail } = this.#marks.shift();
      if (type === "end") this.#utterances.get(detail.id)?.({ interrupted: false, seconds: detail.seconds });
      else this.#emit(type, detail);
    }
    while (this.#spans.length && this.#spans[0][1] < time - 1) this.#spans.shift();
    const { pushed, id } = this.#pushed ?? {};
    if (pushed && pushed.origin !== null && now - pushed.origin >= pushed.seconds) {
      this.#utterances.get(id)({ interrupted: false, seconds: pushed.seconds });
    }
    this.#show(now, time);
  }

  /** Names, weights and head {pitch, ...} of what is heard now; null before the first frame. */
  pose() {
    const { now } = this.clock, motion = this.#motion.at(now), lips = this.#lips.at(now);
    if (!motion && !lips) return null;
    if (!motion) return { names: this.#lips.names, weights: lips.weights, head: null };
    const names = this.#motion.names, weights = [...motion.weights];
    if (lips) {
      lips.weights.forEach((weight, n) => {
        const at = names.indexOf(this.#lips.names[n]);
        if (at >= 0) weights[at] = Math.min(weights[at] + weight, Math.max(1, weights[at], weight));
      });
    }
    const head = motion.head && Object.fromEntries(this.#motion.headNames.map((name, n) => [name, motion.head[n]]));
    return { names, weights, head };
  }

  async close() {
    this.#endListening();
    this.#silence();
    this.#stream.close();
    for (const end of [...this.#utterances.values()]) end({ interrupted: true, seconds: 0 });
    await this.clock.close();
  }

  #follow(event) {
    if (this.#cancels && LOST.has(event.type)) return;
    const { now } = this.clock;
    switch (event.type) {
      case "connection":
        return this.#connect(event);
      case "speech":
        this.#place(event.begin);
        return this.#mark(event);
      case "sound":
        this.#pieces.push(this.clock.play(floats(event.samples), this.#next.rate, this.#motion.origin + this.#next.begin));
        return undefined;
      case "curves":
        // those of speech belong to its sound, which has its place
        if (event.begin >= (this.#spans.at(-1)?.[1] ?? -Infinity) - 0.001 || this.#motion.origin === null) this.#place(event.begin, true);
        return this.#motion.add(event);
      case "flushed": {
        const [begin, end] = this.#spans.at(-1) ?? [0, 0];
        this.#marks.push({ time: end, type: "end", detail: { id: event.id, seconds: end - begin } });
        this.#motion.origin ??= now - end;
        return undefined;
      }
      case "cancelled":
        this.#cancels = Math.max(0, this.#cancels - 1);
        return undefined;
      case "error":
      case "note":
        return this.#emit(event.type, { message: event.message, text: event.text });
      default:
        return undefined;
    }
  }

  #connect({ state, reason }) {
    this.#isOpen = state === "open";
    if (this.#isOpen) return;
    this.#cancels = 0;
    this.#endListening();
    this.#silence();
    for (const end of [...this.#utterances.values()]) end({ interrupted: true, seconds: 0 });
    this.#emit("error", { message: reason, isFinal: state === "refused" });
  }

  /** Give the time `begin` of the stream its place on the clock: later where it is late, idle motion also earlier. */
  #place(begin, isIdle = false) {
    const { now } = this.clock, motion = this.#motion, due = motion.origin + begin - now;
    if (motion.origin === null) motion.origin = now + AHEAD_S - begin;
    else if (due < 0 || (isIdle && due > MOST_AHEAD_S && !this.#marks.length)) {
      const later = AHEAD_S - due;
      motion.origin += later;
      motion.join(now);
      for (const piece of this.#pieces) if (piece.at > now) this.clock.move(piece, piece.at + later);
    }
  }

  #mark(event) {
    const { text, begin, seconds, words, phones } = event, end = begin + seconds;
    const found = [{ time: words[0]?.[1] ?? begin, type: "caption", detail: { text, seconds } }];
    for (const [word, from, to] of words) found.push({ time: from, type: "word", detail: { word, seconds: to - from, text } });
    for (const [phone, from, to] of phones) found.push({ time: from, type: "phone", detail: { phone, seconds: to - from } });
    this.#marks.push(...found.sort((one, other) => one.time - other.time));
    this.#spans.push([begin, end]);
    this.#next = event;
    this.#pieces = this.#pieces.filter((piece) => piece.at + piece.buffer.duration > this.clock.now);
  }

  #begin(id) {
    return new Promise((resolve) => {
      this.#utterances.set(id, (how) => {
        this.#utterances.delete(id);
        if (this.#pushed?.id === id) {
          this.#pushed = null;
          this.#lips.clear(this.clock.now);
        }
        resolve(how);
        this.#emit("end", { id, ...how });
      });
    });
  }

  #beginSound(rate) {
    if (!(rate >= 8000 && rate <= 192_000)) throw new RangeError(`the rate of sound must be 8000 to 192000 Hz, not ${rate}`);
    const { server, key, start } = this.#target, id = String(++this.#n), end = this.#begin(id);
    const options = Object.fromEntries(["talker", "face", "identity"].filter((name) => start[name]).map((name) => [name, start[name]]));
    const fail = (message) => {
      this.#emit("error", { message });
      this.#utterances.get(id)?.({ interrupted: true, seconds: 0 });
    };
    this.#lips = new CurveTrack();
    const { clock } = this, pushed = new PushedSound({ server, key, options, rate, clock, lips: this.#lips, fail });
    return { id, pushed, end, release: null };
  }

  #silence() {
    const { now } = this.clock;
    for (const piece of this.#pieces.splice(0)) this.clock.stop(piece);
    this.#pushed?.release?.();
    this.#pushed?.pushed.stop();
    this.#marks = [];
    this.#spans = [];
    this.#motion.clear(now);
  }

  #endListening() {
    this.#listening?.release?.();
    this.#listening = null;
  }

  async #sound() {
    if (!(await this.clock.resume())) this.#emit("blocked", {});
  }

  #show(now, time) {
    const isSpeaking = this.#spans.some(([begin, end]) => begin <= time && time < end)
      || (this.#pushed && this.#pushed.pushed.heard(now) > 0);
    const state = !this.#isOpen ? "offline" : isSpeaking ? "speaking" : this.#listening ? "listening" : "idle";
    if (state !== this.#state) this.#emit("state", { state: (this.#state = state) });
  }
}
