// The timeline of a project as the page shows it: what the server sent, with edits that it has not confirmed yet.

import { EDITS, FEATURES, KINDS } from "./protocol.js";
import { curveValue, rounded } from "./timeline_view.js";

const LEAST_S = 0.01;
/** Value without effect of each kind of curve, and the seconds from a first key to those beside it that have it. */
const RESTS = { strengths: { rest: 1, flank: 0.5 }, curves: { rest: 0, flank: 0.6 }, edits: { rest: 0, flank: 0.3 } };
const OPEN_END = Infinity;

export class TimelineModel {
  constructor(timeline = {}) {
    this.set(timeline);
  }

  set(timeline) {
    const copy = JSON.parse(JSON.stringify(timeline ?? {}));
    const read = {
      span: (spans) => spans.map((span) => ({ ...span, end: span.end ?? OPEN_END })),
      instant: (instants) => instants,
      curve: (curves, owner) => new Map(curves.map((curve) => [curve[owner], curve.keys])),
    };
    for (const [name, { shape, owner }] of Object.entries(KINDS)) this[name] = read[shape](copy[name] ?? [], owner);
    this.spans = this.spans.flatMap((span) => expand(span));
    this.style = copy.style ?? {};
    this.seeds = copy.seeds ?? {};
    this.gains = copy.gains ?? {};
  }

  spansOf(feature) {
    return this.spans.filter((span) => span.feature === feature).sort((a, b) => a.start - b.start);
  }

  /** The curve of a row: its kind and lane, keys and limits; null for a row without one. */
  curveOf(row, chosen) {
    const rows = { curve: ["curves", chosen.expression], channel: ["edits", chosen.channel] };
    const [name, lane] = row.feature ? ["strengths", row.feature] : rows[row.id] ?? [];
    if (!name) return null;
    const [low, high] = KINDS[name].limits;
    return { name, lane, keys: this[name].get(lane) ?? [], limits: { low, high, ...RESTS[name] } };
  }

  /** The edit that adds a key; the first key of a curve gets one at rest on each side. */
  addKey(curve, time, value) {
    const { keys, limits } = curve, clamped = Math.min(Math.max(value, limits.low), limits.high);
    const key = [rounded(time), rounded(clamped)];
    if (keys.length) return this.withKeys(curve, [...keys.filter((one) => Math.abs(one[0] - key[0]) >= LEAST_S), key]);
    const flanks = [[rounded(time - limits.flank), limits.rest], [rounded(time + limits.flank), limits.rest]];
    return this.withKeys(curve, [...flanks.filter((one) => one[0] >= 0), key]);
  }

  moveKey(curve, number, time, value) {
    const { keys, limits } = curve;
    const low = number > 0 ? keys[number - 1][0] + LEAST_S : 0;
    const high = number + 1 < keys.length ? keys[number + 1][0] - LEAST_S : Infinity;
    const moved = [rounded(Math.min(Math.max(time, low), high)), rounded(Math.min(Math.max(value, limits.low), limits.high))];
    return this.withKeys(curve, keys.map((key, i) => (i === number ? moved : key)));
  }

  removeKey(curve, number) {
    const keys = curve.keys.filter((_, i) => i !== number);
    const idle = keys.every((key) => key[1] === curve.limits.rest);
    return this.withKeys(curve, idle ? [] : keys);
  }

  withKeys({ name, lane }, keys) {
    const { add, owner } = KINDS[name];
    return EDITS[add]({ [owner]: lane, keys: [...keys].sort((a, b) => a[0] - b[0]) });
  }

  /** Apply an edit as the server will. */
  apply(edit) {
    const { kind, ...element } = edit;
    const name = Object.keys(KINDS).find((one) => KINDS[one].add === kind || KINDS[one].remove === kind);
    if (name === undefined) {
      if (kind === "seed") this.seeds = { ...this.seeds, [edit.feature]: edit.seed };
      return;
    }
    const { shape, owner, add } = KINDS[name];
    if (name === "spans") this.#paint(edit, kind === add ? edit.style : null);
    else if (shape === "curve") setKeys(this[name], edit[owner], edit.keys);
    else if (kind === add) this[name] = (shape === "span" ? placed : inserted)(this[name], element);
    else this[name] = shape === "span" ? without(this[name], edit.time) : withoutNear(this[name], edit);
  }

  strengthAt(feature, time) {
    return curveValue(this.strengths.get(feature) ?? [], time, 1);
  }

  #paint({ feature, start, end }, style) {
    const own = cut(this.spans.filter((span) => span.feature === feature), start, end);
    if (style !== null) own.push({ feature, style, start, end });
    this.spans = [...this.spans.filter((span) => span.feature !== feature), ...joined(own.sort((a, b) => a.start - b.start))];
  }
}

function expand(span) {
  return span.feature === "all" ? FEATURES.map((feature) => ({ ...span, feature })) : [span];
}

function setKeys(curves, name, keys) {
  if (keys.length) curves.set(name, keys);
  else curves.delete(name);
}

/** Spans without what lies in [start, end). */
function cut(spans, start, end) {
  return spans.flatMap((span) =>
    [{ ...span, end: Math.min(span.end, start) }, { ...span, start: Math.max(span.start, end) }].filter((one) => one.start < one.end),
  );
}

/** Spans with one more, which replaces those under it. */
function placed(spans, span) {
  return [...cut(spans, span.start, span.end), span].sort((a, b) => a.start - b.start);
}

/** Instants with one more. */
function inserted(instants, instant) {
  return [...instants, instant].sort((a, b) => a.time - b.time);
}

function withoutNear(instants, { time, name }) {
  return instants.filter((instant) => instant.name !== name || Math.abs(instant.time - time) > 1e-6);
}

function without(spans, time) {
  return spans.filter((one) => !(one.start <= time && time < one.end));
}

/** Adjacent spans of one style as one. */
function joined(spans) {
  const result = [];
  for (const span of spans) {
    const last = result[result.length - 1];
    if (last && last.style === span.style && last.end >= span.start) last.end = Math.max(last.end, span.end);
    else result.push({ ...span });
  }
  return result;
}

/** What an edit did, for people who do not see it. */
export function describeEdit(edit) {
  const span = edit.start === undefined ? "" : ` from ${edit.start} to ${edit.end} seconds`;
  const names = {
    paint: `painted ${edit.style} on ${edit.feature}${span}`,
    erase: `erased ${edit.feature}${span}`,
    edge: `moved a phone edge to ${edit.time} seconds of its sentence`,
    gesture: `${edit.name} at ${edit.time} seconds`,
    remove_gesture: `removed a ${edit.name}`,
    gaze: `gaze target${span}`,
    remove_gaze: "removed a gaze target",
    listen: `the face listens${span}`,
    remove_listen: "removed a listening span",
    seed: `new seed for ${edit.feature}`,
  };
  return names[edit.kind] ?? `changed the curve of ${edit.feature ?? edit.expression ?? edit.channel}`;
}
