// Client of `taxel live`: frames, events and status over its WebSocket. No dependency; browsers and Node 20 or later.
//
//   import { TaxelLive } from "./taxel-live.js";
//   const live = await TaxelLive.open("http://127.0.0.1:7117/?token=..."); // the address that `taxel live` prints
//   live.tare();
//   for await (const frame of live) console.log(frame.sequence, frame.force);
//
// The protocol is docs/live-protocol.md, version 5. Node 20 has no WebSocket of its own: then the one below is used.

const PROTOCOL = 5;
const MAGIC = 0x354c5854;
const HEADER = 216;
const CONTACT = 160;
const NOT_KNOWN = 2n ** 64n - 1n;
const NO_STATE = 255;
/** How much a total, the force of a contact or the value of an event says. */
export const CERTAINTIES = ["exact", "at_least", "unknown"];
/** Frames that may wait for a slow reader; the oldest are dropped and counted. */
const WAITING = 256;
const LARGEST_MESSAGE = 64 << 20;

export const UNCHECKED_WIRE = 1;
export const INFERRED_TIME = 2;

export class TaxelError extends Error {}

/** Reads a binary message: one frame, SI units, NaN (or null for counts) for what is not known. */
export function decodeFrame(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < HEADER) {
    throw new TaxelError(`a frame has ${buffer.byteLength} bytes, its header alone needs ${HEADER}`);
  }
  const magic = view.getUint32(0, true);
  if (magic !== MAGIC) throw new TaxelError(`a frame begins with 0x${magic.toString(16)}, not with TXL5`);
  const u64 = (at) => view.getBigUint64(at, true);
  const f64 = (at) => view.getFloat64(at, true);
  const list = (at, count) => Array.from({ length: count }, (_, i) => f64(at + 8 * i));
  const known = (value) => (value === NOT_KNOWN ? null : Number(value));
  const components = view.getUint16(4, true);
  const contactCount = view.getUint16(6, true);
  const taxels = view.getUint32(184, true);
  const channels = view.getUint32(188, true);
  const flags = view.getUint32(192, true);
  const needed = HEADER + CONTACT * contactCount + 5 * channels + (8 * components + 6) * taxels;
  if (![1, 3].includes(components) || buffer.byteLength !== needed) {
    throw new TaxelError(`a frame has ${buffer.byteLength} bytes; its counts need ${needed}`);
  }
  const contacts = Array.from({ length: contactCount }, (_, i) => {
    const at = HEADER + CONTACT * i;
    return {
      id: f64(at),
      taxels: f64(at + 8),
      centre: list(at + 16, 2),
      covariance: list(at + 32, 3),
      velocity: list(at + 56, 2),
      force: list(at + 72, 3),
      forceDeviation: list(at + 96, 3),
      torsion: f64(at + 120),
      peak: f64(at + 128),
      peakTaxel: f64(at + 136),
      bound: f64(at + 144),
      certainty: CERTAINTIES[f64(at + 152)],
    };
  });
  let at = HEADER + CONTACT * contactCount;
  const floats = (count) => new Float32Array(buffer, (at += 4 * count) - 4 * count, count);
  const octets = (count) => new Uint8Array(buffer, (at += count) - count, count);
  return {
    components,
    sequence: u64(8),
    timeNs: u64(16),
    /** null where the wire of the board cannot tell. */
    lost: known(u64(24)),
    late: Number(u64(32)),
    duplicate: Number(u64(40)),
    rate: f64(48),
    latency: f64(56),
    force: list(64, 3),
    forceDeviation: list(88, 3),
    moment: list(112, 3),
    centre: list(136, 2),
    centreCovariance: list(152, 3),
    sum: f64(176),
    totalCertainty: CERTAINTIES[view.getUint8(212)],
    /** Code of the state that is the reason why the total is not exact; null for none. */
    totalReason: view.getUint8(213) === NO_STATE ? null : view.getUint8(213),
    /** False while the values are no forces yet. */
    zeroKnown: (flags & 32) === 0,
    tared: (flags & 1) !== 0,
    tareRunning: (flags & 2) !== 0,
    clipped: (flags & 4) !== 0,
    /** Arrival by the steady clock of the server, ns since its source was opened; null without a link. */
    hostNs: known(u64(200)),
    flags: view.getUint32(208, true),
    contacts,
    readings: floats(channels),
    /** Taxel by taxel: of one component z, of three x, y, z. */
    values: floats(components * taxels),
    deviations: floats(components * taxels),
    residuals: floats(taxels),
    channelStates: octets(channels),
    states: octets(taxels),
    counted: octets(taxels),
  };
}

