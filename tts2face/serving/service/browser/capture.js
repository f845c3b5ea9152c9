// In the thread of the sound: gathers the first channel of its input in blocks, and sends them to the page.

class Capture extends AudioWorkletProcessor {
  constructor({ processorOptions: { size } }) {
    super();
    this.block = new Float32Array(size);
    this.n = 0;
  }

  process([[channel]]) {
    for (const value of channel ?? []) {
      this.block[this.n++] = value;
      if (this.n < this.block.length) continue;
      this.port.postMessage(this.block.slice());
      this.n = 0;
    }
    return true;
  }
}

registerProcessor("tts2face-capture", Capture);
