// A small server with synthetic frames, for working on the page and its tests without the real server.
//
//   node tests/mock-server.mjs [--port 0] [--kind 1|2|3] [--grayscale] [--rate 100] [--scene finger|quiet|all-states]
//                              [--outage 3:6] [--end 5] [--drop-after 4] [--certainty 0|1|2|none]
//
// The first line on stdout names the URL with its token, like that of `taxel live`.

import { randomBytes } from "node:crypto";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { WebSocketServer } from "ws";
import { encodeFrame } from "./encode.mjs";

const dist = join(dirname(fileURLToPath(import.meta.url)), "../dist");
const { values: options } = parseArgs({
  options: {
    port: { type: "string", default: "0" },
    kind: { type: "string", default: "1" },
    grayscale: { type: "boolean", default: false },
    rate: { type: "string", default: "100" },
    scene: { type: "string", default: "finger" },
    outage: { type: "string", default: "" },
    end: { type: "string", default: "" },
    "drop-after": { type: "string", default: "" },
    certainty: { type: "string", default: "0" },
  },
});

const STATES = [
  "ok",
  "unchecked",
  "closed",
  "out_of_range",
  "not_converged",
  "inconsistent",
  "faulty",
  "masked",
  "saturated",
  "ambiguous",
  "below_zero",
];
const CHANNEL_STATES = ["ok", "closed", "saturated", "faulty", "masked"];
const STALE_AFTER = 0.3;
const CSP = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; connect-src 'self'";
const kind = Number(options.kind);
const rate = Number(options.rate);
const size = { 1: 8, 2: 28, 3: 4 }[kind];
const rows = kind === 3 ? 2 : size;
const pitch = { 1: 2e-3, 2: 1.27e-3, 3: 5e-3 }[kind];
const token = randomBytes(16).toString("hex");

/** Repeatable noise with unit standard deviation (xorshift, sum of four). */
let noiseState = 0x2545f491;
function noise() {
  let sum = 0;
  for (let k = 0; k < 4; k++) {
    noiseState ^= noiseState << 13;
    noiseState ^= noiseState >>> 17;
    noiseState ^= noiseState << 5;
    sum += (noiseState >>> 0) / 2 ** 32 - 0.5;
  }
  return sum * Math.sqrt(3);
}

/** Centre of a taxel, m. */
const place = (taxel) => [
  ((taxel % size) - (size - 1) / 2) * pitch,
  ((rows - 1) / 2 - Math.floor(taxel / size)) * pitch,
];

/** Where is pressed at `time`, how hard and with which shear. */
function fingers(time) {
  if (options.scene === "quiet") return [];
  const half = ((kind === 3 ? 0.7 : 1) * size * pitch) / 2;
  const grown = Math.min(1, Math.max(0, (time - 1) / 1.5));
  const moving = {
    centre: [0.45 * half * Math.cos(0.9 * time), 0.4 * half * Math.sin(1.3 * time)],
    width: 0.2 * half,
    peak: 0.017 * grown * (1 + 0.15 * Math.sin(2 * time)),
    shear: [-0.45 * Math.sin(0.9 * time), 0.5 * Math.cos(1.3 * time)],
  };
  const resting = {
    centre: [-0.62 * half, -0.62 * half],
    width: 0.15 * half,
    peak: 0.009 * grown,
    shear: [0.3, 0.15],
  };
  return [moving, resting].filter(({ peak }) => peak > 0);
}

function load(finger, taxel) {
  const [x, y] = place(taxel);
  const distance2 = (x - finger.centre[0]) ** 2 + (y - finger.centre[1]) ** 2;
  return finger.peak * Math.exp(-distance2 / (2 * finger.width ** 2));
}

