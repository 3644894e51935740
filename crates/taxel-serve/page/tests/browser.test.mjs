// The page in a browser, against the real server or, with TAXEL_MOCK=1, against the mock.
//
//   SENSOR      sensor file of the three-axis array (default: the shipped one)
//   RECORDING   recording of a pressure map (default: crates/taxel-recording/tests/recordings/fingertip.csv)
//
// Other settings are those of harness.mjs. Screenshots are written to tests/screenshots/.

import assert from "node:assert/strict";
import { mkdtempSync, readdirSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import WebSocket from "ws";
import { DEVICES } from "./devices.mjs";
import { byTestId, drawn, existing, fromDist, launch, moreFrames, opened, program, repository, screenshots, started, tests } from "./harness.mjs";

const mock = process.env.TAXEL_MOCK === "1";

/** A virtual device, on its standard output. */
const BOARD = "taxel-wire-1-256";
const DEVICE = `device three-axis-8x8 --board ${BOARD} --on -`;

/** What is served in a case: arguments of `taxel live`, and of the mock. */
const CASES = {
  finger: { source: () => `sim:${script("finger")}`, mock: ["--scene", "all-states"] },
  quiet: { source: () => `sim:${script("quiet")}`, options: ["--no-tare"], mock: ["--scene", "quiet"] },
  held: { source: () => `sim:${script("held")}` },
  outage: { source: () => `sim:${script("outage")}`, mock: ["--outage", "3:6"] },
  linked: { source: () => `exec:'${program()}' ${DEVICE} --script '${script("quiet")}'`, options: ["--board", BOARD] },
  heat: { mock: ["--kind", "3", "--scene", "all-states"], mockOnly: true },
  grey: { mock: ["--kind", "3", "--grayscale"], mockOnly: true },
  map: { source: () => `replay:${recording()}`, mock: ["--kind", "2"], describesItself: true },
};

let browser;
before(async () => (browser = await launch()));
after(() => browser?.close());

const script = (name) => existing(join(tests, "scripts", `${name}.toml`), "the script of the simulated source");
const recording = () =>
  existing(process.env.RECORDING ?? join(repository, "crates/taxel-recording/tests/recordings/fingertip.csv"), "the recording of a pressure map");
const sensor = () => process.env.SENSOR ?? "three-axis-8x8";

/** Starts the server of a case; gives its URL, and a function that ends it. */
async function serve(name, context, more = []) {
  const { source, options = [], mock: mockArguments, describesItself, mockOnly } = CASES[name];
  const [command, ...commandArguments] = mock || mockOnly
    ? [process.execPath, join(tests, "mock-server.mjs"), ...mockArguments]
    : [program(), "live", ...(describesItself ? [] : [sensor()]), "--port", "0", "--source", source(), ...options, ...more];
  const { url, stop } = await started(command, commandArguments);
  context.after(stop);
  return { url, stop };
}

/** Starts a device of devices.mjs in a state. */
async function serveDevice(name, state, context) {
  const { start } = DEVICES.find((device) => device.name === name);
  const { url, stop } = await started(program(), ["live", ...start(state), "--port", "0"]);
  context.after(stop);
  return { url, stop };
}

async function open(url, context, settings = {}) {
  const page = await opened(browser, url, settings);
  context.after(page.close);
  return page;
}

const LAYERS = ["z", "x", "y", "readings"];

const badge = (tab, state) =>
  tab.waitForFunction((wanted) => window.taxelTest.badge === wanted, state, { polling: 20 });

const skinPixels = (tab) => byTestId(tab, "skin").evaluate((canvas) => canvas.toDataURL());
const largest = (tab) => byTestId(tab, "skin").evaluate((canvas) => Number(canvas.dataset.max));
const limits = (tab) => byTestId(tab, "skin").evaluate(({ dataset: { low, high } }) => [Number(low), Number(high)]);
/** Waits until the largest value of the image is at least so much, SI. */
const reaches = (tab, least) => tab.waitForFunction((wanted) => Number(document.querySelector("[data-testid=skin]").dataset.max) > wanted, least);

/** Text of the inspector on one line. */
const inspected = async (tab) => (await byTestId(tab, "inspect").innerText()).replace(/\s+/g, " ");

/** Waits for the end of the rest capture at the start: before it there are no forces. */
async function rested(tab) {
  if (mock) return;
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: done");
}

test("each layer appears and changes while a finger moves, and the chosen one is remembered", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  for (const id of LAYERS) {
    await byTestId(tab, `layer-${id}`).click();
    await drawn(tab);
    const { width, height } = await byTestId(tab, "skin").boundingBox();
    assert.ok(width >= 400 && height >= 400, `the image is only ${width} x ${height}`);
    const before = await skinPixels(tab);
    await tab.waitForFunction((old) => document.querySelector("[data-testid=skin]").toDataURL() !== old, before);
  }
  await tab.reload();
  await badge(tab, "live");
  await byTestId(tab, "skin").waitFor();
  assert.equal(await byTestId(tab, "skin").getAttribute("data-layer"), "readings");
  await byTestId(tab, "layer-z").click();
  // The finger comes and goes: between its extremes the force grows by more than noise.
  await tab.waitForFunction(() => {
    const value = Number(document.querySelector("[data-testid=skin]").dataset.max);
    if (!(value >= 0)) return false;
    const [low, high] = (window.seen ??= [value, value]);
    window.seen = [Math.min(low, value), Math.max(high, value)];
    return high > 0.5e-3 && high > 1.3 * low;
  }, undefined, { polling: 30, timeout: 20_000 });
  assert.match(await byTestId(tab, "total-force").innerText(), /(exact|at least)[^]*[\d.]+[^]*mN/);
  await byTestId(tab, "badge").click();
  assert.match(await byTestId(tab, "frame-rate").innerText(), /^\d+\.\d Hz$/);
  assert.match(await byTestId(tab, "latency").innerText(), /^\d[\d.]* and \d[\d.]* ms$/);
  assert.match(await byTestId(tab, "lost").innerText(), /^\d+$/);
  assert.deepEqual(complaints, []);
});

