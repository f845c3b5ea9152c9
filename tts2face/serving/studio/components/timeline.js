// The timeline: sound, words, phones, painted styles, key points, gestures, gaze targets and curves over time.

import { clock } from "tts2face-studio/clock.js";
import { comparison, loadPreview, preview } from "tts2face-studio/preview.js";
import { EDITS, EXPRESSIONS, FEATURES, HEAD_CHANNELS } from "tts2face-studio/protocol.js";
import { addStyle } from "tts2face-studio/style.js";
import { TimelineHost } from "tts2face-studio/timeline_host.js";
import { describeItem, rowItems } from "tts2face-studio/timeline_items.js";
import { same } from "tts2face-studio/timeline_keyboard.js";
import { formatTime, layoutRows } from "tts2face-studio/timeline_view.js";

const HELP = `Up and Down choose a row, Left and Right an element. Space plays. Left bracket and right bracket set the ends
  of the selection at the playhead; Enter paints it on a lane, opens an element or adds one; Delete removes. Alt with
  arrows moves an element. Plus and minus zoom.`;

export default {
  template: `
    <section class="studio-timeline" aria-label="Timeline">
      <div class="studio-bar" role="toolbar" aria-label="Playback and zoom">
        <button type="button" class="studio-play" id="studio-play" @click="toggle" :aria-label="playing ? 'Pause' : 'Play'"
          title="Space"><svg viewBox="0 0 16 16" aria-hidden="true"><path :d="playing ? 'M3 2h4v12H3zM9 2h4v12H9z' : 'M4 2l10 6-10 6z'"/></svg></button>
        <button type="button" id="studio-start" aria-label="To the start" title="Home" @click="host.seek(0)"><svg viewBox="0 0 16 16" aria-hidden="true"><path d="M2 2h2v12H2zM14 2v12L5 8z"/></svg></button>
        <output class="studio-time" aria-label="Time">{{ timeText }}</output>
        <label>Speed <select :value="speed" @change="setSpeed($event.target.value)">
          <option v-for="one in [0.25, 0.5, 1]" :key="one" :value="one">{{ one }}×</option></select></label>
        <span class="studio-gap"></span>
        <span v-if="rangeText" class="studio-range">{{ rangeText }}
          <button type="button" aria-label="Clear the selection" title="Escape" @click="host.setRange(null)">Clear</button></span>
        <label><input type="checkbox" :checked="snaps" @change="setSnaps($event.target.checked)"> Snap</label>
        <button type="button" aria-label="Zoom out" title="Minus" @click="host.zoom(1 / 1.4)">−</button>
        <button type="button" aria-label="Zoom in" title="Plus" @click="host.zoom(1.4)">+</button>
        <button type="button" title="0" @click="host.fit()">Fit</button>
      </div>
      <div class="studio-body">
        <div class="studio-heads">
          <div v-for="row in rows" :key="row.id" class="studio-head" :style="{ height: row.height + 'px' }">
            <template v-if="row.id === 'curve'">
              <select aria-label="Expression of the key points" :value="expression" @change="choose('expression', $event.target.value)">
                <option v-for="one in expressions" :key="one">{{ one }}</option></select>
            </template>
            <template v-else-if="row.id === 'channel'">
              <select aria-label="Channel of the curve" :value="channel" @change="choose('channel', $event.target.value)">
                <option value="">Channel …</option>
                <option v-for="one in channels" :key="one">{{ one }}</option></select>
              <small v-if="compares">dashed: A</small>
            </template>
            <span v-else class="studio-name">{{ row.label }}</span>
            <span v-if="row.feature" class="studio-lane-buttons">
              <button type="button" :aria-pressed="String(laneOf(row).muted)" :aria-label="'Mute ' + row.label" title="Mute"
                @click="emitLane('mute', row, !laneOf(row).muted)">M</button>
              <button type="button" :aria-pressed="String(laneOf(row).solo)" :aria-label="'Solo ' + row.label" title="Solo"
                @click="emitLane('solo', row, !laneOf(row).solo)">S</button>
              <button type="button" :aria-label="'New seed for ' + row.label + ', now ' + seedOf(row)" :title="'New seed, now ' + seedOf(row)"
                @click="reroll(row)"><svg viewBox="0 0 16 16" aria-hidden="true"><path d="M3 1h10a2 2 0 012 2v10a2 2 0 01-2 2H3a2 2 0 01-2-2V3a2 2 0 012-2zm2 3a1.3 1.3 0 100 2.6A1.3 1.3 0 005 4zm6 0a1.3 1.3 0 100 2.6A1.3 1.3 0 0011 4zM8 6.7a1.3 1.3 0 100 2.6 1.3 1.3 0 000-2.6zM5 9.4A1.3 1.3 0 105 12a1.3 1.3 0 000-2.6zm6 0a1.3 1.3 0 100 2.6 1.3 1.3 0 000-2.6z"/></svg></button>
            </span>
          </div>
        </div>
        <div class="studio-plot" ref="plot" :style="{ height: height + 'px' }">
          <canvas ref="base" aria-hidden="true"></canvas>
          <canvas ref="over" aria-hidden="true" style="display: none"></canvas>
          <div ref="playhead" class="studio-playhead" aria-hidden="true"></div>
          <div ref="grid" class="studio-grid" role="grid" tabindex="0" :aria-label="'Elements of the timeline. ' + help"
            :aria-rowcount="rows.length" :aria-activedescendant="cellId(cursorRow)" @keydown="onKey" @wheel="onWheel">
            <div v-for="(cell, number) in cells" :key="number" role="row" :aria-rowindex="number + 1">
              <span role="gridcell" :id="cellId(number)" :aria-selected="String(number === cursorRow)">{{ cell }}</span>
            </div>
          </div>
          <p v-if="!hasSound" class="studio-empty">Type a text or import speech: its sound, words and phones appear here, and
            styles are painted on the lanes below.</p>
        </div>
      </div>
      <div class="studio-scroll" ref="scroll" tabindex="0" role="group" aria-label="Scroll in time" @scroll="onScroll">
        <div :style="{ width: scrollWidth + 'px' }"></div>
      </div>
      <form v-if="editor" class="studio-editor" :aria-label="editor.title" @submit.prevent="submitEditor" @keydown.esc.stop="closeEditor">
        <strong>{{ editor.title }}</strong>
        <label v-for="field in editor.fields" :key="field.name">{{ field.label }}
          <select v-if="field.options" v-model="field.value"><option v-for="one in field.options" :key="one">{{ one }}</option></select>
          <input v-else type="number" v-model.number="field.value" :min="field.low" :max="field.high" :step="field.step" required>
        </label>
        <div><button type="submit">Apply</button><button type="button" @click="removeEdited">Remove</button>
          <button type="button" @click="closeEditor">Cancel</button></div>
      </form>
      <p class="studio-unseen" aria-live="polite">{{ announcement }}</p>
    </section>`,

  props: {
    timeline: { type: Object, default: () => ({}) },
    styles: { type: Array, default: () => [] },
    brush: { type: Object, default: () => ({ tool: "select", style: "" }) },
    lanes: { type: Array, default: () => FEATURES },
    expressions: { type: Array, default: () => EXPRESSIONS },
    preview: String,
    compare: String,
  },
  emits: ["edit", "pick", "range"],

  data() {
    return {
      playing: false, timeText: formatTime(0), speed: 1, snaps: true, rangeText: "", expression: this.expressions[1] ?? "happy",
      channel: "jawOpen", channels: [], cells: [], cursorRow: 0, announcement: "", editor: null, hasSound: true,
      compares: false, scrollWidth: 1, help: HELP,
    }; // prettier-ignore
  },

  computed: {
    laneList() {
      return this.lanes.map((lane) => (typeof lane === "string" ? { feature: lane } : lane));
    },
    rows() {
      return layoutRows(this.laneList.map((lane) => lane.feature));
    },
    height() {
      return this.rows.at(-1).y + this.rows.at(-1).height;
    },
  },

  created() {
    addStyle();
    this.host = new TimelineHost(this);
  },

  mounted() {
    this.host.mount();
    this.stops = [
      preview.on("change", () => this.takePreview()),
      comparison.on("change", () => this.takePreview()),
      ...["play", "pause", "end"].map((event) => clock.on(event, () => (this.playing = clock.playing))),
    ];
    this.takePreview();
    if (this.preview) loadPreview(this.preview).catch((wrong) => this.say(wrong.message));
    if (this.compare) comparison.load(this.compare).catch((wrong) => this.say(wrong.message));
  },

  beforeUnmount() {
    for (const stop of this.stops) stop();
    this.host.unmount();
  },

  watch: {
    timeline() {
      this.host.takeTimeline();
    },
    styles() {
      this.host.takeProps();
    },
    brush() {
      this.host.takeProps();
    },
    lanes() {
      this.host.takeProps();
    },
    compare() {
      if (this.compare) comparison.load(this.compare).catch((wrong) => this.say(wrong.message));
      else comparison.clear();
    },
  },

  methods: {
    toggle: () => clock.toggle(),
    play: (from) => clock.play(from ?? undefined),
    pause: () => clock.pause(),
    seek(time) {
      this.host.seek(time);
    },
    /** Fetch the preview of the project again; the stage of the page shows it, too. */
    setPreview: (url) => loadPreview(url).then(() => true),
    setSpeed(value) {
      this.speed = clock.speed = Number(value);
    },
    setSnaps(on) {
      this.snaps = this.host.state.snaps = on;
    },
    takePreview() {
      this.channels = preview.nFrames ? [...HEAD_CHANNELS, ...preview.channels] : [];
      this.hasSound = preview.nFrames > 0;
      this.compares = comparison.nFrames > 0;
      this.host.takePreview();
    },
    choose(name, value) {
      this[name] = value;
      this.host.choose(name, value);
    },
    laneOf(row) {
      return { muted: false, solo: false, ...this.laneList.find((lane) => lane.feature === row.feature) };
    },
    seedOf(row) {
      return this.timeline.seeds?.[row.feature] ?? this.laneOf(row).seed ?? 0;
    },
    emitLane(kind, row, on) {
      this.$emit("edit", EDITS[kind]({ feature: row.feature, on }));
    },
    reroll(row) {
      this.host.emit(EDITS.seed({ feature: row.feature, seed: this.seedOf(row) + 1 }));
    },
    cellId(number) {
      return `studio-cell-${this.$.uid}-${number}`;
    },
    onKey(event) {
      if (this.host.key(event)) event.preventDefault();
    },
    onWheel(event) {
      this.host.wheel(event);
    },
    onScroll() {
      this.host.scrolled(this.$refs.scroll.scrollLeft);
    },
    say(text) {
      this.announcement = text;
    },

    /** Fill the table that screen readers read: the element of each row next to the cursor. */
    describe() {
      const { state } = this.host;
      this.cursorRow = state.rows.indexOf(state.cursor.row);
      this.cells = state.rows.map((row) => {
        const items = rowItems(row, state), own = row === state.cursor.row && state.cursor.item;
        const index = own ? items.findIndex((item) => same(item, own)) : -1;
        const name = row.feature ? `${row.label} lane` : row.label;
        if (index >= 0) return `${name}, ${index + 1} of ${items.length}: ${describeItem(items[index], state.view.duration)}`;
        return `${name}, ${items.length} elements`;
      });
    },

    openEditor(title, fields, apply, remove) {
      this.editor = { title, fields, apply, remove };
      this.$nextTick(() => this.$el.querySelector(".studio-editor input, .studio-editor select")?.focus());
    },
    submitEditor() {
      const { apply, fields } = this.editor;
      this.closeEditor();
      apply(Object.fromEntries(fields.map((field) => [field.name, field.value])));
    },
    removeEdited() {
      const { remove } = this.editor;
      this.closeEditor();
      remove();
    },
    closeEditor() {
      this.editor = null;
      this.$refs.grid.focus({ preventScroll: true });
    },
  },
};
