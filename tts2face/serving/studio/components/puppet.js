// A camera that drives the head: its pictures go to the studio's server, whose tracker answers with poses. Beside it,
// takes are recorded, and played on the stage.

import { openCamera, streamRecorder } from "tts2face-studio/camera.js";
import { clock } from "tts2face-studio/clock.js";
import { metrics } from "tts2face-studio/metrics.js";
import { loadPreview, preview } from "tts2face-studio/preview.js";

const WIDTH = 480; // of the pictures that are sent: the tracker reads a face from 256 x 256 pixels
const QUALITY = 0.8; // of their JPEG
const MAX_WAITING = 2; // pictures on their way: one that is read, and the next one
const MEASURED = 60; // pictures of which the delay and the rate are shown
const MAX_TAKE_S = 120;
const TAIL_MS = 200; // recorded after the stop, so that the last sound is whole
const REST = { live: "The head follows you.", "no face": "No face is found; come into the picture." };

export default {
  template: `
    <section class="puppet-camera" aria-label="Camera">
      <div class="puppet-view" :class="{ off: mode === 'off' }">
        <video ref="video" muted playsinline aria-label="Picture of the camera"></video>
        <p v-if="mode === 'off'">The head follows your face. Pictures go to the computer that runs the studio, and nowhere
          else.</p>
        <span v-if="isRecording" class="puppet-on"><span aria-hidden="true">●</span> {{ seconds.toFixed(1) }} s</span>
      </div>
      <progress v-if="state === 'calibrating'" :value="share" max="1" aria-label="Calibration"></progress>
      <p class="puppet-status" role="status">{{ problem || text }}</p>
      <p v-if="mode === 'on' && rate" class="puppet-measure">{{ rate.toFixed(0) }} pictures/s, delay {{ delay.toFixed(0) }} ms</p>
      <div class="puppet-buttons">
        <button v-if="mode === 'off'" type="button" class="main" @click="open">Use camera and microphone</button>
        <button v-else type="button" :disabled="isRecording" @click="close">Stop the camera</button>
        <button v-if="mode === 'on'" type="button" class="main" :disabled="isSending" @click="toggle">{{
          isRecording ? 'Stop' : isSending ? 'Sending …' : 'Record a take' }}</button>
      </div>
      <div v-if="shown" class="puppet-player" role="group" aria-label="Take on the stage">
        <button type="button" class="main" @click="play" :aria-label="isPlaying ? 'Pause' : 'Play'">{{ isPlaying ? '❚❚' : '▶' }}</button>
        <input type="range" min="0" :max="duration" step="0.01" :value="time" @input="seek" aria-label="Time in the take" />
        <span>{{ time.toFixed(1) }} / {{ duration.toFixed(1) }} s</span>
      </div>
    </section>`,

  props: { live: String, upload: String },
  emits: ["sent", "failed"],

  data: () => ({
    mode: "off", state: "", share: 0, rate: 0, delay: 0, problem: "", isRecording: false, isSending: false, seconds: 0,
    shown: "", isPlaying: false, time: 0, duration: 0,
  }),

  computed: {
    text() {
      if (this.mode === "off") return "";
      if (this.state === "calibrating") return "Look into the camera, close your lips, speak a sentence, and blink.";
      return REST[this.state] ?? "Starting the tracker …";
    },
  },

  mounted() {
    const show = () => (this.isPlaying = clock.playing);
    this.stops = ["play", "pause", "end", "load"].map((event) => clock.on(event, show));
    this.ticking = setInterval(() => {
      this.time = this.shown ? clock.time : 0;
      if (this.isRecording) this.seconds = (performance.now() - this.began) / 1000;
      if (this.isRecording && this.seconds > MAX_TAKE_S) this.toggle();
    }, 100);
  },

  beforeUnmount() {
    clearInterval(this.ticking);
    for (const stop of this.stops) stop();
    this.close();
  },

  methods: {
    async open() {
      this.problem = "";
      this.mode = "starting";
      try {
        this.stream = await openCamera();
      } catch (refused) {
        this.mode = "off";
        this.problem = refused.message;
        return;
      }
      this.$refs.video.srcObject = this.stream;
      await this.$refs.video.play();
      clock.pause();
      this.shown = "";
      this.mode = "on";
      this.state = "";
      this.connect();
    },

    connect() {
      this.waiting = 0;
      this.answers = [];
      this.channels = null;
      const address = new URL(this.live, location.href);
      address.protocol = address.protocol.replace("http", "ws");
      this.socket = new WebSocket(address);
      this.socket.onmessage = (event) => this.answer(JSON.parse(event.data));
      this.socket.onclose = () => {
        if (this.mode === "off") return;
        this.problem ||= "The tracker has stopped; start the camera again.";
        this.close();
      };
    },

    answer(found) {
      if (found.error) {
        this.problem = found.message[0].toUpperCase() + found.message.slice(1) + ".";
        return;
      }
      if (found.channels) {
        this.channels = found.channels;
        this.grab();
        return;
      }
      this.waiting -= 1;
      this.state = found.state;
      this.share = found.share;
      if (found.weights && !this.shown) preview.pose(this.channels, found.weights, found.head);
      this.measure(performance.now() / 1000 - found.time);
    },

    measure(delay) {
      this.answers.push([performance.now() / 1000, delay]);
      if (this.answers.length > MEASURED) this.answers.shift();
      const all = this.answers, spent = all[all.length - 1][0] - all[0][0];
      if (all.length < 10 || spent <= 0) return;
      this.rate = (all.length - 1) / spent;
      this.delay = (1000 * all.reduce((sum, one) => sum + one[1], 0)) / all.length;
      Object.assign(metrics, { camera_fps: this.rate, camera_ms: this.delay, camera_state: this.state });
    },

    /** Send each new picture of the camera while few are on their way. */
    grab() {
      const { video } = this.$refs;
      if (!this.socket || this.socket.readyState !== WebSocket.OPEN || !video) return;
      video.requestVideoFrameCallback(() => this.grab());
      if (this.waiting >= MAX_WAITING || !video.videoWidth) return;
      this.waiting += 1;
      const time = performance.now() / 1000;
      this.canvas ??= document.createElement("canvas");
      const share = Math.min(WIDTH / video.videoWidth, 1);
      this.canvas.width = Math.round(share * video.videoWidth);
      this.canvas.height = Math.round(share * video.videoHeight);
      this.canvas.getContext("2d").drawImage(video, 0, 0, this.canvas.width, this.canvas.height);
      this.canvas.toBlob((blob) => this.send(time, blob), "image/jpeg", QUALITY);
    },

    async send(time, blob) {
      const head = new DataView(new ArrayBuffer(8));
      head.setFloat64(0, time, true);
      if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(new Blob([head, blob]));
    },

    close() {
      this.mode = "off";
      this.state = "";
      this.rate = 0;
      if (this.isRecording) this.recorder.stop();
      this.isRecording = false;
      this.socket?.close();
      this.socket = null;
      for (const track of this.stream ? this.stream.getTracks() : []) track.stop();
    },

    toggle() {
      if (this.isRecording) {
        this.isRecording = false;
        this.isSending = true;
        setTimeout(() => this.recorder.stop(), TAIL_MS);
        return;
      }
      this.recorder = streamRecorder(this.stream, (recording) => this.store(recording));
      this.recorder.start();
      this.began = performance.now();
      this.seconds = 0;
      this.isRecording = true;
    },

    async store(blob) {
      this.isSending = true;
      try {
        const answer = await fetch(this.upload, { method: "PUT", body: blob, headers: { "Content-Type": blob.type } });
        if (!answer.ok) throw new Error((await answer.json()).error.message);
        this.$emit("sent");
      } catch (refused) {
        this.problem = `The take was not kept: ${refused.message}.`;
      }
      this.isSending = false;
    },

    /** Play a take on the stage; its address ends what the camera shows. */
    async show(address) {
      this.shown = address;
      try {
        await loadPreview(address);
      } catch (wrong) {
        this.shown = "";
        this.$emit("failed", wrong.message);
        return;
      }
      this.duration = preview.duration;
      clock.play(0);
    },

    /** End the take on the stage if it is the one of an address. */
    hide(address) {
      if (this.shown !== address) return;
      clock.pause();
      this.shown = "";
    },

    play() {
      clock.toggle();
    },

    seek(event) {
      clock.seek(Number(event.target.value));
      this.time = clock.time;
    },
  },
};
