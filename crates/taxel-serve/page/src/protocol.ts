// The live protocol, version 5 (docs/live-protocol.md): bytes and JSON in, frames and messages out. No I/O.

/** A quantity and the unit in which it is shown: shown = SI / `si_per_unit`. */
export interface Unit {
  quantity: string;
  symbol: string;
  si_per_unit: number;
}

/** First message of a connection: what the numbers of every frame are. */
export interface Hello {
  protocol: number;
  name: string;
  source: string;
  version: string;
  commit: string;
  sensor_hash: string;
  rows: number;
  columns: number;
  /** Row spacing, column spacing, m; null where it is not known, and lengths are in cells. */
  pitch_m: [number, number] | null;
  mount: { kind: string; radius_m?: number };
  /** Names of the channels in the order of a frame. */
  channels: string[];
  /** Which taxels the channels belong to. */
  wiring: { kind: "per_taxel"; channels: number } | { kind: "crossing" } | { kind: "shared" };
  /** What a channel carries. */
  reading: Unit;
  /** What a taxel's value is. */
  value: Unit;
  /** Of a value: 1 (pressing alone) or 3. */
  components: 1 | 3;
  /** Whether values of either sign occur in normal use. */
  signed: boolean;
  /** Value at the end of the colour scale, SI; null where it is not known. */
  full_scale: number | null;
  /** Value up to which the model was verified, SI. */
  verified: number | null;
  /** How the image of values is coloured. */
  picture: "heat" | "grayscale" | "map";
  /** Whether the total force is a number of this device. */
  total_known: boolean;
  /** Where a trained device was pressed in training: from and to along x and y, m; null of other devices. */
  trained_m: [[number, number], [number, number]] | null;
  /** Units of the forces and speeds of contacts. */
  force_unit: string;
  length_unit: string;
  speed_unit: string;
  period_s: number | null;
  stale_after_s: number;
  /** Names of the state codes of taxels and of channels. */
  states: string[];
  channel_states: string[];
  /** Names of the codes of certainty. */
  certainties: Certainty[];
}

/** How much a number says: all, a least value, or nothing. */
export type Certainty = "exact" | "at_least" | "unknown";

/** Sent every 100 ms. */
export interface Status {
  stale: boolean;
  age_s: number | null;
  ended: boolean;
  clients: number;
  dropped: number;
  tare: "none" | "running" | "done" | "loaded" | "waiting";
  tare_time_ns: number | null;
  message: string;
  below_zero: BelowZero | null;
  /** Null for a source without a link. */
  link: Link | null;
  /** The recording that is being written; null for none. */
  recording: RecordingNow | null;
  /** Folder of recordings that a page begins; null where it may not. */
  records_to: string | null;
  /** Null for a source that is not played from a file, or whose place cannot be chosen. */
  replay: Replay | null;
  /** Of a service with several; none of one. */
  sensors: SensorNow[];
}

/** One of several sensors of a service. */
export interface SensorNow {
  name: string;
  /** Where its page is. */
  path: string;
  /** Whether it is the one of this page. */
  here: boolean;
  state: "live" | "stale" | "ended";
}

/** A recording that is being written. */
export interface RecordingNow {
  name: string;
  length_s: number;
  bytes: number;
  /** Free on its disk; null where the system does not say. */
  free_bytes: number | null;
  /** Messages that the disk did not take in time. */
  lost: number;
  /** Why it has ended, if it has failed. */
  failure: string | null;
}

/** Where a replay is. */
export interface Replay {
  /** Device times of the first and last frame, and of the newest; null before one. */
  from_ns: number;
  to_ns: number;
  at_ns: number | null;
  paused: boolean;
  /** Device seconds per second; null for as fast as possible. */
  speed: number | null;
  loop: boolean;
  ended: boolean;
}