/** A connection to `taxel live`. */
export class TaxelLive {
  /** What the numbers mean; then the last messages of these kinds. */
  hello = null;
  status = null;
  rest = null;
  tares = null;
  baseline = null;
  health = null;
  /** The last 1000 events, marks among them. */
  events = [];
  /** Frames that the reader of this client was too slow for. */
  dropped = 0;
  #address;
  #socket;
  #frames = [];
  #waiting = null;
  #ended = false;
  #failure = null;

  /** Connects to the address that `taxel live` prints. */
  static async open(address) {
    const url = new URL(address);
    const token = url.searchParams.get("token") ?? "";
    if (token === "") throw new TaxelError(`"${address}" has no token: use the address that taxel live prints`);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.pathname = url.pathname.replace(/\/$/, "") + "/ws";
    url.search = `?token=${encodeURIComponent(token)}`;
    url.hash = "";
    const Socket = globalThis.WebSocket ?? PlainWebSocket;
    const live = new TaxelLive();
    live.#address = address;
    await new Promise((resolve, reject) => {
      const socket = new Socket(url.href);
      live.#socket = socket;
      socket.binaryType = "arraybuffer";
      socket.onmessage = ({ data }) => {
        try {
          live.#take(data);
          if (live.hello !== null) resolve();
        } catch (error) {
          live.#end(error);
          reject(error);
        }
      };
      const refused = () => reject(new TaxelError("taxel live does not answer, or the token is of another run"));
      socket.onerror = refused;
      socket.onclose = () => {
        live.#end(null);
        refused();
      };
    });
    return live;
  }

  tare(force = false) {
    this.command({ command: "tare", force });
  }

  clearTare() {
    this.command({ command: "clear_tare" });
  }

  /** Notes `text` at the newest frame. */
  mark(text) {
    this.command({ command: "mark", text });
  }

  /** Returns to the rest values after entry `to` of `tares.entries`. */
  undoTare(to) {
    this.command({ command: "undo_tare", to });
  }

  /** Records the run to `name`, such as "grasp.mcap", in the folder `status.records_to`; `status.message` says why not. */
  startRecording(name) {
    this.command({ command: "start_recording", name });
  }

  stopRecording() {
    this.command({ command: "stop_recording" });
  }

  /** Pauses a replay, or lets it go on; as all that follow it does nothing where `status.replay` is null. */
  pause(on = true) {
    this.command({ command: "pause", on });
  }

  /** Plays the next frame of a replay that is paused. */
  step() {
    this.command({ command: "step" });
  }

  /** Plays a replay from this device time on, s. */
  seek(timeS) {
    this.command({ command: "seek", time_ns: Math.round(timeS * 1e9) });
  }

  /** Plays a replay so many times as fast as it was recorded. */
  speed(speed) {
    this.command({ command: "speed", speed });
  }

  /** Plays a replay again and again, or to its end. */
  loop(on = true) {
    this.command({ command: "loop", on });
  }

  /** A connection to another sensor of the same service: its place in `status.sensors`, or its name. */
  sensor(which) {
    const sensors = this.status?.sensors ?? [];
    const named = sensors.filter(({ name }, place) => name === which || place === which);
    if (named.length !== 1) {
      const known = sensors.map(({ name }) => name).join(", ") || "none: the service has one sensor";
      throw new TaxelError(`${which} names ${named.length} sensors; there are: ${known}`);
    }
    const url = new URL(this.#address);
    url.pathname = named[0].path;
    return TaxelLive.open(url.href);
  }

  /** Sends a command of docs/live-protocol.md. */
  command(command) {
    this.#socket.send(JSON.stringify(command));
  }

  close() {
    this.#socket.close();
    this.#end(null);
  }

  /** The next frame; null when the server has ended. */
  async nextFrame() {
    if (this.#frames.length === 0 && !this.#ended) {
      await new Promise((resolve) => {
        this.#waiting = resolve;
      });
    }
    if (this.#frames.length > 0) return this.#frames.shift();
    if (this.#failure !== null) throw this.#failure;
    return null;
  }

  async *[Symbol.asyncIterator]() {
    for (let frame = await this.nextFrame(); frame !== null; frame = await this.nextFrame()) yield frame;
  }

  #take(data) {
    if (typeof data !== "string") {
      this.#frames.push(decodeFrame(data));
      if (this.#frames.length > WAITING) {
        this.#frames.shift();
        this.dropped += 1;
      }
      this.#wake();
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "hello") {
      if (message.protocol !== PROTOCOL) {
        throw new TaxelError(`the server speaks protocol ${message.protocol}, this client speaks ${PROTOCOL}`);
      }
      this.hello = message;
    } else if (message.type === "events") {
      this.events = [...this.events, ...message.events].slice(-1000);
    } else if (["status", "rest", "tares", "baseline", "health"].includes(message.type)) {
      this[message.type] = message;
    }
  }

  #end(failure) {
    this.#ended = true;
    this.#failure ??= failure;
    this.#wake();
  }

  #wake() {
    this.#waiting?.();
    this.#waiting = null;
  }
}

