// The live protocol, version 2 (docs/live-protocol.md): bytes and JSON in, frames and messages out. No I/O.

/** A quantity and the unit in which it is shown: shown = SI / `si_per_unit`. */
export interface Unit {
  quantity: string;
  symbol: string;
  si_per_unit: number;
}

/** What the numbers of a device with one value per taxel are. */
export interface SignalsMeaning {
  /** Names in the order of a frame. */
  channels: string[];
  /** What a channel carries. */
  signal: Unit;
  /** What a taxel feels. */
  value: Unit;
  /** Value at the end of the colour scale, SI. */
  full_scale: number;
  /** Whether values of either sign occur in normal use. */
  signed: boolean;
  /** Whether the image runs from black to white by the size of the value. */
  grayscale: boolean;
}

/** First message of a connection. */
export interface Hello {
  protocol: number;
  kind: "three_axis" | "pressure_map" | "signals";
  name: string;
  source: string;
  version: string;
  commit: string;
  sensor_hash: string;
  rows: number;
  columns: number;
  /** Row spacing, column spacing, m. */
  pitch_m: [number, number] | null;
  mount: { kind: string; radius_m?: number };
  /** Of the raw image: shown = SI / `si_per_unit`. */
  unit: Unit;
  /** Of a device with one value per taxel; otherwise null, or not there. */
  signals?: SignalsMeaning | null;
  full_scale_n: number | null;
  usable_force_n: number | null;
  period_s: number | null;
  stale_after_s: number;
  states: string[];
  total_force_known: boolean;
}

/** Sent every 100 ms. */
export interface Status {
  stale: boolean;
  age_s: number | null;
  ended: boolean;
  clients: number;
  dropped: number;
  tare: "none" | "running" | "done";
  tare_time_ns: number | null;
  message: string;
}

/** What happened to a contact. */
export interface TouchEvent {
  index: number;
  time_ns: number;
  /** 0 for none. */
  contact: number;
  kind: string;
  /** In `unit`; null where it is not known. */
  value: number | null;
  deviation: number | null;
  unit: string;
  parent?: number;
  into?: number;
  rise_time_s?: number;
  symmetry?: number;
  /** A unit vector. */
  direction?: [number, number];
  score?: number;
}

/** One change of the rest values. */
export interface TareEntry {
  index: number;
  /** Null before the first frame. */
  time_ns: number | null;
  kind: "begun" | "captured" | "cleared" | "refused" | "undone";
  by: "start" | "page";
  /** SI. */
  largest_change: { channel: number; name: string; change: number } | null;
  /** Entry that was gone back to. */
  to: number | null;
  /** Why it was refused. */
  message: string;
  restorable: boolean;
}

/** Changes that the baseline made itself. */
export interface BaselineChanges {
  changes: number;
  /** The last ones, the oldest first; SI. */
  last: { time_ns: number; name: string; change: number; reason: string }[];
}

/** A channel that something is against. */
export interface WrongChannel {
  channel: number;
  name: string;
  taxels: number[];
  condition: string;
  since_ns: number;
  reason: string;
}

/** Condition of all channels. */
export interface Health {
  /** Frames that repeated all readings under a new number. */
  repeated: number;
  channels: number;
  wrong_channels: number;
  /** They, or the first of them. */
  wrong: WrongChannel[];
  /** Units whose readings an exchange of two capacitors explains. */
  swapped: { taxel: number; pairs: [string, string][] }[];
}

export type Message =
  | { type: "hello"; hello: Hello }
  | { type: "rest"; capacitance: readonly (number | null)[] }
  | { type: "status"; status: Status }
  | { type: "events"; missed: number; events: TouchEvent[] }
  | { type: "tares"; entries: TareEntry[] }
  | { type: "baseline"; baseline: BaselineChanges }
  | { type: "health"; health: Health }
  | { type: "unknown" };

export type Command = { command: "tare" } | { command: "clear_tare" } | { command: "undo_tare"; to: number };