/** The link to a board. */
export interface Link {
  name: string;
  board: string;
  /** A to D: how surely damage is seen. */
  wire_class: string;
  state: "absent" | "opening" | "connected" | "in_step" | "silent" | "garbled" | "ended";
  since_unix_s: number;
  /** Why, with advice; empty where the state says all. */
  reason: string;
  connects: number;
  bytes: number;
  overrun: number;
  wire: { delivered: number; lost: number | null; damaged: number; passed_over_bytes: number };
  /** Null without a time or a number of the board, and before the first second. */
  clock: ClockRelation | null;
}

/** The clock of a board against that of the computer that reads it. */
export interface ClockRelation {
  device_time_ns: number;
  /** When that was by the steady clock of the computer, since the program began. */
  host_ns: number;
  /** Seconds of the computer in one of the board, less 1. */
  rate_difference: number;
  /** The reading was taken at most so long before that; null where the delay of the link is not known. */
  before_s: number | null;
  /** And at most so long behind it. */
  behind_s: number;
  segments: number;
}

/** Taxels that read below zero, and why. */
export interface BelowZero {
  taxels: number;
  /** In words. */
  cause: string;
  /** When the zero was taken, s since 1970; null for one that was not taken in this run. */
  zero_unix_s: number | null;
  /** The same in device time. */
  zero_time_ns: number | null;
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
  /** Null without a value. */
  certainty: Certainty | null;
  unit: string;
  /** Words of a mark. */
  text?: string;
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
  /** The link was lost and opened again since. */
  before_reconnect: boolean;
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
  /** Taxels whose readings an exchange of two of their channels explains. */
  swapped: { taxel: number; pairs: [string, string][] }[];
}

export type Message =
  | { type: "hello"; hello: Hello }
  | { type: "rest"; channels: readonly (number | null)[] }
  | { type: "status"; status: Status }
  | { type: "events"; missed: number; events: TouchEvent[] }
  | { type: "tares"; entries: TareEntry[] }
  | { type: "baseline"; baseline: BaselineChanges }
  | { type: "health"; health: Health }
  | { type: "unknown" };

export type Command =
  | { command: "tare"; force?: true }
  | { command: "clear_tare" }
  | { command: "undo_tare"; to: number }
  | { command: "mark"; text: string }
  | { command: "start_recording"; name: string }
  | { command: "stop_recording" }
  | { command: "pause"; on: boolean }
  | { command: "step" }
  | { command: "seek"; time_ns: number }
  | { command: "speed"; speed: number }
  | { command: "loop"; on: boolean };

/** One region of touch. */
export interface Contact {
  /** Number that stays with the contact; 0 for none. */
  id: number;
  taxels: number;
  /** Centre x, y, m. */
  centre: [number, number];
  /** Covariance xx, xy, yy, m2. */
  covariance: [number, number, number];
  /** m/s; NaN without a number. */
  velocity: [number, number];
  /** Force x, y, z, N; where values have no unit of force, the sum of values in z. */
  force: [number, number, number];
  forceDeviation: [number, number, number];
  /** Moment about the normal through the centre, N m. */
  torsion: number;
  peak: number;
  peakTaxel: number;
  /** Code of the state of a taxel that gives no more than a bound; NaN for none. */
  bound: number;
  /** How much the force says. */
  certainty: Certainty;
}

/** What every frame begins with. */
export interface FrameHeader {
  components: number;
  contacts: number;
  sequence: bigint;
  /** Device time, s. */
  time: number;
  /** NaN where the wire cannot tell. */
  lost: number;
  late: number;
  duplicate: number;
  /** Hz. */
  rate: number;
  /** From the frame's arrival at the server to this message, s. */
  latency: number;
  /** Total force x, y, z, N; NaN where it is not known. */
  force: [number, number, number];
  forceDeviation: [number, number, number];
  /** Total moment about the origin, N m. */
  moment: [number, number, number];
  /** Centre of pressure x, y, m. */
  centre: [number, number];
  centreCovariance: [number, number, number];
  /** Sum of the counted values along z, SI. */
  sum: number;
  /** How much the total says (of the sum, where the device gives no force). */
  totalCertainty: Certainty;
  /** Index into `states` of the reason why it is not exact; null for none. */
  totalReason: number | null;
  /** False while the values are no forces yet. */
  zeroKnown: boolean;
  taxels: number;
  channels: number;
  tared: boolean;
  tareRunning: boolean;
  clipped: boolean;
  /** More contacts than a frame can have: some are merged. */
  merged: boolean;
  /** The history of a creeping device is uncertain after a long pause. */
  historyUncertain: boolean;
  /** Taxels that are not part of totals and contacts. */
  leftOut: number;
  /** By the steady clock of the server, s since the program began; NaN without a link. */
  arrival: number;
  /** The wire has no check that would show damage of a value. */
  uncheckedWire: boolean;
  /** The device time is not the device's own. */
  inferredTime: boolean;
}

