// The page of `taxel live`: connects, keeps the newest frame, draws it once for each animation frame.

import { ChannelStore, ChannelTable } from "./channels";
import { Connection } from "./connection";
import { byId, create, setText } from "./dom";
import { Drawing } from "./drawing";
import { belowZeroInWords, durationInWords, tareInWords } from "./format";
import { Help } from "./help";
import { LastSecond } from "./history";
import { taxelName } from "./inspect";
import { Journal, type Tab } from "./journal";
import { Legend } from "./legend";
import type { LinkState, Socket } from "./link";
import { boardLinkInWords, isCurrent, linkInWords, linkState } from "./link";
import { MarkDialog } from "./mark";
import { NowView } from "./now";
import type { Cell, PanelListener } from "./panel";
import type { Frame, FrameHeader, Hello, Status } from "./protocol";
import { decodeFrame, ProtocolError } from "./protocol";
import { RecordControl } from "./recorder";
import { ReplayBar } from "./replay";
import { SensorTabs } from "./sensors";
import { SkinView } from "./skin";
import { ThemeSwitch } from "./theme";
import { TimeView } from "./time";
import { Quantities } from "./units";

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

/** The views of one device. */
interface Views {
  quantities: Quantities;
  store: ChannelStore;
  table: ChannelTable;
  skin: SkinView | null;
  now: NowView;
  time: TimeView;
  legend: Legend;
}

let hello: Hello | null = null;
let views: Views | null = null;
let status: Status | null = null;
let socket: Socket = "connecting";
let link: LinkState = "connecting";
/** Newest frame of the source; the shown one differs while the display is frozen. */
let newest: Frame | null = null;
let shown: Frame | null = null;
let paused = false;
let pinned: Cell | null = null;
let hovered: Cell | null = null;
let dirty = false;
let textDrawnAt = 0;
let stripDrawnAt = 0;
let linkCheckedAt = performance.now();
let closedNotice = "";
let problem = "";
const latency = new LastSecond();

const tare = byId<HTMLButtonElement>("tare");
const pause = byId<HTMLButtonElement>("pause");

const drawing = new Drawing(location);
const help = new Help();

const theme = new ThemeSwitch(byId<HTMLButtonElement>("theme"), () => {
  journal?.condition.draw();
  views?.time.recolour();
  views?.legend.draw();
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
    if (!same) journal.open("taxel");
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
    journal.open("taxel");
    requestDrawing(true);
    if (shown !== null) setText(byId("announce-taxel"), inspect(shown, pinned));
  },
  leave() {
    pinned = null;
    hovered = null;
    requestDrawing(true);
  },
  changed() {
    requestDrawing(true);
  },
};

