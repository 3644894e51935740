// A chart over device time.

import uPlot from "uplot";
import { create, cssValue } from "./dom";
import { decimalsFor } from "./format";
import type { Columns } from "./history";
import { Scale } from "./scale";
import type { Quantity, Shown } from "./units";

export interface StripSeries {
  label: string;
  /** CSS custom property of its colour. */
  colour: string;
  width: number;
  /** Lengths of dashes and gaps, px. */
  dash?: number[];
}

/**
 * Lengths of dashes and gaps of the lines of a chart, px, one after the other: lines that could be confused by eyes that
 * tell no colours apart differ in this too. style.css draws the same in the keys.
 */
const DASHES: readonly (readonly number[])[] = [[], [8, 4], [2, 3], [9, 3, 2, 3]];

/** The dashes of a line of this number. */
export function dashOf(line: number): { dash?: number[] } {
  const dash = DASHES[line % DASHES.length] ?? [];
  return dash.length === 0 ? {} : { dash: [...dash] };
}

/** The key of a line: a piece of it. `colour` is a CSS custom property. */
export function lineKey(line: number, colour: string): HTMLElement {
  const key = create("span", { class: "line-key", "data-dash": String(line % DASHES.length), "aria-hidden": "true" });
  key.style.setProperty("--key", `var(${colour})`);
  return key;
}

/** What is seen of the time axis; times relative to its end, s. */
export interface Axis {
  span: number;
  tares: readonly { at: number; kind: string }[];
  /** What stands at a time of the axis. */
  label(at: number): string;
  /** Wall clock at the end of the axis, s since 1970, whose round times are marked; 0 for round times before the end. */
  clock: number;
}

/** Round steps of time, s. */
const STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10_800];

const KEYS = "Arrow keys move in time, with shift the cursor; plus and minus zoom; Home is the beginning, End is now.";

export class Strip {
  readonly root: HTMLElement;
  /** The chart itself, which takes keys. */
  readonly frame: HTMLElement;
  /** Told where the cursor is, as a time of the axis; null without one. */
  cursorMoved: (at: number | null) => void = () => undefined;
  private readonly plot: uPlot;
  private readonly scale: Scale;
  private readonly quantity: Quantity;
  private readonly resized: ResizeObserver;
  private end = "";
  private axis: Axis = { span: 10, tares: [], label: () => "", clock: 0 };

  constructor(heading: HTMLElement, label: string, series: readonly StripSeries[], keys: readonly HTMLElement[], floor: number, quantity: Quantity) {
    this.quantity = quantity;
    this.scale = new Scale("range", floor);
    this.frame = create("div", {
      class: "frame",
      tabindex: "0",
      role: "application",
      "aria-roledescription": "chart",
      "aria-label": `${label}. ${KEYS}`,
      "data-testid": "strip-chart",
    });
    this.root = create("section", { class: "panel strip", "data-testid": "strip", "aria-label": label }, heading, this.frame);
    if (keys.length > 0) heading.after(create("div", { class: "keys" }, ...keys));
    this.plot = new uPlot(this.settings(series), [[]], this.frame);
    this.plot.root.setAttribute("aria-hidden", "true");
    this.resized = new ResizeObserver(() => {
      const [width, height] = [this.frame.clientWidth, this.frame.clientHeight];
      if (width > 0 && height > 0) this.plot.setSize({ width, height });
    });
    this.resized.observe(this.frame);
  }

  /** The field of the lines, for the pointer. */
  get over(): HTMLElement {
    return this.plot.over;
  }

  /** Smallest width of the scale that is taken by itself, SI. */
  set floor(width: number) {
    this.scale.floor = width;
  }

  private get size(): number {
    return Math.max(Math.abs(this.scale.low), Math.abs(this.scale.high));
  }

  /** The unit in which values are shown. */
  get unit(): Shown {
    return this.quantity.at(this.size);
  }

  /** As many decimals as show a value of this chart in four digits. */
  get decimals(): number {
    return decimalsFor(this.size / this.unit.per);
  }

  destroy(): void {
    this.resized.disconnect();
    this.plot.destroy();
  }

