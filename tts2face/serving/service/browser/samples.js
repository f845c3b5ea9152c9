// Sound of other programs: samples of every common form as 16-bit ones, and microphones.

const BLOCK = 2048; // samples of a microphone that are sent at once, 40 ms at 48 kHz

/** Samples as Int16Array, one channel; an ArrayBuffer and other views hold 16-bit samples, little-endian. */
export function shorts(block) {
  if (block instanceof Int16Array) return block;
  if (globalThis.AudioBuffer && block instanceof AudioBuffer) return shorts(block.getChannelData(0));
  if (block instanceof Float32Array) {
    return Int16Array.from(block, (value) => Math.round(32767 * Math.min(Math.max(value, -1), 1)));
  }
  if (block instanceof ArrayBuffer) return new Int16Array(block, 0, block.byteLength >> 1);
  if (ArrayBuffer.isView(block)) return shorts(block.slice().buffer);
  throw new TypeError("sound must be an Int16Array, a Float32Array, an AudioBuffer or an ArrayBuffer of 16-bit samples");
}

/** 16-bit samples as Float32Array. */
export function floats(samples) {
  return Float32Array.from(samples, (value) => value / 32768);
}

/** Whether a value is one block of sound, not a stream of them. */
export function isBlock(sound) {
  return ArrayBuffer.isView(sound) || sound instanceof ArrayBuffer || (globalThis.AudioBuffer && sound instanceof AudioBuffer);
}

/** The blocks of a stream: a ReadableStream, or what can be iterated over. */
export async function* blocksOf(stream) {
  if (!stream?.getReader) return yield* stream;
  const reader = stream.getReader(); // not every browser iterates over streams
  try {
    for (let part = await reader.read(); !part.done; part = await reader.read()) yield part.value;
  } finally {
    reader.releaseLock();
  }
}

/** Sound at one rate as sound at another, block after block without a seam: linear between two samples. */
export class Resampler {
  #step;
  #place = 0; // of the next sample made, in samples of the block, whose sample -1 is the last of the block before
  #last = 0;

  constructor(from, to) {
    this.#step = from / to;
  }

  /** Samples (Float32Array) at the new rate. */
  add(block) {
    const n = Math.max(0, Math.ceil((block.length - 1 - this.#place) / this.#step)), made = new Float32Array(n);
    for (let i = 0; i < n; i++) {
      const place = this.#place + i * this.#step, before = Math.floor(place);
      const low = before < 0 ? this.#last : block[before];
      made[i] = low + (place - before) * (block[before + 1] - low);
    }
    this.#place += n * this.#step - block.length;
    this.#last = block.at(-1) ?? this.#last;
    return made;
  }
}

/** Send the sound of a MediaStream (a microphone, a call) to a function, in Float32Arrays; returns what ends it. */
export async function capture(context, stream, take) {
  await context.audioWorklet.addModule(new URL("./capture.js", import.meta.url));
  const source = context.createMediaStreamSource(stream);
  const node = new AudioWorkletNode(context, "tts2face-capture", { numberOfOutputs: 0, processorOptions: { size: BLOCK } });
  node.port.onmessage = ({ data }) => take(data);
  source.connect(node);
  return () => {
    node.port.onmessage = null;
    source.disconnect();
  };
}
