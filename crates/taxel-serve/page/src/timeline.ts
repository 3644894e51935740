// A strip chart that reaches back as far as the server remembers: zoom, pan, cursor, export.

import { create, setText } from "./dom";
import { clockTime, durationInWords, fixed } from "./format";
import type { Columns, Recent } from "./history";
import type { Past } from "./past";
import { clockAt, joined, pastColumns, PastSource, View } from "./past";
import type { StripSeries } from "./strip";
import { Strip } from "./strip";
import type { Quantity } from "./units";

/** A line: how it looks, and the signal of the history that it shows. */
export interface TimelineSeries extends StripSeries {
  signal: string;
}

export interface TimelineOptions {
  /** What is charted. */
  label: string;
  quantity: Quantity;
  /** Shown at the left of the tools. */
  choice: readonly HTMLElement[];
  /** Keys of the lines, where no table has them. */
  keys: readonly HTMLElement[];
  series: readonly TimelineSeries[];
  /** Signals to ask the server for; those of the lines and what is exported beside them. */
  signals: string;
  /** A value of a line, of one of its signal; both SI. */
  shown: (value: number, series: number) => number;
  /** Smallest width of the scale that is taken by itself, SI. */
  floor: number;
  /** The last seconds, SI. */
  recent: Recent;
}

/** While it follows, the server is asked again after this time, ms: the last seconds are known anyway. */
const REFRESH = 4000;
/** Least time between two requests of someone who zooms or pans, ms. */
const PAUSE = 150;
/** Spans up to this one have relative times, s. */
const RELATIVE = 30;
const ZOOM = 2;
/** Parts of the span by which keys pan, and move the cursor. */
const PAN = 0.25;
const STEP = 0.01;

export class Timeline {
  readonly strip: Strip;
  private readonly options: TimelineOptions;
  private readonly view: View;
  private readonly source: PastSource;
  private readonly note = create("span", { class: "note", "data-testid": "strip-note" });
  private readonly liveButton: HTMLButtonElement;
  private readonly cursor = create("p", { class: "strip-cursor", "data-testid": "strip-cursor", hidden: "" });
  private columns: Columns = [[]];
  private newest = Number.NaN;
  private gap = 0;
  private end = "now";

  /** `view` is what is seen, which outlasts a chart of other lines. */
  constructor(options: TimelineOptions, view: View) {
    this.options = options;
    this.view = view;
    this.source = new PastSource(location, options.signals);
    this.liveButton = this.button("live", "Live", "Follow what is measured now (End)", () => this.view.follow());
    const tools = create(
      "div",
      { class: "strip-tools", role: "toolbar", "aria-label": `Time axis: ${options.label}` },
      this.button("zoom-out", "\u2212", "Longer time (minus)", () => this.view.zoom(ZOOM)),
      this.button("zoom-in", "+", "Shorter time (plus)", () => this.view.zoom(1 / ZOOM)),
      this.liveButton,
      this.button("export", "CSV", "Export what is seen as CSV", () => this.save()),
    );
    const heading = create("div", { class: "panel-head" }, ...options.choice, this.note, tools);
    this.strip = new Strip(heading, `${options.label} over time`, options.series, options.keys, options.floor, options.quantity);
    this.strip.cursorMoved = (x) => this.showCursor(x);
    this.strip.frame.append(this.cursor);
    this.listen();
  }

  /** Draws what is seen; `now` in ms, a line is broken where nothing came for `gap` s, the end is now while `live`. */
  draw(now: number, gap: number, live: boolean): void {
    this.gap = gap;
    this.end = live ? "now" : "last";
    const { newest } = this.options.recent;
    // The clock of the device was set back: what was before has other times.
    if (newest < this.newest - 0.5) this.source.forget();
    this.newest = newest;
    this.render(now);
  }

  recolour(): void {
    this.strip.recolour();
  }

  /** It is shown no more. */
  destroy(): void {
    this.strip.destroy();
  }

