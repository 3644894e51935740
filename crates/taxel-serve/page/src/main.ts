// The page of `taxel live`: connects, keeps the newest frame, draws it once for each animation frame.

import { listsChannels } from "./channels";
import { Connection } from "./connection";
import { byId, setText } from "./dom";
import { Drawing } from "./drawing";
import { belowZeroInWords, tareInWords } from "./format";
import { LastSecond } from "./history";
import { Journal } from "./journal";
import type { LinkState, Socket } from "./link";
import { boardLinkInWords, clockInWords, linkInWords, linkState } from "./link";
import { MarkDialog } from "./mark";
import type { Cell, PanelListener } from "./panel";
import type { Frame, FrameHeader, Hello, Status } from "./protocol";
import { decodeFrame, ProtocolError } from "./protocol";
import { Readout } from "./readout";
import { ThemeSwitch } from "./theme";
import { TouchView } from "./touch_view";

/** For the tests of the page: times by `performance.now()`. */
interface TestHooks {
  lastFrameAt: number;
  lastMessageAt: number;
  badge: string;
  badgeChangedAt: number;
  frames: number;
  drawn: number;
  /** Called when a frame stands on the canvas, with the time at which it was read. */
  onDrawn?: (header: FrameHeader, readAt: number) => void;
}

declare global {
  interface Window {
    taxelTest: TestHooks;
  }
}

/** Time between two looks at the link, ms. */
const LINK_PERIOD = 40;
/** Time between two updates of numbers that people read, ms. */
const TEXT_PERIOD = 120;
/** Time between two drawings of the strip chart, ms. */
const STRIP_PERIOD = 45;

const hooks: TestHooks = {
  lastFrameAt: Number.NEGATIVE_INFINITY,
  lastMessageAt: Number.NEGATIVE_INFINITY,
  badge: "connecting",
  badgeChangedAt: 0,
  frames: 0,
  drawn: 0,
};
window.taxelTest = hooks;

let hello: Hello | null = null;
let view: TouchView | null = null;
let readout: Readout | null = null;
let status: Status | null = null;
let socket: Socket = "connecting";
let link: LinkState = "connecting";
/** Newest frame of the source; the shown one differs while the display is paused. */
let newest: Frame | null = null;
let shown: Frame | null = null;
let paused = false;
let locked = false;
let pinned: Cell | null = null;
let hovered: Cell | null = null;
let dirty = false;
let textDrawnAt = 0;
let stripDrawnAt = 0;
let linkCheckedAt = performance.now();
let closedNotice = "";
let problem = "";
const latency = new LastSecond();

const controls = {
  tare: byId<HTMLButtonElement>("tare"),
  clearTare: byId<HTMLButtonElement>("clear-tare"),
  pause: byId<HTMLButtonElement>("pause"),
  lock: byId<HTMLButtonElement>("lock"),
};

const drawing = new Drawing(location);

const theme = new ThemeSwitch(byId<HTMLButtonElement>("theme"), () => {
  view?.recolour();
  requestDrawing();
});

const panelListener: PanelListener = {
  hover(cell) {
    hovered = cell;
    requestDrawing(true);
  },
  pick(cell) {
    const same = pinned !== null && pinned.row === cell.row && pinned.column === cell.column;
    pinned = same ? null : cell;
    requestDrawing(true);
  },
  move(rows, columns) {
    if (hello === null) return;
    const from = pinned ?? hovered;
    const next = (at: number, by: number, count: number): number => Math.min(count - 1, Math.max(0, at + by));
    pinned =
      from === null
        ? { row: 0, column: 0 }
        : { row: next(from.row, rows, hello.rows), column: next(from.column, columns, hello.columns) };
    hovered = null;
    requestDrawing(true);
    if (view !== null && shown !== null) setText(byId("announce-taxel"), view.inspect(shown, pinned));
  },
  leave() {
    pinned = null;
    hovered = null;
    requestDrawing(true);
  },
  changed() {
    updateLock();
    requestDrawing(true);
  },
};

const journal = new Journal(panelListener, {
  goBack: (to) => connection.send({ command: "undo_tare", to }),
  force: () => connection.send({ command: "tare", force: true }),
});

const connection = new Connection(location, {
  hello(message) {
    hooks.lastMessageAt = performance.now();
    problem = "";
    greet(message);
  },
  rest(channels) {
    view?.takeRest(channels);
    requestDrawing(true);
  },
  events: (events, missed) => journal.takeEvents(events, missed),
  tares: (entries) => journal.takeTares(entries),
  baseline: (baseline) => journal.takeBaseline(baseline),
  health(health) {
    journal.takeHealth(health);
    updateCondition();
    requestDrawing(true);
  },
  status(message) {
    hooks.lastMessageAt = performance.now();
    status = message;
    updateLink();
    updateTare();
    updateBelowZero();
    updateNotice();
  },
  frame(bytes) {
    const now = performance.now();
    hooks.lastMessageAt = now;
    takeFrame(bytes, now);
  },
  socket(state) {
    socket = state;
    if (state === "open") hooks.lastMessageAt = performance.now();
    updateLink();
    updateTare();
  },
  problem(text) {
    problem = text;
    updateNotice();
  },
});

