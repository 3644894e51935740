// The channels: what is known of the last seconds of each, and a table of them, sorted and filtered.

import { create, cssValue, setText } from "./dom";
import { decimalsFor, fixed, NONE } from "./format";
import { History } from "./history";
import type { Frame, Health, Hello } from "./protocol";
import { recall, remember } from "./store";
import { lineKey } from "./strip";
import type { Quantities } from "./units";

/** More lines than this cannot be distinguished. */
const MOST_LINES = 8;
/** Bins of the last 10 s. */
const BINS = 200;
/** Frames over which the noise is an average. */
const NOISE_FRAMES = 100;
/** Time between two looks at what people read, and between two sortings, ms. */
const TEXT_PERIOD = 250;
const SORT_PERIOD = 1000;

/** A channel in the chart. */
export interface Chosen {
  channel: number;
  /** CSS custom property. */
  colour: string;
}

/** What is known of each channel. */
export class ChannelStore {
  readonly history: History;
  readonly chosen: Chosen[] = [];
  /** SI; null before the server has sent them. */
  rest: readonly (number | null)[] | null = null;
  private readonly previous: Float64Array;
  /** Mean square of the step from one frame to the next, SI. */
  private readonly steps: Float64Array;
  private readonly key: string;
  /** Told of another choice. */
  changed: () => void = () => undefined;

  constructor({ name, channels }: Hello) {
    this.history = new History(channels.length, 10, BINS);
    this.previous = new Float64Array(channels.length).fill(Number.NaN);
    this.steps = new Float64Array(channels.length).fill(Number.NaN);
    this.key = `channels of ${name}`;
    const kept = recall(this.key)?.split(",").map(Number) ?? [];
    const known = kept.filter((channel) => Number.isInteger(channel) && channel >= 0 && channel < channels.length);
    this.choose(known.length > 0 ? known : channels.slice(0, MOST_LINES).map((_, channel) => channel));
  }

  record({ header, reading }: Frame): void {
    this.history.push(header.time, reading);
    for (let channel = 0; channel < reading.length; channel++) {
      const [now, before, mean] = [reading[channel] as number, this.previous[channel] as number, this.steps[channel] as number];
      this.previous[channel] = now;
      const square = (now - before) ** 2;
      if (Number.isFinite(square)) this.steps[channel] = Number.isNaN(mean) ? square : mean + (square - mean) / NOISE_FRAMES;
    }
  }

  /** Standard deviation of a reading from one frame to the next, SI: a press hardly counts. */
  noise(channel: number): number {
    return Math.sqrt((this.steps[channel] as number) / 2);
  }

  /** Change of a reading against rest, SI; the reading itself where no rest value is known. */
  change(reading: number, channel: number): number {
    return reading - (this.rest?.[channel] ?? 0);
  }

  toggle(channel: number): void {
    const chosen = this.chosen.map(({ channel: one }) => one);
    if (chosen.includes(channel)) this.choose(chosen.filter((one) => one !== channel));
    else this.choose([...chosen.slice(chosen.length >= MOST_LINES ? 1 : 0), channel]);
    remember(this.key, this.chosen.map(({ channel: one }) => one).join());
    this.changed();
  }

  /** A line keeps its colour as long as it is chosen. */
  private choose(channels: readonly number[]): void {
    const kept = this.chosen.filter(({ channel }) => channels.includes(channel));
    for (const channel of channels) {
      if (kept.some((line) => line.channel === channel) || kept.length >= MOST_LINES) continue;
      const free = Array.from({ length: MOST_LINES }, (_, line) => `--line-${line + 1}`).find((colour) => !kept.some((line) => line.colour === colour));
      kept.push({ channel, colour: free ?? "--line-1" });
    }
    this.chosen.splice(0, this.chosen.length, ...kept);
  }
}

/** State of a channel that was well in the last frame, while none comes. */
const NOT_KNOWN = "not known";

const HEADS = ["chart", "name", "reading", "unit", "change", "noise", "state", "last 10 s"] as const;
type Head = (typeof HEADS)[number];
/** Heads that sort. */
const SORTED: readonly Head[] = ["name", "reading", "change", "noise", "state"];

interface Row {
  line: HTMLTableRowElement;
  cells: Record<Head, HTMLElement>;
  key: HTMLButtonElement;
  curve: HTMLCanvasElement;
  visible: boolean;
}

export class ChannelTable {
  readonly root: HTMLElement;
  private readonly hello: Hello;
  private readonly quantities: Quantities;
  private readonly store: ChannelStore;
  private readonly body = create("tbody");
  private readonly filter = create("input", { type: "search", placeholder: "name or state", "aria-label": "Channels shown, by name or state", "data-testid": "channel-filter" });
  private readonly count = create("span", { class: "note" });
  private readonly heads = new Map<Head, HTMLElement>();
  private readonly rows: Row[] = [];
  private sortedBy: Head | null = null;
  private falling = false;
  private drawnAt = Number.NEGATIVE_INFINITY;
  private sortedAt = Number.NEGATIVE_INFINITY;
  private readonly wrong = new Map<number, string>();
  private frame: Frame | null = null;
  private current = true;

