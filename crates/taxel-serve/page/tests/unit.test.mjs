// Tests of what needs no browser: decoder, link state, scale, history, numbers.

import assert from "node:assert/strict";
import { test } from "node:test";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import * as esbuild from "esbuild";
import { encodeFrame } from "./encode.mjs";

const src = join(dirname(fileURLToPath(import.meta.url)), "../src");

/** A module of the page, translated in memory. */
async function load(name) {
  const entry = join(src, `${name}.ts`);
  const { outputFiles } = await esbuild.build({
    entryPoints: [entry],
    bundle: true,
    format: "esm",
    write: false,
  });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
}

const { decodeFrame, decodeHeader, parseMessage, ProtocolError } = await load("protocol");
const { boardLinkInWords, clockInWords, linkState } = await load("link");
const { eventInWords } = await load("events");
const { Scale, roundUp } = await load("scale");
const { History, LastSecond } = await load("history");
const { clockAt, joined, parsePast, pastColumns, View } = await load("past");
const { belowZeroInWords, clockTime, decimalsFor, fixed, parseLimit, stateInWords, tareInWords } = await load("format");
const { certain, Quantity } = await load("units");
const { Layout } = await load("image");
const { bytesInWords, lengthInWords } = await load("recorder");
const { colourOf, DIVERGING, GREY, HEAT, SEQUENTIAL } = await load("colour");
const { marksOfStates } = await load("marks");

const UNIT = { quantity: "pressure", symbol: "kPa", si_per_unit: 1e3 };
const HELLO = {
  type: "hello",
  protocol: 5,
  name: "array",
  source: "sim:",
  rows: 1,
  columns: 2,
  channels: ["row 0"],
  wiring: { kind: "crossing" },
  reading: UNIT,
  value: UNIT,
  components: 1,
  full_scale: 1,
  states: ["ok"],
  channel_states: ["ok"],
  certainties: ["exact", "at_least", "unknown"],
};

const THREE_COMPONENTS = {
  components: 3,
  sequence: 2n ** 60n + 1n,
  timeNs: 1_500_000_000n,
  lost: 3,
  late: 4,
  duplicate: 5,
  rate: 120.5,
  latency: 0.0004,
  totalForce: [1, 2, 3],
  totalDeviation: [0.1, 0.2, 0.3],
  moment: [4, 5, 6],
  centre: [7, 8],
  centreCovariance: [9, 10, 11],
  sum: 12,
  flags: 37,
  totalCertainty: 1,
  totalReason: 6,
  leftOut: 1,
  contacts: [[17, 2, 0.1, 0.2, 1, 2, 3, 0.01, -0.02, 4, 5, 6, 0.4, 0.5, 0.6, 0.7, 7, 1, 2, 2]],
  reading: [1, 2, 3, 4, 5, 6, 7, 8],
  value: [0.5, -0.25, 1, Number.NaN, 0, 0],
  deviation: [1, 1, 1, 2, 2, 2],
  residual: [Number.NaN, -1.5],
  channelState: [0, 0, 0, 1, 0, 3, 0, 0],
  state: [0, 6],
  counted: [1, 0],
};