test("mouse, keys and touch inspect a taxel", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context, { hasTouch: true });
  await badge(tab, "live");
  await rested(tab);
  const everything = /row 2, column 3 .*F ?x .* ± .* mN F ?y .* ± .* mN F ?z .* ± .* mN channel reading change state r2c3\.11 .*fF.* r2c3\.22 .* Residual/;
  const image = byTestId(tab, "skin");
  const { width, height } = await image.boundingBox();
  await image.hover({ position: { x: (3.5 / 8) * width, y: (2.5 / 8) * height } });
  await byTestId(tab, "skin-foot").getByText(/^row 2, column 3: pressing .* mN, /).waitFor();
  await image.click({ position: { x: (3.5 / 8) * width, y: (2.5 / 8) * height } });
  await byTestId(tab, "inspect").getByText("row 2, column 3").waitFor();
  assert.match(await inspected(tab), everything);
  assert.notEqual(await byTestId(tab, "inspect-state").innerText(), "");
  await image.click({ position: { x: (3.5 / 8) * width, y: (2.5 / 8) * height } });
  await byTestId(tab, "tare").hover();
  await byTestId(tab, "inspect").getByText("Point at a taxel").waitFor();

  await image.focus();
  // The first key selects the first taxel.
  for (const key of [...Array(3).fill("ArrowDown"), ...Array(4).fill("ArrowRight")]) await tab.keyboard.press(key);
  await byTestId(tab, "inspect").getByText("row 2, column 4").waitFor();
  await tab.keyboard.press("ArrowLeft");
  await byTestId(tab, "inspect").getByText("row 2, column 3").waitFor();
  assert.match(await inspected(tab), everything);
  assert.match(await tab.locator("#announce-taxel").textContent(), /^row 2, column 3: F x /);
  await tab.keyboard.press("End");
  await tab.keyboard.press("PageDown");
  await byTestId(tab, "inspect").getByText("row 7, column 7").waitFor();
  await tab.keyboard.press("Escape");
  await byTestId(tab, "inspect").getByText("Point at a taxel").waitFor();

  const box = await image.boundingBox();
  await tab.touchscreen.tap(box.x + (6.5 / 8) * box.width, box.y + (5.5 / 8) * box.height);
  await byTestId(tab, "inspect").getByText("row 5, column 6").waitFor();
  assert.deepEqual(complaints, []);
});

test("tare runs and is shown as done", async (context) => {
  const { url } = await serve("quiet", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  assert.equal(await byTestId(tab, "tare-state").innerText(), "tare: none");
  await moreFrames(tab, 2);
  await byTestId(tab, "tare").click();
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: done");
  await moreFrames(tab, 2);
  if (!mock) assert.ok((await largest(tab)) < 0.3e-3, "no force after the rest capture");
  await byTestId(tab, "tab-tares").click();
  await byTestId(tab, "clear-tare").click();
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: none");
  await tab.keyboard.press("t");
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: done");
  assert.deepEqual(complaints, []);
});

test("a tare under a contact is refused, and taken when forced", { skip: mock }, async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: done");
  await byTestId(tab, "tab-tares").click();
  const entries = byTestId(tab, "tares").locator("ol > li");
  await byTestId(tab, "events").locator("tr").first().waitFor({ state: "attached" });
  await byTestId(tab, "tare").click();
  await entries.first().getByText(/refused, asked for by the page: contact \d+ presses at row \d, column \d with [\d.]+ mN/).waitFor();
  await entries.first().getByText("Tare anyway", { exact: true }).click();
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent !== "tare: none");
  assert.deepEqual(complaints, []);
});

test("a zero taken under load is drawn as below zero, with its cause and one way back", { skip: mock }, async (context) => {
  const { url } = await serve("held", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  const banner = byTestId(tab, "below-zero");
  assert.equal(await banner.isVisible(), false);
  await reaches(tab, 14e-3);
  // The zero is to be that of the resting finger, not of one that still comes.
  await moreFrames(tab, 30);
  await byTestId(tab, "tare").click();
  await byTestId(tab, "tab-tares").click();
  await byTestId(tab, "tares").getByText("Tare anyway", { exact: true }).click();
  await banner.waitFor();
  await tab.waitForFunction(() => / taxels read/.test(document.getElementById("below-zero-text").textContent));
  assert.match(
    await banner.innerText(),
    /^\d+ taxels read below zero: the zero was taken under load at \d\d:\d\d\. With nothing on the sensor, tare again\./,
  );
  assert.equal(await byTestId(tab, "condition").isVisible(), false, "no channel is accused");
  await byTestId(tab, "skin").focus();
  for (const key of ["Home", ...Array(3).fill("ArrowDown"), ...Array(3).fill("ArrowRight")]) await tab.keyboard.press(key);
  await tab.waitForFunction(() => /below zero: /.test(document.querySelector("[data-testid=inspect]").textContent));
  await drawn(tab);
  // The ground of the cell beside it is the colour of no value: the low end of the map would say zero.
  const ground = () =>
    byTestId(tab, "skin").evaluate((canvas) => {
      const [x, y] = [Math.round((4.16 / 8) * canvas.width), Math.round((3.5 / 8) * canvas.height)];
      return [...canvas.getContext("2d").getImageData(x, y, 1, 1).data.slice(0, 3)];
    });
  assert.deepEqual(await ground(), [242, 163, 223]);
  for (const [name, media] of [
    ["light", { colorScheme: "light" }],
    ["dark", { colorScheme: "dark" }],
    ["forced", { colorScheme: "dark", forcedColors: "active" }],
  ]) {
    await tab.emulateMedia(media);
    await moreFrames(tab, 2);
    await drawn(tab);
    assert.deepEqual(await ground(), [242, 163, 223], name);
    await moreFrames(tab, 25);
    await tab.screenshot({ path: join(screenshots, `below-zero-${name}.png`) });
  }
  await byTestId(tab, "below-zero-tare").click();
  await banner.waitFor({ state: "hidden" });
  assert.deepEqual(complaints, []);
});

test("events are listed, the newest first, and a kind can be chosen", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const rows = byTestId(tab, "events").locator("tr");
  await rows.first().waitFor();
  await tab.waitForFunction(() => document.querySelectorAll("[data-testid=events] tr").length >= 2);
  const times = await rows.locator("td:first-child").allInnerTexts();
  const seconds = times.map(parseFloat);
  assert.deepEqual(seconds, [...seconds].sort((a, b) => b - a));
  assert.match(await rows.last().innerText(), /^\d+\.\d\d s\s+1\s+touch\s+[\d.]+\s+± [\d.]+ [µm]N$/);
  await byTestId(tab, "event-filter").selectOption("touch");
  for (const text of await rows.allInnerTexts()) assert.match(text, /touch/);
  assert.ok((await rows.count()) >= 1);
  // A page that comes late gets what was before.
  const { tab: late } = await open(url, context);
  const first = byTestId(late, "events").locator("tr").last();
  await first.getByText("touch").waitFor();
  assert.equal(await first.locator("td").first().innerText(), times.at(-1));
  assert.deepEqual(complaints, []);
});

