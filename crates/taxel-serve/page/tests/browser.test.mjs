// The page in a browser, against the real server or, with TAXEL_MOCK=1, against the mock.
//
//   TAXEL       the program (default: target/release/taxel, else target/debug/taxel)
//   SENSOR      sensor file of the three-axis array (default: the one in crates/taxel/sensors/ that has the element)
//   RECORDING   recording of a pressure map (default: crates/taxel-recording/tests/recordings/fingertip.csv)
//   CHROMIUM    browser (default: /usr/bin/chromium)
//
// Screenshots are written to tests/screenshots/.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";
import WebSocket from "ws";

const tests = dirname(fileURLToPath(import.meta.url));
const page = join(tests, "..");
const repository = join(page, "../../..");
const screenshots = join(tests, "screenshots");
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

const LIGHT = { width: 1366, height: 768 };
const BROWSER_ARGUMENTS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

let browser;

before(async () => {
  mkdirSync(screenshots, { recursive: true });
  const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";
  browser = await chromium.launch({ executablePath, args: BROWSER_ARGUMENTS });
});

after(() => browser?.close());

function existing(path, what) {
  if (!existsSync(path)) throw new Error(`${what} is missing: ${path}`);
  return path;
}

function script(name) {
  return existing(join(tests, "scripts", `${name}.toml`), "the script of the simulated source");
}

function recording() {
  const committed = join(repository, "crates/taxel-recording/tests/recordings/fingertip.csv");
  return existing(process.env.RECORDING ?? committed, "the recording of a pressure map");
}

function program() {
  const built = ["release", "debug"].map((profile) => join(repository, "target", profile, "taxel"));
  return existing(process.env.TAXEL ?? built.find(existsSync) ?? built[0], "the program taxel");
}

function sensor() {
  if (process.env.SENSOR !== undefined) return existing(process.env.SENSOR, "the sensor file");
  const folder = existing(join(repository, "crates/taxel/sensors"), "the folder of sensor files");
  const files = readdirSync(folder).filter((name) => name.endsWith(".toml"));
  const name = files.find((file) =>
    readFileSync(join(folder, file), "utf8").includes("[element.three_axis_capacitor"),
  );
  if (name === undefined) throw new Error(`no file in ${folder} has a three_axis_capacitor`);
  return join(folder, name);
}

/** Starts the server of a case; gives its URL, and a function that ends it. */
async function serve(name, context) {
  const { source, options = [], mock: mockArguments, describesItself, mockOnly } = CASES[name];
  const [command, ...commandArguments] = mock || mockOnly
    ? [process.execPath, join(tests, "mock-server.mjs"), ...mockArguments]
    : [program(), "live", ...(describesItself ? [] : [sensor()]), "--port", "0", "--source", source(), ...options];
  const server = spawn(command, commandArguments, { stdio: ["ignore", "pipe", "pipe"] });
  const exited = new Promise((resolve) => server.once("exit", resolve));
  let errors = "";
  server.stderr.on("data", (text) => (errors += text));
  const stop = async () => {
    if (server.exitCode === null && server.signalCode === null) server.kill("SIGKILL");
    await exited;
  };
  context.after(stop);
  const url = await new Promise((resolve, reject) => {
    createInterface({ input: server.stdout }).on("line", (line) => {
      const found = /http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]+/i.exec(line);
      if (found !== null) resolve(found[0]);
    });
    exited.then((code) =>
      reject(new Error(`the server ended with ${code} before it named its URL\n${errors}`)),
    );
    setTimeout(
      () => reject(new Error(`the server did not name its URL within 20 s\n${errors}`)),
      20_000,
    ).unref();
  });
  return { url, stop };
}

/** Opens a page in a fresh context; requests elsewhere and errors are complaints. */
async function open(url, context, settings = {}) {
  const { expectErrors = false, prepare, ...contextSettings } = settings;
  const browserContext = await browser.newContext({
    viewport: LIGHT,
    colorScheme: "light",
    ...contextSettings,
  });
  const tab = await browserContext.newPage();
  tab.setDefaultTimeout(15_000);
  const complaints = [];
  tab.on("pageerror", (error) => complaints.push(`uncaught: ${error.message}`));
  tab.on("console", (message) => {
    if (message.type() === "error" && !expectErrors) complaints.push(`console: ${message.text()}`);
  });
  tab.on("request", (request) => {
    const { protocol, host } = new URL(request.url());
    if (protocol !== "data:" && host !== new URL(url).host)
      complaints.push(`foreign request: ${request.url()}`);
  });
  await prepare?.(tab);
  const response = await tab.goto(url);
  context.after(() => browserContext.close());
  return { tab, response, complaints };
}