test("a frame of three components is read field by field", () => {
  const frame = decodeFrame(encodeFrame(THREE_COMPONENTS));
  const { header } = frame;
  assert.equal(header.components, 3);
  assert.equal(header.sequence, 2n ** 60n + 1n);
  assert.equal(header.time, 1.5);
  assert.deepEqual([header.lost, header.late, header.duplicate], [3, 4, 5]);
  assert.deepEqual([header.rate, header.latency], [120.5, 0.0004]);
  assert.deepEqual(header.force, [1, 2, 3]);
  assert.deepEqual(header.forceDeviation, [0.1, 0.2, 0.3]);
  assert.deepEqual(header.moment, [4, 5, 6]);
  assert.deepEqual(header.centre, [7, 8]);
  assert.deepEqual(header.centreCovariance, [9, 10, 11]);
  assert.deepEqual([header.sum, header.leftOut], [12, 1]);
  assert.deepEqual([header.totalCertainty, header.totalReason, header.zeroKnown], ["at_least", 6, false]);
  const other = decodeHeader(encodeFrame({ ...THREE_COMPONENTS, flags: 0, totalCertainty: 0, totalReason: 255 }));
  assert.deepEqual([other.totalCertainty, other.totalReason, other.zeroKnown], ["exact", null, true]);
  assert.deepEqual([header.tared, header.tareRunning, header.clipped, header.historyUncertain, header.merged], [true, false, true, false, false]);
  assert.deepEqual(frame.contacts, [
    {
      id: 17,
      taxels: 2,
      centre: [0.1, 0.2],
      covariance: [1, 2, 3],
      velocity: [0.01, -0.02],
      force: [4, 5, 6],
      forceDeviation: [0.4, 0.5, 0.6],
      torsion: 0.7,
      peak: 7,
      peakTaxel: 1,
      bound: 2,
      certainty: "unknown",
    },
  ]);
  assert.deepEqual([...frame.reading], [1, 2, 3, 4, 5, 6, 7, 8]);
  assert.deepEqual([...frame.value], [0.5, -0.25, 1, Number.NaN, 0, 0]);
  assert.deepEqual([...frame.deviation], [1, 1, 1, 2, 2, 2]);
  assert.deepEqual([...frame.residual], [Number.NaN, -1.5]);
  assert.deepEqual([...frame.channelState], [0, 0, 0, 1, 0, 3, 0, 0]);
  assert.deepEqual([[...frame.state], [...frame.counted]], [[0, 6], [1, 0]]);
});

const ONE_COMPONENT = {
  totalForce: [Number.NaN, Number.NaN, 0.25],
  totalDeviation: [Number.NaN, Number.NaN, 0.01],
  contacts: [[1, 1, 0.1, 0.2, 1, 2, 3, 0, 0, 0, 0, 0.25, 0, 0, 0.01, 0, 7, 1, Number.NaN, 0]],
  reading: [1.5, Number.NaN, 2.5],
  value: [0, 12.5, -3, Number.NaN],
  deviation: [0.5, 0.5, Number.NaN, Number.NaN],
  state: [0, 0, 8, 9],
};

test("a frame of one component is read: channels, then taxels", () => {
  // An odd number of taxels and channels, with and without contacts: the arrays of numbers stay aligned.
  for (const contacts of [ONE_COMPONENT.contacts, []]) {
    const frame = decodeFrame(encodeFrame({ ...ONE_COMPONENT, contacts }));
    assert.deepEqual([frame.header.components, frame.header.channels, frame.header.taxels], [1, 3, 4]);
    assert.deepEqual([frame.header.force[2], frame.header.forceDeviation[2]], [0.25, 0.01]);
    assert.equal(frame.contacts.length, contacts.length);
    for (const name of ["reading", "value", "deviation", "state"]) {
      assert.deepEqual([...frame[name]], ONE_COMPONENT[name], name);
    }
  }
});

test("frames of a wrong length are refused, also when a count does not fit", () => {
  const bytes = encodeFrame(ONE_COMPONENT);
  assert.equal(bytes.byteLength, 216 + 160 + 3 * 5 + 4 * 14);
  assert.throws(() => decodeFrame(bytes.slice(0, -1)), /446 bytes; 3 channels, 4 taxels and 1 contacts need 447/);
  assert.throws(() => decodeFrame(bytes.slice(0, 216 + 160)), ProtocolError);
  for (const place of [184, 188]) {
    for (const count of [2, 5, 2 ** 32 - 1]) {
      const other = bytes.slice(0);
      new DataView(other).setUint32(place, count, true);
      assert.throws(() => decodeFrame(other), ProtocolError);
    }
  }
});

