// Drawing of the timeline; only what is visible is drawn.

import { SPAN_ROWS, channelRange, columnOf, frameValue, valueY } from "./timeline_values.js";
import { curveValue, firstAfter, formatTime, gestureLabel } from "./timeline_view.js";

const FONT = "12px system-ui, sans-serif";
const TICKS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 120];
const VARIABLES = ["panel", "lane", "line", "text", "quiet", "accent", "wave", "curve", "compare", "playhead", "select", "focus"];

export function readColors(element) {
  const style = getComputedStyle(element);
  return Object.fromEntries(VARIABLES.map((name) => [name, style.getPropertyValue(`--studio-${name}`).trim()]));
}

/** Tiles with which styles differ without their colours: stripes of six kinds, dots, and none. */
function patternTile(number, color) {
  const tile = document.createElement("canvas"), context = tile.getContext("2d");
  tile.width = tile.height = 8;
  context.strokeStyle = context.fillStyle = color;
  context.lineWidth = 1.2;
  const lines = [[], [[0, 8, 8, 0]], [[0, 0, 8, 8]], [[0, 4, 8, 4]], [[4, 0, 4, 8]], [[0, 8, 8, 0], [0, 0, 8, 8]], [[0, 4, 8, 4], [4, 0, 4, 8]]];
  context.beginPath();
  for (const [x0, y0, x1, y1] of lines[number % 8] ?? []) {
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
  }
  context.stroke();
  if (number % 8 === 7) context.fillRect(3, 3, 2, 2);
  return tile;
}

export class Painter {
  constructor(canvas, options) {
    this.context = canvas.getContext("2d", options);
    this.patterns = new Map();
  }

  pattern(number, color) {
    const key = `${number}${color}`;
    if (!this.patterns.has(key)) this.patterns.set(key, this.context.createPattern(patternTile(number, color), "repeat"));
    return this.patterns.get(key);
  }

  draw(state) {
    const { context: c } = this, { view, rows, colors } = state;
    this.state = state;
    c.font = FONT;
    c.textBaseline = "middle";
    c.fillStyle = colors.panel;
    c.fillRect(0, 0, view.width, rows.at(-1).y + rows.at(-1).height);
    for (const row of rows) {
      if (row.feature || row.id === "channel" || row.id === "curve") {
        c.fillStyle = colors.lane;
        c.fillRect(0, row.y + 1, view.width, row.height - 2);
      }
      this.#row(row);
      c.fillStyle = colors.line;
      c.fillRect(0, row.y + row.height - 1, view.width, 1);
    }
    this.#range();
    if (state.focused) this.#focus(state.focused);
  }

