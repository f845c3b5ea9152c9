// Lips, lids, teeth and pivot over a picture: handles that are dragged, or moved by the arrow keys.

import { addStyle } from "tts2face-studio/style.js";

const NAMES = { lips: "Lips", right_eye: "Right eye", left_eye: "Left eye", teeth: "Edge of the upper teeth", pivot: "Pivot of the head" };
const EDGES = { upper: "upper edge", lower: "lower edge", seam: "line between the lips" };
const POINTS = ["teeth", "pivot"];
const STEP = 2; // one of so many points of a line has a handle; those between follow
const MARGIN = [0.22, 0.35]; // around all lines, of their width
const PART = 0.03; // by which lips are parted at first, of their width

const copy = (value) => JSON.parse(JSON.stringify(value));
const rounded = (value) => Math.round(10 * value) / 10;

export default {
  template: `
    <figure v-if="picture" class="studio-photo">
      <svg ref="svg" :viewBox="box.join(' ')" :style="{ aspectRatio: box[2] / box[3] }" role="group" aria-label="What was found in the picture"
        @pointermove="drag" @pointerup="drop" @pointercancel="drop">
        <image :href="picture" x="0" y="0" :width="size[0]" :height="size[1]" preserveAspectRatio="none" />
        <template v-for="line in lines" :key="line.part + line.edge">
          <polyline class="halo" :points="line.points.join(' ')" /><polyline :class="line.part" :points="line.points.join(' ')" />
        </template>
        <circle v-for="one in handles" :key="one.key" :class="[one.part, { held: held?.key === one.key }]" :cx="one.place[0]" :cy="one.place[1]"
          :r="(one.edge ? 0.9 : 1.3) * radius" tabindex="0" role="button" :aria-label="one.label" :data-place="one.key"
          @pointerdown="grab($event, one)" @keydown="onKey($event, one)"><title>{{ one.label }}</title></circle>
      </svg>
      <figcaption>
        <span class="lips">Lips</span><span class="right_eye">Lids</span><span class="teeth">Teeth</span><span class="pivot">Pivot</span>
        <button type="button" :aria-pressed="String(isParted)" @click="part">Lips are parted</button>
        <button type="button" :disabled="!isChanged" @click="reset">As found</button>
      </figcaption>
    </figure>`,

  props: { picture: String, size: Array, fit: Object },
  emits: ["change"],
  data: () => ({ own: {}, held: null }),

  created() {
    this.own = copy(this.fit);
  },

  mounted: addStyle,

  watch: {
    picture() {
      this.own = copy(this.fit);
    },
  },

  computed: {
    lines() {
      return Object.keys(NAMES)
        .filter((part) => !POINTS.includes(part) && this.own[part])
        .flatMap((part) => Object.entries(this.own[part]).map(([edge, points]) => ({ part, edge, points })));
    },
    /** The part of the picture that is shown: the face, by the lines that were found. */
    box() {
      const found = Object.entries(this.fit).flatMap(([part, value]) => (POINTS.includes(part) ? [value] : Object.values(value).flat()));
      const ends = [0, 1].map((axis) => found.map((place) => place[axis])).map((values) => [Math.min(...values), Math.max(...values)]);
      const width = ends[0][1] - ends[0][0];
      const [x, y] = ends.map(([low], axis) => Math.max(low - MARGIN[axis] * width, 0));
      return [x, y, ...ends.map(([, high], axis) => Math.min(high + MARGIN[axis] * width, this.size[axis]) - [x, y][axis])];
    },
    radius() {
      return this.box[2] / 90;
    },
    handles() {
      const ofLines = this.lines.flatMap(({ part, edge, points }) => {
        const last = points.length - 1;
        return points.flatMap((place, at) => {
          const isEnd = at === 0 || at === last, isShared = isEnd && edge === "lower" && this.own[part].upper;
          if (isShared || (!isEnd && (at % STEP || at + 1 === last))) return [];
          const label = `${NAMES[part]}, ${isEnd ? "corner" : EDGES[edge]}, point ${at + 1} of ${last + 1}`;
          return [{ part, edge, at, place, label, key: `${part}-${edge}-${at}` }];
        });
      });
      return [...ofLines, ...POINTS.filter((part) => this.own[part]).map((part) => ({ part, place: this.own[part], label: NAMES[part], key: part }))];
    },
    isParted() {
      return Boolean(this.own.lips && !this.own.lips.seam);
    },
    isChanged() {
      return JSON.stringify(this.own) !== JSON.stringify(this.fit);
    },
  },

  methods: {
    reset() {
      this.own = copy(this.fit);
      this.tell();
    },

    tell() {
      this.$emit("change", copy(this.own));
    },

    placeOf({ clientX, clientY }) {
      return new DOMPoint(clientX, clientY).matrixTransform(this.$refs.svg.getScreenCTM().inverse());
    },

    grab(event, handle) {
      const { x, y } = this.placeOf(event);
      this.held = { ...handle, off: [handle.place[0] - x, handle.place[1] - y] };
      this.$refs.svg.setPointerCapture(event.pointerId);
      event.preventDefault();
      event.target.focus();
    },

    drag(event) {
      if (!this.held) return;
      const { x, y } = this.placeOf(event), [now] = this.handles.filter(({ key }) => key === this.held.key);
      this.move(this.held, x + this.held.off[0] - now.place[0], y + this.held.off[1] - now.place[1]);
    },

    drop() {
      if (!this.held) return;
      this.held = null;
      this.tell();
    },

    onKey(event, handle) {
      const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
      const way = ways[event.key];
      if (!way) return;
      const step = (event.shiftKey ? 5 : 1) * (this.box[2] / 400);
      this.move(handle, step * way[0], step * way[1]);
      this.tell();
      event.preventDefault();
    },

    /** Move a point; neighbours on its line follow in part, corners only when they are moved, then on both lines. */
    move({ part, edge, at }, x, y) {
      const shift = (place, share) =>
        [x, y].forEach((way, axis) => (place[axis] = rounded(Math.min(Math.max(place[axis] + share * way, 0), this.size[axis]))));
      if (!edge) return shift(this.own[part], 1);
      const last = this.own[part][edge].length - 1, isEnd = at === 0 || at === last;
      for (const [name, points] of Object.entries(this.own[part])) {
        if (name !== edge && !isEnd) continue;
        const middle = at === last ? points.length - 1 : at;
        points.forEach((place, k) => {
          const share = 1 - Math.abs(k - middle) / (STEP + 1);
          if (share > 0 && (k === middle || (k > 0 && k < points.length - 1))) shift(place, share);
        });
      }
    },

    /** Make the seam of lips that touch two edges, or the edges a seam. */
    part() {
      const { upper, lower, seam } = this.own.lips;
      if (seam) {
        const width = seam.at(-1)[0] - seam[0][0];
        const low = seam.map(([x, y], k) => [x, rounded(y + PART * width * Math.sin((Math.PI * k) / (seam.length - 1)))]);
        this.own.lips = { upper: copy(seam), lower: [seam[0], ...low.slice(1, -1), seam.at(-1)].map((place) => [...place]) };
      } else if (upper.length === lower.length) {
        this.own.lips = { seam: upper.map((place, k) => place.map((value, axis) => rounded((value + lower[k][axis]) / 2))) };
      } else {
        this.own.lips = { seam: upper };
      }
      this.tell();
    },
  },
};