test("a hello must say what the numbers are", () => {
  const hello = (change) => parseMessage(JSON.stringify({ ...HELLO, ...change })).hello;
  assert.equal(hello({ full_scale: null }).components, 1);
  assert.throws(() => hello({ channels: "row 0" }), /list of channels/);
  assert.throws(() => hello({ channel_states: null }), /list of channel states/);
  assert.throws(() => hello({ reading: { ...UNIT, si_per_unit: 0 } }), /unit of the readings/);
  assert.throws(() => hello({ value: null }), /unit of the values/);
  assert.throws(() => hello({ full_scale: 0 }), /full_scale is 0/);
  assert.throws(() => hello({ components: 2 }), /values of 2 components/);
});

test("saturated and ambiguous have marks and words of their own", () => {
  const [ok, saturated, ambiguous] = marksOfStates(["ok", "saturated", "ambiguous"]);
  assert.equal(ok, 0);
  assert.ok(saturated > 0 && ambiguous > 0 && saturated !== ambiguous && ambiguous < 2 ** 16);
  assert.match(stateInWords("ambiguous"), /one of several positions that explain the readings equally well/);
  assert.match(stateInWords("saturated"), /a bound/);
});

test("below zero has a mark, words with the moment of the zero, and a way back", () => {
  const [saturated, belowZero] = marksOfStates(["saturated", "below_zero"]);
  assert.ok(belowZero > 0 && belowZero !== saturated && belowZero < 2 ** 16);
  assert.match(stateInWords("below_zero"), /below zero.* the zero is wrong/);
  const at = new Date(2026, 4, 1, 14, 3, 7).getTime() / 1000;
  assert.equal(clockTime(at), "14:03");
  assert.equal(clockTime(at, true), "14:03:07");
  const words = (taxels, cause, zero_unix_s) => belowZeroInWords({ taxels, cause, zero_unix_s, zero_time_ns: null });
  const way = "With nothing on the sensor, tare again.";
  assert.equal(
    words(3, "the zero was taken under load, or the sensor has changed since", at),
    `3 taxels read below zero: the zero was taken under load at 14:03, or the sensor has changed since. ${way}`,
  );
  assert.equal(words(1, "no zero was taken", null), `1 taxel reads below zero: no zero was taken. ${way}`);
  assert.equal(tareInWords("loaded"), "tare: from a recording");
  assert.equal(tareInWords("done"), "tare: done");
  assert.equal(tareInWords("waiting"), "tare: not taken yet");
});

test("a unit has the prefix that fits its size, and what is counted has none", () => {
  const force = new Quantity({ symbol: "mN", si_per_unit: 1e-3 });
  assert.equal(force.base, "N");
  assert.equal(force.text(143.91494, 0.02), "143.915 ± 0.020 N");
  assert.equal(force.text(0.25, 0.01), "250 ± 10 mN");
  assert.equal(force.text(-1.5, 0.01), "\u22121.500 ± 0.010 N");
  assert.equal(force.text(4e-7), "400.0 nN");
  // What belongs together is in one unit; zero is in the usual one.
  assert.equal(force.text(0.002, Number.NaN, 20), "0.00 N");
  assert.equal(force.text(0), "0.00 mN");
  assert.equal(force.text(Number.NaN, Number.NaN), "–");
  assert.equal(new Quantity({ symbol: "uS", si_per_unit: 1e-6 }).text(2.5e-6), "2.500 µS");
  assert.equal(new Quantity({ symbol: "kPa", si_per_unit: 1e3 }).text(250), "250.0 Pa");
  assert.equal(new Quantity({ symbol: "fF", si_per_unit: 1e-15 }).text(1.25e-12), "1.250 pF");
  assert.equal(Quantity.of("N·m").text(1.4764), "1.476 N·m");
  const counts = new Quantity({ symbol: "counts", si_per_unit: 1 });
  assert.equal(counts.text(143914), "143914 counts");
  assert.equal(Quantity.of("cells").text(-5.86887), "\u22125.869 cells");
  assert.equal(Quantity.of("1").text(295), "295");
});

test("a bound begins with its sign, and what is not known has no number", () => {
  assert.equal(certain("62.7 mN", "exact"), "62.7 mN");
  assert.equal(certain("62.7 mN", "at_least"), "≥ 62.7 mN");
  assert.equal(certain("62.7 mN", "unknown"), "not known");
  assert.equal(certain("62.7 mN", null), "62.7 mN");
});

