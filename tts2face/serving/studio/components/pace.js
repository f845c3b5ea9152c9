// Which of the browser's frames draw while the clip plays. Where the processor draws, every frame costs it the whole
// window, moved playheads included: stage and timeline then draw in the same frames, about 30 a second.

const SOFTWARE_MS = 26; // least time between two drawn frames: every second one of a display of 60 Hz

class Pace {
  isSoftware = false; // whether the processor draws
  #last = -Infinity;
  #frame = -1;
  #draws = true;

  /** Of how many frames of a display, so many milliseconds apart, one draws. */
  steps(display) {
    return this.isSoftware ? Math.ceil(SOFTWARE_MS / display) : 1;
  }

  /** Whether the frame with the time of its callback draws; the same answer for all that ask in it. */
  draws(now) {
    if (now === this.#frame) return this.#draws;
    this.#frame = now;
    this.#draws = !this.isSoftware || now - this.#last >= SOFTWARE_MS;
    if (this.#draws) this.#last = now;
    return this.#draws;
  }
}

export const pace = new Pace();

/** Calls a function in each frame of the display while it returns true, and again once it is woken. */
export class Frames {
  #tick;
  #next = null;

  constructor(tick) {
    this.#tick = tick;
  }

  wake() {
    this.#next ??= requestAnimationFrame((now) => {
      this.#next = null;
      if (this.#tick(now)) this.wake();
    });
  }

  /** End for good. */
  stop() {
    cancelAnimationFrame(this.#next);
    this.#tick = () => false;
  }
}
