// What the timeline shows and does, without its page: state, drawing once a frame, edits.

import { clock } from "./clock.js";
import { metrics, Meter } from "./metrics.js";
import { comparison, preview } from "./preview.js";
import { Frames, pace } from "./pace.js";
import { EDITS, KINDS, LEAST_PHONE_S } from "./protocol.js";
import { openEditor } from "./timeline_editor.js";
import { Painter, readColors } from "./timeline_draw.js";
import { rowItems } from "./timeline_items.js";
import { performKey } from "./timeline_keyboard.js";
import { describeEdit, TimelineModel } from "./timeline_model.js";
import { PointerTools } from "./timeline_pointer.js";
import { SPAN_ROWS } from "./timeline_values.js";
import { curveValue, formatTime, rounded, View } from "./timeline_view.js";
import { Waveform } from "./waveform.js";

const TEXT_S = 0.2; // between two texts of the time that plays: each makes the browser draw a part of the page
const NUDGE_PAUSE_MS = 350; // an edge that keys move is sent when they rest
const WHEEL_ZOOM = 0.0015;

export class TimelineHost {
  constructor(component) {
    this.component = component;
    this.state = {
      view: new View(), rows: component.rows, model: new TimelineModel(component.timeline), preview, comparison, phones: [],
      brush: component.brush, styles: component.styles, lanes: {}, range: null, snaps: true, waveform: null, ghost: null,
      chosen: { expression: component.expression, channel: component.channel }, baseKeys: [], colors: {}, focused: null,
      cursor: { row: component.rows[0], item: null }, offset: (keys, time) => curveValue(keys, time),
    }; // prettier-ignore
  }

  mount() {
    const { base, over, grid, plot } = this.component.$refs;
    this.painter = new Painter(base, { alpha: false });
    this.overlay = new Painter(over);
    this.tools = new PointerTools(grid, this.state, this);
    this.meter = new Meter("timeline_ms");
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(plot);
    this.themes = new MutationObserver(() => this.takeColors());
    for (const element of [document.body, document.documentElement]) this.themes.observe(element, { attributeFilter: ["class", "data-theme"] });
    this.frames = new Frames((now) => this.tick(now));
    this.stops = ["play", "pause", "end", "load", "seek"].map((event) => clock.on(event, () => this.frames.wake()));
    this.stops.push(clock.on("seek", () => this.reveal()));
    document.getElementById("studio-style").addEventListener("load", () => this.takeColors());
    this.takeColors();
    this.takeProps();
    this.resize();
  }

  unmount() {
    this.frames.stop();
    clearTimeout(this.nudged);
    this.sizes.disconnect();
    this.themes.disconnect();
    for (const stop of this.stops) stop();
  }

  takeColors() {
    this.state.colors = readColors(this.component.$el);
    this.painter.patterns.clear();
    this.redraw();
  }

  takeProps() {
    const { component, state } = this, solos = component.laneList.some((lane) => lane.solo);
    Object.assign(state, { rows: component.rows, styles: component.styles, brush: component.brush });
    state.lanes = Object.fromEntries(
      component.laneList.map((lane) => [lane.feature, { ...lane, silent: lane.muted || (solos && !lane.solo) }]),
    );
    state.cursor.row = state.rows.find((row) => row.id === state.cursor.row.id) ?? state.rows[0];
    this.redraw();
  }

  takeTimeline() {
    if (this.tools?.gesture) return; // the edit that ends it brings the timeline again
    this.state.model.set(this.component.timeline);
    this.refocus();
  }

  takePreview() {
    const { state } = this, { view } = state;
    state.phones = preview.phones.map((phone) => [...phone]);
    state.baseKeys = state.model.edits.get(state.chosen.channel) ?? [];
    if (this.pcm !== preview.pcm) {
      this.pcm = preview.pcm;
      state.waveform = preview.pcm.length ? new Waveform(preview.pcm, preview.rate) : null;
    }
    const isNew = !view.duration;
    view.duration = preview.duration;
    if (isNew || view.scale < view.leastScale) view.fit();
    view.moveTo(view.start);
    this.refocus();
    this.moved();
  }