test("on a cylinder columns are narrower towards the sides, and the far side has no width", () => {
  const turn = { arc: 2 * Math.PI, angle: 0 };
  const layout = new Layout(200, 100, 1, 1, 8, turn);
  const widths = Array.from({ length: 8 }, (_, column) => layout.box(0, column, 1).width);
  assert.ok(widths[3] > widths[2] && widths[2] > 0 && widths[4] === widths[3], widths.join());
  assert.deepEqual([widths[0], widths[1], widths[6], widths[7]], [0, 0, 0, 0]);
  assert.ok(Number.isNaN(layout.across(0)) && layout.across(0.5) === 100);
  // Where a column is drawn is where it is found.
  for (const share of [0.3, 0.5, 0.7]) assert.ok(Math.abs(layout.shareAt(layout.across(share) / 200) - share) < 1e-12);
  // By half a turn the middle is behind.
  assert.ok(Number.isNaN(new Layout(200, 100, 1, 1, 8, { ...turn, angle: Math.PI }).across(0.5)));
});

test("sizes and lengths of a recording are said in words", () => {
  assert.deepEqual([0, 999, 1000, 12_345_678, 2.5e12].map(bytesInWords), ["0 B", "999 B", "1.0 kB", "12 MB", "2.5 TB"]);
  assert.deepEqual([0.4, 75, 3723].map(lengthInWords), ["00:00", "01:15", "01:02:03"]);
});

test("a frame that is cut short or too long is refused with both lengths", () => {
  const bytes = encodeFrame(THREE_COMPONENTS);
  assert.throws(() => decodeFrame(bytes.slice(0, bytes.byteLength - 1)), /475 bytes.*need 476/);
  const longer = new Uint8Array(bytes.byteLength + 1);
  longer.set(new Uint8Array(bytes));
  assert.throws(() => decodeFrame(longer.buffer), ProtocolError);
  assert.throws(() => decodeHeader(bytes.slice(0, 100)), /100 bytes.*216/);
});

test("a foreign magic and another number of components are refused", () => {
  const bytes = encodeFrame(THREE_COMPONENTS);
  new DataView(bytes).setUint16(4, 2, true);
  assert.throws(() => decodeFrame(bytes), /2 components/);
  new DataView(bytes).setUint32(0, 0, true);
  assert.throws(() => decodeFrame(bytes), /TXL5/);
});

test("hello and status are read, other protocols refused", () => {
  assert.equal(parseMessage(JSON.stringify(HELLO)).hello.name, "array");
  assert.equal(parseMessage('{"type":"status","stale":true}').status.stale, true);
  assert.equal(parseMessage('{"type":"later"}').type, "unknown");
  assert.throws(() => parseMessage(JSON.stringify({ ...HELLO, protocol: 2 })), /protocol 2/);
  assert.throws(() => parseMessage(JSON.stringify({ ...HELLO, rows: 0 })), /rows is 0/);
  assert.throws(() => parseMessage("{"), /not JSON/);
});

test("silence of frames or of the socket is stale, whatever the last status said", () => {
  const live = {
    socket: "open",
    status: { stale: false, ended: false },
    messageAge: 20,
    frameAge: 20,
    staleAfter: 0.3,
  };
  assert.equal(linkState(live), "live");
  assert.equal(linkState({ ...live, frameAge: 360 }), "stale");
  assert.equal(linkState({ ...live, messageAge: 450 }), "stale");
  assert.equal(linkState({ ...live, status: { stale: true, ended: false } }), "stale");
  assert.equal(linkState({ ...live, status: { stale: true, ended: true } }), "ended");
  assert.equal(linkState({ ...live, socket: "disconnected" }), "disconnected");
  assert.equal(linkState({ ...live, frameAge: Number.POSITIVE_INFINITY }), "waiting");
});