const connection = new Connection(location, {
  hello(message) {
    hooks.lastMessageAt = performance.now();
    problem = "";
    greet(message);
  },
  rest(channels) {
    if (views !== null) views.store.rest = channels;
    requestDrawing(true);
  },
  events: (events, missed) => journal.takeEvents(events, missed),
  tares: (entries) => journal.takeTares(entries),
  baseline: (baseline) => journal.takeBaseline(baseline),
  health(health) {
    journal.takeHealth(health);
    views?.table.takeHealth(health);
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
    record.take(message);
    replay.take(message);
    sensors.take(message);
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

const send = connection.send.bind(connection);
const journal = new Journal(panelListener, {
  goBack: (to) => send({ command: "undo_tare", to }),
  force: () => send({ command: "tare", force: true }),
  clear: () => send({ command: "clear_tare" }),
});
const mark = new MarkDialog((text) => send({ command: "mark", text }));
const record = new RecordControl(send);
const replay = new ReplayBar(send, journal.events);
const sensors = new SensorTabs();

/** Begins anew for a device; keeps scales, chart and selection if it is the same one again. */
function greet(message: Hello): void {
  const identity = ({ protocol, source, version, commit, ...device }: Hello): string => JSON.stringify(device);
  const same = hello !== null && views !== null && identity(hello) === identity(message);
  hello = message;
  status = null;
  setText(byId("name"), message.name);
  document.title = `${message.name} – taxel live`;
  journal.greet(message);
  updateCondition();
  if (!same) begin(message);
  drawing.show(message);
}

/** Builds the views of a device. */
function begin(message: Hello): void {
  newest = null;
  shown = null;
  pinned = null;
  hovered = null;
  const quantities = new Quantities(message);
  const store = new ChannelStore(message);
  const table = new ChannelTable(message, quantities, store);
  const now = new NowView(message, quantities);
  const time = new TimeView(message, quantities, store, now.subject);
  const legend = new Legend(message);
  store.changed = () => {
    table.showChosen();
    time.choose();
  };
  table.showChosen();
  table.setCurrent(isCurrent(link));
  help.takeLegend(legend);
  const listed = now.subject === "channels";
  const skin = listed ? null : new SkinView(message, quantities, () => store.rest, panelListener, [drawing.button]);
  const first = skin?.root ?? create("section", { class: "panel skin", "aria-label": "Channels" }, create("div", { class: "panel-head" }, create("h2", {}, "Channels")), table.root);
  first.classList.toggle("listed", listed);
  journal.takeChannels(listed ? null : table);
  journal.hide("taxel", listed);
  journal.open(message.rows * message.columns > 1 ? "events" : "taxel");
  byId("main").replaceChildren(first, create("div", { class: "beside" }, now.root, time.root, journal.root));
  views = { quantities, store, table, skin, now, time, legend };
}

function takeFrame(bytes: ArrayBuffer, now: number): void {
  if (hello === null || views === null) return;
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
  views.store.record(frame);
  views.time.record(frame);
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
  if (hello === null || views === null || shown === null) return;
  const frame = shown;
  const selected = hovered ?? pinned;
  const read = now - textDrawnAt > TEXT_PERIOD;
  views.skin?.draw({ frame, selected, theme: theme.theme, now }, read);
  hooks.drawn += 1;
  if (frame === newest) hooks.onDrawn?.(frame.header, hooks.lastFrameAt);
  if (!paused && now - stripDrawnAt > STRIP_PERIOD) {
    stripDrawnAt = now;
    views.time.draw(now, link === "live");
  }
  views.table.draw(frame, now);
  if (!read) return;
  textDrawnAt = now;
  const { rows, columns } = hello;
  const device = hello;
  views.now.show(frame, now, !isCurrent(link), views.store.chosen, (taxel) => taxelName(device, { row: Math.floor(taxel / columns), column: taxel % columns }));
  journal.condition.takeStates(frame.state);
  if (rows * columns === 1) inspect(frame, { row: 0, column: 0 });
  else if (selected === null) journal.inspector.clear();
  else inspect(frame, selected);
  views.skin?.setFoot(selected === null ? "" : journal.inspector.brief(hello, views.quantities, frame, selected));
}

/** Shows the taxel in the inspector; returns the sentence for screen readers. */
function inspect(frame: Frame, cell: Cell): string {
  if (hello === null || views === null) return "";
  const sentence = journal.inspector.show(hello, views.quantities, frame, cell, views.store.rest);
  return journal.inspector.withCondition(sentence, journal.condition.wordsOf(cell.row * hello.columns + cell.column));
}

/** Numbers of the connection, which go on while the display is frozen or nothing comes. */
function updateCounts(): void {
  const header = newest?.header ?? null;
  journal.link.show({ header, status, latency: latency.summary(performance.now()), live: link === "live", state: link });
  byId("clipped").hidden = header?.clipped !== true;
  byId("merged").hidden = header?.merged !== true;
  byId("unchecked").hidden = header?.uncheckedWire !== true;
  byId("history").hidden = header?.historyUncertain !== true;
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
  if (state === link) return;
  link = state;
  hooks.badge = state;
  hooks.badgeChangedAt = now;
  setText(byId("badge"), state);
  document.body.dataset["state"] = state;
  journal.condition.setCurrent(isCurrent(state));
  views?.table.setCurrent(isCurrent(state));
  requestDrawing(true);
  const words = linkInWords(state, Number.POSITIVE_INFINITY, hello !== null);
  setText(byId("announce-state"), words === "" ? state : `${state}: ${words}`);
  const placeholder = document.getElementById("placeholder");
  if (placeholder !== null && words !== "") setText(placeholder, words);
}

function updateTare(): void {
  const open = socket === "open";
  const state = status?.tare ?? "none";
  // Not `disabled`: a button that is pressed by key would lose the focus.
  tare.setAttribute("aria-disabled", String(!open || state === "running"));
  const since = (newest?.header.time ?? Number.NaN) - (status?.tare_time_ns ?? Number.NaN) / 1e9;
  setText(byId("tare-state"), tareInWords(state));
  byId("tare-state").title = state === "done" && since >= 1 ? `Tared ${durationInWords(since)} ago` : "";
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
  pause.setAttribute("aria-pressed", String(value));
  pause.textContent = value ? "Go on" : "Freeze";
  byId("paused").hidden = !value;
  requestDrawing(true);
}

tare.addEventListener("click", () => {
  if (status?.tare !== "running") send({ command: "tare" });
});
byId("below-zero-tare").addEventListener("click", () => tare.click());
pause.addEventListener("click", () => {
  if (status?.replay == null) setPaused(!paused);
  else replay.toggle(send);
});
byId("badge").addEventListener("click", () => journal.reveal("link"));
byId("condition").addEventListener("click", () => journal.reveal("condition"));
byId("notice-close").addEventListener("click", () => {
  closedNotice = byId("notice-text").textContent ?? "";
  problem = "";
  updateNotice();
});

const TAB_KEYS: readonly Tab[] = ["channels", "taxel", "events", "tares", "link", "condition"];

document.addEventListener("keydown", (event) => {
  const target = event.target instanceof HTMLElement ? event.target : document.body;
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  if (target instanceof HTMLInputElement && target.type !== "range") return;
  const key = event.key.toLowerCase();
  // Over a dialog, keys do nothing to what is behind it, but those that close it.
  if (mark.open || record.open || (drawing.open && key !== "d") || (help.open && key !== "?")) return;
  const tab = TAB_KEYS[Number(key) - 1];
  // On a button, space presses that button.
  if (key === "p" || (key === " " && !(target instanceof HTMLButtonElement))) pause.click();
  else if (key === "t") tare.click();
  else if (key === "l") views?.skin?.toggleScale();
  else if (key === "m") mark.show();
  else if (key === "r") record.toggle();
  else if (key === "?") help.toggle();
  else if (key === "d" && drawing.exists) drawing.toggle();
  else if (tab !== undefined) journal.reveal(tab);
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
