// Records takes of prompts with the webcam and the microphone, and sends each while the next one is read.

import { openCamera, streamRecorder } from "tts2face-studio/camera.js";

const COUNT = 3; // numbers before a take
const COUNT_MS = 600; // between them
const TAIL_MS = 300; // recorded after the stop, so that the last sound is whole
const HINT = "Press Space, read the sentence after the countdown, and press Space again. What to do better is written here.";
const STATES = {
  sending: "sending",
  failed: "not sent",
  checking: "being checked",
  good: "good",
  weak: "usable",
  refused: "record again",
};

export default {
  template: `
    <section class="recorder" aria-label="Recorder">
      <div class="recorder-view">
        <video ref="video" muted playsinline aria-label="Picture of the camera"></video>
        <svg class="recorder-frame" viewBox="0 0 400 300" aria-hidden="true">
          <ellipse cx="200" cy="145" rx="78" ry="108" />
          <path d="M110 122h24M266 122h24" />
        </svg>
        <p v-if="mode === 'off'" class="recorder-welcome">
          Sit in front of a window or a lamp, with the camera at the height of your eyes.<br />
          The takes stay on the computer that runs the studio.
          <button type="button" class="recorder-main" @click="open">Use camera and microphone</button>
        </p>
        <p v-if="problem" class="recorder-problem" role="alert">{{ problem }}</p>
        <p v-if="mode === 'counting'" class="recorder-count" aria-live="assertive">{{ count }}</p>
        <p v-if="mode === 'recording'" class="recorder-on"><span aria-hidden="true">●</span> {{ seconds.toFixed(1) }} s</p>
        <video v-if="shown !== null" class="recorder-played" :src="upload + shown" controls autoplay
          aria-label="Recorded take" @ended="shown = null"></video>
      </div>
      <div class="recorder-level" role="meter" aria-label="Level of the microphone" aria-valuemin="0" aria-valuemax="100"
        :aria-valuenow="level"><span :style="{ width: level + '%' }" :class="{ loud: isLoud }"></span></div>
      <p class="recorder-number">{{ isSingle ? '' : 'Prompt ' + (at + 1) + ' of ' + prompts.length }}
        <span v-if="stateOf(at)" :class="'recorder-state ' + stateOf(at)">{{ names[stateOf(at)] }}</span></p>
      <p class="recorder-prompt" lang="" aria-live="polite">{{ prompts[at] }}</p>
      <div class="recorder-buttons">
        <button type="button" class="recorder-main" :disabled="mode === 'off' || mode === 'saving'" @click="toggle"
          aria-keyshortcuts="Space">{{ mode === 'recording' ? 'Stop' : mode === 'counting' ? 'Cancel' : stateOf(at) ? 'Record again' : 'Record' }}
          <kbd>Space</kbd></button>
        <button v-if="!isSingle" type="button" :disabled="isBusy || at === 0" @click="select(at - 1)">Back</button>
        <button v-if="!isSingle" type="button" :disabled="isBusy || at + 1 === prompts.length"
          @click="select(at + 1)">Next</button>
        <button type="button" :disabled="isBusy || !takes[at]" @click="play">{{ shown === null ? 'Play' : 'Close' }}</button>
        <button type="button" :disabled="isBusy || !takes[at]" @click="$emit('remove', at)">Delete take</button>
      </div>
      <p class="recorder-advice" role="status" :class="stateOf(told)">{{ advice }}</p>
      <ol v-if="!isSingle" class="recorder-list" aria-label="Prompts" tabindex="0">
        <li v-for="(text, n) in prompts" :key="n">
          <button type="button" :class="stateOf(n)" :aria-current="n === at ? 'true' : null" :disabled="isBusy"
            @click="select(n)"><span class="recorder-mark" aria-hidden="true">{{ marks[stateOf(n)] || '○' }}</span>
            {{ text }}<span class="recorder-hidden">{{ names[stateOf(n)] || 'not recorded' }}</span></button>
        </li>
      </ol>
    </section>`,
  // `longest`: seconds after which a forgotten recording ends by itself.
  props: { prompts: Array, takes: Object, upload: String, first: Number, longest: { type: Number, default: 30 } },
  data: () => ({
    mode: "off",
    at: 0,
    count: COUNT,
    seconds: 0,
    level: 0,
    isLoud: false,
    problem: "",
    shown: null,
    told: null,
    local: {},
    names: STATES,
    marks: { sending: "…", failed: "!", checking: "…", good: "✓", weak: "~", refused: "✗" },
  }),
  computed: {
    isBusy() {
      return ["counting", "recording", "saving"].includes(this.mode);
    },
    isSingle() {
      return this.prompts.length === 1;
    },
    advice() {
      if (this.told === null || !this.stateOf(this.told)) return HINT;
      const take = this.takes[this.told] || {};
      const state = this.stateOf(this.told);
      const which = this.isSingle ? "The take" : `Prompt ${this.told + 1}`;
      if (state === "failed") return `${which} was not sent; record it again.`;
      if (take.advice) return `${which}, ${STATES[state]}: ${take.advice}.`;
      return `${which}: ${STATES[state]}.`;
    },
  },
  watch: {
    takes(now, before) {
      const changed = Object.keys(now).filter((n) => now[n].state !== (before[n] || {}).state);
      const judged = changed.filter((n) => now[n].state !== "checking");
      if (judged.length) this.told = Number(judged[judged.length - 1]);
    },
  },
  mounted() {
    this.at = this.first;
    window.addEventListener("keydown", this.press);
    window.addEventListener("beforeunload", this.leave);
  },
  beforeUnmount() {
    window.removeEventListener("keydown", this.press);
    window.removeEventListener("beforeunload", this.leave);
    this.close();
  },
  methods: {
    stateOf(n) {
      return n === null ? "" : this.local[n] || (this.takes[n] || {}).state || "";
    },
    async open() {
      this.problem = "";
      try {
        this.stream = await openCamera();
      } catch (refused) {
        this.problem = refused.message;
        return;
      }
      this.$refs.video.srcObject = this.stream;
      await this.$refs.video.play();
      this.mode = "idle";
      this.context = new AudioContext();
      const analyser = this.context.createAnalyser();
      analyser.fftSize = 2048;
      this.context.createMediaStreamSource(this.stream).connect(analyser);
      const samples = new Float32Array(analyser.fftSize);
      this.meter = setInterval(() => {
        analyser.getFloatTimeDomainData(samples);
        let peak = 1e-5;
        for (const sample of samples) peak = Math.max(peak, Math.abs(sample));
        this.level = Math.round(Math.max(0, 100 + (100 / 60) * 20 * Math.log10(Math.min(peak, 1)))); // of 60 dB
        this.isLoud = peak >= 0.99;
        if (this.mode === "recording") this.seconds = (performance.now() - this.began) / 1000;
        if (this.mode === "recording" && this.seconds > this.longest) this.stop();
      }, 80);
    },
    close() {
      clearInterval(this.meter);
      clearTimeout(this.timer);
      for (const track of this.stream ? this.stream.getTracks() : []) track.stop();
      if (this.context) this.context.close();
    },
    press(event) {
      if (event.code !== "Space" || event.repeat || event.target.closest("input,textarea,button,select,video,a")) return;
      event.preventDefault();
      if (this.mode !== "off" && this.mode !== "saving") this.toggle();
    },
    leave(event) {
      if (Object.values(this.local).includes("sending") || this.isBusy) event.preventDefault();
    },
    toggle() {
      this.shown = null;
      if (this.mode === "recording") return this.stop();
      if (this.mode === "counting") {
        clearTimeout(this.timer);
        this.mode = "idle";
        return;
      }
      this.mode = "counting";
      this.count = COUNT + 1;
      this.tick();
    },
    tick() {
      this.count -= 1;
      if (this.count === 0) return this.record();
      this.timer = setTimeout(this.tick, COUNT_MS);
    },
    record() {
      this.recorder = streamRecorder(this.stream, (recording) => this.send(this.at, recording));
      this.recorder.start();
      this.began = performance.now();
      this.seconds = 0;
      this.mode = "recording";
    },
    stop() {
      this.mode = "saving";
      setTimeout(() => this.recorder.stop(), TAIL_MS);
    },
    async send(at, blob) {
      this.local = { ...this.local, [at]: "sending" };
      this.mode = "idle";
      const next = this.prompts.findIndex((_, n) => n > at && !["good", "weak", "checking"].includes(this.stateOf(n)));
      if (next >= 0) this.select(next);
      let isSent = false;
      try {
        const answer = await fetch(this.upload + at, { method: "PUT", body: blob, headers: { "Content-Type": blob.type } });
        isSent = answer.ok;
      } catch (lost) {
        isSent = false;
      }
      const { [at]: _, ...others } = this.local;
      this.local = isSent ? others : { ...others, [at]: "failed" };
      if (isSent) this.$emit("sent", at);
      else this.told = at;
    },
    select(n) {
      this.shown = null;
      this.at = n;
      if ((this.takes[n] || {}).advice) this.told = n;
      this.$emit("select", n);
    },
    play() {
      this.shown = this.shown === null ? this.at : null;
    },
  },
};
