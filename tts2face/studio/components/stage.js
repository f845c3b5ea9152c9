// The stage: what it shows at the time of the clock.

import { clock } from "tts2face-studio/clock.js";
import { loadPreview, preview } from "tts2face-studio/preview.js";

export default {
  template: `
    <section aria-label="Stage" style="position: relative; height: 100%; overflow: hidden">
      <img v-if="picture" :src="picture" alt="Final picture" style="width: 100%; height: 100%; object-fit: contain">
      <p v-else role="status">{{ frames }} frames</p>
    </section>`,
  props: { face: String, environment: String, preview: String },
  emits: ["view", "failed"],
  data: () => ({ frames: 0, picture: null }),
  mounted() {
    window.__studio = { clock, preview };
    this.stop = preview.on("change", () => (this.frames = preview.nFrames));
    if (this.preview) loadPreview(this.preview).catch((wrong) => this.$emit("failed", wrong.message));
  },
  beforeUnmount() {
    this.stop?.();
  },
  methods: {
    setPreview(url) {
      return loadPreview(url).then(() => true);
    },
    view(name) {
      this.$emit("view", name);
    },
    fullscreen() {
      this.$el.requestFullscreen();
    },
    showPicture(url) {
      this.picture = url;
    },
  },
};
