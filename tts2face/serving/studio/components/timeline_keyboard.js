// What keys do on the timeline: arrows move between rows and elements, Enter opens or paints, Delete removes.

import { clock } from "./clock.js";
import { rowItems } from "./timeline_items.js";
import { EDITS } from "./protocol.js";
import { SPAN_ROWS } from "./timeline_values.js";
import { curveValue, rounded } from "./timeline_view.js";

const STEP_S = 0.01;
const VALUE_STEPS = { curve: 0.05, channel: 0.02 };
const ZOOM = 1.4;

/** Perform a key; returns whether it was one of the timeline's. */
export function performKey(event, state, host) {
  const modified = event.ctrlKey || event.metaKey;
  if (modified) return modifiedKey(event, host);
  if (event.altKey && event.key.startsWith("Arrow")) return adjust(event.key, state, host);
  const keys = {
    " ": () => clock.toggle(),
    ArrowLeft: () => step(state, host, -1),
    ArrowRight: () => step(state, host, 1),
    ArrowUp: () => changeRow(state, host, -1),
    ArrowDown: () => changeRow(state, host, 1),
    Home: () => host.seek(0),
    End: () => host.seek(state.view.duration),
    ",": () => host.seek(clock.time - 1 / state.preview.fps),
    ".": () => host.seek(clock.time + 1 / state.preview.fps),
    "+": () => host.zoom(ZOOM),
    "=": () => host.zoom(ZOOM),
    "-": () => host.zoom(1 / ZOOM),
    0: () => host.fit(),
    "[": () => setEdge(state, host, 0),
    "]": () => setEdge(state, host, 1),
    Escape: () => host.setRange(null),
    Enter: () => enter(state, host),
    Delete: () => remove(state, host),
    Backspace: () => remove(state, host),
  };
  const action = keys[event.key];
  if (!action) return false;
  action();
  return true;
}

function modifiedKey(event, host) {
  if (event.key === "+" || event.key === "=") host.zoom(ZOOM);
  else if (event.key === "-") host.zoom(1 / ZOOM);
  else if (event.key === "0") host.fit();
  else return false;
  return true;
}

function current(state) {
  const { row } = state.cursor, items = rowItems(row, state);
  const index = items.findIndex((item) => same(item, state.cursor.item));
  return { row, items, index };
}

export function same(a, b) {
  return Boolean(a && b) && a.kind === b.kind && Math.abs(a.begin - b.begin) < 1e-6 && (a.index ?? a.number ?? a.gesture?.name) === (b.index ?? b.number ?? b.gesture?.name);
}

function step(state, host, direction) {
  const { row, items, index } = current(state);
  if (!items.length) {
    host.seek(clock.time + direction * (state.range ? STEP_S : 0.1));
    return;
  }
  let next = index + direction;
  if (index < 0) {
    const after = items.findIndex((item) => item.begin >= clock.time);
    next = direction > 0 ? (after < 0 ? items.length - 1 : after) : (after < 0 ? items.length : after) - 1;
  }
  const item = items[Math.min(Math.max(next, 0), items.length - 1)];
  host.focus(row, item);
  host.seek(item.begin);
}

function changeRow(state, host, direction) {
  const { rows, cursor } = state, at = rows.indexOf(cursor.row);
  const row = rows[Math.min(Math.max(at + direction, 0), rows.length - 1)];
  const time = cursor.item?.begin ?? clock.time;
  const items = rowItems(row, state);
  const item = items.length ? items.reduce((best, one) => (Math.abs(one.begin - time) < Math.abs(best.begin - time) ? one : best)) : null;
  host.focus(row, item);
}

function setEdge(state, host, side) {
  const range = state.range ? [...state.range] : [0, state.view.duration];
  range[side] = clock.time;
  host.setRange(range[1] - range[0] > STEP_S ? range : null);
}

/** Paint or erase the selection on a lane; add an element to an empty row; open the one that has the focus. */
function enter(state, host) {
  const { row, item } = state.cursor, time = rounded(clock.time);
  if (row.feature && state.range) {
    const range = { feature: row.feature, start: rounded(state.range[0]), end: rounded(state.range[1]) };
    if (state.brush.tool === "eraser") host.emit(EDITS.erase(range));
    else if (state.brush.style) host.emit(EDITS.paint({ ...range, style: state.brush.style }));
    return;
  }
  if (item && (item.begin === item.end ? Math.abs(item.begin - time) < 0.02 : true)) {
    host.pick(item);
    host.open(row, item);
    return;
  }
  if (row.id === "gestures") host.emit(EDITS.gesture({ time, name: "nod", size: 1, seconds: null, down_deg: null, left_deg: null }));
  else if (SPAN_ROWS[row.id]) {
    const { kind, made } = SPAN_ROWS[row.id];
    const [start, end] = state.range ?? [time, Math.min(time + 1, state.view.duration)];
    host.emit(EDITS[kind]({ start: rounded(start), end: rounded(end), ...made }));
  } else addKey(row, state, host, time);
}

function addKey(row, state, host, time) {
  const curve = state.model.curveOf(row, state.chosen);
  if (!curve || (row.id === "channel" && !state.chosen.channel)) return;
  host.emit(state.model.addKey(curve, time, curveValue(curve.keys, time, curve.limits.rest) + (VALUE_STEPS[row.id] ?? 0.1)));
  host.focus(row, rowItems(row, state).find((item) => item.kind === "key" && item.begin === time) ?? null);
}

function remove(state, host) {
  const { row, item } = state.cursor;
  if (row.feature && state.range) {
    host.emit(EDITS.erase({ feature: row.feature, start: rounded(state.range[0]), end: rounded(state.range[1]) }));
    return;
  }
  if (item) host.remove(row, item);
}

/** Alt and an arrow: move a phone's first edge, a key or a gesture by 10 ms, or change the value of a key. */
function adjust(key, state, host) {
  const { row, item } = state.cursor;
  if (!item) return true;
  const sideways = key === "ArrowLeft" ? -STEP_S : key === "ArrowRight" ? STEP_S : 0;
  const upwards = key === "ArrowUp" ? 1 : key === "ArrowDown" ? -1 : 0;
  if (item.kind === "phone" && sideways) host.nudgeEdge(item.index, sideways);
  else if (item.kind === "key") {
    const curve = state.model.curveOf(row, state.chosen), [time, value] = curve.keys[item.number];
    host.emit(state.model.moveKey(curve, item.number, time + sideways, value + upwards * (VALUE_STEPS[row.id] ?? 0.1)));
    host.focus(row, rowItems(row, state).find((one) => one.kind === "key" && one.number === item.number) ?? null);
  } else if (item.kind === "gesture") {
    const { time, size } = item.gesture;
    host.replaceGesture(item.gesture, { time: rounded(Math.max(time + sideways, 0)), size: size + 0.1 * upwards });
  }
  return true;
}
