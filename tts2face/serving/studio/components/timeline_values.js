// Values of curves and where they are drawn.

import { HEAD_CHANNELS, KINDS } from "./protocol.js";

export function valueY(row, value, low, high) {
  return row.y + row.height - 6 - ((value - low) / (high - low)) * (row.height - 12);
}

export function yValue(row, y, low, high) {
  return low + ((row.y + row.height - 6 - y) / (row.height - 12)) * (high - low);
}

/** Column of a channel as `Preview.value` takes it; null for an unknown name. */
export function columnOf(preview, name) {
  if (!name || !preview.nFrames) return null;
  const head = HEAD_CHANNELS.indexOf(name);
  if (head >= 0) return head - 6;
  const column = preview.channel(name);
  return column < 0 ? null : column;
}

export function frameValue(preview, column, time) {
  const at = Math.min(Math.max(time * preview.fps, 0), preview.nFrames - 1), first = Math.floor(at);
  const next = Math.min(first + 1, preview.nFrames - 1);
  return preview.value(first, column) * (1 - at + first) + preview.value(next, column) * (at - first);
}

/** Least and greatest value of the chosen channel in both previews, with some room; made once for each revision. */
export function channelRange(state) {
  const { preview, comparison, chosen } = state, key = `${chosen.channel} ${preview.revision} ${comparison.revision}`;
  if (state.kept?.key === key) return state.kept.range;
  let low = 0, high = 0.05;
  for (const one of [preview, comparison]) {
    const column = columnOf(one, chosen.channel);
    for (let frame = 0; column !== null && frame < one.nFrames; frame++) {
      const value = one.value(frame, column);
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  const room = 0.15 * (high - low);
  state.kept = { key, range: [low < 0 ? low - room : low, high + room] };
  return state.kept.range;
}

/** Rows of spans of which one element at most holds at a time: kind of its elements, and values of a new one. */
export const SPAN_ROWS = {
  targets: {
    kind: KINDS.gaze.add, list: "gaze", title: "Gaze target", hint: "Double-click to add a direction of the eyes",
    made: { down_deg: 0, left_deg: 0 }, text: describeGaze, label: (one) => `eyes look ${describeGaze(one)}`,
  },
  listens: {
    kind: KINDS.listens.add, list: "listens", title: "Listening", hint: "Double-click where nothing is said to let the face listen",
    made: {}, text: () => "listens", label: () => "the face listens",
  },
};

export function describeGaze({ down_deg: down, left_deg: left }) {
  const parts = [];
  if (down) parts.push(`${Math.abs(down)}° ${down > 0 ? "down" : "up"}`);
  if (left) parts.push(`${Math.abs(left)}° to the ${left > 0 ? "person’s left" : "person’s right"}`);
  return parts.join(", ") || "at the viewer";
}
