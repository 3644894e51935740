// The strip chart: the last ten seconds of device time.

import uPlot from "uplot";
import { create, cssValue } from "./dom";
import type { Columns } from "./history";
import { Scale } from "./scale";

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

export class Strip {
  readonly root: HTMLElement;
  private readonly plot: uPlot;
  private readonly scale: Scale;
  private readonly span: number;

  constructor(
    heading: HTMLElement,
    label: string,
    series: readonly StripSeries[],
    span: number,
    floor: number,
  ) {
    this.span = span;
    this.scale = new Scale("range", floor);
    const frame = create("div", { class: "frame" });
    this.root = create(
      "section",
      { class: "panel strip", "data-testid": "strip", "aria-label": label },
      heading,
      frame,
    );
    this.plot = new uPlot(this.settings(series), [[]], frame);
    this.plot.root.setAttribute("aria-hidden", "true");
    new ResizeObserver(() => {
      const [width, height] = [frame.clientWidth, frame.clientHeight];
      if (width > 0 && height > 0) this.plot.setSize({ width, height });
    }).observe(frame);
  }

  /** Smallest width of the scale that is taken by itself. */
  set floor(width: number) {
    this.scale.floor = width;
  }

  /** Forgets the values so far, such as those in another unit. */
  restart(floor: number): void {
    this.scale.release();
    this.scale.floor = floor;
  }

  /** Draws these columns; `now` in ms. */
  draw(columns: Columns, now: number): void {
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
    this.plot.setData(columns);
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
      padding: [8, 10, 0, 0],
      legend: { show: false },
      cursor: { show: false },
      scales: {
        x: { time: false, range: () => [-this.span, 0] },
        y: { range: () => [this.scale.low, this.scale.high] },
      },
      axes: [
        {
          ...axis,
          size: 26,
          space: 50,
          values: (_, splits) => splits.map((at) => (at === 0 ? "now" : `\u2212${Math.abs(at)} s`)),
        },
        {
          ...axis,
          size: 52,
          space: (_plot, _axis, _low, _high, size) => Math.max(26, size / 7),
          values: (_, splits) =>
            splits.map((value) => String(Number(value.toPrecision(6))).replace("-", "\u2212")),
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
}
