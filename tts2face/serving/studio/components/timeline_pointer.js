// What a pointer does on the timeline: each press begins one gesture, which moves with the pointer and ends in edits.

import { clock } from "./clock.js";
import { EDITS, LEAST_PHONE_S } from "./protocol.js";
import { SPAN_ROWS, channelRange, valueY, yValue } from "./timeline_values.js";
import { channelValue, edgeAt, hitKey, rowAt, rowItems, shownLimits, snapTimes } from "./timeline_items.js";
import { rounded } from "./timeline_view.js";

const SPAN_LEAST_S = 0.02; // of a painted span
const CLICK_PX = 3;
const RESIZE_PX = 5;
const NEW_S = 1.0; // of a new gaze target or listening span

export class PointerTools {
  /** `state` holds what is shown; `host` has the methods emit(edit), redraw(), pick(item), open(row, item). */
  constructor(element, state, host) {
    Object.assign(this, { element, state, host, gesture: null });
    element.addEventListener("pointerdown", (event) => this.down(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.up(event));
    element.addEventListener("pointercancel", () => this.cancel());
    element.addEventListener("dblclick", (event) => this.double(event));
  }

  at(event) {
    const box = this.element.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** Time at a place, moved to the next edge unless Alt is held. */
  time(x, event) {
    const { view } = this.state, time = Math.min(Math.max(view.time(x), 0), view.duration);
    return this.state.snaps && !event.altKey ? view.snap(time, snapTimes(this.state)) : time;
  }

  down(event) {
    if (event.button !== 0 || !this.state.view.duration) return;
    const { x, y } = this.at(event), row = rowAt(this.state.rows, y);
    if (!row) return;
    this.element.focus({ preventScroll: true });
    this.gesture = this.begin(row, x, y, event);
    if (!this.gesture) return;
    this.element.setPointerCapture(event.pointerId);
    this.gesture.from = x;
    this.gesture.moved = false;
    event.preventDefault();
  }

  begin(row, x, y, event) {
    if (row.id === "ruler") return this.scrub(x);
    if (row.id === "wave") return this.select(x, event);
    if (row.id === "phones") return this.edge(row, x) ?? this.choose(row, x);
    const key = hitKey(row, this.state, x, y, (value) => this.valueY(row, value));
    if (key) return this.key(row, key);
    if (row.feature) return this.state.brush.tool === "select" ? this.resize(row, x) : this.paint(row, x, event);
    if (row.id === "gestures") return this.instant(row, x) ?? this.choose(row, x);
    return this.choose(row, x);
  }

  move(event) {
    const { x, y } = this.at(event);
    if (!this.gesture) {
      this.element.style.cursor = this.cursor(x, y);
      return;
    }
    this.gesture.moved ||= Math.abs(x - this.gesture.from) >= CLICK_PX;
    this.gesture.move?.(x, y, event);
    this.host.redraw();
  }

  up(event) {
    const { gesture } = this;
    if (!gesture) return;
    this.gesture = null;
    gesture.end?.(this.at(event).x, gesture.moved, event);
    this.state.ghost = null;
    this.host.redraw();
  }

  cancel() {
    this.gesture?.cancel?.();
    this.gesture = this.state.ghost = null;
    this.host.redraw();
  }

  cursor(x, y) {
    const { state } = this, row = rowAt(state.rows, y);
    if (!row) return "default";
    if (row.id === "ruler" || row.id === "wave") return "text";
    if (row.id === "phones") return edgeAt(state, x) === null ? "pointer" : "ew-resize";
    if (hitKey(row, state, x, y, (value) => this.valueY(row, value))) return "move";
    if (row.feature) return state.brush.tool === "select" ? (this.spanEdge(row, x) ? "ew-resize" : "default") : "crosshair";
    return "default";
  }

  valueY(row, value) {
    return valueY(row, value, ...shownLimits(row, this.state, channelRange));
  }

  scrub(x) {
    const seek = (place) => clock.seek(this.state.view.time(place));
    seek(x);
    return { move: seek };
  }

  select(x, event) {
    const begin = this.time(x, event);
    return {
      move: (place, _, now) => {
        const end = this.time(place, now);
        this.host.setRange(Math.abs(end - begin) > 0.005 ? [Math.min(begin, end), Math.max(begin, end)] : null);
      },
      end: (place, moved) => {
        if (moved) return;
        this.host.setRange(null);
        clock.seek(this.state.view.time(place));
      },
    };
  }

  /** The edge between two phones, within 10 ms of the others. */
  edge(row, x) {
    const { state } = this, index = edgeAt(state, x);
    if (index === null) return null;
    const [before, phone] = [state.phones[index - 1], state.phones[index]], first = phone[1];
    const set = (time) => {
      before[2] = phone[1] = rounded(Math.min(Math.max(time, before[1] + LEAST_PHONE_S), phone[2] - LEAST_PHONE_S));
      state.ghost = { time: phone[1] };
    };
    return {
      move: (place) => set(state.view.time(place)),
      end: (_, moved) => moved && phone[1] !== first && this.host.moveEdge(index, phone[1]),
      cancel: () => set(first),
    };
  }

  choose(row, x) {
    const { view } = this.state, time = view.time(x);
    const item = rowItems(row, this.state).find((one) =>
      one.end > one.begin ? one.begin <= time && time < one.end : Math.abs(view.x(one.begin) - x) <= 8,
    );
    this.host.focus(row, item ?? null);
    if (item) this.host.pick(item);
    return item ? { move: () => null } : null;
  }

  paint(row, x, event) {
    const { state } = this, { tool, style } = state.brush, begin = this.time(x, event);
    const span = { start: begin, end: begin };
    const stretch = (place, _, now) => {
      const end = this.time(place, now);
      [span.start, span.end] = [Math.min(begin, end), Math.max(begin, end)];
      state.ghost = { row, span, style: tool === "brush" ? style : null };
    };
    return {
      move: stretch,
      end: (place, moved) => {
        if (!moved) return this.choose(row, place);
        if (span.end - span.start < SPAN_LEAST_S) return null;
        const range = { feature: row.feature, start: rounded(span.start), end: rounded(span.end) };
        return this.host.emit(tool === "brush" ? EDITS.paint({ ...range, style }) : EDITS.erase(range));
      },
    };
  }

  spanEdge(row, x) {
    const { view, model } = this.state;
    for (const span of model.spansOf(row.feature)) {
      if (Math.abs(view.x(span.start) - x) <= RESIZE_PX) return { span, side: "start" };
      if (Math.abs(view.x(Math.min(span.end, view.duration)) - x) <= RESIZE_PX) return { span, side: "end" };
    }
    return null;
  }

  /** Move one end of a span: what is added is painted, what is taken is erased. */
  resize(row, x) {
    const hit = this.spanEdge(row, x);
    if (!hit) return this.choose(row, x);
    const { span, side } = hit, { style, feature } = span, old = { start: span.start, end: span.end };
    return {
      move: (place, _, now) => {
        const time = this.time(place, now);
        span[side] = side === "start" ? Math.min(time, old.end - SPAN_LEAST_S) : Math.max(time, old.start + SPAN_LEAST_S);
      },
      end: (_, moved) => {
        const { start, end } = span;
        Object.assign(span, old);
        if (!moved) return this.host.focus(row, rowItems(row, this.state).find((item) => item.span === span) ?? null);
        const grows = side === "start" ? start < old.start : end > old.end;
        if (grows) return this.host.emit(EDITS.paint({ feature, style, start: rounded(start), end: rounded(end) }));
        const range = side === "start" ? [old.start, start] : [end, Math.min(old.end, this.state.view.duration)];
        return range[1] - range[0] > 1e-3 && this.host.emit(EDITS.erase({ feature, start: rounded(range[0]), end: rounded(range[1]) }));
      },
      cancel: () => Object.assign(span, old),
    };
  }

  key(row, { curve, number }) {
    const { state } = this, [time, value] = curve.keys[number], drawn = row.id === "channel" ? channelValue(state, time) : value;
    let edit = null;
    return {
      move: (place, y, event) => {
        const limits = shownLimits(row, state, channelRange);
        const change = yValue(row, y, ...limits) - drawn;
        edit = state.model.moveKey(curve, number, this.time(place, event), row.id === "channel" ? value + change : drawn + change);
        state.model.apply(edit);
      },
      end: () => {
        this.host.focus(row, rowItems(row, state).find((item) => item.kind === "key" && item.number === number) ?? null);
        if (edit) this.host.emit(edit);
      },
      cancel: () => state.model.apply(state.model.withKeys(curve, curve.keys)),
    };
  }

  instant(row, x) {
    const { state } = this, gesture = state.model.gestures.find((one) => Math.abs(state.view.x(one.time) - x) <= 8);
    if (!gesture) return null;
    const first = gesture.time;
    return {
      move: (place, _, event) => (gesture.time = rounded(this.time(place, event))),
      end: (_, moved) => {
        const { time } = gesture;
        gesture.time = first;
        if (!moved) return this.choose(row, state.view.x(first));
        return this.host.replaceGesture(gesture, { time });
      },
      cancel: () => (gesture.time = first),
    };
  }

  double(event) {
    const { x, y } = this.at(event), { state } = this, row = rowAt(state.rows, y), time = this.time(x, event);
    if (!row) return;
    const item = rowItems(row, state).find((one) => one.begin <= time + 8 / state.view.scale && time - 8 / state.view.scale <= one.end);
    const curve = state.model.curveOf(row, state.chosen);
    const onKey = curve && hitKey(row, state, x, y, (value) => this.valueY(row, value));
    if (onKey || (item && !curve)) this.host.open(row, item);
    else if (row.id === "gestures") this.host.emit(EDITS.gesture({ time: rounded(time), name: "nod", size: 1, seconds: null, down_deg: null, left_deg: null }));
    else if (SPAN_ROWS[row.id]) {
      const end = rounded(Math.min(time + NEW_S, state.view.duration)), { kind, made } = SPAN_ROWS[row.id];
      this.host.emit(EDITS[kind]({ start: rounded(time), end, ...made }));
    } else if (curve && this.canAdd(row)) {
      const value = yValue(row, y, ...shownLimits(row, state, channelRange));
      this.host.emit(state.model.addKey(curve, time, this.keyValue(row, curve, time, value)));
    }
  }

  canAdd(row) {
    return row.id !== "channel" || Boolean(this.state.chosen.channel);
  }

  /** The value of a new key at a drawn place: of a channel, the offset that moves its curve there. */
  keyValue(row, curve, time, value) {
    if (row.id !== "channel") return value;
    const { state } = this, keys = curve.keys;
    return value - channelValue(state, time) + state.offset(keys, time);
  }
}