test("a scale follows upwards at once, shrinks slowly, never below its floor", () => {
  const scale = new Scale("symmetric", 10);
  scale.follow(-1, 2, 0);
  assert.deepEqual([scale.low, scale.high], [-10, 10]);
  scale.follow(-33, 2, 1);
  assert.deepEqual([scale.low, scale.high], [-40, 40]);
  scale.follow(0, 0, 2);
  assert.equal(scale.high, 40);
  for (let time = 3; time < 60; time++) scale.follow(0, 0, time);
  assert.equal(scale.high, 10);
});

test("a fixed scale stays and a limit that makes no scale is refused", () => {
  const scale = new Scale("positive", 10);
  assert.equal(scale.fix(0, 2), true);
  scale.follow(0, 500, 0);
  assert.equal(scale.high, 2);
  assert.equal(scale.fix(0, Number.NaN), false);
  assert.equal(scale.fix(0, 0), false);
  assert.equal(scale.high, 2);
  scale.release();
  scale.follow(0, 500, 1);
  assert.equal(scale.high, 500);
});

test("a range contains its values and is no narrower than its floor", () => {
  const scale = new Scale("range", 20);
  scale.follow(203, 205, 0);
  assert.ok(scale.low <= 203 && scale.high >= 205 && scale.high - scale.low >= 20);
  scale.follow(150, 290, 1);
  assert.ok(scale.low <= 150 && scale.high >= 290);
});

test("round limits are not smaller than the value", () => {
  assert.deepEqual([0.011, 1, 1.01, 7, 99, 101].map(roundUp), [0.015, 1, 1.5, 8, 100, 150]);
});

test("history keeps a peak of one frame among thousands, in bounded memory", () => {
  const history = new History(1);
  for (let frame = 0; frame < 60_000; frame++) history.push(frame / 1000, [frame === 55_123 ? -7 : 1]);
  const [times, values] = history.columns(0.5);
  assert.ok(times.length <= 2 * 501);
  assert.equal(Math.min(...values), -7);
  assert.ok(
    times.every((time, index) => time <= 0 && time >= -10.1 && (index === 0 || time >= times[index - 1])),
  );
});

test("history breaks its line where nothing came and starts anew when the clock goes back", () => {
  const history = new History(1);
  for (const time of [0, 0.1, 3, 3.1]) history.push(time, [1]);
  assert.equal(history.columns(0.5)[1].filter((value) => value === null).length, 1);
  assert.ok(Math.abs(history.oldest) < 1e-9);
  history.push(1, [5]);
  assert.deepEqual(history.columns(0.5)[1], [5, 5]);
  assert.ok(Math.abs(history.oldest - 1) < 0.021);
  assert.ok(Number.isNaN(new History(1).oldest));
});

const ANSWER = {
  from_ns: 0,
  to_ns: 60e9,
  oldest_ns: 10e9,
  newest_ns: 42e9,
  width_ns: 1e9,
  time_ns: [10e9, 11e9, 40e9, 41e9],
  unix_s: [1000, 1000.5, 1015, 1015.5],
  signals: [{ name: "force_z", unit: "N", first: [1, 2.5, null, 4], min: [1, 2, null, 4], mean: [1, 2, null, 4], max: [1.5, 2.5, null, 5], last: [1.5, 2, null, 4.5], rises: [true, false, true, true] }],
  tares: [{ time_ns: 11e9, unix_s: 1000.5, kind: "tare" }],
  events: [],
};

test("the past is four points for each row, in their order; pauses and missing values break the line", () => {
  const past = parsePast(ANSWER);
  assert.deepEqual(past.tares, [{ time: 11, kind: "tare" }]);
  const milli = (value) => 1e3 * value;
  const [times, values] = pastColumns(past, ["force_z"], milli, 50, 42, 0.5);
  const row = (begin) => [0, 0.25, 0.5, 0.75].map((part) => begin + part);
  assert.deepEqual(times, [...row(-40), ...row(-39), -24.5, ...row(-10), ...row(-9)]);
  // A falling edge is one: its largest value comes first.
  assert.deepEqual(values, [1000, 1000, 1500, 1500, 2500, 2500, 2000, 2000, null, null, null, null, null, 4000, 4000, 5000, 4500]);
  // What the page knows better itself is left to it; a signal that is not kept is a gap.
  assert.equal(pastColumns(past, ["force_z"], milli, 50, 41.5, 0.5)[0].length, 13);
  assert.ok(pastColumns(past, ["force_y"], milli, 50, 42, 0.5)[1].every((value) => value === null));
});