const byTestId = (tab, id) => tab.locator(`[data-testid="${id}"]`);
const FORCE_IMAGES = ["image-fx", "image-fy", "image-fz"];
const IMAGES = ["image-raw", ...FORCE_IMAGES];

const badge = (tab, state) =>
  tab.waitForFunction((wanted) => window.taxelTest.badge === wanted, state, { polling: 20 });

/** Waits until this many more frames arrived. */
async function moreFrames(tab, count) {
  const from = await tab.evaluate(() => window.taxelTest.frames);
  await tab.waitForFunction((wanted) => window.taxelTest.frames >= wanted, from + count, { polling: 20 });
}

/** Waits until the page has drawn what it was asked to. */
const drawn = (tab) =>
  tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

const pixels = (tab, id) => byTestId(tab, id).evaluate((canvas) => canvas.toDataURL());
const limits = (tab) =>
  tab.evaluate((ids) => {
    const canvases = ids.map((id) => document.querySelector(`[data-testid="${id}"]`));
    return canvases.map((canvas) => [canvas.dataset.low, canvas.dataset.high]);
  }, IMAGES);

/** Text of the inspector on one line. */
const inspected = async (tab) => (await byTestId(tab, "inspect").innerText()).replace(/\s+/g, " ");

/** Waits for the end of the rest capture at the start: before it the scatter of the gaps reads as forces. */
async function rested(tab) {
  if (mock) return;
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: done");
}

test("four images appear and change while a finger moves", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  const before = {};
  for (const id of IMAGES) {
    await byTestId(tab, id).waitFor();
    const { width, height } = await byTestId(tab, id).boundingBox();
    assert.ok(width >= 200 && height >= 200, `${id} is only ${width} x ${height}`);
    before[id] = await pixels(tab, id);
  }
  for (const id of IMAGES) {
    await tab.waitForFunction(
      ([name, old]) => document.querySelector(`[data-testid="${name}"]`).toDataURL() !== old,
      [id, before[id]],
    );
  }
  // The finger comes and goes: between its extremes the force grows by more than noise.
  await tab.waitForFunction(
    (ids) => {
      const seen = (window.seen ??= {});
      return ids.every((id) => {
        const value = Number(document.querySelector(`[data-testid="${id}"]`).dataset.max);
        if (!(value >= 0)) return false;
        const [low, high] = seen[id] ?? [value, value];
        seen[id] = [Math.min(low, value), Math.max(high, value)];
        return seen[id][1] > 0.5 && seen[id][1] > 1.3 * seen[id][0];
      });
    },
    FORCE_IMAGES,
    { polling: 30, timeout: 20_000 },
  );
  assert.match(await byTestId(tab, "total-force").innerText(), /[\d.]+ ± [\d.]+[^]*mN/);
  assert.match(await byTestId(tab, "frame-rate").innerText(), /^\d+\.\d\s*Hz$/);
  assert.match(await byTestId(tab, "latency").innerText(), /\d\s*max\s*\d[\d.]*\s*ms$/);
  assert.match(await byTestId(tab, "lost").innerText(), /^\d+$/);
  assert.deepEqual(complaints, []);
});