/** One region of touch. */
export interface Contact {
  taxels: number;
  /** Centre x, y, m. */
  centre: [number, number];
  /** Covariance xx, xy, yy, m2. */
  covariance: [number, number, number];
  /** Force x, y, z, N; for a map without unit of force the sum of values in z. */
  force: [number, number, number];
  peak: number;
  peakTaxel: number;
  /** Number that stays with the contact; 0 for none. */
  id: number;
  /** m/s; NaN without a number. */
  velocity: [number, number];
}

/** What every frame begins with, whatever its kind. */
export interface FrameHeader {
  kind: 1 | 2 | 3;
  contacts: number;
  sequence: bigint;
  /** Device time, s. */
  time: number;
  lost: number;
  late: number;
  duplicate: number;
  /** Hz. */
  rate: number;
  /** From the frame's arrival at the server to this message, s. */
  latency: number;
  /** Total force x, y, z, N. */
  force: [number, number, number];
  forceDeviation: [number, number, number];
  /** Total moment about the origin, N m. */
  moment: [number, number, number];
  /** Centre of pressure x, y, m. */
  centre: [number, number];
  centreCovariance: [number, number, number];
  taxels: number;
  /** Channels of a device with one value per taxel; 0 for other kinds. */
  channels: number;
  tared: boolean;
  tareRunning: boolean;
  clipped: boolean;
  /** The force history of a creeping device is uncertain after a long pause. */
  historyUncertain: boolean;
}

export interface ThreeAxisFrame {
  kind: 1;
  header: FrameHeader;
  contacts: Contact[];
  /** F, taxel by taxel: 11, 12, 21, 22. */
  capacitance: Float32Array;
  /** N, taxel by taxel: x, y, z. */
  force: Float32Array;
  deviation: Float32Array;
  residual: Float32Array;
  state: Uint8Array;
  touching: Uint8Array;
  faulty: Uint8Array;
}

export interface MapFrame {
  kind: 2;
  header: FrameHeader;
  contacts: Contact[];
  /** SI unit of the map; NaN where there is no sensel or no reading. */
  value: Float32Array;
  state: Uint8Array;
}

export interface SignalsFrame {
  kind: 3;
  header: FrameHeader;
  contacts: Contact[];
  /** Of each channel, SI; NaN for no reading. */
  signal: Float32Array;
  /** The same at rest; NaN where a channel has no rest value. */
  rest: Float32Array;
  /** Of each taxel, SI; NaN for none. */
  value: Float32Array;
  /** NaN where it is not known. */
  deviation: Float32Array;
  state: Uint8Array;
}

export type Frame = ThreeAxisFrame | MapFrame | SignalsFrame;

/** A message that is not what the protocol says. */
export class ProtocolError extends Error {}

/** Version of the protocol that this page speaks. */
const PROTOCOL = 2;
const MAGIC = 0x314c5854;
const HEADER_LENGTH = 184;
const CONTACT_LENGTH = 88;
/** Number and velocity of each contact, at the end of the message. */
const IDENTITY_LENGTH = 24;
/** Bytes for each taxel: kind 1 has 11 f32 and 3 u8, kind 2 one f32 and one u8, kind 3 two f32 and one u8. */
const TAXEL_LENGTH = { 1: 11 * 4 + 3, 2: 4 + 1, 3: 2 * 4 + 1 } as const;
/** Kind 3: number of channels, and bytes for each: signal and rest. */
const CHANNELS_LENGTH = 4;
const CHANNEL_LENGTH = 2 * 4;