  choose(name, value) {
    this.state.chosen[name] = value;
    if (name === "channel") this.state.baseKeys = this.state.model.edits.get(value) ?? [];
    this.refocus();
  }

  resize() {
    const { base, over, plot } = this.component.$refs, { view } = this.state, ratio = window.devicePixelRatio;
    const width = plot.clientWidth, height = this.component.height;
    if (!width) return;
    for (const canvas of [base, over]) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      Object.assign(canvas.style, { width: `${width}px`, height: `${height}px` });
      canvas.getContext("2d").setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    const fitted = Math.abs(view.scale - view.leastScale) < 1e-6;
    view.width = width;
    if (fitted || view.scale < view.leastScale) view.fit();
    this.moved();
  }

  redraw() {
    this.dirty = true;
    this.frames.wake();
  }

  /** After a change of what is visible. */
  moved() {
    const { view } = this.state, { component } = this;
    component.scrollWidth = Math.max(view.duration * view.scale, 1);
    metrics.view = { start: view.start, scale: view.scale, duration: view.duration };
    metrics.rows = this.state.rows;
    this.redraw();
    component.$nextTick(() => {
      const { scroll } = component.$refs;
      if (scroll && Math.abs(scroll.scrollLeft - view.start * view.scale) > 1.5) scroll.scrollLeft = view.start * view.scale;
    });
  }

  scrolled(left) {
    const { view } = this.state;
    if (Math.abs(left - view.start * view.scale) <= 1.5) return;
    view.moveTo(left / view.scale);
    this.moved();
  }

  /** One frame of the display; returns whether the next one is wanted, too. */
  tick(now) {
    if (!clock.playing || pace.draws(now)) this.draw();
    return clock.playing || this.dirty;
  }

  draw() {
    const begin = performance.now(), { state } = this, time = clock.time;
    if (clock.playing && state.view.reveal(time)) this.moved();
    if (!this.dirty && time === this.shown) return;
    this.shown = time;
    if (this.dirty) this.painter.draw(state);
    if (this.dirty) this.drawGhost();
    this.dirty = false;
    const x = state.view.x(time), { style } = this.component.$refs.playhead;
    style.transform = `translateX(${x.toFixed(1)}px)`;
    style.visibility = x < 0 || x > state.view.width ? "hidden" : "visible";
    if (!clock.playing) {
      this.component.timeText = formatTime(time);
      return;
    }
    if (Math.abs(time - (this.written ?? -1)) > TEXT_S) this.component.timeText = formatTime((this.written = time));
    this.meter.add(performance.now() - begin);
  }

  /** What a gesture would do when it ends here. */
  drawGhost() {
    const { overlay, state } = this, { context: c } = overlay, { view, colors, ghost } = state;
    const shown = ghost ? "block" : "none"; // an empty canvas costs a blend of all its pixels in each frame
    if (this.component.$refs.over.style.display !== shown) this.component.$refs.over.style.display = shown;
    if (!ghost) return;
    c.clearRect(0, 0, view.width, this.component.height);
    overlay.state = state;
    c.font = "12px system-ui, sans-serif";
    c.textBaseline = "middle";
    if (ghost?.span && ghost.style) overlay.block(ghost.row, ghost.span, ghost.style);
    else if (ghost?.span) {
      c.fillStyle = `${colors.panel}d0`;
      c.fillRect(view.x(ghost.span.start), ghost.row.y + 2, (ghost.span.end - ghost.span.start) * view.scale, ghost.row.height - 5);
    } else if (ghost) {
      c.fillStyle = colors.accent;
      c.fillRect(view.x(ghost.time) - 1, 22, 2, state.rows.find((row) => row.id === "phones").y + 2);
    }
  }

  key(event) {
    return performKey(event, this.state, this);
  }

  /** Ctrl and the wheel zoom at the pointer; sideways and Shift scroll in time. */
  wheel(event) {
    const { view } = this.state, sideways = event.shiftKey ? event.deltaY || event.deltaX : event.deltaX;
    if (event.ctrlKey) view.zoom(Math.exp(-event.deltaY * WHEEL_ZOOM), event.offsetX);
    else if (sideways) view.moveTo(view.start + sideways / view.scale);
    else return;
    event.preventDefault();
    this.moved();
  }

