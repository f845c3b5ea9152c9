// The timeline of a project as the page shows it: what the server sent, with edits that it has not confirmed yet.

import { FEATURES, curveValue, rounded } from "./timeline_view.js";

const LEAST_S = 0.01;
export const STRENGTH = { low: 0, high: 3, rest: 1, flank: 0.5 };
export const WEIGHT = { low: -0.5, high: 1.5, rest: 0, flank: 0.6 };
const OPEN_END = Infinity;

export class TimelineModel {
  constructor(timeline = {}) {
    this.set(timeline);
  }

  set(timeline) {
    const copy = JSON.parse(JSON.stringify(timeline ?? {}));
    const ended = (spans) => (spans ?? []).map((span) => ({ ...span, end: span.end ?? OPEN_END }));
    this.style = copy.style ?? {};
    this.spans = ended(copy.spans).flatMap((span) => expand(span));
    this.expressions = ended(copy.expressions);
    this.nods = copy.nods ?? [];
    this.gaze = ended(copy.gaze);
    this.listens = ended(copy.listens);
    this.strengths = byName(copy.strengths, "feature");
    this.curves = byName(copy.curves, "expression");
    this.channels = byName(copy.edits, "channel");
    this.seeds = copy.seeds ?? {};
    this.gains = copy.gains ?? {};
  }

  spansOf(feature) {
    return this.spans.filter((span) => span.feature === feature).sort((a, b) => a.start - b.start);
  }

  /** Keys of a row that has a curve, its limits, and what names it in an edit. */
  curveOf(row, chosen) {
    if (row.feature) return { keys: this.strengths.get(row.feature) ?? [], limits: STRENGTH, edit: { kind: "strength", feature: row.feature } };
    if (row.id === "curve") {
      return { keys: this.curves.get(chosen.expression) ?? [], limits: WEIGHT, edit: { kind: "curve", expression: chosen.expression } };
    }
    if (row.id !== "channel") return null;
    const limits = { low: -1000, high: 1000, rest: 0, flank: 0.3 };
    return { keys: this.channels.get(chosen.channel) ?? [], limits, edit: { kind: "channel", channel: chosen.channel } };
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

  withKeys(curve, keys) {
    return { ...curve.edit, keys: [...keys].sort((a, b) => a[0] - b[0]) };
  }

  /** Apply an edit as the server will. */
  apply(edit) {
    const change = {
      paint: () => this.#paint(edit, edit.style),
      erase: () => this.#paint(edit, null),
      strength: () => setKeys(this.strengths, edit.feature, edit.keys),
      curve: () => setKeys(this.curves, edit.expression, edit.keys),
      channel: () => setKeys(this.channels, edit.channel, edit.keys),
      nod: () => (this.nods = [...this.nods, { time: edit.time, size: edit.size }].sort((a, b) => a.time - b.time)),
      remove_nod: () => (this.nods = this.nods.filter((nod) => Math.abs(nod.time - edit.time) > 1e-6)),
      gaze: () => (this.gaze = placed(this.gaze, edit)),
      remove_gaze: () => (this.gaze = without(this.gaze, edit.time)),
      listen: () => (this.listens = placed(this.listens, edit)),
      remove_listen: () => (this.listens = without(this.listens, edit.time)),
      seed: () => (this.seeds = { ...this.seeds, [edit.feature]: edit.seed }),
    }[edit.kind];
    change?.();
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

function byName(curves, name) {
  return new Map((curves ?? []).map((curve) => [curve[name], curve.keys]));
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
function placed(spans, edit) {
  return [...cut(spans, edit.start, edit.end), { ...edit }].sort((a, b) => a.start - b.start);
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
    nod: `nod at ${edit.time} seconds`,
    remove_nod: "removed a nod",
    gaze: `gaze target${span}`,
    remove_gaze: "removed a gaze target",
    listen: `the face listens${span}`,
    remove_listen: "removed a listening span",
    seed: `new seed for ${edit.feature}`,
  };
  return names[edit.kind] ?? `changed the curve of ${edit.feature ?? edit.expression ?? edit.channel}`;
}
