// Force over time, and the readings of chosen channels: one chart, with a choice where a device has both.

import type { ChannelStore } from "./channels";
import { create, symbol } from "./dom";
import { History, type Recent } from "./history";
import { named } from "./layers";
import type { Subject } from "./now";
import { View } from "./past";
import type { Frame, Hello } from "./protocol";
import { recall, remember } from "./store";
import { dashOf, lineKey } from "./strip";
import { Timeline, type TimelineOptions } from "./timeline";
import type { Quantities } from "./units";

const AXES = ["x", "y", "z"] as const;
/** Numbers of their dashes: pressing, the thickest, is the solid line. */
const AXIS_LINES = [1, 2, 0] as const;
/** Devices of at most so many channels have them in the history of the service. */
const MOST_KEPT = 32;
/** Smallest width of the scale of changes, of the largest reading that was seen. */
const FLOOR_SHARE = 0.002;

type Chart = "force" | "channels";

export class TimeView {
  readonly root = create("div", { class: "time" });
  private readonly hello: Hello;
  private readonly quantities: Quantities;
  private readonly store: ChannelStore;
  private readonly subject: Subject;
  private readonly totals: History;
  private readonly view = new View();
  private chart: Chart;
  private timeline: Timeline;
  private live = true;
  private largest = 0;

  constructor(hello: Hello, quantities: Quantities, store: ChannelStore, subject: Subject) {
    this.hello = hello;
    this.quantities = quantities;
    this.store = store;
    this.subject = subject;
    this.totals = new History(hello.components);
    this.chart = this.hasForce && recall("chart") !== "channels" ? "force" : "channels";
    this.timeline = this.build();
  }

  private get hasForce(): boolean {
    return this.subject === "force" || this.subject === "sum";
  }

  /** Takes every frame that arrives. */
  record(frame: Frame): void {
    const { header, reading } = frame;
    const none = [Number.NaN, Number.NaN, Number.NaN];
    // A bound is charted, since it is the least that is known; what is not known is a gap.
    const known = header.zeroKnown && header.totalCertainty !== "unknown";
    const total = this.hello.force_unit === "N" ? header.force : [Number.NaN, Number.NaN, header.sum];
    this.totals.push(header.time, (known ? total : none).slice(3 - this.hello.components));
    if (this.chart === "channels") for (const one of reading) if (Math.abs(one) > this.largest) this.largest = Math.abs(one);
  }

  /** `live` is true while frames come; `now` in ms. */
  draw(now: number, live = this.live): void {
    this.live = live;
    const gap = Math.max(this.hello.stale_after_s, 2.5 * (this.hello.period_s ?? 0));
    if (this.chart === "channels") this.timeline.strip.floor = Math.max(1e-18, FLOOR_SHARE * this.largest);
    this.timeline.draw(now, gap, live);
  }

  recolour(): void {
    this.timeline.recolour();
  }

  /** Other channels are chosen. */
  choose(): void {
    if (this.chart === "channels") this.rebuild();
  }

  private show(chart: Chart): void {
    this.chart = chart;
    remember("chart", chart);
    this.rebuild();
    this.root.querySelector<HTMLElement>(`[data-testid="chart-${chart}"]`)?.focus();
  }

  private rebuild(): void {
    this.timeline.destroy();
    this.timeline = this.build();
    this.draw(performance.now());
  }

  private build(): Timeline {
    const timeline = new Timeline(this.chart === "force" ? this.ofTotals() : this.ofChannels(), this.view);
    this.root.replaceChildren(timeline.strip.root);
    return timeline;
  }

  private choice(): HTMLElement[] {
    const force = this.subject === "sum" ? "Sum" : "Force";
    if (!this.hasForce) return [create("h2", {}, "Channels")];
    const group = create("div", { class: "segments start", role: "group", "aria-label": "What is charted" });
    for (const [chart, words] of [["force", force], ["channels", "Channels"]] as const) {
      const button = create("button", { type: "button", "data-testid": `chart-${chart}`, "aria-pressed": String(chart === this.chart) }, words);
      button.addEventListener("click", () => this.show(chart));
      group.append(button);
    }
    return [create("h2", {}, "Time"), group];
  }

  private ofTotals(): TimelineOptions {
    const { components, force_unit: unit, full_scale: fullScale } = this.hello;
    const newtons = unit === "N";
    const label = newtons ? "Total force" : "Sum of values";
    const axes = AXES.slice(3 - components);
    const series = axes.map((axis, line) => ({
      label: components === 3 ? `F ${axis}` : label,
      signal: newtons ? `force_${axis}` : "sum",
      colour: `--axis-${axis}`,
      width: axis === "z" ? 2 : 1.5,
      ...(components === 3 ? dashOf(AXIS_LINES[line] as number) : {}),
    }));
    const key = (axis: string, line: number): HTMLElement =>
      create("span", { class: `key axis-${axis}` }, lineKey(AXIS_LINES[line] as number, `--axis-${axis}`), symbol("F", axis));
    return {
      label,
      quantity: newtons ? this.quantities.force : this.quantities.value,
      choice: this.choice(),
      keys: components === 3 ? axes.map(key) : [],
      series,
      signals: "totals",
      shown: (si) => si,
      floor: components === 3 && fullScale !== null ? fullScale / 4 : 1e-9,
      recent: this.totals,
    };
  }

  private ofChannels(): TimelineOptions {
    const { channels, reading } = this.hello;
    const { chosen, history } = this.store;
    const series = chosen.map(({ channel, colour }, line) => ({
      label: channels[channel] ?? "",
      signal: `channel ${channels[channel]}`,
      colour,
      width: 1.5,
      ...dashOf(line),
    }));
    const keys = chosen.map(({ channel, colour }, line) => {
      const key = create("span", { class: "key" }, lineKey(line, colour), channels[channel] ?? "");
      key.style.setProperty("--key", `var(${colour})`);
      return key;
    });
    const shown = (value: number, line: number): number => this.store.change(value, chosen[line]?.channel ?? 0);
    const lines = chosen.map(({ channel }) => channel);
    const recent: Recent = {
      get newest() {
        return history.newest;
      },
      get oldest() {
        return history.oldest;
      },
      get newestClock() {
        return history.newestClock;
      },
      columns: (gap) => {
        const [times, ...values] = history.columns(gap, lines);
        return [times, ...values.map((column, line) => column.map((value) => (value === null ? null : shown(value, line))))];
      },
    };
    return {
      label: `Change of ${named(reading.quantity).toLowerCase()} against rest`,
      quantity: this.quantities.reading,
      choice: this.choice(),
      keys,
      series,
      signals: channels.length <= MOST_KEPT ? "channels,totals" : "totals",
      shown,
      floor: 1e-18,
      recent,
    };
  }
}