  private render(now = performance.now()): void {
    if (!Number.isFinite(this.newest)) return;
    const { view, source, options } = this;
    const range = view.range(this.newest);
    const { recent } = options;
    const known = view.live ? recent.oldest <= range[0] : source.covers(range);
    if (!known) source.want(range, view.live && this.followed(range) ? REFRESH : PAUSE, () => this.render());
    this.columns = this.seen(range);
    this.strip.draw(this.columns, now, {
      span: view.span,
      tares: (source.past?.tares ?? []).map(({ time, kind }) => ({ at: time - range[1], kind })),
      label: (x) => this.timeInWords(range[1] + x, x),
      clock: view.live && view.span <= RELATIVE ? 0 : this.clockAt(range[1]),
    });
    this.liveButton.setAttribute("aria-pressed", String(view.live));
    setText(this.note, [this.strip.unit.symbol, this.rangeInWords(range)].filter((part) => part !== "").join(", "));
    this.strip.root.dataset["from"] = range[0].toFixed(3);
    this.strip.root.dataset["to"] = range[1].toFixed(3);
    this.strip.root.dataset["points"] = String(this.columns[0].length);
  }

  /** Whether what is known of the server goes on in the last seconds without a gap. */
  private followed([from]: readonly [number, number]): boolean {
    const { oldest } = this.options.recent;
    return (this.source.past?.newest ?? Number.NEGATIVE_INFINITY) >= oldest && this.source.covers([from, oldest]);
  }

  /** What the server remembers of the range, then the last seconds, which the page knows better. */
  private seen([from, to]: readonly [number, number]): Columns {
    const { recent, series, shown } = this.options;
    const fresh = shifted(recent.columns(this.gap), this.newest - to);
    const past = this.source.past;
    const names = series.map(({ signal }) => signal);
    if (past === null) return fresh;
    const old = pastColumns(past, names, shown, to, recent.oldest, this.gap);
    const all = joined(old, fresh, Math.max(this.gap, 1.5 * past.width));
    return within(all, from - to - past.width, past.width);
  }

  /** Wall clock at a device time, s since 1970. */
  private clockAt(time: number): number {
    const now: Pick<Past, "times" | "clock"> = { times: [this.newest], clock: [this.options.recent.newestClock] };
    const past = this.source.past;
    const inside = past !== null && time <= (past.times[past.times.length - 1] ?? Number.NEGATIVE_INFINITY);
    return clockAt(inside ? past : now, time);
  }

  private timeInWords(time: number, x: number): string {
    if (this.view.live && this.view.span <= RELATIVE) return x === 0 ? this.end : `\u2212${Math.abs(x)} s`;
    return clockTime(this.clockAt(time), this.view.span < 3600);
  }

  private rangeInWords([from, to]: readonly [number, number]): string {
    if (this.view.live) return `last ${durationInWords(this.view.span)}`;
    const [begin, end] = [from, to].map((time) => clockTime(this.clockAt(time), true));
    return `${begin} to ${end}`;
  }

  /** The values of all lines at a place of the chart, or nothing. */
  private showCursor(x: number | null): void {
    const at = x === null ? -1 : nearest(this.columns[0], x);
    this.cursor.hidden = at < 0;
    if (at < 0) return;
    const { series } = this.options;
    const place = this.columns[0][at] as number;
    const end = this.view.range(this.newest)[1];
    const values = series.map(({ label }, line) => `${label} ${this.valueInWords(at, line + 1)}`);
    const unit = this.strip.unit.symbol;
    const clock = this.clockAt(end + place);
    const time = `${clockTime(clock, true)}.${Math.floor(10 * (clock % 1))} (${fixed(end + place, 1)} s)`;
    setText(this.cursor, `${time}   ${values.join("   ")}${unit === "" ? "" : ` ${unit}`}`);
  }

  /** A value, or the smallest and largest about the time of one point. */
  private valueInWords(at: number, column: number): string {
    const values = this.columns[column] as (number | null)[];
    const [times] = this.columns;
    // A row of the history has four points, a bin of the last seconds two.
    const half = (this.source.past?.width ?? 0) / 2;
    const about = (_: unknown, index: number): boolean => Math.abs((times[at - 4 + index] ?? Number.NaN) - (times[at] as number)) <= half;
    const near = Array.from({ length: 9 }, (_, index) => values[at - 4 + index] ?? null).filter(about);
    const pair = [...near, values[at] ?? null].filter((value) => value !== null);
    if (pair.length === 0) return "no value";
    const shown = (value: number): string => fixed(value / this.strip.unit.per, this.strip.decimals);
    const [low, high] = [shown(Math.min(...pair)), shown(Math.max(...pair))];
    return low === high ? low : `${low} … ${high}`;
  }