/** The little of a WebSocket client that is needed, for a Node without one. */
class PlainWebSocket {
  onmessage = null;
  onerror = null;
  onclose = null;
  #socket = null;
  #crypto = null;

  constructor(address) {
    this.#open(new URL(address)).catch((error) => this.onerror?.(error));
  }

  async #open(url) {
    const net = await import("node:net");
    this.#crypto = await import("node:crypto");
    const key = this.#crypto.randomBytes(16).toString("base64");
    const socket = net.connect({ host: url.hostname.replace(/^\[|\]$/g, ""), port: Number(url.port || 80), noDelay: true });
    this.#socket = socket;
    let buffer = Buffer.alloc(0);
    let open = false;
    socket.on("connect", () => {
      socket.write(
        `GET ${url.pathname}${url.search} HTTP/1.1\r\nHost: ${url.host}\r\nUpgrade: websocket\r\n` +
          `Connection: Upgrade\r\nSec-WebSocket-Key: ${key}\r\nSec-WebSocket-Version: 13\r\n\r\n`,
      );
    });
    socket.on("error", (error) => this.onerror?.(error));
    socket.on("close", () => this.onclose?.());
    socket.on("data", (data) => {
      buffer = buffer.length === 0 ? data : Buffer.concat([buffer, data]);
      if (!open) {
        const end = buffer.indexOf("\r\n\r\n");
        if (end < 0) return;
        const head = buffer.subarray(0, end).toString("latin1");
        const accept = this.#crypto
          .createHash("sha1")
          .update(`${key}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`)
          .digest("base64");
        if (!head.startsWith("HTTP/1.1 101") || !head.includes(accept)) {
          this.onerror?.(new TaxelError(head.split("\r\n")[0]));
          socket.destroy();
          return;
        }
        open = true;
        buffer = buffer.subarray(end + 4);
      }
      buffer = this.#messages(buffer);
    });
  }

  /** Hands on the whole messages at the begin of `buffer`; the rest. taxel sends none in pieces. */
  #messages(buffer) {
    while (buffer.length >= 2) {
      let [length, at] = [buffer[1] & 127, 2];
      if (length === 126) {
        if (buffer.length < 4) break;
        [length, at] = [buffer.readUInt16BE(2), 4];
      } else if (length === 127) {
        if (buffer.length < 10) break;
        [length, at] = [Number(buffer.readBigUInt64BE(2)), 10];
      }
      if (length > LARGEST_MESSAGE) {
        this.onerror?.(new TaxelError(`a message of ${length} bytes is none of taxel live`));
        this.#socket.destroy();
        break;
      }
      if (buffer.length < at + length) break;
      const payload = buffer.subarray(at, at + length);
      const code = buffer[0] & 15;
      buffer = buffer.subarray(at + length);
      if (code === 1) this.onmessage?.({ data: payload.toString("utf8") });
      // A copy, so that its numbers lie at multiples of their size.
      else if (code === 2) this.onmessage?.({ data: new Uint8Array(payload).buffer });
      else if (code === 9) this.#send(10, payload);
      else if (code === 8) this.#socket.end();
    }
    return buffer;
  }

  send(text) {
    this.#send(1, Buffer.from(text, "utf8"));
  }

  close() {
    this.#socket?.end();
  }

  #send(code, payload) {
    const mask = this.#crypto.randomBytes(4);
    const head =
      payload.length < 126
        ? Buffer.from([128 | code, 128 | payload.length])
        : Buffer.from([128 | code, 128 | 126, payload.length >> 8, payload.length & 255]);
    const masked = Buffer.from(payload.map((byte, i) => byte ^ mask[i & 3]));
    this.#socket.write(Buffer.concat([head, mask, masked]));
  }
}