  /** Draws these columns over this axis; `now` in ms. */
  draw(columns: Columns, now: number, axis: Axis): void {
    let low = Number.POSITIVE_INFINITY;
    let high = Number.NEGATIVE_INFINITY;
    for (const values of columns.slice(1)) {
      for (const value of values) {
        if (value === null) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    if (low <= high) this.scale.follow(Math.min(low, 0), Math.max(high, 0), now / 1000);
    this.axis = axis;
    this.plot.setData(columns);
    // uPlot keeps the words of an axis whose ends stay.
    const end = axis.label(0);
    if (end !== this.end) this.plot.redraw(false, true);
    this.end = end;
  }

  /** Moves the cursor by a part of the width; one that is not there begins in the middle. */
  moveCursor(share: number): void {
    const { clientWidth: width, clientHeight: height } = this.over;
    const from = this.plot.cursor.left ?? -1;
    const left = from < 0 ? width / 2 : Math.min(width, Math.max(0, from + share * width));
    this.plot.setCursor({ left, top: height / 2 });
  }

  /** Takes the colours of a new theme. */
  recolour(): void {
    this.plot.redraw(false, true);
  }

  private settings(series: readonly StripSeries[]): uPlot.Options {
    const axis: uPlot.Axis = {
      stroke: () => cssValue("--dim"),
      grid: { stroke: () => cssValue("--line"), width: 1 },
      ticks: { stroke: () => cssValue("--line"), width: 1, size: 4 },
      font: `11px ${cssValue("--font")}`,
      gap: 4,
    };
    return {
      width: 300,
      height: 120,
      padding: [8, 26, 0, 0],
      legend: { show: false },
      cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
      hooks: {
        draw: [() => this.drawTares()],
        setCursor: [({ cursor }) => this.cursorMoved(this.cursorAt(cursor.left))],
      },
      scales: {
        x: { time: false, range: () => [-this.axis.span, 0] },
        y: { range: () => [this.scale.low, this.scale.high] },
      },
      axes: [
        {
          ...axis,
          size: 26,
          space: 64,
          incrs: STEPS,
          splits: (_plot, _axis, low, high, step) => this.splits(low, high, step),
          values: (_, splits) => splits.map((at) => this.axis.label(at)),
        },
        {
          ...axis,
          size: 52,
          space: (_plot, _axis, _low, _high, size) => Math.max(26, size / 7),
          values: (_, splits) =>
            splits.map((value) => String(Number((value / this.unit.per).toPrecision(6))).replace("-", "\u2212")),
        },
      ],
      series: [
        {},
        ...series.map(({ label, colour, width, dash }) => ({
          label,
          width,
          ...(dash === undefined ? {} : { dash }),
          stroke: () => cssValue(colour),
          points: { show: false },
          spanGaps: false,
        })),
      ],
    };
  }

  private cursorAt(left: number | undefined): number | null {
    return left === undefined || left < 0 ? null : this.plot.posToVal(left, "x");
  }

  /** Round times on the clock, or before the end. */
  private splits(low: number, high: number, step: number): number[] {
    const { clock } = this.axis;
    const splits: number[] = [];
    for (let count = Math.ceil((low + clock) / step); count * step - clock <= high; count++) {
      splits.push(Number((count * step - clock).toFixed(3)));
    }
    return splits;
  }

  /** A line where the rest values changed: what is left of it has another zero. */
  private drawTares(): void {
    const { ctx: context, bbox } = this.plot;
    const scale = devicePixelRatio;
    context.save();
    context.strokeStyle = cssValue("--dim");
    context.fillStyle = cssValue("--dim");
    context.font = `${10 * scale}px ${cssValue("--font")}`;
    context.lineWidth = scale;
    context.textAlign = "left";
    // Those of the line that was drawn last.
    context.setLineDash([]);
    for (const { at, kind } of this.axis.tares) {
      if (at <= -this.axis.span || at >= 0 || kind === "tare refused") continue;
      const x = this.plot.valToPos(at, "x", true);
      context.beginPath();
      context.moveTo(x, bbox.top);
      context.lineTo(x, bbox.top + bbox.height);
      context.stroke();
      context.fillText(kind, x + 3 * scale, bbox.top + bbox.height - 4 * scale);
    }
    context.restore();
  }
}