test("mouse, keys and touch inspect a taxel", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context, { hasTouch: true });
  await badge(tab, "live");
  await rested(tab);
  const everything = new RegExp(
    "row 2, column 3 .*mN ± σ F ?x .*± .*F ?y .*± .*F ?z .*±.* fF .*C ?11 .*C ?12 .*C ?21 .*C ?22 .*" +
      "Residual .* Closed .* Faulty",
  );
  const image = byTestId(tab, "image-fz");
  const { width, height } = await image.boundingBox();
  await image.hover({ position: { x: (3.5 / 8) * width, y: (2.5 / 8) * height } });
  await byTestId(tab, "inspect").getByText("row 2, column 3").waitFor();
  assert.match(await inspected(tab), everything);
  assert.notEqual(await byTestId(tab, "inspect-state").innerText(), "");
  await byTestId(tab, "tare").hover();
  await byTestId(tab, "inspect").getByText("Point at a taxel").waitFor();

  await byTestId(tab, "image-fx").focus();
  for (const key of [
    "ArrowDown",
    "ArrowDown",
    "ArrowDown",
    "ArrowRight",
    "ArrowRight",
    "ArrowRight",
    "ArrowRight",
  ]) {
    await tab.keyboard.press(key);
  }
  // The first key selects the first taxel.
  await byTestId(tab, "inspect").getByText("row 2, column 4").waitFor();
  await tab.keyboard.press("ArrowLeft");
  await byTestId(tab, "inspect").getByText("row 2, column 3").waitFor();
  assert.match(await inspected(tab), everything);
  await tab.keyboard.press("End");
  await tab.keyboard.press("PageDown");
  await byTestId(tab, "inspect").getByText("row 7, column 7").waitFor();
  await tab.keyboard.press("Escape");
  await byTestId(tab, "inspect").getByText("Point at a taxel").waitFor();

  const box = await byTestId(tab, "image-raw").boundingBox();
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
  // The twin's gaps scatter by 3 %: without rest values nothing reads as a few millinewtons.
  const largest = async () => Number(await byTestId(tab, "image-fz").getAttribute("data-max"));
  if (!mock) assert.ok((await largest()) > 0.5, "forces before the rest capture");
  await byTestId(tab, "tare").click();
  await tab.waitForFunction(() => document.getElementById("tare-state").textContent === "tare: done");
  await moreFrames(tab, 2);
  if (!mock) assert.ok((await largest()) < 0.3, "no force after the rest capture");
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
  await tab.waitForFunction(() => Number(document.querySelector('[data-testid="image-fz"]').dataset.max) > 14);
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
  await byTestId(tab, "image-fz").focus();
  for (const key of ["Home", ...Array(3).fill("ArrowDown"), ...Array(3).fill("ArrowRight")]) await tab.keyboard.press(key);
  await tab.waitForFunction(() => /below zero: /.test(document.querySelector("[data-testid=inspect]").textContent));
  await drawn(tab);
  // The ground of the cell beside it is the colour of no value: the low end of the map would say zero.
  const ground = () =>
    byTestId(tab, "image-fz").evaluate((canvas) => {
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
  assert.match(await rows.last().innerText(), /^\d+\.\d\d s\s+1\s+touch\s+[\d.]+ ± [\d.]+ mN$/);
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

test("the clock of a board stands beside the state of its link, with its bound", { skip: mock }, async (context) => {
  const { url } = await serve("linked", context);
  const { tab, complaints } = await open(url, context);
  const clock = tab.getByTestId("clock");
  await clock.waitFor();
  assert.match(await clock.textContent(), /^clock (\d+\.\d ppm (fast|slow)|rate not known yet), .*\d\.\d\d ms/);
  assert.match(await clock.getAttribute("title"), /by the clock of the board was/);
  for (const [name, width, scheme] of [["light", 1366, "light"], ["dark", 1366, "dark"], ["narrow", 390, "light"]]) {
    await tab.setViewportSize({ width, height: width === 390 ? 844 : 768 });
    await tab.emulateMedia({ colorScheme: scheme });
    await tab.waitForTimeout(200);
    assert.ok(await tab.evaluate(() => document.documentElement.scrollWidth <= innerWidth), name);
    await tab.screenshot({ path: join(screenshots, `clock-${name}.png`) });
  }
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
  const { width, height } = await map.boundingBox();
  await map.hover({ position: { x: (2.5 / 8) * width, y: (2.5 / 8) * height } });
  await byTestId(tab, "inspect-condition").getByText("r2c2.22: the same reading").waitFor();
  // Arrow keys go from tab to tab.
  await byTestId(tab, "tab-condition").focus();
  await tab.keyboard.press("ArrowRight");
  assert.equal(await byTestId(tab, "tab-events").getAttribute("aria-selected"), "true");
  assert.deepEqual(complaints, []);
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
  const reaches = (least) =>
    tab.waitForFunction((wanted) => Number(document.querySelector("[data-testid=strip]").dataset.points) > wanted, least);
  await reaches(100);
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
  await byTestId(tab, "image-fz").waitFor();
  await moreFrames(tab, 5);
  await drawn(tab);
  const looks = await tab.evaluate(() => {
    const style = (selector) => [...document.querySelectorAll(selector)].map((element) => getComputedStyle(element));
    return {
      bars: style(".panel .bar").map(({ backgroundImage }) => backgroundImage),
      keys: style(".strip .line-key").map(({ backgroundImage, backgroundColor }) => [backgroundImage, backgroundColor].join(" ")),
      pressed: style("[data-testid=raw-absolute]")[0].backgroundColor,
      released: style("[data-testid=raw-change]")[0].backgroundColor,
      theme: document.documentElement.dataset.theme,
    };
  });
  assert.equal(looks.bars.length, 4);
  for (const bar of looks.bars) assert.match(bar, /^linear-gradient/);
  assert.equal(new Set(looks.keys).size, 3, looks.keys.join("\n"));
  const dashes = looks.keys.map((key) => /\) 0(px|%), .*?(\d+)px/.exec(key)?.[2] ?? "solid");
  assert.equal(new Set(dashes).size, 3, dashes.join());
  assert.notEqual(looks.pressed, looks.released);
  // A theme that was chosen by hand gives way: its lines could lie on their own colour.
  await byTestId(tab, "theme").click();
  assert.equal(await byTestId(tab, "theme").innerText(), "Theme: light");
  assert.equal(await tab.evaluate(() => document.documentElement.dataset.theme), "dark");
  await tab.screenshot({ path: join(screenshots, "forced-colours.png") });
  assert.deepEqual(complaints, []);
});

test("images are large in a low window, and the total force is whole in a narrow one", async (context) => {
  const { url } = await serve("finger", context);
  const { tab } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "image-fz").waitFor();
  await tab.setViewportSize({ width: 1024, height: 768 });
  await moreFrames(tab, 3);
  await drawn(tab);
  for (const id of IMAGES) {
    const { width, height } = await byTestId(tab, id).boundingBox();
    assert.ok(width >= 190 && height >= 190, `${id} is only ${width} x ${height}`);
  }
  assert.ok(await tab.evaluate(() => document.documentElement.scrollHeight <= 768), "it does not fit on the screen");
  await tab.setViewportSize({ width: 390, height: 844 });
  await moreFrames(tab, 3);
  await drawn(tab);
  const narrow = await tab.evaluate(() => {
    const parts = [...document.querySelectorAll("[data-testid=total-force] .pair, [data-testid=total-force] .unit")];
    return { width: document.documentElement.scrollWidth, right: Math.max(...parts.map((part) => part.getBoundingClientRect().right)), parts: parts.length };
  });
  assert.ok(narrow.width <= 390 && narrow.right <= 390 && narrow.parts === 4, JSON.stringify(narrow));
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
  const prepare = (tab) =>
    tab.route(/\/(\?.*|app\.js|app\.css)$/, (route) => {
      const { pathname } = new URL(route.request().url());
      return route.fulfill({ path: join(page, "dist", pathname === "/" ? "index.html" : pathname) });
    });
  const { tab } = await open(String(wrong), context, { prepare, expectErrors: true });
  await badge(tab, "refused");
  await tab.getByText("refused: wrong token — use the URL printed by taxel live").first().waitFor();
  assert.equal(await byTestId(tab, "image-fz").count(), 0);
});

