// Speech of another program: it is heard when the service has made the lips that belong to it.

import { LiveStream } from "./live_stream.js";
import { Resampler, floats, shorts } from "./samples.js";

const MARGIN_S = 0.15; // between the first lips, or sound that comes late, and what is heard of it
const LEAST_S = 0.04; // of a message: the service works longer on many short ones
const MOST_SAMPLES = 32_000; // of a message, which has at most 64 KB

/** One utterance of pushed sound on a clock, whose lips a `CurveTrack` gets. */
export class PushedSound {
  #clock;
  #lips;
  #stream;
  #resampler;
  #gathered = []; // blocks that have not been sent
  #early = []; // samples that came before the first lips
  #pieces = [];
  #n = 0; // samples at the rate of the device so far
  #isEnded = false;
  seconds = Infinity; // of the whole utterance, once it is known

  /** `fail` is called with a reason when the service does not answer. */
  constructor({ server, key, options, rate, clock, lips, fail }) {
    this.#clock = clock;
    this.#lips = lips;
    this.rate = rate;
    this.fail = fail;
    this.#resampler = new Resampler(rate, clock.context.sampleRate);
    this.#stream = new LiveStream(server, key, { input: "audio", rate, ...options }, (event) => this.#follow(event));
  }

  /** Time of the clock at which its first sample is heard; null while nothing is known. */
  get origin() {
    return this.#lips.origin;
  }

  /** Seconds of it that have been heard. */
  heard(now) {
    return this.origin === null ? 0 : Math.min(Math.max(now - this.origin, 0), this.#n / this.#clock.context.sampleRate);
  }

  add(block) {
    this.#gathered.push(shorts(block));
    if (this.#gathered.reduce((sum, one) => sum + one.length, 0) >= LEAST_S * this.rate) this.#send();
  }

  /** All of it has come. */
  end() {
    if (this.#isEnded) return;
    this.#isEnded = true;
    this.#send();
    this.#stream.send({ type: "end" });
    this.#know();
  }

  /** Be silent at once. */
  stop() {
    this.#stream.close();
    for (const piece of this.#pieces) this.#clock.stop(piece);
  }

  #follow(event) {
    if (event.type === "curves") {
      this.#lips.add(event);
      if (this.origin === null) this.#start();
    } else if (event.type === "done") this.#stream.close();
    else if (event.type === "error" || (event.type === "connection" && event.state !== "open")) {
      this.stop();
      this.fail(event.message ?? event.reason);
    }
  }

  #send() {
    const samples = joined(this.#gathered.splice(0));
    for (let at = 0; at < samples.length; at += MOST_SAMPLES) this.#stream.send(samples.slice(at, at + MOST_SAMPLES));
    if (this.origin === null) this.#early.push(samples);
    else this.#play(samples);
  }

  /** Begin to be heard: the first lips have come, those of the next blocks come as fast as their sound. */
  #start() {
    this.#lips.origin = this.#clock.now + MARGIN_S;
    for (const samples of this.#early.splice(0)) this.#play(samples);
    this.#know();
  }

  #play(part) {
    const samples = this.#resampler.add(floats(part)), { sampleRate } = this.#clock.context, now = this.#clock.now;
    let at = this.origin + this.#n / sampleRate;
    if (at < now) {
      // the sender has paused: the rest is heard as much later
      this.#lips.origin += now + MARGIN_S - at;
      this.#lips.join(now);
      at = now + MARGIN_S;
    }
    this.#pieces.push(this.#clock.play(samples, sampleRate, at));
    this.#n += samples.length;
  }

  #know() {
    if (this.#isEnded && this.origin !== null) this.seconds = this.#n / this.#clock.context.sampleRate;
  }
}

function joined(blocks) {
  const whole = new Int16Array(blocks.reduce((sum, one) => sum + one.length, 0));
  let at = 0;
  for (const block of blocks) {
    whole.set(block, at);
    at += block.length;
  }
  return whole;
}