/** One frame of any device. Values of several components stand taxel by taxel: x, y, z. */
export interface Frame {
  header: FrameHeader;
  contacts: Contact[];
  /** Of each channel, SI; NaN for no reading. */
  reading: Float32Array;
  /** Of each taxel, SI; NaN for none. */
  value: Float32Array;
  /** NaN where it is not known. */
  deviation: Float32Array;
  /** Of each taxel; NaN without redundant channels. */
  residual: Float32Array;
  /** Of each channel: index into `channel_states`. */
  channelState: Uint8Array;
  /** Of each taxel: index into `states`. */
  state: Uint8Array;
  /** Of each taxel: 1 where its value is part of totals and contacts. */
  counted: Uint8Array;
}

/** A message that is not what the protocol says. */
export class ProtocolError extends Error {}

/** Version of the protocol that this page speaks. */
const PROTOCOL = 5;
const MAGIC = 0x354c5854;
const HEADER_LENGTH = 216;
const CERTAINTIES: readonly Certainty[] = ["exact", "at_least", "unknown"];
/** Stands for a number that is not known. */
const NOT_KNOWN = 2n ** 64n - 1n;
const NO_STATE = 255;
const CONTACT_LENGTH = 20 * 8;
/** Bytes of a channel: reading and state. */
const CHANNEL_LENGTH = 4 + 1;
/** Bytes of a taxel: residual, state, whether it counts; and for each component value and deviation. */
const TAXEL_LENGTH = 4 + 2;
const COMPONENT_LENGTH = 2 * 4;

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
  if (message["type"] === "rest" && Array.isArray(message["channels"])) {
    return { type: "rest", channels: message["channels"] as (number | null)[] };
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
  if (hello.components !== 1 && hello.components !== 3) {
    throw new ProtocolError(`this page cannot show values of ${String(hello.components)} components`);
  }
  for (const key of ["rows", "columns"] as const) {
    if (!Number.isInteger(hello[key]) || hello[key] < 1) {
      throw new ProtocolError(`${key} is ${String(hello[key])}, not a positive whole number`);
    }
  }
  for (const key of ["states", "channel_states", "channels"] as const) {
    const names: unknown = hello[key];
    if (!Array.isArray(names) || !names.every((name) => typeof name === "string")) {
      throw new ProtocolError(`hello has no list of ${key.replace("_", " ")}`);
    }
  }
  for (const key of ["reading", "value"] as const) {
    if (!((hello[key]?.si_per_unit ?? 0) > 0)) throw new ProtocolError(`hello has no unit of the ${key}s`);
  }
  if (hello.full_scale !== null && !(hello.full_scale > 0)) {
    throw new ProtocolError(`full_scale is ${String(hello.full_scale)}, not a positive number`);
  }
  return hello;
}