test("joined columns break where the second begins later", () => {
  assert.deepEqual(joined([[-9, -8], [1, 2]], [[-7.5, -7], [3, 4]], 1), [[-9, -8, -7.5, -7], [1, 2, 3, 4]]);
  assert.deepEqual(joined([[-9, -8], [1, 2]], [[-4], [3]], 1), [[-9, -8, -6, -4], [1, 2, null, 3]]);
  assert.deepEqual(joined([[], []], [[-4], [3]], 1), [[-4], [3]]);
});

test("the clock of a replay at double speed is found between the rows and continued outside", () => {
  const past = parsePast(ANSWER);
  assert.equal(clockAt(past, 10.5), 1000.25);
  assert.equal(clockAt(past, 25.5), 1007.75);
  assert.equal(clockAt(past, 8), 998);
  assert.equal(clockAt(past, 43), 1017.5);
  assert.ok(Number.isNaN(clockAt({ times: [], clock: [] }, 1)));
});

test("the view follows, zooms about a point, and stays within what there is", () => {
  const view = new View();
  assert.deepEqual(view.range(100), [90, 100]);
  view.zoom(2, 0.1);
  assert.deepEqual(view.range(100), [80, 100], "now stays where it is while it follows");
  view.goTo(70, 10, 100);
  assert.deepEqual([view.live, ...view.range(100)], [false, 50, 70]);
  view.zoom(0.5, 0.25);
  assert.deepEqual(view.range(100), [52.5, 62.5], "a quarter of the width stays at 55 s");
  view.goTo(-1000, 10, 100);
  assert.deepEqual(view.range(100), [10, 20]);
  view.goTo(-Infinity, Number.NaN, 100);
  assert.deepEqual(view.range(100), [0, 10]);
  view.goTo(150, 10, 100);
  assert.equal(view.live, true);
  for (let step = 0; step < 40; step++) view.zoom(2);
  assert.equal(view.span, 12 * 3600);
  for (let step = 0; step < 60; step++) view.zoom(0.5);
  assert.equal(view.span, 2);
});

test("latency is that of the last second", () => {
  const latency = new LastSecond();
  latency.push(0, 9);
  for (const [index, value] of [1, 2, 3, 4, 50].entries()) latency.push(5000 + index, value);
  assert.deepEqual(latency.summary(5100), { median: 3, largest: 50 });
  assert.ok(Number.isNaN(latency.summary(9000).median));
});

test("numbers are written with a true minus, without a negative zero, unknown ones with a dash", () => {
  assert.equal(fixed(-1.234, 2), "\u22121.23");
  assert.equal(fixed(-0.001, 2), "0.00");
  assert.equal(fixed(Number.NaN, 2), "–");
  assert.equal(parseLimit("\u22122,5"), -2.5);
  assert.ok(Number.isNaN(parseLimit("")));
});

test("lightness of the maps is monotonic: up along one, down and up along the other", () => {
  const lightness = (colour) => {
    const [red, green, blue] = colour.match(/\d+/g).map(Number);
    return 0.2126 * (red / 255) ** 2.2 + 0.7152 * (green / 255) ** 2.2 + 0.0722 * (blue / 255) ** 2.2;
  };
  const rises = (map) =>
    map.every((colour, index) => index === 0 || lightness(colour) >= lightness(map[index - 1]) - 2e-3);
  assert.ok(rises(SEQUENTIAL) && rises(HEAT) && rises(GREY));
  assert.deepEqual([GREY[0], GREY[255]], ["rgb(0, 0, 0)", "rgb(255, 255, 255)"]);
  assert.ok(rises(DIVERGING.light.slice(0, 128)) && rises(DIVERGING.light.slice(128).reverse()));
  assert.ok(rises(DIVERGING.dark.slice(0, 128).reverse()) && rises(DIVERGING.dark.slice(128)));
  assert.equal(colourOf(SEQUENTIAL, 99, 0, 1), SEQUENTIAL[255]);
});

