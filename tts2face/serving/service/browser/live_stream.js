// A live stream of the service over a WebSocket, which is opened again when it breaks (docs/http.md, "Live streams").

const PROTOCOL = "tts2face"; // beside the key, which is no part of the address: addresses stand in logs
const FIRST_WAIT_S = 0.5; // before the connection is tried again; doubled up to
const LONGEST_WAIT_S = 15;
const LASTING_S = 5; // of a connection after which the wait is the first one again
const REFUSED = new Set([1007, 1008]); // close codes: a wrong first message, a key that is not accepted

export class LiveStream {
  #server;
  #key;
  #start;
  #follow;
  #socket = null;
  #waiting = []; // messages until the connection is open
  #wait = FIRST_WAIT_S;
  #timer = null;
  #isClosed = false;

  /**
   * `server`: address of the service; `key`: its API key, or a function that gives one, also a promise; `start`: the
   * first message. `follow` gets the events of the service, {type: "sound", samples} and
   * {type: "connection", state: "open" | "lost" | "refused", reason}.
   */
  constructor(server, key, start, follow) {
    this.#server = server;
    this.#key = key;
    this.#start = start;
    this.#follow = follow;
    this.#open();
  }

  /** Send an object as JSON, or Int16Array; kept until the connection is open. */
  send(message) {
    const content = ArrayBuffer.isView(message) ? message : JSON.stringify(message);
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(content);
    else this.#waiting.push(content);
  }

  close() {
    this.#isClosed = true;
    clearTimeout(this.#timer);
    this.#socket?.close();
  }

  async #open() {
    const address = new URL("/v1/stream", this.#server);
    address.protocol = address.protocol.replace("http", "ws");
    let key = "";
    try {
      key = typeof this.#key === "function" ? await this.#key() : this.#key;
    } catch (wrong) {
      return this.#end({ code: 0, reason: `there is no key: ${wrong.message ?? wrong}` }, 0);
    }
    if (this.#isClosed) return;
    const socket = new WebSocket(address, key ? [PROTOCOL, `${PROTOCOL}.key.${key}`] : []);
    const began = performance.now();
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      socket.send(JSON.stringify({ type: "start", ...this.#start }));
      for (const content of this.#waiting.splice(0)) socket.send(content);
      this.#follow({ type: "connection", state: "open" });
    };
    socket.onmessage = ({ data }) => {
      if (this.#isClosed) return;
      this.#follow(typeof data === "string" ? JSON.parse(data) : { type: "sound", samples: new Int16Array(data) });
    };
    socket.onclose = (event) => this.#end(event, (performance.now() - began) / 1000);
    this.#socket = socket;
  }

  #end({ code, reason }, seconds) {
    this.#socket = null;
    if (this.#isClosed) return;
    this.#waiting = [];
    if (REFUSED.has(code)) {
      this.#isClosed = true;
      return this.#follow({ type: "connection", state: "refused", reason: reason || `the service refused it (${code})` });
    }
    if (seconds > LASTING_S) this.#wait = FIRST_WAIT_S;
    const wait = this.#wait * (0.5 + Math.random()); // not all pages at once, after a service has restarted
    this.#wait = Math.min(2 * this.#wait, LONGEST_WAIT_S);
    this.#follow({ type: "connection", state: "lost", reason: reason || `no connection to ${this.#server}` });
    this.#timer = setTimeout(() => this.#open(), 1000 * wait);
  }
}
