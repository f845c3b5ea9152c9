// The stage: the head of the project, at the time of the clock.

import { clock } from "tts2face-studio/clock.js";
import { metrics, Meter } from "tts2face-studio/metrics.js";
import { Frames, pace } from "tts2face-studio/pace.js";
import { comparison, loadPreview, preview, sides } from "tts2face-studio/preview.js";
import { StageScene } from "tts2face-studio/stage_scene.js";
import { addStyle } from "tts2face-studio/style.js";

const VIEWS = { front: "Front", "three-quarter": "Three-quarter", profile: "Profile", close: "Close-up" };

const WANTED_MS = { device: 1000 / 60, processor: 1000 / 30 }; // between drawn frames, or what the display allows
const SLOW = 1.03, FAST = 1.01; // of it, above which fewer pixels are drawn, and below which more
const LONGEST_DISPLAY_MS = 34; // between frames of a display: 30 a second
const ADAPT_MS = 400; // between two changes of the number of pixels
const MAKING_MS = 1500; // after which a face that does not come is being made
const REST_MS = 250; // at rest before the sharp picture
const AWAKE_MS = 1500; // at rest, while the frames of the display are measured; then nothing is called
const LEAST_SHARE = 0.65; // of the device's pixels along a side: fewer show as squares

export default {
  template: `
    <section class="studio-stage" aria-label="Stage">
      <canvas ref="canvas" role="img" tabindex="0" :aria-label="label" @keydown="onKey"></canvas>
      <img v-if="picture" class="studio-picture" :src="picture" alt="Final picture of this instant, drawn by the renderer">
      <p v-if="message" class="studio-message" role="status">{{ message }}</p>
      <p v-if="side" class="studio-side" role="status">{{ side }}</p>
      <div class="studio-views" role="group" aria-label="Camera">
        <button v-for="(text, name) in views" :key="name" type="button" :aria-pressed="String(current === name)"
          @click="view(name)">{{ text }}</button>
        <button v-if="picture" type="button" @click="showPicture(null)">Live preview</button>
        <button type="button" id="studio-fullscreen" aria-label="Full screen" title="Full screen" @click="fullscreen()"><svg
          viewBox="0 0 16 16" aria-hidden="true"><path d="M1 1h5v2H3v3H1zM10 1h5v5h-2V3h-3zM1 10h2v3h3v2H1zM13 10h2v5h-5v-2h3z"/></svg></button>
      </div>
    </section>`,

  props: { face: String, environment: { type: String, default: "studio" }, preview: String },
  emits: ["view", "failed"],

  data: () => ({ views: VIEWS, current: "front", picture: null, message: "", time: 0, side: "" }),

  computed: {
    label() {
      const view = VIEWS[this.current] ?? "Free view";
      return `${view} of the head. Arrow keys turn the camera, plus and minus change the distance, 1 to 4 choose a view.`;
    },
  },

  async mounted() {
    addStyle();
    this.meter = new Meter("js_ms", "fps");
    Object.assign(this, { dirty: true, share: 1, adapted: 0, rested: 0, drawn: null, ticked: null });
    this.frames = new Frames(this.tick);
    this.changed = () => {
      this.dirty = true;
      this.frames.wake();
    };
    try {
      this.scene = new StageScene(this.$refs.canvas, this.changed);
    } catch (refused) {
      this.fail("This browser has no WebGL; switch it on, or use “Final picture”.", refused);
      return;
    }
    pace.isSoftware = this.scene.isSoftware;
    if (pace.isSoftware) this.share = LEAST_SHARE;
    this.display = 1000 / 60;
    this.interval = this.wanted();
    this.stops = [preview.on("change", this.changed), ...["play", "seek"].map((event) => clock.on(event, this.changed))];
    this.stops.push(comparison.on("change", () => this.showSide()), sides.on(() => this.showSide()));
    this.watchContext();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.$el);
    this.resize();
    this.scene.controls.addEventListener("start", () => this.release());
    this.frames.wake();
    if (this.preview) loadPreview(this.preview).catch((wrong) => this.fail(wrong.message, wrong));
    await this.loadFace();
  },

  beforeUnmount() {
    this.loading?.abort();
    this.frames?.stop();
    this.observer?.disconnect();
    for (const stop of this.stops ?? []) stop();
    this.scene?.dispose();
  },

  watch: {
    face() {
      this.loadFace();
    },
    environment() {
      this.scene?.setBackground(this.environment);
    },
  },

  methods: {
    async loadFace() {
      this.loading?.abort(); // a face that is asked for no longer neither replaces this one nor fails
      if (!this.scene || !this.face) {
        this.message = this.face ? this.message : "Choose a face to see it here.";
        return;
      }
      const { signal } = (this.loading = new AbortController());
      this.message = "Loading the face …";
      const begin = performance.now();
      const making = setTimeout(() => (this.message = "This face is shown for the first time: it takes some seconds …"), MAKING_MS);
      try {
        await this.scene.setFace(this.face, signal);
        this.scene.setBackground(this.environment);
        const { views } = this.scene.face.stage;
        this.views = Object.fromEntries(Object.entries(VIEWS).filter(([name]) => name in views));
        this.message = "";
        metrics.face_ms = performance.now() - begin;
        this.resize();
      } catch (wrong) {
        if (!signal.aborted) this.fail(wrong.message, wrong);
      } finally {
        clearTimeout(making);
      }
    },

    /** Fetch the preview of a project again; what has not changed is kept. */
    setPreview(url) {
      return loadPreview(url).then(() => true);
    },

    view(name) {
      this.current = name;
      if (!this.scene) return;
      this.scene.moved = false;
      this.scene.view(name);
      this.$emit("view", name);
    },

    fullscreen() {
      if (document.fullscreenElement) document.exitFullscreen();
      else this.$el.requestFullscreen();
    },

    showSide() {
      this.changed();
      this.side = !comparison.nFrames ? "" : sides.shown === comparison ? "A" : "B: the project";
    },

    /** Lay a picture over the head; null removes it. */
    showPicture(url) {
      this.picture = url;
    },

    release() {
      this.scene.moved = true;
      this.current = "";
    },

    resize() {
      const { clientWidth: width, clientHeight: height } = this.$refs.canvas ?? {};
      if (!width || !height || !this.scene) return;
      this.scene.resize(width, height, window.devicePixelRatio);
      this.changed();
    },

    watchContext() {
      const { canvas } = this.$refs;
      canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        this.lost = true;
        this.message = "The graphics device was reset; the head comes back in a moment.";
      });
      canvas.addEventListener("webglcontextrestored", () => {
        this.lost = false;
        this.message = "";
        this.changed();
      });
    },

    /** One frame of the display; returns whether the next one is wanted, too. */
    tick(now) {
      if (clock.playing) this.dirty = true;
      if (this.dirty) this.ticked = null;
      else this.measureDisplay(now);
      this.adapt();
      if (this.dirty && !this.lost && (!clock.playing || pace.draws(now))) this.draw(now);
      return clock.playing || this.dirty || this.rested === null || performance.now() - this.rested < AWAKE_MS;
    },

    draw(now) {
      const begin = performance.now(), { scene } = this;
      this.dirty = false;
      metrics.time = clock.time;
      scene.setMotion(sides.shown, metrics.time);
      scene.render();
      this.measure(now);
      metrics.frames = (metrics.frames ?? 0) + 1;
      if (clock.playing) metrics.playing_share = scene.sharpness;
      metrics.is_sharp = scene.sharpness >= 1 && this.rested !== null;
      if (clock.playing) this.meter.add(performance.now() - begin);
    },

    /** Least time between two drawn frames that display and pace allow. */
    wanted() {
      const least = WANTED_MS[pace.isSoftware ? "processor" : "device"];
      return Math.max(pace.steps(this.display) * this.display, least);
    },

    /** Take the time since the last frame of a page at rest into that of the display: near the least, as other work skips frames. */
    measureDisplay(now) {
      const since = Math.min(now - (this.ticked ?? now), LONGEST_DISPLAY_MS);
      if (since > 0) this.display += (since < this.display ? 0.3 : 0.02) * (since - this.display);
      this.ticked = now;
    },

    /** Take the time of a frame that was drawn into the mean time between two. */
    measure(now) {
      if (this.drawn) this.interval = 0.9 * this.interval + 0.1 * Math.min(now - this.drawn, 200);
      this.drawn = now;
    },

    /** Fewer pixels while a slow device plays; at rest, after a moment, one sharp picture. */
    adapt() {
      const now = performance.now(), { scene } = this;
      if (!clock.playing && !this.dirty) {
        this.drawn = null;
        this.rested ??= now;
        if (now - this.rested < REST_MS || scene.sharpness === (scene.isSoftware ? 2 : 1)) return;
        scene.setSharpness(scene.isSoftware ? 2 : 1);
        this.dirty = true;
        return;
      }
      if (this.rested) scene.setSharpness(this.share);
      this.rested = null;
      if (now - this.adapted < ADAPT_MS) return;
      this.adapted = now;
      const wanted = this.wanted(), step = this.interval > SLOW * wanted ? 0.8 : this.interval < FAST * wanted ? 1.1 : 1;
      this.share = Math.min(Math.max(this.share * step, LEAST_SHARE), 1);
      if (step !== 1) scene.setSharpness(this.share);
    },

    onKey(event) {
      const names = Object.keys(this.views);
      if (event.key >= "1" && event.key <= String(names.length)) this.view(names[event.key - 1]);
      else if (event.key.startsWith("Arrow")) this.turn(event.key);
      else if (event.key === "+" || event.key === "-") this.approach(event.key === "+" ? 0.9 : 1 / 0.9);
      else return;
      event.preventDefault();
    },

    turn(key) {
      const { camera, controls } = this.scene, step = 0.08;
      const away = camera.position.clone().sub(controls.target);
      const radius = away.length(), yaw = Math.atan2(away.x, away.z), pitch = Math.asin(away.y / radius);
      const a = yaw + (key === "ArrowLeft" ? -step : key === "ArrowRight" ? step : 0);
      const b = Math.min(Math.max(pitch + (key === "ArrowUp" ? step : key === "ArrowDown" ? -step : 0), -1.4), 1.4);
      away.set(Math.sin(a) * Math.cos(b), Math.sin(b), Math.cos(a) * Math.cos(b)).multiplyScalar(radius);
      camera.position.copy(controls.target).add(away);
      controls.update();
      this.release();
    },

    approach(factor) {
      const { camera, controls } = this.scene;
      camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
      controls.update();
      this.release();
    },

    fail(message, cause) {
      this.message = message;
      console.warn(cause);
      this.$emit("failed", message);
    },
  },
};