test("key M notes words at the newest frame, and the list of events has them", { skip: mock }, async (context) => {
  const { url } = await serve("quiet", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const dialog = tab.locator("#mark-dialog");
  await tab.keyboard.press("m");
  assert.ok(await dialog.isVisible());
  // The key itself is no letter of the mark, and keys of the page are letters in it.
  assert.equal(await tab.getByTestId("mark-text").inputValue(), "");
  await tab.keyboard.type("map the first grasp");
  assert.equal(await tab.getByTestId("mark-text").inputValue(), "map the first grasp");
  await tab.keyboard.press("Enter");
  assert.ok(!(await dialog.isVisible()));
  await tab.getByText("mark: map the first grasp").first().waitFor();
  // Without words, or cancelled, nothing is noted.
  await tab.keyboard.press("m");
  await tab.keyboard.press("Enter");
  await tab.keyboard.press("m");
  await tab.keyboard.type("no");
  await tab.keyboard.press("Escape");
  assert.ok(!(await dialog.isVisible()));
  await tab.waitForTimeout(400);
  assert.equal(await tab.getByText("mark: no", { exact: true }).count(), 0);
  assert.deepEqual(complaints, []);
});

test("the clock of a board stands with its bound behind the chip of the link", { skip: mock }, async (context) => {
  const { url } = await serve("linked", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "badge").click();
  await byTestId(tab, "clock").getByText(/by the clock of the board was .* s by that of the computer/).waitFor();
  assert.match(await byTestId(tab, "clock").innerText(), /at most \d+\.\d\d ms/);
  assert.match(await byTestId(tab, "board").innerText(), /wire class A/);
  assert.deepEqual(complaints, []);
});

test("tares are listed with who took them, and one can go back to each", async (context) => {
  const { url } = await serve("quiet", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "tab-tares").click();
  const entries = byTestId(tab, "tares").locator("ol > li");
  await entries.getByText("rest values of the calibration").waitFor();
  await byTestId(tab, "tare").click();
  await entries.first().getByText("tare by the page").waitFor();
  assert.match(await entries.first().innerText(), /largest change [+\u2212]?[\d.]+ fF \(r\dc\d\.\d\d\)/);
  assert.equal(await byTestId(tab, "tare-state").innerText(), "tare: done");
  await byTestId(tab, "undo-0").focus();
  await tab.keyboard.press("Enter");
  await entries.first().getByText("back to the calibration").waitFor();
  await byTestId(tab, "tare-state").getByText("tare: none").waitFor();
  assert.match(await entries.first().innerText(), /in force/);
  await byTestId(tab, "undo-1").waitFor();
  assert.deepEqual(complaints, []);
});

test("what is wrong with channels is said in a line, on a map and in words", { skip: !mock }, async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const chip = byTestId(tab, "condition");
  assert.equal(await chip.innerText(), "3 channels dead, stuck, inconsistent");
  await chip.click();
  await byTestId(tab, "wrong").getByText("the same reading for 3.1 s").waitFor();
  await byTestId(tab, "wrong").getByText("changed places: r3c5.11 and r3c5.12, or r3c5.21 and r3c5.22").waitFor();
  const map = byTestId(tab, "condition-map");
  // A taxel that is not used is not called well.
  assert.equal(await map.getAttribute("data-masked"), "56");
  const { width, height } = await map.boundingBox();
  await map.hover({ position: { x: (2.5 / 8) * width, y: (2.5 / 8) * height } });
  await map.click({ position: { x: (2.5 / 8) * width, y: (2.5 / 8) * height } });
  await byTestId(tab, "inspect-condition").getByText("r2c2.22: the same reading").waitFor();
  // Arrow keys go from tab to tab.
  await byTestId(tab, "tab-condition").focus();
  await tab.keyboard.press("ArrowLeft");
  assert.equal(await byTestId(tab, "tab-link").getAttribute("aria-selected"), "true");
  assert.deepEqual(complaints, []);
});

test("without frames no channel is called well: before the first, after the last, behind a garbled link", async (context) => {
  const cases = [
    { server: ["--outage", "0:60"], badge: "stale", words: "Not known yet: no frame has come." },
    { server: ["--outage", "2:60"], badge: "stale", words: "No frames come. In the last one nothing was against any of 256 channels." },
  ].map(({ server, ...seen }) => ({ ...seen, command: process.execPath, server: [join(tests, "mock-server.mjs"), ...server] }));
  if (!mock) {
    // Lines of a program are no packets of this board.
    const server = ["live", sensor(), "--port", "0", "--source", "exec:yes", "--board", BOARD];
    cases.push({ command: program(), server, badge: "stale", words: "Not known yet: no frame has come.", link: /garbled/ });
  }
  for (const { command, server, badge: state, words, link } of cases) {
    const { url, stop } = await started(command, server);
    context.after(stop);
    const { tab, complaints } = await open(url, context);
    await badge(tab, state);
    await byTestId(tab, "tab-condition").click();
    await byTestId(tab, "condition-summary").getByText(words, { exact: true }).waitFor();
    assert.equal(await byTestId(tab, "condition-map").getAttribute("data-unsaid"), "--none");
    await byTestId(tab, "tab-channels").click();
    if (words.startsWith("No frames come")) await byTestId(tab, "channels").getByText("not known", { exact: true }).first().waitFor();
    assert.equal(await byTestId(tab, "channels").getByText("ok", { exact: true }).count(), 0);
    if (link !== undefined) await tab.waitForFunction((source) => new RegExp(source).test(document.querySelector("[data-testid=badge-detail]").innerText), link.source);
    assert.deepEqual(complaints, []);
    await stop();
  }
});

/** What the chart shows: ends of the time axis, device time in s, and number of points. */
const chart = (tab) =>
  byTestId(tab, "strip").evaluate(({ dataset: { from, to, points } }) => [from, to, points].map(Number));

