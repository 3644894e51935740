// What the browser tests share: the program, a server, a browser, a page.
//
//   TAXEL       the program (default: target/release/taxel, else target/debug/taxel)
//   CHROMIUM    browser (default: /usr/bin/chromium)
//   TAXEL_DIST  1: the page of dist/ instead of that in the program, for working on the page

import { spawn } from "node:child_process";
import { existsSync, mkdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

export const tests = dirname(fileURLToPath(import.meta.url));
export const page = join(tests, "..");
export const repository = join(page, "../../..");
export const screenshots = join(tests, "screenshots");

export function existing(path, what) {
  if (!existsSync(path)) throw new Error(`${what} is missing: ${path}`);
  return path;
}

export function program() {
  const built = ["release", "debug"].map((profile) => join(repository, "target", profile, "taxel"));
  return existing(process.env.TAXEL ?? built.find(existsSync) ?? built[0], "the program taxel");
}

export function launch() {
  mkdirSync(screenshots, { recursive: true });
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: [
      "--no-sandbox",
      "--disable-gpu",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      // A page that the test itself serves from dist/ counts as one of another network.
      "--disable-features=LocalNetworkAccessChecks,BlockInsecurePrivateNetworkRequests",
    ],
  });
}

/** Starts a server; gives its URL, and a function that ends it. */
export async function started(command, commandArguments, options = {}) {
  const server = spawn(command, commandArguments, { stdio: ["ignore", "pipe", "pipe"], env: { ...process.env, TAXEL_STATE: "" }, ...options });
  const exited = new Promise((resolve) => server.once("exit", resolve));
  let errors = "";
  server.stderr.on("data", (text) => (errors += text));
  const stop = async () => {
    if (server.exitCode === null && server.signalCode === null) server.kill("SIGKILL");
    await exited;
  };
  const url = await new Promise((resolve, reject) => {
    createInterface({ input: server.stdout }).on("line", (line) => {
      const found = /http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]+/i.exec(line);
      if (found !== null) resolve(found[0]);
    });
    exited.then((code) => reject(new Error(`the server ended with ${code} before it named its URL\n${errors}`)));
    setTimeout(() => reject(new Error(`the server did not name its URL within 20 s\n${errors}`)), 20_000).unref();
  });
  return { url, stop };
}