function contactsOf(pressed) {
  return pressed.map((finger, index) => {
    const loads = Array.from({ length: rows * size }, (_, taxel) => load(finger, taxel));
    const total = loads.reduce((sum, value) => sum + value, 0);
    const peak = Math.max(...loads);
    const variance = finger.width ** 2;
    return [
      index + 1,
      loads.filter((value) => value > 1e-3).length,
      ...finger.centre,
      variance,
      0.3 * variance * Math.sign(finger.centre[0]),
      0.7 * variance,
      0.01,
      0,
      ...(kind === 1 ? [total * finger.shear[0], total * finger.shear[1], total] : [0, 0, 12e3 * total]),
      ...[4e-4, 4e-4, 4e-4],
      0,
      kind === 1 ? peak : 12e3 * peak,
      loads.indexOf(peak),
      Number.NaN,
      0,
    ];
  });
}

function stateOf(taxel, force) {
  const [row, column] = [Math.floor(taxel / size), taxel % size];
  if (row === 7 && column === 0) return "masked";
  if (row === 0 && column === 7) return "faulty";
  if (row === 5 && column === 6) return "closed";
  if (options.scene === "all-states") {
    if (row === 2 && column === 1) return "not_converged";
    if (row === 3 && column === 5) return "inconsistent";
    if (row === 1 && column === 4) return "unchecked";
  }
  return force > 0.015 ? "out_of_range" : "ok";
}

/** Capacitance before and after a tare differ by nothing here; the force does. */
let offset = 0.0008;

function threeAxisFrame(time, pressed) {
  const n = size * size;
  const frame = {
    components: 3,
    reading: [],
    value: [],
    deviation: [],
    residual: [],
    state: [],
    channelState: [],
  };
  for (let taxel = 0; taxel < n; taxel++) {
    const force = [offset / 3, 0, offset];
    for (const finger of pressed) {
      const normal = load(finger, taxel);
      force[0] += normal * finger.shear[0];
      force[1] += normal * finger.shear[1];
      force[2] += normal;
    }
    const state = stateOf(taxel, force[2]);
    const rest = [203e-15, 204e-15, 190e-15, 205e-15];
    rest.forEach((value, capacitor) => {
      const side = (capacitor & 1 ? 1 : -1) * force[0] + (capacitor & 2 ? -1 : 1) * force[1];
      let reading = value * (1 + 12 * force[2] + 6.5 * side) + 0.08e-15 * noise();
      if (state === "closed" && capacitor === 3) reading = value * 1.4;
      if (state === "faulty" && capacitor === 1) reading = Number.NaN;
      frame.reading.push(state === "masked" ? Number.NaN : reading);
    });
    const none = state === "masked" || state === "not_converged" || state === "faulty";
    for (const value of force) frame.value.push(none ? Number.NaN : value + 5e-5 * noise());
    for (let axis = 0; axis < 3; axis++) frame.deviation.push(none ? Number.NaN : 5e-5);
    frame.residual.push(
      none || state === "unchecked" ? Number.NaN : state === "inconsistent" ? 6.2 : noise(),
    );
    frame.state.push(STATES.indexOf(state));
    rest.forEach((_, capacitor) => {
      const closed = state === "closed" && capacitor === 3;
      const faulty = state === "faulty" && capacitor === 1;
      const name = state === "masked" ? "masked" : closed ? "closed" : faulty ? "faulty" : "ok";
      frame.channelState.push(CHANNEL_STATES.indexOf(name));
    });
  }
  return frame;
}

function mapFrame(pressed) {
  const frame = { reading: [], value: [], deviation: [], state: [], channelState: [] };
  for (let taxel = 0; taxel < size * size; taxel++) {
    const [row, column] = [Math.floor(taxel / size), taxel % size];
    const missing = Math.hypot(row - 13.5, column - 13.5) > 16 || (row > 20 && column === 5);
    const value = Math.round(pressed.reduce((sum, finger) => sum + 12e3 * load(finger, taxel), 0));
    for (const values of [frame.reading, frame.value]) values.push(missing ? Number.NaN : value);
    frame.deviation.push(Number.NaN);
    frame.state.push(STATES.indexOf(missing ? "masked" : "ok"));
    frame.channelState.push(CHANNEL_STATES.indexOf(missing ? "masked" : "ok"));
  }
  return frame;
}