const mark = new MarkDialog((text) => connection.send({ command: "mark", text }));

/** Begins anew for a device; keeps scales, chart and selection if it is the same one again. */
function greet(message: Hello): void {
  const identity = ({ protocol, source, version, commit, ...device }: Hello): string => JSON.stringify(device);
  const same = hello !== null && view !== null && identity(hello) === identity(message);
  hello = message;
  status = null;
  setText(byId("name"), message.name);
  setText(byId("source"), message.source);
  byId("source").title = [
    `source ${message.source}`,
    `taxel ${message.version} (${message.commit})`,
    ...(message.sensor_hash === "" ? [] : [`sensor file ${message.sensor_hash}`]),
  ].join("\n");
  document.title = `${message.name} – taxel live`;
  document.body.dataset["components"] = String(message.components);
  document.body.toggleAttribute("data-channels", listsChannels(message));
  drawing.show(message);
  journal.greet(message);
  updateCondition();
  if (same) return;
  newest = null;
  shown = null;
  pinned = null;
  hovered = null;
  const main = byId("main");
  readout = new Readout(byId("readout"), message);
  view = new TouchView(message, main, panelListener, journal);
  if (locked) setLocked(false);
}

function takeFrame(bytes: ArrayBuffer, now: number): void {
  if (hello === null || view === null) return;
  let frame: Frame;
  try {
    frame = decodeFrame(bytes);
    if (frame.header.taxels !== hello.rows * hello.columns) {
      throw new ProtocolError(
        `a frame has ${frame.header.taxels} taxels, not ${hello.rows} x ${hello.columns}`,
      );
    }
    const channels = hello.channels.length;
    if (frame.header.channels !== channels || frame.header.components !== hello.components) {
      throw new ProtocolError(
        `a frame has ${frame.header.channels} channels and ${frame.header.components} components, ` +
          `not ${channels} and ${hello.components}`,
      );
    }
  } catch (error) {
    if (!(error instanceof ProtocolError)) throw error;
    problem = error.message;
    updateNotice();
    return;
  }
  const first = hooks.lastFrameAt === Number.NEGATIVE_INFINITY;
  hooks.lastFrameAt = now;
  hooks.frames += 1;
  newest = frame;
  view.record(frame);
  latency.push(now, frame.header.latency);
  if (first || link !== "live") updateLink();
  if (!paused) requestDrawing();
}

function requestDrawing(withText = false): void {
  if (withText) textDrawnAt = 0;
  if (dirty) return;
  dirty = true;
  requestAnimationFrame(draw);
}

function draw(): void {
  dirty = false;
  const now = performance.now();
  if (!paused || shown === null) shown = newest;
  if (view === null || shown === null) return;
  const selected = hovered ?? pinned;
  view.drawImages({ frame: shown, selected, theme: theme.theme, now });
  hooks.drawn += 1;
  if (shown === newest) hooks.onDrawn?.(shown.header, hooks.lastFrameAt);
  if (!paused && now - stripDrawnAt > STRIP_PERIOD) {
    stripDrawnAt = now;
    view.drawStrip(now);
  }
  if (now - textDrawnAt > TEXT_PERIOD) {
    textDrawnAt = now;
    readout?.showTotals(shown.header);
    if (selected === null) view.clearInspector();
    else view.inspect(shown, selected);
  }
}

/** Numbers of the connection, which go on while the display is paused or nothing comes. */
function updateCounts(): void {
  const header: FrameHeader | undefined = newest?.header;
  if (header === undefined) return;
  readout?.showCounts({ header, status, latency: latency.summary(performance.now()), live: link === "live" });
  byId("clipped").hidden = !header.clipped;
  byId("merged").hidden = !header.merged;
  byId("unchecked").hidden = !header.uncheckedWire;
  byId("history").hidden = !header.historyUncertain;
}

