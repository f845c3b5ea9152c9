// What of a clip a timeline shows, and where: rows, seconds and pixels, places to snap to.

export const FEATURE_LABELS = {
  expression: "Expression",
  brows: "Brows",
  blink: "Eyelids",
  gaze: "Gaze",
  cheeks: "Cheeks, nose",
  head: "Head",
};
/** Name of a gesture as people read it. */
export const gestureLabel = (name) => name.replaceAll("_", " ");

const MAX_SCALE = 2000; // pixels per second
const SNAP_PX = 7;

/** Rows from top to bottom with their places. */
export function layoutRows(features) {
  const rows = [
    { id: "ruler", label: "Time", height: 22 },
    { id: "wave", label: "Sound", height: 44 },
    { id: "words", label: "Words", height: 20 },
    { id: "phones", label: "Phones", height: 22 },
    ...features.map((feature) => ({ id: `lane:${feature}`, feature, label: FEATURE_LABELS[feature] ?? feature, height: 27 })),
    { id: "curve", label: "Expression keys", height: 44 },
    { id: "gestures", label: "Gestures", height: 22 },
    { id: "targets", label: "Gaze targets", height: 22 },
    { id: "listens", label: "Listening", height: 22 },
    { id: "channel", label: "Channel", height: 72 },
  ];
  let y = 0;
  for (const row of rows) {
    row.y = y;
    y += row.height;
  }
  return rows;
}

export class View {
  start = 0; // seconds at the left edge
  scale = 100; // pixels per second
  width = 1;
  duration = 0;

  x(time) {
    return (time - this.start) * this.scale;
  }

  time(x) {
    return this.start + x / this.scale;
  }

  get end() {
    return this.time(this.width);
  }

  get leastScale() {
    return this.width / Math.max(this.duration, 0.1);
  }

  fit() {
    this.scale = this.leastScale;
    this.start = 0;
  }

  zoom(factor, x) {
    const at = this.time(x);
    this.scale = Math.min(Math.max(this.scale * factor, this.leastScale), MAX_SCALE);
    this.moveTo(at - x / this.scale);
  }

  moveTo(start) {
    this.start = Math.min(Math.max(start, 0), Math.max(this.duration - this.width / this.scale, 0));
  }

  /** Show a time; a time outside begins a new page. */
  reveal(time) {
    if (time >= this.start && time <= this.end) return false;
    this.moveTo(time < this.start ? time - 0.1 * (this.width / this.scale) : time - 0.05 * (this.width / this.scale));
    return true;
  }

  /** The nearest of some times within a few pixels, else the time itself. */
  snap(time, times) {
    let best = time, least = SNAP_PX / this.scale;
    for (const one of times) {
      const away = Math.abs(one - time);
      if (away < least) [best, least] = [one, away];
    }
    return best;
  }
}

/** Index of the first of some elements, sorted by time, whose end lies after a time. */
export function firstAfter(items, time, end) {
  let low = 0, high = items.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (end(items[middle]) > time) high = middle;
    else low = middle + 1;
  }
  return low;
}

/** Value at a time of the curve through keys, as tts2face/gestures/elements.py; `empty` without keys. */
export function curveValue(keys, time, empty = 0) {
  if (!keys.length) return empty;
  if (time <= keys[0][0]) return keys[0][1];
  const next = firstAfter(keys, time, (key) => key[0]);
  if (next >= keys.length) return keys[keys.length - 1][1];
  const [before, after] = [keys[next - 1], keys[next]];
  const share = (time - before[0]) / (after[0] - before[0]);
  return before[1] + (after[1] - before[1]) * share * share * (3 - 2 * share);
}

export function formatTime(time) {
  const minutes = Math.floor(time / 60), seconds = time - 60 * minutes;
  return `${minutes}:${seconds.toFixed(2).padStart(5, "0")}`;
}

export const rounded = (value) => Math.round(value * 1000) / 1000;