/** Reading of a channel at rest; not known in grey. */
const restOf = (channel) => {
  if (kind === 1) return [203, 204, 190, 205][channel % 4] * 1e-15;
  if (kind === 2) return 0;
  return options.grayscale ? null : 4.2 + 0.37 * channel;
};

/** Crossed channels, whose rows and columns know no single taxel; or, in grey, one channel for each taxel. */
function oneComponentFrame(time, pressed) {
  const n = rows * size;
  const loads = Array.from({ length: n }, (_, taxel) => pressed.reduce((sum, finger) => sum + load(finger, taxel), 0));
  const signed = options.grayscale ? Math.cos(5 * time) : 1;
  const scale = options.grayscale ? 0.1 : 12e6;
  const frame = { value: [], deviation: [], state: [] };
  loads.forEach((force, taxel) => {
    const state =
      options.scene !== "all-states"
        ? "ok"
        : (["ambiguous", "ok", "saturated", "ok", "masked", "ambiguous", "faulty", "out_of_range"][taxel] ?? "ok");
    const none = state === "masked" || state === "faulty" || (state === "ambiguous" && taxel === 5);
    frame.value.push(none ? Number.NaN : scale * force * signed);
    frame.deviation.push(none || state === "saturated" ? Number.NaN : 0.004 * scale * 0.017);
    frame.state.push(STATES.indexOf(state));
  });
  const sums = options.grayscale
    ? loads.map((force) => 2 * force * signed)
    : [
        ...Array.from({ length: rows }, (_, row) => loads.slice(row * size, (row + 1) * size)),
        ...Array.from({ length: size }, (_, column) => loads.filter((_, taxel) => taxel % size === column)),
      ].map((line) => line.reduce((sum, force) => sum + force, 0));
  frame.reading = sums.map((sum, channel) =>
    options.grayscale ? sum + 1e-5 * noise() : restOf(channel) * (1 + 14 * sum) + 2e-3 * noise(),
  );
  return frame;
}

function frameAt(time, sequence) {
  const pressed = fingers(time);
  const contacts = contactsOf(pressed);
  const body =
    kind === 1 ? threeAxisFrame(time, pressed) : kind === 2 ? mapFrame(pressed) : oneComponentFrame(time, pressed);
  const force = [0, 0, 0];
  const moment = [0, 0, 0];
  const weighted = [0, 0];
  let total = 0;
  for (let taxel = 0; taxel < rows * size; taxel++) {
    const [x, y] = place(taxel);
    const [fx, fy, fz] = kind === 1 ? body.value.slice(3 * taxel, 3 * taxel + 3) : [0, 0, body.value[taxel]];
    if (Number.isNaN(fz)) continue;
    [fx, fy, fz].forEach((value, axis) => (force[axis] += value));
    moment[0] -= y * fz;
    moment[1] += x * fz;
    moment[2] += x * fy - y * fx;
    total += Math.max(0, fz);
    weighted[0] += x * Math.max(0, fz);
    weighted[1] += y * Math.max(0, fz);
  }
  const nothing = [Number.NaN, Number.NaN, Number.NaN];
  const pressing = total > 0.003;
  // In grey no force is known; otherwise that of pressures on an electrode of 1 mm2 each.
  const totals = { 1: force, 2: nothing, 3: options.grayscale ? nothing : [NaN, NaN, 1e-6 * force[2]] }[kind];
  const deviations = { 1: [4e-4, 4e-4, 4e-4], 2: nothing, 3: [NaN, NaN, 2e-3] }[kind];
  return encodeFrame({
    sequence,
    timeNs: BigInt(Math.round(time * 1e9)),
    rate,
    latency: 4e-4 + 2e-4 * Math.abs(noise()),
    totalForce: totals,
    totalDeviation: deviations,
    moment: kind === 1 ? moment : nothing,
    centre: pressing ? weighted.map((value) => value / total) : nothing.slice(1),
    centreCovariance: pressing && kind === 1 ? [4e-9, 0, 4e-9] : nothing,
    contacts,
    sum: force[2],
    // Of the total, because of a saturated taxel; or no zero yet.
    totalCertainty: Number(options.certainty) || 0,
    totalReason: Number(options.certainty) > 0 ? STATES.indexOf("saturated") : 255,
    flags: (tare.state === "done" ? 1 : 0) + (tare.state === "running" ? 2 : 0) + (options.certainty === "none" ? 32 : 0),
    ...body,
  });
}