/** Opens a page in a fresh context; requests elsewhere and errors are complaints. */
export async function opened(browser, url, settings = {}) {
  const { expectErrors = false, prepare, ...contextSettings } = settings;
  const browserContext = await browser.newContext({
    viewport: { width: 1366, height: 768 },
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
  if (process.env.TAXEL_DIST === "1") await fromDist(tab);
  await prepare?.(tab);
  const response = await tab.goto(url);
  return { tab, response, complaints, close: () => browserContext.close() };
}

/** Serves the built page instead of that of the program. */
export const fromDist = (tab) =>
  tab.route(/\/(\?.*|app\.js|app\.css)$/, (route) => {
    const { pathname } = new URL(route.request().url());
    return route.fulfill({ path: join(page, "dist", pathname === "/" ? "index.html" : pathname) });
  });

export const byTestId = (tab, id) => tab.locator(`[data-testid="${id}"]`);

/** Waits until the page has drawn what it was asked to. */
export const drawn = (tab) =>
  tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** Waits until this many more frames arrived. */
export async function moreFrames(tab, count) {
  const from = await tab.evaluate(() => window.taxelTest.frames);
  await tab.waitForFunction((wanted) => window.taxelTest.frames >= wanted, from + count, { polling: 20 });
}

/** What is wrong with the layout of a page, in words: text that is cut, parts that overlap, contrast, small targets. */
export const faultsOfLayout = (tab, { targets = false } = {}) => tab.evaluate(measureLayout, { targets });

/* c8 ignore start: runs in the browser */
function measureLayout({ targets }) {
  const found = [];
  const seen = (element) => element.checkVisibility({ checkVisibilityCSS: true }) && element.closest(".unseen") === null;
  const nameOf = (element) => {
    const own = element.dataset?.testid ?? element.id;
    return `${element.tagName.toLowerCase()}${own ? `#${own}` : element.className ? `.${String(element.className.baseVal ?? element.className).split(" ")[0]}` : ""} "${(element.textContent ?? "").trim().slice(0, 40)}"`;
  };
  const box = (element) => element.getBoundingClientRect();
  if (document.documentElement.scrollWidth > innerWidth + 1) found.push(`the page is ${document.documentElement.scrollWidth} px wide, the window ${innerWidth}`);
  const scope = document.querySelector("dialog[open]") ?? document.body;

  // Text: every line lies within the boxes that cut it, unless they scroll.
  const texts = new Map();
  const walker = document.createTreeWalker(scope, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const parent = walker.currentNode.parentElement;
    if (walker.currentNode.data.trim() === "" || !seen(parent) || ["SCRIPT", "STYLE", "OPTION", "NOSCRIPT"].includes(parent.tagName)) continue;
    texts.set(walker.currentNode, parent);
  }
  for (const [node, parent] of texts) {
    const range = document.createRange();
    range.selectNodeContents(node);
    for (let around = parent; around !== null && around !== document.documentElement; around = around.parentElement) {
      const { overflowX, overflowY, position } = getComputedStyle(around);
      const edge = box(around);
      const scrolls = (overflow) => overflow === "auto" || overflow === "scroll";
      // What is scrolled to is not cut.
      if (scrolls(overflowX) || scrolls(overflowY)) break;
      if (overflowX === "visible" && overflowY === "visible" && around.tagName !== "BUTTON") continue;
      for (const line of range.getClientRects()) {
        if (line.width === 0) continue;
        if (line.left < edge.left - 1 || line.right > edge.right + 1 || line.top < edge.top - 2 || line.bottom > edge.bottom + 2) {
          found.push(`cut: ${nameOf(parent)} by ${nameOf(around)}`);
          break;
        }
      }
      if (position === "fixed") break;
    }
    const { left, right } = range.getBoundingClientRect();
    if ((left < -1 || right > innerWidth + 1) && parent.closest(".scroll, .bar-of-words") === null) found.push(`beyond the window: ${nameOf(parent)}`);
  }

  // Panels, and what can be pressed, do not lie over each other.
  const apart = (elements, what) => {
    elements.forEach((one, at) => {
      for (const other of elements.slice(at + 1)) {
        if (one.contains(other) || other.contains(one)) continue;
        const [a, b] = [box(one), box(other)];
        const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        // Neighbours share a border.
        if (across > 1.5 && down > 1.5) found.push(`${what} overlap: ${nameOf(one)} and ${nameOf(other)}`);
      }
    });
  };
  const pick = (selector) => [...scope.querySelectorAll(selector)].filter(seen);
  apart(pick(".panel, header"), "areas");
  const pressable = pick("button, select, input").filter((element) => element.closest(".scroll, .bar-of-words") === null);
  apart(pressable, "controls");
  // Nor do neighbouring words of one area.
  apart([...new Set(texts.values())].filter((element) => element.closest(".scroll, .bar-of-words, .u-wrap, svg, .keys, .strip-cursor, #replay-events") === null && !["HTML", "BODY"].includes(element.tagName)), "words");
  // What an area has does not go beyond it.
  for (const area of pick(".panel, header")) {
    if (area.scrollHeight > area.clientHeight + 1 || area.scrollWidth > area.clientWidth + 1) {
      found.push(`too much in it: ${nameOf(area)} ${area.scrollWidth} x ${area.scrollHeight} in ${area.clientWidth} x ${area.clientHeight}`);
    }
  }

  // Contrast of words on what is behind them, 4.5 to 1 (WCAG 2.2, 1.4.3); what is disabled is exempt there.
  const numbers = (colour) => {
    const context = (window.contrastContext ??= new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true }));
    context.clearRect(0, 0, 1, 1);
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    const [red, green, blue, alpha] = context.getImageData(0, 0, 1, 1).data;
    return [red, green, blue, alpha / 255];
  };
  const light = ([red, green, blue]) => {
    const linear = [red, green, blue].map((value) => (value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  };
  const kept = new Map();
  const colourOf = (text) => {
    if (!kept.has(text)) kept.set(text, numbers(text));
    return kept.get(text);
  };
  for (const element of new Set(texts.values())) {
    if (element.closest('[aria-disabled="true"], .u-wrap') !== null) continue;
    const style = getComputedStyle(element);
    let ground = [255, 255, 255, 1];
    for (let behind = element; behind !== null; behind = behind.parentElement) {
      const colour = colourOf(getComputedStyle(behind).backgroundColor);
      if (colour[3] < 0.8) continue;
      ground = colour;
      break;
    }
    const [one, other] = [light(colourOf(element instanceof SVGElement ? style.fill : style.color)), light(ground)];
    const contrast = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
    if (contrast < 4.5) found.push(`contrast ${contrast.toFixed(2)}: ${nameOf(element)} ${style.color} on ${ground}`);
  }

  if (targets) {
    for (const element of pick("button, select, input")) {
      const { width, height } = box(element);
      if (Math.min(width, height) < 43.5 && element.type !== "range") found.push(`target of ${Math.round(width)} x ${Math.round(height)}: ${nameOf(element)}`);
      if (element.type === "range" && height < 43.5) found.push(`target of ${Math.round(height)} px height: ${nameOf(element)}`);
    }
  }
  return [...new Set(found)];
}
/* c8 ignore stop */
