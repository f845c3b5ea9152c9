/** Samples of one channel: 16-bit, or floats from -1 to 1. */
export type Block = Int16Array | Float32Array | ArrayBuffer | AudioBuffer;
export type Blocks = ReadableStream<Block> | AsyncIterable<Block> | Iterable<Block>;
export type State = "idle" | "speaking" | "listening" | "offline";

/** How an utterance ended, and how many seconds of it were heard. */
export interface Ending {
  interrupted: boolean;
  seconds: number;
}

export interface HeadEvents {
  /** The file is shown; `names` are the weights that move it. */
  ready: CustomEvent<{ names: string[] }>;
  /** A word begins to be heard. */
  word: CustomEvent<{ word: string; seconds: number; text: string }>;
  /** A phone (IPA; "sil": silence) begins to be heard. */
  phone: CustomEvent<{ phone: string; seconds: number }>;
  /** A sentence begins to be heard. */
  caption: CustomEvent<{ text: string; seconds: number }>;
  /** An utterance has been heard, or was interrupted. */
  end: CustomEvent<Ending & { id: string }>;
  state: CustomEvent<{ state: State }>;
  /** What of a text is not followed. */
  note: CustomEvent<{ message: string; text?: string }>;
  /** `isFinal`: the service refuses the connection, which is not tried again. */
  error: CustomEvent<{ message: string; text?: string; isFinal?: boolean }>;
  /** The browser allows no sound before a click or a key; the face speaks without. */
  blocked: CustomEvent<Record<string, never>>;
}

export class Tts2faceHead extends HTMLElement {
  /** API key, or a function that gives one for each connection. */
  key: string | (() => string | Promise<string>) | null;
  /** Options of a clip (docs/options.md), such as { style: "happy", seed: 3, hair: "bob01" }. */
  options: Record<string, unknown>;
  /** A GLTFLoader of the page, with decoders of its own. */
  loader?: unknown;
  readonly state: State;
  /** Weights by name as they are drawn. */
  readonly weights: Record<string, number>;
  /** Scene, camera and renderer of three.js; null outside a document. */
  readonly stage: { scene: any; camera: any; renderer: any; puppet: any } | null;
  speak(text: string | ReadableStream<string> | AsyncIterable<string | null>): Promise<Ending>;
  push(sound: Block | Blocks | MediaStream, rate?: number): Promise<Ending>;
  endSound(): void;
  listen(sound?: Blocks | MediaStream, rate?: number): Promise<void>;
  interrupt(): number;
  gesture(name: string, how?: { size?: number; seconds?: number; down_deg?: number; left_deg?: number }): void;
  changeStyle(style: string): void;
  addEventListener<K extends keyof HeadEvents>(type: K, listener: (event: HeadEvents[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "tts2face-head": Tts2faceHead;
  }
}
