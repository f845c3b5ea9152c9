// Least and greatest samples of a sound in blocks, one list for each zoom level, each made once.

const FIRST_BLOCK = 64, GROWTH = 4;

export class Waveform {
  constructor(pcm, rate) {
    this.rate = rate;
    this.levels = [];
    let block = FIRST_BLOCK, low = new Int16Array(Math.ceil(pcm.length / block)), high = new Int16Array(low.length);
    for (let b = 0, i = 0; b < low.length; b++) {
      let least = 32767, most = -32768;
      for (const end = Math.min(i + block, pcm.length); i < end; i++) {
        const sample = pcm[i];
        if (sample < least) least = sample;
        if (sample > most) most = sample;
      }
      low[b] = least;
      high[b] = most;
    }
    this.levels.push({ block, low, high });
    while (low.length > 512) {
      block *= GROWTH;
      const n = Math.ceil(low.length / GROWTH), coarseLow = new Int16Array(n), coarseHigh = new Int16Array(n);
      for (let b = 0; b < n; b++) {
        coarseLow[b] = Math.min(...low.subarray(b * GROWTH, b * GROWTH + GROWTH));
        coarseHigh[b] = Math.max(...high.subarray(b * GROWTH, b * GROWTH + GROWTH));
      }
      [low, high] = [coarseLow, coarseHigh];
      this.levels.push({ block, low, high });
    }
  }

  /** Least and greatest sample in [-1, 1] of each pixel of a view. */
  draw(context, view, top, height) {
    const perPixel = this.rate / view.scale;
    const level = this.levels.findLast((one) => one.block <= perPixel) ?? this.levels[0];
    const middle = top + height / 2, gain = height / 2 / 32768;
    context.beginPath();
    for (let x = 0; x < view.width; x++) {
      const first = Math.floor((view.time(x) * this.rate) / level.block);
      const last = Math.max(Math.floor((view.time(x + 1) * this.rate) / level.block), first + 1);
      let least = 0, most = 0;
      for (let b = Math.max(first, 0); b < last && b < level.low.length; b++) {
        if (level.low[b] < least) least = level.low[b];
        if (level.high[b] > most) most = level.high[b];
      }
      context.rect(x, middle - most * gain, 1, Math.max((most - least) * gain, 1));
    }
    context.fill();
  }
}