  constructor(hello: Hello, quantities: Quantities, store: ChannelStore) {
    this.hello = hello;
    this.quantities = quantities;
    this.store = store;
    const head = create("tr");
    for (const name of HEADS) {
      const cell = create("th", { scope: "col", class: `of-${name.split(" ")[0]}` });
      if (SORTED.includes(name)) {
        const button = create("button", { type: "button", class: "sort", "data-testid": `sort-${name}` }, name);
        button.addEventListener("click", () => this.sortBy(name));
        cell.append(button);
      } else cell.append(create("span", name === "chart" || name === "unit" ? { class: "unseen" } : {}, name));
      this.heads.set(name, cell);
      head.append(cell);
    }
    const table = create("table", { class: "channels", "data-testid": "channels" }, create("thead", {}, head), this.body);
    const scroll = create("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": "Channels" }, table);
    const bar = create("div", { class: "table-bar" }, this.filter, ...this.groups(), this.count);
    this.root = create("div", { class: "channel-table" }, bar, scroll);
    this.filter.addEventListener("input", () => this.sift());
    const seen = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const row = this.rows[Number((target as HTMLElement).dataset["channel"])];
        if (row !== undefined) row.visible = isIntersecting;
      }
      // What comes into view is drawn also when no frame comes any more.
      this.drawnAt = Number.NEGATIVE_INFINITY;
      if (this.frame !== null) this.draw(this.frame, performance.now());
    });
    hello.channels.forEach((name, channel) => {
      const row = this.row(name, channel);
      this.rows.push(row);
      this.body.append(row.line);
      seen.observe(row.line);
    });
    this.sift();
  }

  takeHealth(health: Health): void {
    this.wrong.clear();
    for (const { channel, condition } of health.wrong) this.wrong.set(channel, condition);
  }

  /** Whether frames show how the channels are. */
  setCurrent(current: boolean): void {
    this.current = current;
    this.drawnAt = Number.NEGATIVE_INFINITY;
  }

  /** Draws the rows that are seen; `now` in ms. */
  draw(frame: Frame, now: number): void {
    this.frame = frame;
    if (now - this.drawnAt < TEXT_PERIOD || this.root.offsetParent === null) return;
    this.drawnAt = now;
    if (this.sortedBy !== null && this.sortedBy !== "name" && now - this.sortedAt > SORT_PERIOD) this.sort(now);
    const { reading: quantity } = this.quantities;
    this.rows.forEach(({ cells, line, curve, visible }, channel) => {
      if (!visible) return;
      const reading = frame.reading[channel] as number;
      const noise = this.store.noise(channel);
      const words = quantity.words(reading);
      setText(cells.reading, words.number);
      setText(cells.unit, words.symbol);
      // Change and noise are in the unit of the reading, as fine as the noise allows.
      const rest = this.store.rest?.[channel] ?? null;
      const { per } = quantity.at(Math.abs(reading));
      const decimals = noise > 0 ? decimalsFor(noise / per, 2) : decimalsFor(Math.abs(reading) / per, 4);
      setText(cells.change, rest === null ? NONE : signed(fixed((reading - rest) / per, decimals)));
      setText(cells.noise, Number.isFinite(noise) ? fixed(noise / per, decimals) : NONE);
      const state = this.stateOf(channel);
      setText(cells.state, state);
      line.classList.toggle("bad", !["ok", "masked", NOT_KNOWN].includes(state));
      this.drawCurve(curve, channel);
    });
  }

  /** Marks the lines that the chart has. */
  showChosen(): void {
    this.rows.forEach(({ key }, channel) => {
      const place = this.store.chosen.findIndex((chosen) => chosen.channel === channel);
      key.setAttribute("aria-pressed", String(place >= 0));
      key.replaceChildren(...(place < 0 ? [] : [lineKey(place, this.store.chosen[place]?.colour ?? "")]));
    });
  }

  private row(name: string, channel: number): Row {
    const cells = {} as Record<Head, HTMLElement>;
    const line = create("tr", { "data-channel": String(channel) });
    for (const head of HEADS) {
      cells[head] = create(head === "name" ? "th" : "td", head === "name" ? { scope: "row", class: "of-name" } : { class: `of-${head.split(" ")[0]}` });
      line.append(cells[head]);
    }
    cells.name.textContent = name;
    const key = create("button", { type: "button", class: "line-choice", "aria-label": `Chart ${name}`, title: `Chart ${name}` });
    key.addEventListener("click", () => this.store.toggle(channel));
    cells.chart.append(key);
    const curve = create("canvas", { "aria-hidden": "true" });
    cells["last 10 s"].append(curve);
    return { line, cells, key, curve, visible: false };
  }

  private stateOf(channel: number): string {
    const state = this.hello.channel_states[this.frame?.channelState[channel] ?? -1] ?? "";
    return this.wrong.get(channel) ?? (this.current || state !== "ok" ? state : NOT_KNOWN);
  }

  private drawCurve(canvas: HTMLCanvasElement, channel: number): void {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((length) => Math.round(length * devicePixelRatio)) as [number, number];
    const context = canvas.getContext("2d");
    if (context === null || width < 4) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    context.clearRect(0, 0, width, height);
    const [times, values] = this.store.history.columns(1, [channel]) as [number[], (number | null)[]];
    const known = values.filter((value) => value !== null);
    if (known.length === 0) return;
    const [low, high] = [Math.min(...known), Math.max(...known)];
    // A channel at rest is a thin line, not its noise over the whole height.
    const noise = this.store.noise(channel);
    const span = Math.max(high - low, 20 * (Number.isFinite(noise) ? noise : 0), Number.MIN_VALUE);
    const middle = (high + low) / 2;
    const edge = 2 * devicePixelRatio;
    context.beginPath();
    values.forEach((value, at) => {
      const x = width * (1 + (times[at] as number) / this.store.history.span);
      if (value === null) return;
      const y = height / 2 - ((value - middle) / span) * (height - 2 * edge);
      if (at === 0 || values[at - 1] === null) context.moveTo(x, y);
      else context.lineTo(x, y);
    });
    context.strokeStyle = cssValue("--accent");
    context.lineWidth = 1.25 * devicePixelRatio;
    context.stroke();
  }

  /** A choice of groups, where names have a part before a point or their last blank. */
  private groups(): HTMLElement[] {
    const groups = [...new Set(this.hello.channels.map(groupOf))];
    if (groups.length < 2 || groups.length >= this.hello.channels.length) return [];
    const select = create("select", { class: "filter", "aria-label": "Group of channels", "data-testid": "channel-group" });
    for (const group of ["", ...groups]) select.append(create("option", { value: group }, group === "" ? "all groups" : group));
    select.addEventListener("change", () => this.sift(select.value));
    return [select];
  }

  private group = "";

  private sift(group = this.group): void {
    this.group = group;
    const wanted = this.filter.value.trim().toLowerCase();
    let shown = 0;
    this.rows.forEach(({ line }, channel) => {
      const name = this.hello.channels[channel] ?? "";
      const fits = `${name} ${this.stateOf(channel)}`.toLowerCase().includes(wanted) && (group === "" || groupOf(name) === group);
      line.hidden = !fits;
      if (fits) shown += 1;
    });
    const all = this.rows.length;
    setText(this.count, shown === all ? `${all} ${all === 1 ? "channel" : "channels"}` : `${shown} of ${all}`);
  }

  private sortBy(head: Head): void {
    // A second click turns the order round, a third takes it back.
    if (this.sortedBy !== head) [this.sortedBy, this.falling] = [head, head !== "name"];
    else if (this.falling === (head !== "name")) this.falling = !this.falling;
    else this.sortedBy = null;
    for (const [name, cell] of this.heads) {
      if (name === this.sortedBy) cell.setAttribute("aria-sort", this.falling ? "descending" : "ascending");
      else cell.removeAttribute("aria-sort");
    }
    this.sort(performance.now());
  }

  private sort(now: number): void {
    this.sortedAt = now;
    const order = this.rows.map((_, channel) => channel);
    const value = (channel: number): number | string => {
      const reading = this.frame?.reading[channel] ?? Number.NaN;
      switch (this.sortedBy) {
        case "name":
          return this.hello.channels[channel] ?? "";
        case "reading":
          return reading;
        case "change":
          return Math.abs(this.store.change(reading, channel));
        case "noise":
          return this.store.noise(channel);
        // What is wrong comes first.
        case "state":
          return `${this.stateOf(channel) === "ok" ? 0 : 1}${this.stateOf(channel)}`;
        default:
          return channel;
      }
    };
    const compare = (a: number | string, b: number | string): number =>
      typeof a === "string" ? a.localeCompare(String(b), undefined, { numeric: true }) : (Number.isNaN(a) ? -Infinity : a) - (Number.isNaN(b as number) ? -Infinity : (b as number)) || 0;
    const sign = this.sortedBy !== null && this.falling ? -1 : 1;
    order.sort((a, b) => sign * compare(value(a), value(b)) || a - b);
    this.body.append(...order.map((channel) => (this.rows[channel] as Row).line));
  }
}

function groupOf(name: string): string {
  const at = Math.max(name.lastIndexOf("."), name.lastIndexOf(" "));
  return at > 0 ? name.slice(0, at) : "";
}

/** With a plus sign, so that a change is seen to be one. */
function signed(text: string): string {
  return /^[1-9]|^0\.\d*[1-9]/.test(text) ? `+${text}` : text;
}