/** Reads a text message of the server. */
export function parseMessage(text: string): Message {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch {
    throw new ProtocolError(`a text message is not JSON: ${text.slice(0, 60)}`);
  }
  if (typeof value !== "object" || value === null) throw new ProtocolError("a text message is not an object");
  const message = value as Record<string, unknown>;
  if (message["type"] === "hello") return { type: "hello", hello: checkedHello(message) };
  if (message["type"] === "rest" && Array.isArray(message["capacitance_f"])) {
    return { type: "rest", capacitance: message["capacitance_f"] as (number | null)[] };
  }
  if (message["type"] === "events" && Array.isArray(message["events"])) {
    return { type: "events", missed: Number(message["missed"]), events: message["events"] as TouchEvent[] };
  }
  if (message["type"] === "tares" && Array.isArray(message["entries"])) {
    return { type: "tares", entries: message["entries"] as TareEntry[] };
  }
  if (message["type"] === "baseline" && Array.isArray(message["last"])) {
    return { type: "baseline", baseline: message as unknown as BaselineChanges };
  }
  if (message["type"] === "health" && Array.isArray(message["wrong"]) && Array.isArray(message["swapped"])) {
    return { type: "health", health: message as unknown as Health };
  }
  if (message["type"] === "status") return { type: "status", status: message as unknown as Status };
  return { type: "unknown" };
}

function checkedHello(message: Record<string, unknown>): Hello {
  const hello = message as unknown as Hello;
  if (hello.protocol !== PROTOCOL) {
    throw new ProtocolError(`the server speaks protocol ${String(hello.protocol)}, this page speaks ${PROTOCOL}`);
  }
  if (!KINDS.includes(hello.kind)) {
    throw new ProtocolError(`this page cannot show a device of kind ${String(hello.kind)}`);
  }
  for (const key of ["rows", "columns"] as const) {
    if (!Number.isInteger(hello[key]) || hello[key] < 1) {
      throw new ProtocolError(`${key} is ${String(hello[key])}, not a positive whole number`);
    }
  }
  if (!Array.isArray(hello.states)) throw new ProtocolError("hello has no list of states");
  if (!(hello.unit?.si_per_unit > 0)) throw new ProtocolError("hello has no unit of the raw image");
  if (hello.kind === "signals") checkSignals(hello.signals);
  return hello;
}

const KINDS: readonly string[] = ["three_axis", "pressure_map", "signals"];

function checkSignals(signals: SignalsMeaning | null | undefined): void {
  const channels: unknown = signals?.channels;
  if (!Array.isArray(channels) || !channels.every((name) => typeof name === "string")) {
    throw new ProtocolError("hello has no names of the channels");
  }
  for (const key of ["signal", "value"] as const) {
    if (!((signals?.[key]?.si_per_unit ?? 0) > 0)) throw new ProtocolError(`hello has no unit of the ${key}s`);
  }
  if (!((signals?.full_scale ?? 0) > 0)) {
    throw new ProtocolError(`full_scale is ${String(signals?.full_scale)}, not a positive number`);
  }
}

/** Reads the fixed part of a binary message and checks its length. Cheap enough for every frame at 1000/s. */
export function decodeHeader(bytes: ArrayBuffer): FrameHeader {
  if (bytes.byteLength < HEADER_LENGTH) {
    throw new ProtocolError(`a frame has ${bytes.byteLength} bytes, its header alone needs ${HEADER_LENGTH}`);
  }
  const view = new DataView(bytes);
  const magic = view.getUint32(0, true);
  if (magic !== MAGIC) throw new ProtocolError(`a frame begins with 0x${magic.toString(16)}, not with TXL1`);
  const kind = view.getUint16(4, true);
  if (kind !== 1 && kind !== 2 && kind !== 3) {
    throw new ProtocolError(`a frame is of kind ${kind}; known are 1, 2 and 3`);
  }
  const contacts = view.getUint16(6, true);
  const taxels = view.getUint32(176, true);
  // The number of channels of kind 3 stands behind the contacts.
  const channelsAt = HEADER_LENGTH + contacts * CONTACT_LENGTH;
  let length = channelsAt + contacts * IDENTITY_LENGTH;
  let channels = 0;
  let parts = `${taxels} taxels and ${contacts} contacts`;
  if (kind === 3) {
    // A frame that ends before it is too short anyway.
    if (bytes.byteLength >= channelsAt + CHANNELS_LENGTH) channels = view.getUint32(channelsAt, true);
    parts = `${channels} channels, ${parts}`;
    length += CHANNELS_LENGTH + channels * CHANNEL_LENGTH;
  }
  length += taxels * TAXEL_LENGTH[kind];
  if (bytes.byteLength !== length) {
    throw new ProtocolError(`a frame has ${bytes.byteLength} bytes; ${parts} need ${length}`);
  }
  const flags = view.getUint32(180, true);
  return {
    kind,
    contacts,
    sequence: view.getBigUint64(8, true),
    time: Number(view.getBigUint64(16, true)) / 1e9,
    lost: Number(view.getBigUint64(24, true)),
    late: Number(view.getBigUint64(32, true)),
    duplicate: Number(view.getBigUint64(40, true)),
    rate: view.getFloat64(48, true),
    latency: view.getFloat64(56, true),
    force: triple(view, 64),
    forceDeviation: triple(view, 88),
    moment: triple(view, 112),
    centre: [view.getFloat64(136, true), view.getFloat64(144, true)],
    centreCovariance: triple(view, 152),
    taxels,
    channels,
    tared: (flags & 1) !== 0,
    tareRunning: (flags & 2) !== 0,
    clipped: (flags & 4) !== 0,
    historyUncertain: (flags & 8) !== 0,
  };
}