test("a server that is gone is shown as disconnected", async (context) => {
  const { url, stop } = await serve("quiet", context);
  const { tab } = await open(url, context, { expectErrors: true });
  await badge(tab, "live");
  await stop();
  await badge(tab, "disconnected");
  assert.equal(await byTestId(tab, "badge").innerText(), "disconnected");
  assert.equal(await byTestId(tab, "image-fz").count(), 1);
});

test("a pressure map is one image with its unit; missing sensels are not drawn as zero", async (context) => {
  const { url } = await serve("map", context);
  const { tab, complaints } = await open(url, context);
  await byTestId(tab, "image-value").waitFor();
  await tab.waitForFunction(
    () => Number(document.querySelector('[data-testid="image-value"]').dataset.max) > 0,
  );
  assert.equal(await byTestId(tab, "image-fz").count(), 0);
  const unit = await tab.locator(".scale .unit").innerText();
  await byTestId(tab, "strip").waitFor();
  await byTestId(tab, "pause").click();
  await drawn(tab);
  // Walks over all sensels by key until there is one that is missing and one that reads zero.
  const found = await byTestId(tab, "image-value").evaluate((canvas) => {
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
    byTestId(tab, "image-value").evaluate(
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
  byTestId(tab, "image-value").evaluate(
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

test("one component: image in colours of heat, channels with their change, ambiguous taxels plain to see", async (context) => {
  const { url } = await serve("heat", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "image-value").waitFor();
  const channels = await byTestId(tab, "channels").innerText();
  assert.match(channels, /ohm\s+change/);
  for (const name of ["row 0", "row 1", "column 0", "column 3"]) {
    assert.match(channels, new RegExp(`${name}\\s+\\d\\.\\d+\\s+[\u2212\\d.]+ %`));
  }
  assert.match(await byTestId(tab, "strip-note").innerText(), /^%, last 10 s$/);
  // Someone presses: a row and its numbers grow, and the force is in millinewtons.
  await tab.waitForFunction(() => Number(document.querySelector('[data-testid="image-value"]').dataset.max) > 20);
  assert.match(await byTestId(tab, "total-force").innerText(), /[\d.]+ ± [\d.]+\s*mN/);
  assert.match(await tab.locator(".legend").innerText(), /one of several positions that explain the readings equally well/);
  await byTestId(tab, "pause").click();
  await drawn(tab);
  // The disc of the mark is dark, its question mark bright; without a value the ground is not a colour of the map.
  const ground = await colourAt(tab, [1, 1], [0.85, 0.85, 0.04]);
  const disc = await colourAt(tab, [1, 1], [0.5, 0.5, 0.3]);
  assert.ok(Math.min(...ground) > 180, `ground ${ground}`);
  assert.ok(ground[0] - disc[0] > 60, `mark ${disc} on ${ground}`);
  await byTestId(tab, "image-value").focus();
  for (const key of ["Home", "ArrowDown", "ArrowRight"]) await tab.keyboard.press(key);
  await byTestId(tab, "inspect").getByText("row 1, column 1").waitFor();
  assert.match(await inspected(tab), /ambiguous: one of several positions.* Pressure no value/);
  for (const key of ["ArrowRight", "ArrowUp"]) await tab.keyboard.press(key);
  await byTestId(tab, "inspect").getByText("row 0, column 2").waitFor();
  assert.match(await inspected(tab), /saturated: .* a bound Pressure [\d.]+ kPa/);
  await tab.keyboard.press("ArrowRight");
  assert.match(await inspected(tab), /row 0, column 3 ok Pressure [\d.]+ ± [\d.]+ kPa/);
  await tab.screenshot({ path: join(screenshots, "one-component-heat.png") });
  assert.deepEqual(complaints, []);
});

test("one component in grey: black is nothing, white the full scale of either sign", async (context) => {
  const { url } = await serve("grey", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "image-value").waitFor();
  // Until a taxel reads a large negative value, which is as bright as a positive one.
  await byTestId(tab, "image-value").focus();
  await tab.keyboard.press("Home");
  await tab.keyboard.press("PageDown");
  await tab.keyboard.press("ArrowRight");
  await tab.waitForFunction(() =>
    /Change of force\u2212(\d+\.\d+) ±/.exec(document.querySelector('[data-testid="inspect"]').textContent)?.[1] > 0.4,
  );
  await byTestId(tab, "pause").click();
  await drawn(tab);
  const bright = await colourAt(tab, [1, 1], [0.12, 0.88, 0.06]);
  const dark = await colourAt(tab, [0, 3], [0.12, 0.88, 0.06]);
  for (const colour of [bright, dark]) {
    assert.ok(Math.max(...colour) - Math.min(...colour) < 2, `${colour} is not a grey`);
  }
  assert.ok(bright[0] > 25 && dark[0] < 25, `bright ${bright}, dark ${dark}`);
  assert.match(await byTestId(tab, "total-force").innerText(), /^\s*z?\s*–/);
  assert.match(await byTestId(tab, "strip-note").innerText(), /^mV, last 10 s$/);
  assert.match(await byTestId(tab, "channels").innerText(), /sensel 8\s+[\u2212\d.]+\s+[\u2212\d.]+ mV/);
  await tab.screenshot({ path: join(screenshots, "one-component-grey.png") });
  // Beside a list of channels there is little room for events: what happened and its value are read whole.
  await tab.setViewportSize({ width: 1024, height: 768 });
  await byTestId(tab, "events").locator("tr").first().waitFor();
  const cut = await tab.evaluate(() =>
    [...document.querySelectorAll("[data-testid=events] td, [data-testid=channels] td")]
      .filter((cell) => {
        const { right, width } = cell.getBoundingClientRect();
        const place = cell.closest(".scroll").getBoundingClientRect();
        return right > place.right + 0.5 || cell.scrollWidth > width + 1;
      })
      .map((cell) => `${cell.textContent}: ${cell.scrollWidth} px in ${cell.getBoundingClientRect().width}`),
  );
  assert.deepEqual(cut, []);
  await tab.screenshot({ path: join(screenshots, "one-component-low.png") });
  assert.deepEqual(complaints, []);
});

test("one component fits on the screen, light and dark", async (context) => {
  const { url } = await serve("grey", context);
  const { tab } = await open(url, context);
  await badge(tab, "live");
  await byTestId(tab, "image-value").focus();
  await tab.keyboard.press("ArrowDown");
  for (const [width, height, colorScheme] of [
    [1366, 768, "light"],
    [1366, 650, "dark"],
    [1920, 1080, "dark"],
    [1180, 820, "light"],
    [820, 1180, "light"],
  ]) {
    await tab.emulateMedia({ colorScheme });
    await tab.setViewportSize({ width, height });
    await moreFrames(tab, 3);
    await drawn(tab);
    const found = await tab.evaluate(() => {
      const { scrollWidth, scrollHeight } = document.documentElement;
      const parts = [...document.querySelectorAll(".panel, .readout, header")];
      const cut = parts.filter((part) => part.scrollHeight > part.clientHeight + 1 || part.scrollWidth > part.clientWidth + 1);
      return { scrollWidth, scrollHeight, cut: cut.map((part) => part.getAttribute("aria-label") ?? part.className) };
    });
    assert.deepEqual(found, { scrollWidth: width, scrollHeight: height, cut: [] }, `${width} x ${height}`);
    await tab.screenshot({ path: join(screenshots, `one-component-${colorScheme}-${width}x${height}.png`) });
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

test("pause freezes the images while counting goes on", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await moreFrames(tab, 5);
  await byTestId(tab, "pause").click();
  await drawn(tab);
  const frozen = await Promise.all(IMAGES.map((id) => pixels(tab, id)));
  const total = await byTestId(tab, "total-force").innerText();
  await moreFrames(tab, 12);
  assert.deepEqual(await Promise.all(IMAGES.map((id) => pixels(tab, id))), frozen);
  assert.equal(await byTestId(tab, "total-force").innerText(), total);
  assert.match(await byTestId(tab, "frame-rate").innerText(), /^\d/);
  assert.equal(await byTestId(tab, "badge").innerText(), "live");
  await tab.keyboard.press("p");
  await tab.waitForFunction(
    ([id, old]) => document.querySelector(`[data-testid="${id}"]`).toDataURL() !== old,
    ["image-raw", frozen[0]],
  );
  assert.deepEqual(complaints, []);
});

test("lock keeps the scales, a limit can be typed", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await tab.waitForFunction(
    () => Number(document.querySelector('[data-testid="image-fz"]').dataset.max) > 1.5,
  );
  const high = byTestId(tab, "image-fz-high");
  await high.fill("1");
  await high.press("Enter");
  // The typed limit stands when a value above it is drawn.
  await tab.waitForFunction(() => {
    const { high, max } = document.querySelector('[data-testid="image-fz"]').dataset;
    return high === "1" && Number(max) > 1;
  });
  await tab.keyboard.press("l");
  assert.equal(await byTestId(tab, "lock").getAttribute("aria-pressed"), "true");
  const locked = await limits(tab);
  assert.deepEqual(locked[3], ["0", "1"]);
  await moreFrames(tab, 20);
  assert.deepEqual(await limits(tab), locked);
  await byTestId(tab, "lock").click();
  await tab.waitForFunction(
    () => Number(document.querySelector('[data-testid="image-fz"]').dataset.high) > 1,
  );
  assert.equal(await byTestId(tab, "lock").getAttribute("aria-pressed"), "false");

  const before = await pixels(tab, "image-raw");
  await byTestId(tab, "raw-change").click();
  await tab.waitForFunction(() =>
    document.querySelector('[data-testid="image-raw"]').dataset.low.startsWith("-"),
  );
  assert.notEqual(await pixels(tab, "image-raw"), before);
  assert.deepEqual(complaints, []);
});

test("every control is reached by key with a visible focus", async (context) => {
  const { url } = await serve("finger", context);
  const { tab } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await byTestId(tab, "image-fz").waitFor();
  const reached = new Set();
  for (let step = 0; step < 50; step++) {
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
  const wanted = ["strip-zoom-out", "strip-zoom-in", "strip-live", "strip-export", "strip-chart", "tab-events", "event-filter", "events", "tare", "clear-tare", "pause", "lock", "drawing", "theme", "raw-absolute", "raw-change", ...IMAGES];
  const missing = [...wanted, "image-fz-low", "image-fz-high"].filter((id) => !reached.has(id));
  assert.deepEqual(missing, []);
});

test("light and dark follow system and switch, and everything fits on the screen", async (context) => {
  const { url } = await serve("finger", context);
  const { tab, complaints } = await open(url, context);
  await badge(tab, "live");
  await rested(tab);
  await tab.waitForFunction(
    () => Number(document.querySelector('[data-testid="image-fz"]').dataset.max) > 1.5,
  );
  await byTestId(tab, "image-fz").focus();
  for (const key of ["ArrowDown", "ArrowDown", "ArrowDown", "ArrowDown", "ArrowRight", "ArrowRight"]) {
    await tab.keyboard.press(key);
  }
  const brightness = () =>
    tab.evaluate(() => {
      const [red, green, blue] = getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number);
      return (red + green + blue) / 3;
    });
  const shoot = async (name, viewport) => {
    await tab.setViewportSize(viewport);
    await drawn(tab);
    await moreFrames(tab, 2);
    await drawn(tab);
    const fit = await tab.evaluate(() => {
      const bottom = Math.max(
        ...[...document.body.children].map((child) => child.getBoundingClientRect().bottom),
      );
      const { scrollWidth, scrollHeight } = document.documentElement;
      const cut = [...document.querySelectorAll(".panel, .readout, header")].filter(
        (part) => part.scrollHeight > part.clientHeight + 1 || part.scrollWidth > part.clientWidth + 1,
      );
      return {
        bottom,
        scrollWidth,
        scrollHeight,
        cut: cut.map((part) => part.getAttribute("aria-label") ?? part.className),
      };
    });
    assert.ok(fit.scrollWidth <= viewport.width, `${name}: ${fit.scrollWidth} px wide`);
    assert.ok(fit.scrollHeight <= viewport.height, `${name}: ${fit.scrollHeight} px high`);
    assert.ok(fit.bottom <= viewport.height, `${name}: the content ends at ${fit.bottom} px`);
    assert.deepEqual(fit.cut, [], `${name}: parts that do not fit`);
    await tab.screenshot({ path: join(screenshots, `${name}.png`) });
  };
  assert.ok((await brightness()) > 200);
  await shoot("light-1366x768", LIGHT);
  await shoot("light-1366x650", { width: 1366, height: 650 });
  await shoot("light-820x1180", { width: 820, height: 1180 });
  await shoot("light-1180x820", { width: 1180, height: 820 });
  await tab.emulateMedia({ colorScheme: "dark" });
  await tab.waitForFunction(() => document.documentElement.dataset.theme === "dark");
  assert.ok((await brightness()) < 60);
  await shoot("dark-1366x768", LIGHT);
  await byTestId(tab, "theme").click();
  assert.equal(await byTestId(tab, "theme").innerText(), "Theme: light");
  assert.ok((await brightness()) > 200);
  await byTestId(tab, "theme").click();
  assert.equal(await byTestId(tab, "theme").innerText(), "Theme: dark");
  assert.ok((await brightness()) < 60);
  assert.deepEqual(complaints, []);
});