test("the chart keeps its history over a reload, zooms, pans, reads values and is saved", { skip: mock }, async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context, { acceptDownloads: true });
  await badge(tab, "live");
  await byTestId(tab, "events").getByText("release").first().waitFor();
  await tab.reload();
  await badge(tab, "live");
  // The page is some frames old; its chart is not.
  await tab.waitForFunction((wanted) => Number(document.querySelector("[data-testid=strip]").dataset.points) > wanted, 100);
  assert.ok((await tab.evaluate(() => window.taxelTest.frames)) < 120);

  // By wheel, by button and by key, following; then back in time.
  let [from, to] = await chart(tab);
  assert.ok(Math.abs(to - from - 10) < 0.01);
  await byTestId(tab, "strip-zoom-out").click();
  [from, to] = await chart(tab);
  assert.ok(Math.abs(to - from - 20) < 0.01);
  await byTestId(tab, "strip-chart").focus();
  await tab.keyboard.press("+");
  await tab.keyboard.press("+");
  [from, to] = await chart(tab);
  assert.ok(Math.abs(to - from - 5) < 0.01);
  assert.equal(await byTestId(tab, "strip-live").getAttribute("aria-pressed"), "true");
  await tab.keyboard.press("Home");
  await byTestId(tab, "strip-note").getByText(/^mN, \d\d:\d\d:\d\d to \d\d:\d\d:\d\d$/).waitFor();
  assert.equal(await byTestId(tab, "strip-live").getAttribute("aria-pressed"), "false");
  [from, to] = await chart(tab);
  assert.ok(from < 0.1 && Math.abs(to - 5) < 0.2, `from ${from} to ${to}`);
  const box = await byTestId(tab, "strip-chart").boundingBox();
  const [x, y] = [box.x + 0.6 * box.width, box.y + 0.5 * box.height];
  await tab.mouse.move(x, y);
  await tab.mouse.wheel(0, -200);
  await tab.waitForFunction((before) => Number(document.querySelector("[data-testid=strip]").dataset.from) > before + 0.3, from);
  let zoomed = await chart(tab);
  assert.ok(zoomed[1] < to && zoomed[1] - zoomed[0] < to - from);
  await tab.mouse.down();
  await tab.mouse.move(x - 60, y, { steps: 4 });
  await tab.mouse.up();
  const panned = await chart(tab);
  assert.ok(panned[0] > zoomed[0] + 0.2, `${zoomed} to ${panned}`);

  // The cursor says time and values.
  await tab.mouse.move(x, y);
  const words = /^\d\d:\d\d:\d\d\.\d \(\d+\.\d s\)\s+F x \S+.*\s+F y \S+.*\s+F z \S+.* mN$/;
  assert.match(await byTestId(tab, "strip-cursor").innerText(), words);
  await byTestId(tab, "strip-chart").focus();
  await tab.keyboard.press("Shift+ArrowRight");
  assert.match(await byTestId(tab, "strip-cursor").innerText(), words);
  await tab.screenshot({ path: join(screenshots, "history.png") });

  // What is seen is what is saved, in SI.
  [from, to] = await chart(tab);
  const [download] = await Promise.all([tab.waitForEvent("download"), byTestId(tab, "strip-export").click()]);
  assert.match(download.suggestedFilename(), /^taxel-history-[\dT-]+Z\.csv$/);
  const lines = readFileSync(await download.path(), "utf8").trim().split("\n");
  const header = lines.findIndex((line) => !line.startsWith("#"));
  assert.match(lines[header - 1], /^# history from [\d.]+ s to [\d.]+ s in rows of 0\.1 s$/);
  assert.match(lines[header], /^time \[s\],clock \[s since 1970\],force_x min \[N\],.*moment_z max \[N m\],contacts min \[1\],.*,events$/);
  const times = lines.slice(header + 1).map(parseFloat);
  assert.ok(Math.abs(times[0] - from) < 0.11 && Math.abs(times.at(-1) - to) < 0.11, `${times[0]} to ${times.at(-1)}`);

  await byTestId(tab, "strip-live").click();
  await byTestId(tab, "strip-note").getByText("mN, last").waitFor();
  assert.deepEqual(complaints, []);
});

test("forced colours keep bars, keys and pressed buttons; lines of the axes differ in dashes", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context, { forcedColors: "active", colorScheme: "dark" });
  await badge(tab, "live");
  await byTestId(tab, "skin").waitFor();
  await moreFrames(tab, 5);
  await drawn(tab);
  const looks = await tab.evaluate(() => {
    const style = (selector) => [...document.querySelectorAll(selector)].map((element) => getComputedStyle(element));
    return {
      bar: style(".skin .bar")[0].backgroundImage,
      keys: style(".strip .line-key").map(({ backgroundImage, backgroundColor }) => [backgroundImage, backgroundColor].join(" ")),
      pressed: style("[data-testid=layer-z]")[0].backgroundColor,
      released: style("[data-testid=layer-x]")[0].backgroundColor,
    };
  });
  assert.match(looks.bar, /^linear-gradient/);
  assert.equal(new Set(looks.keys).size, 3, looks.keys.join("\n"));
  const dashes = looks.keys.map((key) => /\) 0(px|%), .*?(\d+)px/.exec(key)?.[2] ?? "solid");
  assert.equal(new Set(dashes).size, 3, dashes.join());
  assert.notEqual(looks.pressed, looks.released);
  // A theme that was chosen by hand gives way: its lines could lie on their own colour.
  await byTestId(tab, "help").click();
  await byTestId(tab, "theme").click();
  assert.equal(await byTestId(tab, "theme").innerText(), "Theme: light");
  assert.equal(await tab.evaluate(() => document.documentElement.dataset.theme), "dark");
  assert.deepEqual(complaints, []);
});

test("the history needs the token, and says what is wrong with a request", { skip: mock }, async (context) => {
  const { url } = await serve("quiet", context);
  const ask = (change) => {
    const address = new URL(url);
    address.pathname = "/history";
    for (const [key, value] of Object.entries(change)) address.searchParams.set(key, value);
    return fetch(address);
  };
  assert.equal((await ask({ token: "wrong" })).status, 401);
  const wrong = await ask({ points: "0" });
  assert.equal(wrong.status, 400);
  assert.match(await wrong.text(), /points is "0"; use a whole number from 1 to 10000/);
  const answer = await ask({ signals: "taxels", points: "10" });
  assert.equal((await answer.json()).signals.length, 64);
});