/** What the numbers are: of three components, of a map, of one component. */
const MEANINGS = {
  1: {
    channels: Array.from({ length: 4 * rows * size }, (_, channel) => {
      const taxel = channel >> 2;
      return `r${Math.floor(taxel / size)}c${taxel % size}.${["11", "12", "21", "22"][channel & 3]}`;
    }),
    wiring: { kind: "per_taxel", channels: 4 },
    reading: { quantity: "capacitance", symbol: "fF", si_per_unit: 1e-15 },
    value: { quantity: "force", symbol: "mN", si_per_unit: 1e-3 },
    components: 3,
    signed: true,
    full_scale: 0.01,
    verified: 0.015,
    picture: "heat",
    total_known: true,
    force_unit: "N",
  },
  2: {
    channels: Array.from({ length: rows * size }, (_, cell) => `r${Math.floor(cell / size)}c${cell % size}`),
    wiring: { kind: "per_taxel", channels: 1 },
    reading: { quantity: "raw", symbol: "counts", si_per_unit: 1 },
    value: { quantity: "raw", symbol: "counts", si_per_unit: 1 },
    components: 1,
    signed: false,
    full_scale: null,
    verified: null,
    picture: "map",
    total_known: false,
    force_unit: "1",
  },
  3: options.grayscale
    ? {
        channels: Array.from({ length: rows * size }, (_, taxel) => `sensel ${taxel + 1}`),
        wiring: { kind: "per_taxel", channels: 1 },
        reading: { quantity: "voltage", symbol: "mV", si_per_unit: 1e-3 },
        value: { quantity: "change of force", symbol: "mN", si_per_unit: 1e-3 },
        components: 1,
        signed: true,
        full_scale: 2e-3,
        verified: null,
        picture: "grayscale",
        total_known: false,
        force_unit: "N",
      }
    : {
        channels: ["row 0", "row 1", "column 0", "column 1", "column 2", "column 3"],
        wiring: { kind: "crossing" },
        reading: { quantity: "resistance", symbol: "ohm", si_per_unit: 1 },
        value: { quantity: "pressure", symbol: "kPa", si_per_unit: 1e3 },
        components: 1,
        signed: false,
        full_scale: 200e3,
        verified: null,
        picture: "heat",
        total_known: true,
        force_unit: "N",
      },
};

const hello = {
  type: "hello",
  protocol: 5,
  trained_m: null,
  name: { 1: "three-axis capacitive array 8x8", 2: "fingertip map 28x28", 3: "one component 2x4" }[kind],
  source: kind === 2 ? "replay:fingertip.csv" : "sim:finger.toml",
  version: "0.0.0",
  commit: "mock",
  sensor_hash: kind === 2 ? "" : "0123456789abcdef",
  rows,
  columns: size,
  pitch_m: [pitch, pitch],
  mount: { kind: "flat" },
  ...MEANINGS[kind],
  length_unit: "m",
  speed_unit: "m/s",
  period_s: 1 / rate,
  stale_after_s: STALE_AFTER,
  states: STATES,
  channel_states: CHANNEL_STATES,
  certainties: ["exact", "at_least", "unknown"],
};