  private save(): void {
    const range = this.view.range(this.newest);
    const stamp = new Date(1000 * this.clockAt(range[1]));
    const name = Number.isNaN(stamp.getTime()) ? "" : `-${stamp.toISOString().slice(0, 19).replaceAll(":", "-")}Z`;
    create("a", { href: this.source.export(range), download: `taxel-history${name}.csv` }).click();
  }

  private button(id: string, words: string, title: string, act: () => void): HTMLButtonElement {
    const attributes = { type: "button", class: "small", "data-testid": `strip-${id}`, title, "aria-label": title };
    const button = create("button", attributes, words);
    button.addEventListener("click", () => {
      act();
      this.render();
    });
    return button;
  }

  private goTo(end: number): void {
    this.view.goTo(end, this.source.past?.oldest ?? Number.NaN, this.newest);
    this.render();
  }

  private pan(share: number): void {
    this.goTo(this.view.range(this.newest)[1] + share * this.view.span);
  }

  private listen(): void {
    const { frame, over } = this.strip;
    over.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const { left, width } = over.getBoundingClientRect();
        const sideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
        if (sideways) this.pan((event.deltaX + (event.shiftKey ? event.deltaY : 0)) / width);
        else this.view.zoom(Math.exp(0.002 * event.deltaY), (event.clientX - left) / width);
        this.render();
      },
      { passive: false },
    );
    let held: { x: number; end: number } | null = null;
    over.addEventListener("pointerdown", (event) => {
      held = { x: event.clientX, end: this.view.range(this.newest)[1] };
      over.setPointerCapture(event.pointerId);
    });
    over.addEventListener("pointermove", (event) => {
      if (held === null || Math.abs(event.clientX - held.x) < 3) return;
      this.goTo(held.end - ((event.clientX - held.x) / over.clientWidth) * this.view.span);
    });
    for (const end of ["pointerup", "pointercancel"]) over.addEventListener(end, () => (held = null));
    frame.addEventListener("keydown", (event) => {
      if (!this.key(event)) return;
      event.preventDefault();
      event.stopPropagation();
      this.render();
    });
  }

  /** Whether the key means something here. */
  private key({ key, shiftKey, ctrlKey, altKey, metaKey }: KeyboardEvent): boolean {
    if (ctrlKey || altKey || metaKey) return false;
    const sign = { ArrowLeft: -1, ArrowRight: 1 }[key];
    if (sign !== undefined && shiftKey) this.strip.moveCursor(sign * STEP);
    else if (sign !== undefined) this.pan(sign * PAN);
    else if (key === "+" || key === "=") this.view.zoom(1 / ZOOM);
    else if (key === "-") this.view.zoom(ZOOM);
    else if (key === "Home") this.goTo(Number.NEGATIVE_INFINITY);
    else if (key === "End") this.view.follow();
    else return false;
    return true;
  }
}

/** Columns with later times. */
function shifted([times, ...values]: Columns, by: number): Columns {
  return by === 0 ? [times, ...values] : [times.map((time) => time + by), ...values];
}

/** The part of columns between two times. */
function within([times, ...values]: Columns, from: number, to: number): Columns {
  const first = times.findIndex((time) => time >= from);
  if (first < 0) return [[], ...values.map(() => [])];
  const after = times.findIndex((time) => time > to);
  const end = after < 0 ? times.length : after;
  return [times.slice(first, end), ...values.map((column) => column.slice(first, end))];
}

/** Place of the time nearest to `x`; -1 in an empty column. */
function nearest(times: readonly number[], x: number): number {
  let best = -1;
  times.forEach((time, at) => {
    if (best < 0 || Math.abs(time - x) < Math.abs((times[best] as number) - x)) best = at;
  });
  return best;
}