  zoom(factor) {
    const { view } = this.state, x = view.x(clock.time);
    view.zoom(factor, x >= 0 && x <= view.width ? x : view.width / 2);
    this.moved();
  }

  fit() {
    this.state.view.fit();
    this.moved();
  }

  seek(time) {
    clock.seek(time);
    this.redraw();
  }

  reveal() {
    if (this.state.view.reveal(clock.time)) this.moved();
  }

  setRange(range) {
    this.state.range = clock.range = range;
    this.component.rangeText = range ? `${formatTime(range[0])} to ${formatTime(range[1])}` : "";
    this.component.$emit("range", range);
    this.redraw();
  }

  /** Give an element the focus of the keyboard. */
  focus(row, item) {
    const { state, component } = this;
    state.cursor = { row, item };
    state.focused = item ? { row, begin: item.begin, end: item.end } : null;
    component.describe();
    this.redraw();
  }

  /** Keep the focus on the element that is still there. */
  refocus() {
    const { row, item } = this.state.cursor;
    const items = item ? rowItems(row, this.state) : [];
    const kept = items.find((one) => one.kind === item.kind && (one.index ?? -1) === (item.index ?? -1) && Math.abs(one.begin - item.begin) < 0.3);
    this.focus(row, kept ?? null);
  }

  pick(item) {
    if (item.kind === "word") this.setRange([item.begin, item.end]);
    if (item.kind !== "word" && item.kind !== "phone") return;
    const { kind, name, begin, end, index } = item, phone = kind === "phone" ? preview.phones[index] : null;
    const sentence = phone ? phone[3] : preview.words[index][3], [text, occurrence] = preview.sentences[sentence] ?? ["", 0];
    this.component.$emit("pick", { kind, name, begin, end, index: phone ? phone[4] : index, text, occurrence });
  }

  open(row, item) {
    openEditor(this, row, item);
  }

  /** Show an edit at once, and send it. */
  emit(edit) {
    this.state.model.apply(edit);
    this.component.$emit("edit", edit);
    this.component.say(describeEdit(edit));
    this.refocus();
    return edit;
  }

  remove(row, item) {
    const { state } = this;
    if (item.kind === "span") this.emit(EDITS.erase({ feature: row.feature, start: item.begin, end: Math.min(item.end, state.view.duration) }));
    else if (item.kind === "gesture") this.emit(EDITS.remove_gesture(item.gesture));
    else if (SPAN_ROWS[row.id]) this.emit(EDITS[KINDS[SPAN_ROWS[row.id].list].remove]({ time: item.begin }));
    else if (item.kind === "key") this.emit(state.model.removeKey(state.model.curveOf(row, state.chosen), item.number));
  }

  replaceGesture(gesture, changed) {
    const [low, high] = KINDS.gestures.limits, made = { ...gesture, ...changed };
    this.emit(EDITS.remove_gesture(gesture));
    this.emit(EDITS.gesture({ ...made, size: rounded(Math.min(Math.max(made.size, low), high)) }));
  }

  moveEdge(index, time) {
    const phone = preview.phones[index], [text, occurrence, begin] = preview.sentences[phone[3]];
    this.emit(EDITS.edge({ text, occurrence, index: phone[4], time: rounded(time - begin) }));
  }

  nudgeEdge(index, change) {
    const { phones } = this.state, [before, phone] = [phones[index - 1], phones[index]];
    if (!before || phone[4] === 0) return;
    before[2] = phone[1] = rounded(Math.min(Math.max(phone[1] + change, before[1] + LEAST_PHONE_S), phone[2] - LEAST_PHONE_S));
    this.focus(this.state.cursor.row, rowItems(this.state.cursor.row, this.state)[index]);
    clearTimeout(this.nudged);
    this.nudged = setTimeout(() => this.moveEdge(index, phone[1]), NUDGE_PAUSE_MS);
  }
}