  #row(row) {
    if (row.feature) return this.#lane(row);
    const draw = {
      ruler: () => this.#ruler(row),
      wave: () => this.#wave(row),
      words: () => this.#labels(row, this.state.preview.words),
      phones: () => this.#labels(row, this.state.phones),
      curve: () => this.#expressions(row),
      gestures: () => this.#gestures(row),
      targets: () => this.#spans(row),
      listens: () => this.#spans(row),
      channel: () => this.#channel(row),
    }[row.id];
    return draw();
  }

  #ruler(row) {
    const { context: c } = this, { view, colors } = this.state;
    const step = TICKS.find((one) => one * view.scale >= 64) ?? 300;
    c.fillStyle = colors.quiet;
    for (let k = Math.floor(view.start / step); k * step <= Math.min(view.end, view.duration); k++) {
      const x = Math.round(view.x(k * step));
      c.fillRect(x, row.y + 14, 1, 8);
      c.fillText(formatTime(k * step).replace(/(\.\d)0$/, "$1").replace(/\.0$/, ""), x + 3, row.y + 9);
    }
  }

  #wave(row) {
    const { context: c } = this, { view, colors, waveform } = this.state;
    c.fillStyle = colors.wave;
    if (waveform) waveform.draw(c, view, row.y + 2, row.height - 5);
  }

  #labels(row, items) {
    const { context: c } = this, { view, colors } = this.state, middle = row.y + row.height / 2;
    for (let i = firstAfter(items, view.start, (item) => item[2]); i < items.length && items[i][1] < view.end; i++) {
      const [text, begin, end] = items[i], x = view.x(begin), width = view.x(end) - x, isDoubtful = row.id === "words" && items[i][4];
      if (width < 1.5) continue;
      c.fillStyle = colors.line;
      c.fillRect(Math.round(x), row.y + 2, 1, row.height - 5);
      c.fillRect(Math.round(x + width), row.y + 2, 1, row.height - 5);
      c.fillStyle = row.id === "words" ? colors.text : colors.quiet;
      if (width > 9) this.#text(isDoubtful ? `${text}?` : text, x + 4, middle, width - 6);
      if (isDoubtful) c.fillRect(Math.round(x) + 3, row.y + row.height - 4, Math.max(1, width - 5), 1);
    }
  }

  /** Text within a width, cut where it does not fit. */
  #text(text, x, y, width) {
    const { context: c } = this, left = Math.max(x, 3), room = x + width - left;
    let shown = text;
    while (shown && c.measureText(shown).width > room) shown = shown.slice(0, -1);
    if (shown) c.fillText(shown, left, y);
  }

  #lane(row) {
    const { view, model, colors, lanes } = this.state, { context: c } = this;
    for (const span of model.spansOf(row.feature)) this.block(row, span, span.style);
    const base = model.style[row.feature];
    if (base && !model.spansOf(row.feature).length) {
      c.fillStyle = colors.quiet;
      this.#text(`${base} throughout`, 4, row.y + row.height / 2, view.width);
    }
    const keys = model.strengths.get(row.feature) ?? [];
    if (keys.length) this.#keyed(row, keys, 0, 3);
    if (lanes[row.feature]?.silent) {
      c.fillStyle = `${colors.panel}b0`;
      c.fillRect(0, row.y, view.width, row.height - 1);
    }
  }

  /** A span of a style with its colour, pattern and name. */
  block(row, { start, end }, style, alpha = 1) {
    const { context: c } = this, { view, colors, styles } = this.state;
    if (end <= view.start || start >= view.end) return;
    const number = Math.max(styles.findIndex((one) => one.name === style), 0), color = styles[number]?.color ?? "#808890";
    const x = Math.max(view.x(start), -2), width = Math.min(view.x(Math.min(end, view.duration)), view.width + 2) - x;
    c.globalAlpha = 0.36 * alpha;
    c.fillStyle = color;
    c.fillRect(x, row.y + 3, width, row.height - 7);
    c.globalAlpha = 0.55 * alpha;
    c.fillStyle = this.pattern(number, color);
    c.fillRect(x, row.y + 3, width, row.height - 7);
    c.globalAlpha = alpha;
    c.strokeStyle = color;
    c.lineWidth = 1.5;
    c.strokeRect(x + 0.75, row.y + 3.75, Math.max(width - 1.5, 0.5), row.height - 8.5);
    const size = Math.min(c.measureText(style).width + 8, width - 4);
    if (size > 14) {
      c.globalAlpha = 0.8 * alpha;
      c.fillStyle = colors.panel;
      c.fillRect(Math.max(x, 0) + 3, row.y + row.height / 2 - 8, size, 15);
      c.globalAlpha = 1;
      c.fillStyle = colors.text;
      this.#text(style, Math.max(x, 0) + 7, row.y + row.height / 2, width - 10);
    }
    c.globalAlpha = 1;
  }

  /** A curve through keys with handles, for values from `low` to `high`. */
  #keyed(row, keys, low, high) {
    const { context: c } = this, { view, colors } = this.state;
    const y = (value) => valueY(row, value, low, high);
    c.strokeStyle = c.fillStyle = colors.curve;
    c.lineWidth = 1.5;
    c.beginPath();
    for (let x = 0; x <= view.width; x += 3) c.lineTo(x, y(curveValue(keys, view.time(x))));
    c.stroke();
    for (const [time, value] of keys) if (time >= view.start - 0.1 && time <= view.end + 0.1) this.#handle(view.x(time), y(value));
  }

  #handle(x, y) {
    const { context: c } = this, { colors } = this.state;
    c.beginPath();
    c.arc(x, y, 4, 0, 7);
    c.fillStyle = colors.panel;
    c.fill();
    c.lineWidth = 2;
    c.strokeStyle = colors.curve;
    c.stroke();
  }

  #expressions(row) {
    const { model, chosen, view, colors } = this.state, { context: c } = this;
    for (const span of model.expressions) {
      if (span.expression !== chosen.expression) continue;
      c.fillStyle = colors.select;
      const y = valueY(row, span.weight, -0.5, 1.5), rest = valueY(row, 0, -0.5, 1.5);
      c.fillRect(view.x(span.start), Math.min(y, rest), (Math.min(span.end, view.duration) - span.start) * view.scale, Math.abs(y - rest));
    }
    this.#axis(row, 0, -0.5, 1.5);
    const keys = model.curves.get(chosen.expression) ?? [];
    if (keys.length) this.#keyed(row, keys, -0.5, 1.5);
    else this.#hint(row, "Double-click to add a key point");
  }

  #axis(row, value, low, high) {
    this.context.fillStyle = this.state.colors.line;
    this.context.fillRect(0, Math.round(valueY(row, value, low, high)), this.state.view.width, 1);
  }

  #hint(row, text) {
    this.context.fillStyle = this.state.colors.quiet;
    this.#text(text, 6, row.y + row.height / 2, this.state.view.width);
  }

  #gestures(row) {
    const { model, view, colors } = this.state, { context: c } = this;
    if (!model.gestures.length) this.#hint(row, "Double-click to add a gesture");
    for (const { time, name, size } of model.gestures) {
      const x = view.x(time);
      if (x < -120 || x > view.width + 10) continue;
      c.fillStyle = colors.accent;
      c.fillRect(x - 2, row.y + 3, 2 + 2 * Math.min(size, 2), row.height - 6);
      this.#text(gestureLabel(name), x + 8, row.y + row.height / 2, 110);
    }
  }

  #spans(row) {
    const { model, view, colors } = this.state, { context: c } = this, { list, hint, text } = SPAN_ROWS[row.id];
    if (!model[list].length) this.#hint(row, hint);
    for (const one of model[list]) {
      const x = view.x(one.start), width = (Math.min(one.end, view.duration) - one.start) * view.scale;
      if (x + width < 0 || x > view.width) continue;
      c.fillStyle = colors.select;
      c.fillRect(x, row.y + 3, width, row.height - 7);
      c.strokeStyle = colors.accent;
      c.lineWidth = 1.5;
      c.strokeRect(x + 0.75, row.y + 3.75, Math.max(width - 1.5, 0.5), row.height - 8.5);
      c.fillStyle = colors.text;
      this.#text(text(one), x + 6, row.y + row.height / 2, width - 8);
    }
  }

  #channel(row) {
    const { state } = this, { preview, comparison, chosen, model, baseKeys, colors } = state;
    const column = columnOf(preview, chosen.channel);
    if (column === null) return this.#hint(row, "Choose a channel of the motion to see and correct its curve");
    const [low, high] = channelRange(state);
    this.#axis(row, 0, low, high);
    const other = columnOf(comparison, chosen.channel);
    if (comparison.nFrames && other !== null) this.#frames(row, comparison, other, colors.compare, low, high, () => 0, [5, 3]);
    const keys = model.edits.get(chosen.channel) ?? [];
    const shift = (time) => curveValue(keys, time) - curveValue(baseKeys, time);
    this.#frames(row, preview, column, colors.curve, low, high, shift, []);
    for (const [time] of keys) this.#handle(state.view.x(time), valueY(row, frameValue(preview, column, time) + shift(time), low, high));
    this.context.fillStyle = colors.quiet;
    this.context.fillText(high.toFixed(2), 3, row.y + 9);
    this.context.fillText(low.toFixed(2), 3, row.y + row.height - 10);
    return null;
  }

  #frames(row, preview, column, color, low, high, shift, dash) {
    const { context: c } = this, { view } = this.state;
    c.strokeStyle = color;
    c.lineWidth = 1.5;
    c.setLineDash(dash);
    c.beginPath();
    const step = Math.max(1, Math.floor(preview.fps / view.scale / 2));
    const first = Math.max(Math.floor(view.start * preview.fps) - step, 0);
    for (let frame = first - (first % step); frame < preview.nFrames; frame += step) {
      const time = frame / preview.fps;
      c.lineTo(view.x(time), valueY(row, preview.value(frame, column) + shift(time), low, high));
      if (time > view.end) break;
    }
    c.stroke();
    c.setLineDash([]);
  }

  #range() {
    const { context: c } = this, { view, range, colors, rows } = this.state;
    if (!range) return;
    const x = view.x(range[0]), width = view.x(range[1]) - x, bottom = rows.at(-1).y + rows.at(-1).height;
    c.fillStyle = colors.select;
    c.fillRect(x, 0, width, bottom);
    c.fillStyle = colors.accent;
    c.fillRect(Math.round(x), 0, 1, bottom);
    c.fillRect(Math.round(x + width), 0, 1, bottom);
  }

  #focus({ row, begin, end }) {
    const { context: c } = this, { view, colors } = this.state;
    const x = view.x(begin), width = Math.max(view.x(Math.min(end, view.duration)) - x, 9);
    c.strokeStyle = colors.focus;
    c.lineWidth = 2;
    c.strokeRect(x - (end > begin ? 0 : 5), row.y + 2, width, row.height - 5);
  }
}
