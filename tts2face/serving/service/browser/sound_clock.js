// The clock of a head: the sound that is heard. While no sound may play yet, the time of the page stands for it.

/** Seconds that run with the sound of the device; sound is placed on them. */
export class SoundClock {
  #context = null;
  #isSounding = false; // whether the device's time is read, not the page's
  #shift = 0; // from the one that is read to the seconds of the clock
  #pieces = new Set();

  /** Seconds of what is heard now; never less than before by more than the device's own estimate of its delay. */
  get now() {
    return this.#raw() + this.#shift;
  }

  /** Whether sound is heard: browsers let a page sound after a click or a key. */
  get isSounding() {
    return this.#isSounding;
  }

  /** The context of the sound, made when it is first asked for. */
  get context() {
    if (!this.#context) {
      this.#context = new AudioContext({ latencyHint: "interactive" });
      this.#context.onstatechange = () => this.#follow();
      this.#follow();
    }
    return this.#context;
  }

  /** Let sound be heard; whether it is. */
  async resume() {
    const { context } = this;
    // the promise of a context that may not sound yet stays open until the first click
    await Promise.race([context.resume(), new Promise((done) => setTimeout(done, 300))]);
    this.#follow();
    return this.#isSounding;
  }

  /** Play samples (Float32Array, -1 to 1) so that the first is heard at a time of the clock; returns what `stop` takes. */
  play(samples, rate, at) {
    const buffer = this.context.createBuffer(1, Math.max(samples.length, 1), rate);
    buffer.copyToChannel(samples, 0);
    const piece = { buffer, at, source: null };
    this.#pieces.add(piece);
    this.#start(piece);
    return piece;
  }

  /** Move a piece that has not been heard to another time. */
  move(piece, at) {
    if (!this.#pieces.has(piece)) return;
    this.#end(piece);
    piece.at = at;
    this.#start(piece);
  }

  stop(piece) {
    this.#end(piece);
    this.#pieces.delete(piece);
  }

  async close() {
    for (const piece of [...this.#pieces]) this.stop(piece);
    await this.#context?.close();
  }

  #raw() {
    if (!this.#isSounding) return performance.now() / 1000;
    return this.#context.currentTime - (this.#context.outputLatency || this.#context.baseLatency || 0);
  }

  #follow() {
    const isSounding = this.#context.state === "running";
    if (isSounding === this.#isSounding) return;
    const at = this.now;
    this.#isSounding = isSounding;
    this.#shift = at - this.#raw();
    for (const piece of this.#pieces) {
      this.#end(piece);
      this.#start(piece);
    }
  }

  /** Give a piece to the device; one that has begun already from the place where it is now. */
  #start(piece) {
    if (this.now > piece.at + piece.buffer.duration) return void this.#pieces.delete(piece);
    if (!this.#isSounding) return; // it is given when sound may be heard
    const source = this.#context.createBufferSource(), from = piece.at - this.#shift;
    source.buffer = piece.buffer;
    source.connect(this.#context.destination);
    source.onended = () => this.#pieces.delete(piece);
    source.start(Math.max(from, 0), Math.max(0, this.#context.currentTime - from));
    piece.source = source;
  }

  #end(piece) {
    if (!piece.source) return;
    piece.source.onended = null;
    piece.source.stop();
    piece.source.disconnect();
    piece.source = null;
  }
}