const tare = { state: "none", timeNs: null, message: "" };
const entry = (fields) => ({
  index: tares.length,
  time_ns: null,
  by: "page",
  largest_change: null,
  to: null,
  message: "",
  ...fields,
});
const tares = [];
tares.push(entry({ kind: "begun", by: "start" }));
const tellTares = () => JSON.stringify({ type: "tares", entries: tares });
function tared(fields) {
  const largest = { channel: 0, name: hello.channels[0], change: 1.25 * hello.reading.si_per_unit };
  tares.push(entry({ time_ns: Math.round(seconds() * 1e9), largest_change: largest, ...fields }));
  send(tellTares());
}

/** Events that every client gets, also one that comes late. */
const EVENTS = [
  { kind: "touch", contact: 1, value: 0.0053, deviation: 0.0001, unit: "N" },
  { kind: "step", contact: 1, value: 0.0895, deviation: 0.00002, unit: "N" },
  { kind: "impact", contact: 2, value: 0.25, deviation: 0.001, unit: "N", rise_time_s: 0.0257 },
  { kind: "cyclic", contact: 2, value: 2.857, deviation: 0.01, unit: "Hz", symmetry: 0.98 },
  { kind: "slip", contact: 1, value: 0.0203, deviation: 0.0004, unit: "m/s", direction: [0.7, 0.7] },
  { kind: "slip", contact: 1, value: 0.0203, deviation: 0.0004, unit: "m/s", direction: [1, 0], score: 0.71 },
  { kind: "merged", contact: 2, value: 0.25, deviation: 0.001, unit: "N", into: 1 },
  { kind: "release", contact: 1, value: 0.0002, deviation: null, unit: "N" },
].map((event, index) => ({ index, time_ns: 250_000_000 * (index + 1), certainty: "exact", ...event }));
const HEALTH = {
  type: "health",
  repeated: 0,
  channels: kind === 1 ? 4 * rows * size : rows * size,
  wrong_channels: 0,
  wrong: [],
  swapped: [],
};
const wrong = (channel, name, taxels, condition, reason) => ({
  channel,
  name,
  taxels,
  condition,
  since_ns: 1_500_000_000,
  evidence: 3,
  reason,
});
if (options.scene === "all-states" && kind === 1) {
  HEALTH.wrong = [
    wrong(29, "r0c7.12", [7], "dead", "no reading, or one at the low end of the range"),
    wrong(75, "r2c2.22", [18], "stuck", "the same reading for 3.1 s, without noise"),
    wrong(116, "r3c5.11", [29], "inconsistent", "contradicts the readings beside it by 6.2 standard deviations"),
  ];
  HEALTH.swapped = [{ taxel: 29, pairs: [["r3c5.11", "r3c5.12"], ["r3c5.21", "r3c5.22"]] }];
  HEALTH.wrong_channels = 3;
  HEALTH.repeated = 2;
}
const started = performance.now();
const seconds = () => (performance.now() - started) / 1000;
const [outageFrom, outageTo] =
  options.outage === "" ? [Infinity, Infinity] : options.outage.split(":").map(Number);
const endsAt = options.end === "" ? Infinity : Number(options.end);
let lastFrame = seconds();
let sequence = 0n;
let seen = false;

function command(text) {
  const { command: name, to } = JSON.parse(text);
  if (name === "clear_tare" || name === "undo_tare") {
    Object.assign(tare, { state: "none", timeNs: null, message: "" });
    tared(name === "undo_tare" ? { kind: "undone", to } : { kind: "cleared" });
  }
  if (name !== "tare" || tare.state === "running") return;
  if (fingers(seconds()).length > 0) {
    tare.message = "tare refused: the sensor is being touched, 12.3 mN in all";
    tared({ kind: "refused", largest_change: null, message: tare.message });
    return;
  }
  Object.assign(tare, { state: "running", message: "" });
  setTimeout(() => {
    offset = 0;
    Object.assign(tare, { state: "done", timeNs: Math.round(seconds() * 1e9) });
    tared({ kind: "captured" });
  }, 300);
}

