// The clock of a page: the sound that plays. Everything that moves reads `clock.time`, in seconds of the clip.

const LEAD_S = 0.02; // a source starts so much later, so that the device is not late for its first samples

class Clock {
  #context = null;
  #buffer = null;
  #source = null;
  #offset = 0; // of the clip where the source started, or where playing paused
  #started = 0; // time of the audio context at that place
  #rate = 1;
  #listeners = new Map();
  #pending = null;
  range = null; // [begin, end] that is repeated while playing

  /** Replace the sound: 16-bit samples at `rate` Hz. Playing goes on at the same place. */
  load(pcm, rate) {
    this.#pending = { pcm, rate };
    const playing = this.playing, at = this.time;
    this.#buffer = null;
    if (playing) this.play(at);
    this.#emit("load");
  }

  get duration() {
    return this.#pending ? this.#pending.pcm.length / this.#pending.rate : 0;
  }

  get playing() {
    return this.#source !== null;
  }

  get speed() {
    return this.#rate;
  }

  set speed(rate) {
    const at = this.time;
    this.#rate = rate;
    if (this.playing) this.play(at);
  }

  /** Seconds of the clip that are heard now; the delay of the output is subtracted. */
  get time() {
    if (!this.playing) return this.#offset;
    const delay = this.#context.outputLatency || this.#context.baseLatency || 0;
    const heard = (this.#context.currentTime - this.#started - delay) * this.#rate;
    return Math.min(this.#offset + Math.max(heard, 0), this.duration);
  }

  /** Play from a place, from the current one without an argument, from the start at the end of the clip. */
  async play(from) {
    if (!this.#pending) return;
    let at = from ?? this.#offset;
    if (this.range && (at < this.range[0] || at >= this.range[1])) at = this.range[0];
    if (at >= this.duration - 0.01) at = this.range ? this.range[0] : 0;
    this.#stop();
    this.#offset = at;
    this.#context ??= new AudioContext();
    const source = this.#context.createBufferSource();
    source.buffer = this.#buffer ??= this.#decode();
    source.playbackRate.value = this.#rate;
    source.connect(this.#context.destination);
    source.onended = () => this.#ended(source);
    this.#source = source;
    this.#started = this.#context.currentTime + LEAD_S;
    if (this.#context.state === "suspended") await this.#context.resume();
    if (this.#source !== source) return;
    this.#started = this.#context.currentTime + LEAD_S;
    source.start(this.#started, at, this.range ? this.range[1] - at : undefined);
    this.#emit("play");
  }

  pause() {
    if (!this.playing) return;
    this.#offset = this.time;
    this.#stop();
    this.#emit("pause");
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  seek(time) {
    const at = Math.min(Math.max(time, 0), this.duration);
    if (this.playing) this.play(at);
    else this.#offset = at;
    this.#emit("seek");
  }

  /** Call a function at "load", "play", "pause", "seek" or "end"; returns a function that stops it. */
  on(event, listener) {
    if (!this.#listeners.has(event)) this.#listeners.set(event, new Set());
    this.#listeners.get(event).add(listener);
    return () => this.#listeners.get(event).delete(listener);
  }

  #decode() {
    const { pcm, rate } = this.#pending;
    const buffer = this.#context.createBuffer(1, Math.max(pcm.length, 1), rate);
    const samples = buffer.getChannelData(0);
    for (let i = 0; i < pcm.length; i++) samples[i] = pcm[i] / 32768;
    return buffer;
  }

  #stop() {
    if (!this.#source) return;
    this.#source.onended = null;
    try {
      this.#source.stop();
    } catch {
      // it had not started yet
    }
    this.#source.disconnect();
    this.#source = null;
  }

  #ended(source) {
    if (this.#source !== source) return;
    this.#source = null;
    if (this.range) {
      this.play(this.range[0]);
      return;
    }
    this.#offset = this.duration;
    this.#emit("end");
  }

  #emit(event) {
    for (const listener of this.#listeners.get(event) ?? []) listener();
  }
}

export const clock = new Clock();
