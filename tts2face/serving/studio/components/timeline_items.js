// Elements of the rows of a timeline as a list: what keys reach, what a pointer hits, and what a screen reader says.

import { KINDS } from "./protocol.js";
import { SPAN_ROWS, columnOf, frameValue } from "./timeline_values.js";
import { curveValue, firstAfter, gestureLabel } from "./timeline_view.js";

const HIT_PX = 6;

/** Elements of a row in order of time: {kind, begin, end, label, ...what it is}. */
export function rowItems(row, state) {
  const { model, preview, chosen } = state;
  const make = {
    words: () => preview.words.map(([text, begin, end, , isDoubtful], index) => ({ kind: "word", begin, end, index, name: text, label: `${isDoubtful ? "doubtful " : ""}word ${text}` })),
    phones: () => state.phones.map((phone, index) => ({ kind: "phone", begin: phone[1], end: phone[2], index, name: phone[0], label: `phone ${phone[0]}` })),
    gestures: () => model.gestures.map((one) => ({ kind: "gesture", begin: one.time, end: one.time, gesture: one, label: `${gestureLabel(one.name)} of size ${one.size}` })),
    curve: () => keyItems(row, state, chosen.expression),
    channel: () => keyItems(row, state, chosen.channel),
  }[row.id];
  if (make) return make();
  const spans = SPAN_ROWS[row.id];
  if (spans) return model[spans.list].map((one) => ({ kind: spans.kind, begin: one.start, end: one.end, element: one, label: spans.label(one) }));
  if (!row.feature) return [];
  const styles = model.spansOf(row.feature).map((span) => ({ kind: "span", begin: span.start, end: span.end, span, label: `style ${span.style}` }));
  return [...styles, ...keyItems(row, state, `strength of ${row.label}`)].sort((a, b) => a.begin - b.begin);
}

function keyItems(row, state, name) {
  const curve = state.model.curveOf(row, state.chosen);
  if (!curve) return [];
  return curve.keys.map(([time, value], number) => ({ kind: "key", begin: time, end: time, number, value, label: `key point of ${name}, value ${value}` }));
}

export function describeItem(item, duration) {
  const end = Math.min(item.end, duration);
  const span = end > item.begin ? `from ${item.begin.toFixed(2)} to ${end.toFixed(2)} seconds` : `at ${item.begin.toFixed(2)} seconds`;
  return `${item.label}, ${span}`;
}

export function rowAt(rows, y) {
  return rows.find((row) => y >= row.y && y < row.y + row.height) ?? null;
}

/** Limits of the values that a row shows: those of the chosen channel follow its curve. */
export function shownLimits(row, state, channelRange) {
  if (row.feature) return KINDS.strengths.limits;
  return row.id === "curve" ? KINDS.curves.limits : channelRange(state);
}

/** Value at which a key of a row is drawn: that of the finished channel, else the key's own. */
export function shownValue(row, state, [time, value]) {
  if (row.id !== "channel") return value;
  return channelValue(state, time);
}

/** Value of the chosen channel at a time, with corrections that the preview does not have yet. */
export function channelValue(state, time) {
  const column = columnOf(state.preview, state.chosen.channel);
  if (column === null) return 0;
  const keys = state.model.edits.get(state.chosen.channel) ?? [];
  return frameValue(state.preview, column, time) + curveValue(keys, time) - curveValue(state.baseKeys, time);
}

/** The edge of a phone next to a place: {index of the phone that begins there, low, high}; null without one. */
export function edgeAt(state, x) {
  const { phones, view } = state, time = view.time(x);
  let best = null, least = HIT_PX;
  for (let i = Math.max(firstAfter(phones, time, (phone) => phone[2]) - 1, 0); i < phones.length; i++) {
    const away = Math.abs(view.x(phones[i][1]) - x);
    if (phones[i][4] > 0 && away <= least) [best, least] = [i, away];
    if (view.x(phones[i][1]) > x + HIT_PX) break;
  }
  return best;
}

/** Places in time that others snap to. */
export function snapTimes(state) {
  const { preview, phones, model, view } = state, times = [0, view.duration];
  for (const items of [preview.words, phones]) {
    for (let i = firstAfter(items, view.start, (item) => item[2]); i < items.length && items[i][1] < view.end; i++) times.push(items[i][1], items[i][2]);
  }
  for (const span of model.spans) times.push(span.start, span.end);
  return times;
}

export function hitKey(row, state, x, y, valueToY) {
  const curve = state.model.curveOf(row, state.chosen);
  if (!curve) return null;
  const number = curve.keys.findIndex((key) => {
    const dy = valueToY(shownValue(row, state, key)) - y;
    return Math.hypot(state.view.x(key[0]) - x, dy) <= HIT_PX + 2;
  });
  return number < 0 ? null : { curve, number };
}