const types = {
  "app.js": "text/javascript",
  "app.css": "text/css",
  "index.html": "text/html; charset=utf-8",
};
const DRAWING = `<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="20mm" viewBox="0 0 40 20">
<rect x="1" y="1" width="38" height="18" fill="#e8ecf2" stroke="#223" stroke-width="0.3"/>
<circle cx="12" cy="10" r="6" fill="none" stroke="#0072b2" stroke-width="0.4"/></svg>`;
const server = createServer(async (request, response) => {
  const url = new URL(request.url, "http://localhost");
  const name = url.pathname === "/" ? "index.html" : url.pathname.slice(1);
  if (["index.html", "drawing.svg", "history"].includes(name) && url.searchParams.get("token") !== token) {
    response.writeHead(401, { "content-type": "text/plain" }).end("wrong token\n");
    return;
  }
  if (name === "drawing.svg" && kind !== 2) {
    response.writeHead(200, { "content-type": "image/svg+xml" }).end(DRAWING);
    return;
  }
  if (name === "history") {
    const nothing = { from_ns: 0, to_ns: 0, oldest_ns: null, newest_ns: null, width_ns: 1e8, time_ns: [], unix_s: [] };
    const answer = JSON.stringify({ ...nothing, signals: [], tares: [], events: [] });
    response.writeHead(200, { "content-type": "application/json" }).end(answer);
    return;
  }
  if (types[name] === undefined) {
    response.writeHead(404).end();
    return;
  }
  const content = await readFile(join(dist, name));
  response.writeHead(200, { "content-type": types[name], "content-security-policy": CSP }).end(content);
});

const sockets = new WebSocketServer({ noServer: true });
server.on("upgrade", (request, socket, head) => {
  const url = new URL(request.url, "http://localhost");
  if (url.pathname !== "/ws" || url.searchParams.get("token") !== token) {
    socket.end("HTTP/1.1 401 Unauthorized\r\nconnection: close\r\ncontent-length: 0\r\n\r\n");
    return;
  }
  sockets.handleUpgrade(request, socket, head, (client) => {
    client.on("message", (text) => command(String(text)));
    client.send(JSON.stringify(hello));
    client.send(tellTares());
    // Of channels of which no frame has come nothing is known.
    if (seen) client.send(JSON.stringify(HEALTH));
    client.send(JSON.stringify({ type: "events", missed: 0, events: EVENTS }));
    client.send(JSON.stringify({ type: "rest", channels: hello.channels.map((_, channel) => restOf(channel)) }));
  });
});

function send(message) {
  for (const client of sockets.clients) client.send(message);
}

setInterval(
  () => {
    const now = seconds();
    if ((now >= outageFrom && now < outageTo) || now >= endsAt) {
      lastFrame = Math.min(lastFrame, now);
      sequence = BigInt(Math.floor(now * rate));
      return;
    }
    while (sequence < BigInt(Math.floor(now * rate))) {
      sequence += 1n;
      if (!seen) send(JSON.stringify(HEALTH));
      seen = true;
      send(frameAt(Number(sequence) / rate, sequence));
      lastFrame = now;
    }
  },
  Math.min(20, 1000 / rate),
);

setInterval(() => {
  const age = seconds() - lastFrame;
  send(
    JSON.stringify({
      type: "status",
      stale: age > STALE_AFTER,
      age_s: age,
      ended: seconds() >= endsAt,
      clients: sockets.clients.size,
      dropped: 0,
      tare: tare.state,
      tare_time_ns: tare.timeNs,
      message: tare.message,
      below_zero: null,
      link: null,
      recording: null,
      records_to: null,
      replay: null,
      sensors: [],
    }),
  );
}, 100);

if (options["drop-after"] !== "") {
  setTimeout(() => process.exit(0), 1000 * Number(options["drop-after"]));
}

server.listen(Number(options.port), "127.0.0.1", () => {
  console.log(`http://127.0.0.1:${server.address().port}/?token=${token}`);
});