/** Reads the fixed part of a binary message and checks its length. Cheap enough for every frame at 1000/s. */
export function decodeHeader(bytes: ArrayBuffer): FrameHeader {
  if (bytes.byteLength < HEADER_LENGTH) {
    throw new ProtocolError(`a frame has ${bytes.byteLength} bytes, its header alone needs ${HEADER_LENGTH}`);
  }
  const view = new DataView(bytes);
  const magic = view.getUint32(0, true);
  if (magic !== MAGIC) throw new ProtocolError(`a frame begins with 0x${magic.toString(16)}, not with TXL5`);
  const components = view.getUint16(4, true);
  if (components !== 1 && components !== 3) {
    throw new ProtocolError(`a frame has values of ${components} components; known are 1 and 3`);
  }
  const contacts = view.getUint16(6, true);
  const taxels = view.getUint32(184, true);
  const channels = view.getUint32(188, true);
  const length =
    HEADER_LENGTH +
    contacts * CONTACT_LENGTH +
    channels * CHANNEL_LENGTH +
    taxels * (TAXEL_LENGTH + components * COMPONENT_LENGTH);
  if (bytes.byteLength !== length) {
    throw new ProtocolError(
      `a frame has ${bytes.byteLength} bytes; ${channels} channels, ${taxels} taxels and ${contacts} contacts need ${length}`,
    );
  }
  const flags = view.getUint32(192, true);
  return {
    components,
    contacts,
    sequence: view.getBigUint64(8, true),
    time: Number(view.getBigUint64(16, true)) / 1e9,
    lost: known(view.getBigUint64(24, true)),
    late: Number(view.getBigUint64(32, true)),
    duplicate: Number(view.getBigUint64(40, true)),
    rate: view.getFloat64(48, true),
    latency: view.getFloat64(56, true),
    force: triple(view, 64),
    forceDeviation: triple(view, 88),
    moment: triple(view, 112),
    centre: [view.getFloat64(136, true), view.getFloat64(144, true)],
    centreCovariance: triple(view, 152),
    sum: view.getFloat64(176, true),
    totalCertainty: certainty(view.getUint8(212)),
    totalReason: view.getUint8(213) === NO_STATE ? null : view.getUint8(213),
    zeroKnown: (flags & 32) === 0,
    taxels,
    channels,
    tared: (flags & 1) !== 0,
    tareRunning: (flags & 2) !== 0,
    clipped: (flags & 4) !== 0,
    merged: (flags & 16) !== 0,
    historyUncertain: (flags & 8) !== 0,
    leftOut: view.getUint32(196, true),
    arrival: known(view.getBigUint64(200, true)) / 1e9,
    uncheckedWire: (view.getUint32(208, true) & 1) !== 0,
    inferredTime: (view.getUint32(208, true) & 2) !== 0,
  };
}

/** Reads a whole binary message. The arrays of the frame are views of `bytes`. */
export function decodeFrame(bytes: ArrayBuffer): Frame {
  const header = decodeHeader(bytes);
  const contacts = decodeContacts(bytes, header.contacts);
  const { channels, taxels, components } = header;
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
  return {
    header,
    contacts,
    reading: floats(channels),
    value: floats(components * taxels),
    deviation: floats(components * taxels),
    residual: floats(taxels),
    channelState: octets(channels),
    state: octets(taxels),
    counted: octets(taxels),
  };
}

function decodeContacts(bytes: ArrayBuffer, count: number): Contact[] {
  const view = new DataView(bytes);
  const contacts: Contact[] = [];
  for (let contact = 0; contact < count; contact++) {
    const offset = HEADER_LENGTH + contact * CONTACT_LENGTH;
    const number = (place: number): number => view.getFloat64(offset + 8 * place, true);
    contacts.push({
      id: number(0),
      taxels: number(1),
      centre: [number(2), number(3)],
      covariance: triple(view, offset + 32),
      velocity: [number(7), number(8)],
      force: triple(view, offset + 72),
      forceDeviation: triple(view, offset + 96),
      torsion: number(15),
      peak: number(16),
      peakTaxel: number(17),
      bound: number(18),
      certainty: certainty(number(19)),
    });
  }
  return contacts;
}

/** A code that this page does not know says nothing. */
function certainty(code: number): Certainty {
  return CERTAINTIES[code] ?? "unknown";
}

function known(value: bigint): number {
  return value === NOT_KNOWN ? Number.NaN : Number(value);
}

function triple(view: DataView, offset: number): [number, number, number] {
  return [
    view.getFloat64(offset, true),
    view.getFloat64(offset + 8, true),
    view.getFloat64(offset + 16, true),
  ];
}