/** Reads a whole binary message. The arrays of the frame are views of `bytes`. */
export function decodeFrame(bytes: ArrayBuffer): Frame {
  const header = decodeHeader(bytes);
  const contacts = decodeContacts(bytes, header.contacts);
  const n = header.taxels;
  let offset = HEADER_LENGTH + header.contacts * CONTACT_LENGTH;
  // Every browser runs on a little-endian machine, and every f32 array begins at a multiple of four.
  const floats = (count: number): Float32Array => {
    const array = new Float32Array(bytes, offset, count);
    offset += 4 * count;
    return array;
  };
  const octets = (count: number): Uint8Array => {
    const array = new Uint8Array(bytes, offset, count);
    offset += count;
    return array;
  };
  if (header.kind === 2) return { kind: 2, header, contacts, value: floats(n), state: octets(n) };
  if (header.kind === 3) {
    offset += CHANNELS_LENGTH;
    return {
      kind: 3,
      header,
      contacts,
      signal: floats(header.channels),
      rest: floats(header.channels),
      value: floats(n),
      deviation: floats(n),
      state: octets(n),
    };
  }
  return {
    kind: 1,
    header,
    contacts,
    capacitance: floats(4 * n),
    force: floats(3 * n),
    deviation: floats(3 * n),
    residual: floats(n),
    state: octets(n),
    touching: octets(n),
    faulty: octets(n),
  };
}

function decodeContacts(bytes: ArrayBuffer, count: number): Contact[] {
  const view = new DataView(bytes);
  const identities = bytes.byteLength - count * IDENTITY_LENGTH;
  const contacts: Contact[] = [];
  for (let contact = 0; contact < count; contact++) {
    const offset = HEADER_LENGTH + contact * CONTACT_LENGTH;
    contacts.push({
      taxels: view.getFloat64(offset, true),
      centre: [view.getFloat64(offset + 8, true), view.getFloat64(offset + 16, true)],
      covariance: triple(view, offset + 24),
      force: triple(view, offset + 48),
      peak: view.getFloat64(offset + 72, true),
      peakTaxel: view.getFloat64(offset + 80, true),
      ...decodeIdentity(view, identities + contact * IDENTITY_LENGTH),
    });
  }
  return contacts;
}

function decodeIdentity(view: DataView, offset: number): Pick<Contact, "id" | "velocity"> {
  const [id, x, y] = triple(view, offset);
  return { id, velocity: [x, y] };
}

function triple(view: DataView, offset: number): [number, number, number] {
  return [
    view.getFloat64(offset, true),
    view.getFloat64(offset + 8, true),
    view.getFloat64(offset + 16, true),
  ];
}
