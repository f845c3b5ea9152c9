// Measures of a page for tests and for the curious: frames per second and milliseconds of script per frame.

export const metrics = (window.__studio = window.__studio ?? {});

const PAUSE_MS = 1000; // between two pieces of work of which the second begins a new measure

/** Mean time of a repeated piece of work over a second, written to `metrics` under two names. */
export class Meter {
  #since = -Infinity;
  #last = -Infinity;
  #spent = [];

  constructor(timeName, rateName) {
    this.names = [timeName, rateName];
  }

  add(milliseconds) {
    const now = performance.now();
    if (now - this.#last > PAUSE_MS) {
      this.#since = now - milliseconds;
      this.#spent = [];
    }
    this.#last = now;
    this.#spent.push(milliseconds);
    const elapsed = now - this.#since;
    if (elapsed < 1000) return;
    const [timeName, rateName] = this.names, spent = this.#spent;
    metrics[timeName] = spent.reduce((sum, one) => sum + one, 0) / spent.length;
    if (rateName) metrics[rateName] = (spent.length * 1000) / elapsed;
    this.#since = now;
    this.#spent = [];
  }
}