test("a source that stops is shown as stale within half a second, then as live again", async (context) => {
  const { url } = await serve("outage", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const seen = await tab.waitForFunction(
    () => {
      const { badge: state, badgeChangedAt, lastFrameAt } = window.taxelTest;
      return state === "stale" ? { delay: badgeChangedAt - lastFrameAt } : false;
    },
    undefined,
    { polling: 20 },
  );
  const { delay } = await seen.jsonValue();
  context.diagnostic(`stale after ${delay.toFixed(0)} ms`);
  assert.ok(delay > 0 && delay <= 500, `the badge turned stale ${delay} ms after the last frame`);
  assert.equal(await byTestId(tab, "badge").innerText(), "stale");
  assert.match(await byTestId(tab, "badge-detail").innerText(), /no frames for \d+\.\d s/);
  assert.match(await byTestId(tab, "announce").innerText(), /stale/);
  await tab.screenshot({ path: join(screenshots, "stale.png") });
  await badge(tab, "live");
  assert.deepEqual(complaints, []);
});

test("a wrong token is refused by page and socket, and the page says so", async (context) => {
  const { url } = await serve("quiet", context);
  const wrong = new URL(url);
  wrong.searchParams.set("token", "wrong");
  const { status } = await fetch(wrong);
  assert.equal(status, 401);
  const socketUrl = new URL(wrong);
  socketUrl.protocol = "ws:";
  socketUrl.pathname = "/ws";
  const answer = await new Promise((resolve) => {
    const socket = new WebSocket(socketUrl);
    socket.on("unexpected-response", (request, response) => {
      resolve(response.statusCode);
      request.destroy();
    });
    socket.on("open", () => resolve("opened"));
    socket.on("error", () => resolve("no answer"));
  });
  assert.equal(answer, 401);
  // A page that was loaded before, with a token that is not valid any more.
  const { tab } = await open(String(wrong), context, { prepare: fromDist, expectErrors: true });
  await badge(tab, "refused");
  await tab.getByText("refused: wrong token — use the URL printed by taxel live").first().waitFor();
  assert.equal(await byTestId(tab, "skin").count(), 0);
});

test("a server that is gone is shown as disconnected", async (context) => {
  const { url, stop } = await serve("quiet", context);
  const { tab } = await open(url, context, { expectErrors: true });
  await badge(tab, "live");
  await stop();
  await badge(tab, "disconnected");
  assert.equal(await byTestId(tab, "badge").innerText(), "disconnected");
  await byTestId(tab, "certainty").getByText("old").waitFor();
  assert.equal(await byTestId(tab, "skin").count(), 1);
});

test("a pressure map is one image with its unit; missing sensels are not drawn as zero", async (context) => {
  const { url } = await serve("map", context);
  const { tab, complaints } = await open(url, context);
  await byTestId(tab, "skin").waitFor();
  await tab.waitForFunction(
    () => Number(document.querySelector('[data-testid="skin"]').dataset.max) > 0,
  );
  const unit = await tab.locator(".scale .unit").innerText();
  await byTestId(tab, "strip").waitFor();
  await tab.evaluate(() => document.getElementById("replay-play")?.click());
  if (!mock) await badge(tab, "paused");
  await byTestId(tab, "layer-value").click();
  await drawn(tab);
  // Walks over all sensels by key until there is one that is missing and one that reads zero.
  const found = await byTestId(tab, "skin").evaluate((canvas) => {
    const press = (key) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
    const inspector = document.querySelector('[data-testid="inspect"]');
    const place = () => /row (\d+), column (\d+)/.exec(inspector.textContent).slice(1).map(Number);
    const kinds = {};
    press("PageUp");
    press("PageDown");
    press("End");
    const [lastRow, lastColumn] = place();
    press("PageUp");
    for (let row = 0; row <= lastRow; row++) {
      press("Home");
      for (let column = 0; column <= lastColumn; column++) {
        if (/no value/.test(inspector.textContent)) kinds.missing ??= place();
        else if (/(Value|Pressure)0(\.0+)? /.test(inspector.textContent)) kinds.zero ??= place();
        press("ArrowRight");
      }
      press("ArrowDown");
    }
    press("Escape");
    return { ...kinds, rows: lastRow + 1, columns: lastColumn + 1 };
  });
  assert.ok(found.missing !== undefined, "the recording has no missing sensel");
  assert.ok(found.zero !== undefined, "the recording has no sensel that reads zero");
  await drawn(tab);
  const colour = ([row, column]) =>
    byTestId(tab, "skin").evaluate(
      (canvas, cell) => {
        const [width, height] = [canvas.width / cell.columns, canvas.height / cell.rows];
        const size = Math.max(1, Math.floor(width / 2));
        const [x, y] = [(cell.column + 0.25) * width, (cell.row + 0.25) * height];
        const { data } = canvas.getContext("2d").getImageData(x, y, size, size);
        const sum = [0, 0, 0];
        data.forEach((value, index) => index % 4 < 3 && (sum[index % 4] += value));
        return sum.map((value) => (4 * value) / data.length);
      },
      { row, column, rows: found.rows, columns: found.columns },
    );
  const [missing, zero] = [await colour(found.missing), await colour(found.zero)];
  const difference = Math.hypot(...missing.map((value, channel) => value - zero[channel]));
  assert.ok(difference > 40, `missing ${missing} and zero ${zero} look alike`);
  assert.match(await byTestId(tab, "total-force").innerText(), new RegExp(`\\d[^]*(${unit}|N)`));
  await tab.screenshot({ path: join(screenshots, "map-1366x768.png") });
  assert.deepEqual(complaints, []);
});

/** Mean colour of a square of a taxel, its place and size in parts of the taxel. */
const colourAt = (tab, [row, column], [x, y, size], [rows, columns] = [2, 4]) =>
  byTestId(tab, "skin").evaluate(
    (canvas, at) => {
      const [width, height] = [canvas.width / at.columns, canvas.height / at.rows];
      const side = Math.max(1, Math.floor(at.size * Math.min(width, height)));
      const left = Math.round((at.column + at.x) * width - side / 2);
      const top = Math.round((at.row + at.y) * height - side / 2);
      const { data } = canvas.getContext("2d").getImageData(left, top, side, side);
      const sum = [0, 0, 0];
      data.forEach((value, index) => index % 4 < 3 && (sum[index % 4] += value));
      return sum.map((value) => (4 * value) / data.length);
    },
    { row, column, x, y, size, rows, columns },
  );

test("one component: image in colours of heat, ambiguous taxels plain to see, a bound is said", async (context) => {
  const { url } = await serve("heat", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "skin").waitFor();
  await byTestId(tab, "tab-channels").click();
  await byTestId(tab, "channels").getByText("ohm").first().waitFor();
  const channels = await byTestId(tab, "channels").innerText();
  for (const name of ["row 0", "row 1", "column 0", "column 3"]) assert.match(channels, new RegExp(`${name}\\s+\\d+\\.\\d+\\s+m?ohm`));
  // Someone presses: a row and its numbers grow.
  await reaches(tab, 20e3);
  assert.match(await byTestId(tab, "total-force").innerText(), /[\d.]+\s*mN/);
  await tab.keyboard.press("?");
  assert.match(await tab.locator(".legend").innerText(), /one of several positions that explain the readings equally well/);
  await tab.keyboard.press("?");
  await byTestId(tab, "pause").click();
  await drawn(tab);
  // The disc of the mark is dark, its question mark bright; without a value the ground is not a colour of the map.
  const ground = await colourAt(tab, [1, 1], [0.85, 0.85, 0.04]);
  const disc = await colourAt(tab, [1, 1], [0.5, 0.5, 0.3]);
  assert.ok(Math.min(...ground) > 180, `ground ${ground}`);
  assert.ok(ground[0] - disc[0] > 60, `mark ${disc} on ${ground}`);
  await byTestId(tab, "skin").focus();
  for (const key of ["Home", "ArrowDown", "ArrowRight"]) await tab.keyboard.press(key);
  await byTestId(tab, "inspect").getByText("row 1, column 1").waitFor();
  assert.match(await inspected(tab), /ambiguous: one of several positions.* Pressure no value/);
  for (const key of ["ArrowRight", "ArrowUp"]) await tab.keyboard.press(key);
  await byTestId(tab, "inspect").getByText("row 0, column 2").waitFor();
  assert.match(await inspected(tab), /saturated: .* a bound Pressure [\d.]+/);
  assert.deepEqual(complaints, []);
});

test("one component in grey: black is nothing, white the full scale of either sign", async (context) => {
  const { url } = await serve("grey", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "skin").waitFor();
  // Until a taxel reads a large negative value, which is as bright as a positive one.
  await byTestId(tab, "skin").focus();
  for (const key of ["Home", "PageDown", "ArrowRight"]) await tab.keyboard.press(key);
  await tab.waitForFunction(() => /Change of force\u22120?\.?[4-9]\d*|Change of force\u2212\d{3}/.test(document.querySelector("[data-testid=inspect]").textContent));
  await byTestId(tab, "pause").click();
  await drawn(tab);
  const bright = await colourAt(tab, [1, 1], [0.12, 0.88, 0.06]);
  const dark = await colourAt(tab, [0, 3], [0.12, 0.88, 0.06]);
  for (const colour of [bright, dark]) assert.ok(Math.max(...colour) - Math.min(...colour) < 2, `${colour} is not a grey`);
  assert.ok(bright[0] > 25 && dark[0] < 25, `bright ${bright}, dark ${dark}`);
  assert.match(await byTestId(tab, "total-force").innerText(), /Largest change of force/);
  assert.match(await byTestId(tab, "strip-note").innerText(), /V, last 10 s$/);
  assert.deepEqual(complaints, []);
});

test("a cylinder turns by button, key and pointer, and its far side is not seen", { skip: mock }, async (context) => {
  const { url } = await serveDevice("piezo-sleeve", "touched", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const image = byTestId(tab, "skin");
  await image.waitFor();
  await moreFrames(tab, 5);
  const { width, height } = await image.boundingBox();
  const left = async () => {
    await image.hover({ position: { x: 0.1 * width, y: 0.25 * height } });
    return (await byTestId(tab, "skin-foot").getByText(/^sensel \d/).innerText()).match(/sensel \d/)[0];
  };
  assert.equal(await left(), "sensel 1");
  for (let step = 0; step < 4; step++) await byTestId(tab, "turn-left").click();
  assert.equal(await left(), "sensel 3");
  await image.focus();
  for (let step = 0; step < 4; step++) await tab.keyboard.press(".");
  assert.equal(await left(), "sensel 1");
  assert.ok(Math.abs(Number(await image.getAttribute("data-turn"))) < 1e-3);
  const box = await image.boundingBox();
  await tab.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
  await tab.mouse.down();
  await tab.mouse.move(box.x + 0.8 * box.width, box.y + 0.5 * box.height, { steps: 6 });
  await tab.mouse.up();
  assert.ok(Number(await image.getAttribute("data-turn")) > 0.4);
  assert.deepEqual(complaints, []);
});

test("a single taxel is a gauge; its overload is a bound", { skip: mock }, async (context) => {
  const { url } = await serveDevice("in-plane-50um", "touched", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  assert.equal(await byTestId(tab, "skin").count(), 0);
  await tab.waitForFunction(() => /^1[12]\.\d+ .*full scale 61\.\d+ N/.test(document.querySelector("[data-testid=gauge]")?.getAttribute("aria-label") ?? ""));
  await byTestId(tab, "certainty").getByText("exact").waitFor();
  assert.deepEqual(complaints, []);
});

test("a raw board is a table of its channels by name, sorted, filtered and charted", { skip: mock }, async (context) => {
  const { url } = await serveDevice("six-pads", "fault", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const rows = byTestId(tab, "channels").locator("tbody tr:visible");
  await rows.first().waitFor();
  const names = () => rows.locator("th").allInnerTexts();
  assert.deepEqual(await names(), ["thumb", "index", "middle", "ring", "little", "palm"]);
  assert.equal(await byTestId(tab, "tab-channels").isVisible(), false);
  // Which one is broken: the chip of the header, the row, and the first when sorted by state.
  await byTestId(tab, "condition").getByText(/^ring /).waitFor();
  await tab.waitForFunction(() => document.querySelectorAll("[data-testid=channels] tr.bad").length === 1);
  await byTestId(tab, "sort-state").click();
  assert.equal((await names())[0], "ring");
  await byTestId(tab, "sort-name").click();
  assert.deepEqual(await names(), ["index", "little", "middle", "palm", "ring", "thumb"]);
  await byTestId(tab, "channel-filter").fill("mid");
  assert.deepEqual(await names(), ["middle"]);
  const chosen = byTestId(tab, "now-channels").locator("dt");
  assert.equal(await chosen.count(), 6);
  await rows.first().getByRole("button", { name: "Chart middle" }).click();
  await tab.waitForFunction(() => document.querySelectorAll("[data-testid=now-channels] dt").length === 5);
  assert.deepEqual(await chosen.allInnerTexts(), ["thumb", "index", "ring", "little", "palm"]);
  assert.match(await byTestId(tab, "strip-note").innerText(), /^counts, last 10 s$/);
  assert.deepEqual(complaints, []);
});

test("what a board sends becomes a page of its channels by one command", { skip: mock }, async (context) => {
  const folder = mkdtempSync(join(tmpdir(), "taxel-listen-"));
  const board = join(folder, "board.toml");
  const device = `exec:node '${join(tests, "devices/six-pads.mjs")}' touched`;
  const server = await started(program(), ["listen", device, "--seconds", "3", "-o", board, "--live", "--port", "0"]);
  context.after(async () => {
    await server.stop();
    rmSync(folder, { recursive: true });
  });
  const { tab, complaints } = await open(server.url, context);
  await badge(tab, "live");
  const rows = byTestId(tab, "channels").locator("tbody tr:visible");
  await rows.first().waitFor();
  // The counter that stands first is none of them.
  assert.equal(await rows.count(), 6);
  assert.match(readFileSync(board, "utf8"), /\{sequence\},\{value c/);
  assert.deepEqual(complaints, []);
});

test("a run is recorded from the page, and no notice moves a button", { skip: mock }, async (context) => {
  const folder = mkdtempSync(join(tmpdir(), "taxel-page-"));
  context.after(() => rmSync(folder, { recursive: true }));
  const { url } = await serve("quiet", context, ["--record-folder", folder]);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const places = () =>
    tab.evaluate(() => [...document.querySelectorAll("main button, header button")].filter((button) => button.checkVisibility() && button.closest(".bar-of-words") === null).map((button) => [button.dataset.testid, Math.round(button.getBoundingClientRect().x), Math.round(button.getBoundingClientRect().y)]));
  /** To a pixel: positions are rounded. */
  const unmoved = (now) => now.forEach(([name, x, y], at) => assert.ok(Math.hypot(x - before[at][1], y - before[at][2]) < 1.5 && name === before[at][0], `${name} is at ${x}, ${y}, was at ${before[at]}`));
  await byTestId(tab, "record").waitFor();
  const before = await places();
  const record = async (name) => {
    await byTestId(tab, "record").click();
    await byTestId(tab, "record-name").fill(name);
    await tab.keyboard.press("Enter");
  };
  await record("../elsewhere");
  await byTestId(tab, "notice").getByText(/is no name of a recording/).waitFor();
  unmoved(await places());
  await record("grasp 1");
  const chip = byTestId(tab, "recording");
  await chip.getByText(/^● 00:0[1-9] grasp 1\.mcap, [\d.]+ [kM]?B, [\d.]+ [GT]B free$/).waitFor();
  unmoved(await places());
  await byTestId(tab, "record").click();
  await chip.waitFor({ state: "hidden" });
  assert.deepEqual(readdirSync(folder), ["grasp 1.mcap"]);
  assert.ok(statSync(join(folder, "grasp 1.mcap")).size > 10_000);
  // A file that exists is not replaced.
  await record("grasp 1");
  await byTestId(tab, "notice").getByText(/grasp 1\.mcap: cannot be made/).waitFor();
  assert.deepEqual(complaints, []);
});

test("a replay is paused, stepped, sought, looped and watched to its end", { skip: mock }, async (context) => {
  const { url } = await serveDevice("three-axis-8x8", "ended", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "ended");
  const at = async () => parseFloat(await byTestId(tab, "replay-time").innerText());
  assert.ok((await at()) > 2.9);
  // The touch of the recording stands on the bar.
  await byTestId(tab, "replay-events").locator(".sign").first().waitFor({ state: "attached" });
  await byTestId(tab, "replay-speed").selectOption("0.25");
  await byTestId(tab, "replay-begin").click();
  await badge(tab, "live");
  await tab.waitForFunction(() => parseFloat(document.getElementById("replay-time").textContent) < 0.5);
  await byTestId(tab, "replay-play").click();
  await badge(tab, "paused");
  const frames = await tab.evaluate(() => window.taxelTest.frames);
  for (let step = 1; step <= 3; step++) {
    await byTestId(tab, "replay-step").click();
    await tab.waitForFunction((wanted) => window.taxelTest.frames >= wanted, frames + step);
  }
  assert.equal(await tab.evaluate(() => window.taxelTest.frames), frames + 3);
  await byTestId(tab, "replay-at").evaluate((slider) => {
    slider.value = "900";
    slider.dispatchEvent(new Event("change"));
  });
  await tab.waitForFunction(() => parseFloat(document.getElementById("replay-time").textContent) > 2.6);
  await badge(tab, "paused");
  await byTestId(tab, "replay-loop").click();
  await tab.waitForFunction(() => document.getElementById("replay-loop").getAttribute("aria-pressed") === "true");
  await byTestId(tab, "replay-speed").selectOption("5");
  await byTestId(tab, "replay-play").click();
  // It comes round: from before the end to near the beginning.
  await tab.waitForFunction(() => parseFloat(document.getElementById("replay-time").textContent) < 1);
  assert.deepEqual(complaints, []);
});

test("several sensors have a page each, and one that is absent does not stop the others", { skip: mock }, async (context) => {
  const board = join(tests, "devices/six-pads.toml");
  const devices = ["liquid-metal-2x4", "in-plane-50um", "--source", "tcp:127.0.0.1:9", "--source", "sim:press", "--board", board];
  const { url, stop } = await started(program(), ["live", ...devices, "--port", "0"]);
  context.after(stop);
  const { tab, complaints } = await open(url, context);
  await byTestId(tab, "sensors").getByText("stale").waitFor();
  assert.equal(await byTestId(tab, "name").innerText(), "liquid-metal microchannel array 2x4");
  assert.match(await byTestId(tab, "badge-detail").innerText(), /127\.0\.0\.1:9 is (absent|opening)/);
  await byTestId(tab, "sensors").getByText("in-plane capacitive sensor, 50 um").click();
  await tab.waitForURL(/\/2\/\?token=/);
  await badge(tab, "live");
  await byTestId(tab, "gauge").waitFor();
  // Its history and drawing are its own.
  await tab.waitForFunction(() => Number(document.querySelector("[data-testid=strip]").dataset.points) > 20);
  await byTestId(tab, "drawing").click();
  await tab.waitForFunction(() => document.getElementById("drawing-image").naturalWidth > 0);
  const other = new URL("/2/history", url);
  assert.equal((await fetch(other)).status, 401);
  assert.deepEqual(complaints, []);
});

test("the total says whether it is exact, a bound, or not known", async (context) => {
  for (const [certainty, words, figure, spread] of [
    ["0", "exact", /^[\d.]+ mN ± [\d.]+$/, /± /],
    ["1", "at least", /^≥ [\d.]+ mN$/, /^$/],
    ["2", "not known", /^– mN$/, /^$/],
    ["none", "no zero yet", /^– mN$/, /^$/],
  ]) {
    const { url, stop } = await started(process.execPath, [join(tests, "mock-server.mjs"), "--kind", "1", "--certainty", certainty]);
    context.after(stop);
    const { tab, complaints } = await open(url, context);
    await badge(tab, "live");
    await byTestId(tab, "certainty").getByText(words, { exact: true }).waitFor();
    // While a finger presses; what is not known has no number at all.
    await tab.waitForFunction((source) => new RegExp(source).test(document.querySelector(".figure").innerText.replace(/\s+/g, " ").replace("\u2212", "").trim()), figure.source);
    assert.match(await byTestId(tab, "total-deviation").innerText(), spread);
    const reason = await byTestId(tab, "certainty-reason").innerText();
    if (certainty === "1" || certainty === "2") assert.match(reason, /saturated: at the end of what can be read/);
    // Before there is a zero no taxel has a colour of a value.
    const max = await byTestId(tab, "skin").getAttribute("data-max");
    assert.equal(max === "", certainty === "none");
    assert.deepEqual(complaints, []);
    await stop();
  }
});

test("the drawing of the device opens by button and key, and a recording without one has no button", async (context) => {
  for (const name of ["finger", "heat"]) {
    const { url } = await serve(name, context);
    const { tab, complaints } = await open(url, context);
    await badge(tab, "live");
    const dialog = byTestId(tab, "drawing-dialog");
    assert.equal(await dialog.isVisible(), false);
    await byTestId(tab, "drawing").click();
    await dialog.waitFor();
    const image = byTestId(tab, "drawing-image");
    await tab.waitForFunction(() => document.getElementById("drawing-image").naturalWidth > 0);
    const device = await byTestId(tab, "name").innerText();
    assert.ok((await image.getAttribute("alt")).includes(device));
    const { width, height } = await image.boundingBox();
    assert.ok(width > 300 && height > 300, `the drawing is ${width} x ${height}`);
    await drawn(tab);
    await tab.screenshot({ path: join(screenshots, `drawing-${name}.png`) });
    // Other keys do nothing behind it.
    await tab.keyboard.press("p");
    assert.equal(await byTestId(tab, "pause").getAttribute("aria-pressed"), "false");
    await tab.keyboard.press("Escape");
    await dialog.waitFor({ state: "hidden" });
    await tab.keyboard.press("d");
    await dialog.waitFor();
    await byTestId(tab, "drawing-close").click();
    await dialog.waitFor({ state: "hidden" });
    assert.deepEqual(complaints, []);
  }
  const { url } = await serve("map", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  assert.equal(await byTestId(tab, "drawing").isVisible(), false);
  await tab.keyboard.press("d");
  assert.equal(await byTestId(tab, "drawing-dialog").isVisible(), false);
  assert.deepEqual(complaints, []);
});

test("freeze keeps the image while counting goes on", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await moreFrames(tab, 5);
  await byTestId(tab, "layer-readings").click();
  await byTestId(tab, "pause").click();
  await drawn(tab);
  const frozen = await skinPixels(tab);
  const total = await byTestId(tab, "total-force").innerText();
  await moreFrames(tab, 12);
  assert.equal(await skinPixels(tab), frozen);
  assert.equal(await byTestId(tab, "total-force").innerText(), total);
  await tab.keyboard.press("5");
  assert.match(await byTestId(tab, "frame-rate").innerText(), /^\d/);
  assert.equal(await byTestId(tab, "badge").innerText(), "live");
  await tab.keyboard.press("p");
  await tab.waitForFunction((old) => document.querySelector("[data-testid=skin]").toDataURL() !== old, frozen);
  assert.deepEqual(complaints, []);
});

test("a limit can be typed, in the unit that is shown, and stays until it is let go", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await reaches(tab, 1.5e-3);
  await byTestId(tab, "limit-high").fill("1");
  await byTestId(tab, "limit-high").press("Enter");
  // The typed limit stands when a value above it is drawn.
  await tab.waitForFunction(() => {
    const { high, max } = document.querySelector("[data-testid=skin]").dataset;
    return Number(high) === 1e-3 && Number(max) > 1e-3;
  });
  assert.equal(await byTestId(tab, "follow").getAttribute("aria-pressed"), "true");
  await moreFrames(tab, 20);
  assert.deepEqual(await limits(tab), [0, 1e-3]);
  await byTestId(tab, "skin").focus();
  await tab.keyboard.press("l");
  await tab.waitForFunction(() => Number(document.querySelector("[data-testid=skin]").dataset.high) > 1e-3);
  assert.equal(await byTestId(tab, "follow").getAttribute("aria-pressed"), "false");
  await byTestId(tab, "layer-change").click();
  await tab.waitForFunction(() => document.querySelector("[data-testid=skin]").dataset.low.startsWith("-"));
  assert.deepEqual(complaints, []);
});

test("every control is reached by key with a visible focus", async (context) => {
  const { url } = await serve("finger", context);
  const { tab } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await byTestId(tab, "skin").waitFor();
  const reached = new Set();
  for (let step = 0; step < 60; step++) {
    await tab.keyboard.press("Tab");
    const focus = await tab.evaluate(() => {
      const { activeElement } = document;
      const { outlineStyle, outlineWidth } = getComputedStyle(activeElement);
      const visible = outlineStyle !== "none" && parseFloat(outlineWidth) >= 2;
      const name = activeElement.getAttribute("aria-label") ?? activeElement.textContent.trim();
      return { id: activeElement.dataset.testid, visible, name, body: activeElement === document.body };
    });
    if (focus.body) continue;
    assert.ok(focus.visible, `the focus on ${focus.id ?? focus.name} cannot be seen`);
    assert.notEqual(focus.name, "", `${focus.id} has no name`);
    if (focus.id !== undefined) reached.add(focus.id);
  }
  const wanted = ["strip-zoom-out", "strip-zoom-in", "strip-live", "strip-export", "strip-chart", "tab-events", "event-filter", "events", "badge", "tare", "pause", "mark", "help", "drawing", "skin", "follow", "limit-low", "limit-high", ...LAYERS.map((id) => `layer-${id}`)];
  const missing = wanted.filter((id) => !reached.has(id));
  assert.deepEqual(missing, []);
});


test("light and dark follow system and switch; keys are listed by the question mark", async (context) => {
  const { url } = await serve("quiet", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  const brightness = () =>
    tab.evaluate(() => {
      const [red, green, blue] = getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number);
      return (red + green + blue) / 3;
    });
  assert.ok((await brightness()) > 200);
  await tab.emulateMedia({ colorScheme: "dark" });
  await tab.waitForFunction(() => document.documentElement.dataset.theme === "dark");
  assert.ok((await brightness()) < 60);
  await tab.keyboard.press("?");
  await byTestId(tab, "help-dialog").getByText("tare: take the next frames as rest").waitFor();
  for (const [words, least, most] of [["Theme: light", 200, 255], ["Theme: dark", 0, 60]]) {
    await byTestId(tab, "theme").click();
    assert.equal(await byTestId(tab, "theme").innerText(), words);
    const found = await brightness();
    assert.ok(found >= least && found <= most, `${words}: ${found}`);
  }
  await tab.keyboard.press("Escape");
  assert.equal(await byTestId(tab, "help-dialog").isVisible(), false);
  assert.deepEqual(complaints, []);
});