function updateLink(): void {
  const now = performance.now();
  const frameAge = now - hooks.lastFrameAt;
  const state = linkState({
    socket,
    status,
    messageAge: now - hooks.lastMessageAt,
    frameAge,
    staleAfter: hello?.stale_after_s ?? Number.POSITIVE_INFINITY,
  });
  const board = socket === "open" ? boardLinkInWords(status?.link) : "";
  const detail = [linkInWords(state, frameAge, hello !== null), board].filter((words) => words !== "").join("; ");
  setText(byId("detail"), detail);
  const clock = socket === "open" ? clockInWords(status?.link) : null;
  byId("clock").hidden = clock === null;
  setText(byId("clock"), clock?.short ?? "");
  byId("clock").title = clock?.full ?? "";
  if (state === link) return;
  link = state;
  hooks.badge = state;
  hooks.badgeChangedAt = now;
  setText(byId("badge"), state);
  document.body.dataset["state"] = state;
  const words = linkInWords(state, Number.POSITIVE_INFINITY, hello !== null);
  setText(byId("announce-state"), words === "" ? state : `${state}: ${words}`);
  const placeholder = document.getElementById("placeholder");
  if (placeholder !== null && words !== "") setText(placeholder, words);
}

function updateTare(): void {
  const open = socket === "open";
  const state = status?.tare ?? "none";
  // Not `disabled`: a button that is pressed by key would lose the focus.
  controls.tare.setAttribute("aria-disabled", String(!open || state === "running"));
  controls.clearTare.setAttribute("aria-disabled", String(!open));
  const since = (newest?.header.time ?? Number.NaN) - (status?.tare_time_ns ?? Number.NaN) / 1e9;
  const age = state === "done" && since >= 1 ? `, ${duration(since)} ago` : "";
  setText(byId("tare-state"), tareInWords(state));
  byId("tare-state").title = age === "" ? "" : `Tared${age.slice(1)}`;
  byId("tare-state").dataset["state"] = state;
}

/** While taxels read below zero: why, and the way back. */
function updateBelowZero(): void {
  const below = status?.below_zero ?? null;
  // While a zero is being taken, as at the start, the way back is under way.
  byId("below-zero").hidden = below === null || status?.tare === "running";
  if (below !== null) setText(byId("below-zero-text"), belowZeroInWords(below));
}

/** One line when something is wrong with a channel; it leads to the words. */
function updateCondition(): void {
  const brief = journal.condition.brief();
  const chip = byId("condition");
  setText(chip, brief);
  chip.hidden = brief === "";
}

function duration(seconds: number): string {
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  return seconds < 7200 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
}

/** The last notice of the server, or what the page itself did not understand. */
function updateNotice(): void {
  const text =
    problem !== "" ? `The page does not understand the server: ${problem}` : (status?.message ?? "");
  if (text === "") closedNotice = "";
  byId("notice").hidden = text === "" || text === closedNotice;
  setText(byId("notice-text"), text);
}

function setPaused(value: boolean): void {
  paused = value;
  controls.pause.setAttribute("aria-pressed", String(value));
  controls.pause.textContent = value ? "Resume" : "Pause";
  byId("paused").hidden = !value;
  requestDrawing(true);
}

function setLocked(value: boolean): void {
  for (const { scale } of view?.panels ?? []) {
    if (value) scale.fix(scale.low, scale.high);
    else scale.release();
  }
  updateLock();
  requestDrawing();
}

/** The button is down when every scale is fixed, by whatever way. */
function updateLock(): void {
  locked = view !== null && view.panels.every(({ scale }) => scale.fixed);
  controls.lock.setAttribute("aria-pressed", String(locked));
  controls.lock.textContent = locked ? "Unlock scales" : "Lock scales";
}

controls.tare.addEventListener("click", () => {
  if (status?.tare !== "running") connection.send({ command: "tare" });
});
byId("below-zero-tare").addEventListener("click", () => controls.tare.click());
controls.clearTare.addEventListener("click", () => connection.send({ command: "clear_tare" }));
controls.pause.addEventListener("click", () => setPaused(!paused));
controls.lock.addEventListener("click", () => setLocked(!locked));
byId("condition").addEventListener("click", () => journal.open("condition"));
byId("notice-close").addEventListener("click", () => {
  closedNotice = byId("notice-text").textContent ?? "";
  problem = "";
  updateNotice();
});

document.addEventListener("keydown", (event) => {
  const target = event.target instanceof HTMLElement ? event.target : document.body;
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  if (target instanceof HTMLInputElement) return;
  const key = event.key.toLowerCase();
  // Over the drawing, keys do nothing to the images behind it.
  if (mark.open || (drawing.open && key !== "d")) return;
  // On a button, space presses that button.
  if (key === "p" || (key === " " && !(target instanceof HTMLButtonElement))) controls.pause.click();
  else if (key === "t") controls.tare.click();
  else if (key === "l") controls.lock.click();
  else if (key === "m") mark.show();
  else if (key === "d" && drawing.exists) drawing.toggle();
  else return;
  event.preventDefault();
});

setInterval(() => {
  const now = performance.now();
  // When the page itself was held up, messages are waiting to be read: look again the next time.
  const heldUp = now - linkCheckedAt > 5 * LINK_PERIOD;
  linkCheckedAt = now;
  if (!heldUp) updateLink();
}, LINK_PERIOD);
setInterval(updateCounts, TEXT_PERIOD);