test("events, tares and health are messages of their own", () => {
  const read = (message) => parseMessage(JSON.stringify(message));
  const event = { index: 3, time_ns: 5, contact: 2, kind: "touch", value: 0.5, deviation: null, unit: "N" };
  assert.deepEqual(read({ type: "events", missed: 3, events: [event] }), { type: "events", missed: 3, events: [event] });
  assert.deepEqual(read({ type: "tares", entries: [] }), { type: "tares", entries: [] });
  const health = { type: "health", repeated: 1, channels: 4, wrong_channels: 0, wrong: [], swapped: [] };
  assert.equal(read(health).health.repeated, 1);
  assert.equal(read({ type: "baseline", changes: 2, last: [] }).baseline.changes, 2);
  // What a message lacks must not reach the panels.
  for (const type of ["events", "tares", "baseline", "health"]) assert.equal(read({ type }).type, "unknown");
});

test("an event is reported in words and with its value, deviation and unit", () => {
  assert.equal(eventInWords({ kind: "split", parent: 3 }), "split from 3");
  assert.equal(eventInWords({ kind: "merged", into: 1 }), "merged into 1");
  assert.equal(eventInWords({ kind: "impact", rise_time_s: 0.0257 }), "impact, rise 25.7 ms");
  assert.equal(eventInWords({ kind: "cyclic", symmetry: 0.994 }), "cyclic, symmetry 0.99");
  assert.equal(eventInWords({ kind: "slip", direction: [0, -1] }), "slip ↓");
  assert.equal(eventInWords({ kind: "slip", direction: [-1, 0], score: 0.7 }), "slip ← along the row, score 0.70");
});

test("the clock of a board is said with its bound, and only while the link is in step", () => {
  const clock = {
    device_time_ns: 12_340_000_000,
    host_ns: 15_342_000_000,
    rate_difference: 60e-6,
    before_s: 0.0004,
    behind_s: 0.0012,
    segments: 1,
  };
  const link = { state: "in_step", clock };
  const full = clockInWords(link);
  assert.match(full, /runs 60\.0 ppm too slow/);
  assert.match(full, /12\.340 s by the clock of the board was 15\.342 s/);
  assert.match(full, /at most 0\.40 ms before and 1\.20 ms behind it/);
  const oneWay = clockInWords({ ...link, clock: { ...clock, before_s: null, rate_difference: -2e-6, segments: 3 } });
  assert.match(oneWay, /is not known.*runs 2\.0 ppm too fast\. Segment 3/);
  assert.match(clockInWords({ ...link, clock: { ...clock, rate_difference: 0 } }), /How much faster or slower .* is not known yet/);
  assert.equal(clockInWords({ ...link, state: "silent" }), null);
  assert.equal(clockInWords({ ...link, clock: null }), null);
  assert.equal(clockInWords(null), null);
});

test("the link to a board is said while it is not in step, and marks are events", () => {
  const link = { name: "/dev/ttyACM0", state: "in_step", reason: "" };
  assert.equal(boardLinkInWords(null), "");
  assert.equal(boardLinkInWords(link), "");
  assert.equal(boardLinkInWords({ ...link, state: "garbled", reason: "wrong baud" }), "/dev/ttyACM0 is garbled: wrong baud");
  assert.equal(eventInWords({ kind: "mark", text: "grasp", contact: 0 }), "mark: grasp");
});

test("a loss that the wire cannot tell, an arrival and uncertain flags are read", () => {
  const header = decodeHeader(encodeFrame({ ...THREE_COMPONENTS, lost: 2n ** 64n - 1n, hostNs: 2_500_000_000n, uncertain: 3 }));
  assert.ok(Number.isNaN(header.lost));
  assert.deepEqual([header.arrival, header.uncheckedWire, header.inferredTime], [2.5, true, true]);
  assert.ok(Number.isNaN(decodeHeader(encodeFrame(THREE_COMPONENTS)).arrival));
});
