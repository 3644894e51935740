// The numbers below the header: totals, rate, latency, losses.

import { create, setText } from "./dom";
import { compact, fixed, newtons, NONE, withDeviation } from "./format";
import type { FrameHeader, Hello, Status } from "./protocol";

const AXES = ["x", "y", "z"] as const;

/** Below this spacing of taxels positions are given to the micrometre, m. */
const SMALL_PITCH = 5e-4;

/** Numbers that come from the connection and not from the shown frame. */
export interface Counts {
  header: FrameHeader;
  status: Status | null;
  latency: { median: number; largest: number };
  /** Whether frames arrive now. */
  live: boolean;
}

export class Readout {
  /** Totals and counts wrap as two blocks. */
  private block: HTMLElement;
  private readonly hello: Hello;
  private readonly cells = new Map<string, HTMLElement>();

  constructor(root: HTMLElement, hello: Hello) {
    this.hello = hello;
    const totals = create("div", { class: "block" });
    const counts = create("div", { class: "block" });
    root.replaceChildren(totals, counts);
    this.block = totals;
    const axes = hello.components === 3 ? AXES : ["z"];
    const newtons = hello.force_unit === "N";
    this.group(newtons ? "Total force" : "Sum of values", "total-force", axes, newtons ? "mN" : hello.value.symbol, true);
    if (hello.components === 3) this.group("Moment", "moment", AXES, "µN·m");
    this.group("Centre of pressure", "centre", ["x", "y"], "mm");
    this.block = counts;
    this.group("Frame rate", "frame-rate", [""], "Hz");
    this.group("Latency, median", "latency", ["", "max"], "ms");
    this.group("Lost", "lost", [""], "");
    this.group("Late", "late", [""], "");
    this.group("Duplicate", "duplicate", [""], "");
    this.group("Dropped", "dropped", [""], "");
  }

  /** Totals of the shown frame. */
  showTotals(header: FrameHeader): void {
    const { hello } = this;
    if (hello.components === 3) {
      AXES.forEach((axis, index) => {
        const [force, deviation] = [header.force[index] as number, header.forceDeviation[index] as number];
        this.set(`total-force ${axis}`, withDeviation(1e3 * force, 1e3 * deviation, 2));
        this.set(`moment ${axis}`, fixed(1e6 * (header.moment[index] as number), 1));
      });
    } else if (hello.force_unit === "N") {
      const [text, unit] = newtons(header.force[2], header.forceDeviation[2]);
      this.set("total-force z", text);
      this.set("total-force unit", unit);
    } else {
      this.set("total-force z", compact(header.sum / hello.value.si_per_unit));
    }
    const [xx, , yy] = header.centreCovariance;
    const decimals = Math.min(...(hello.pitch_m ?? [1])) < SMALL_PITCH ? 3 : 2;
    this.set("centre x", centre(header.centre[0], xx, decimals));
    this.set("centre y", centre(header.centre[1], yy, decimals));
  }

  /** Numbers that go on while the display is paused. */
  showCounts({ header, status, latency, live }: Counts): void {
    this.set("frame-rate ", live ? fixed(header.rate, 1) : NONE);
    this.set("latency ", fixed(1e3 * latency.median, 2));
    this.set("latency max", fixed(1e3 * latency.largest, 2));
    this.count("lost", header.lost);
    this.count("late", header.late);
    this.count("duplicate", header.duplicate);
    this.count("dropped", status?.dropped ?? 0);
  }

  private count(name: string, value: number): void {
    this.set(`${name} `, Number.isNaN(value) ? "not known" : String(value));
    this.cells.get(`${name} `)?.closest(".values")?.classList.toggle("nonzero", value > 0);
  }

  private set(name: string, text: string): void {
    const cell = this.cells.get(name);
    if (cell !== undefined) setText(cell, text);
  }

  private group(
    label: string,
    testId: string,
    parts: readonly string[],
    unit: string,
    coloured = false,
  ): void {
    const values = create("div", { class: "values", "data-testid": testId });
    for (const part of parts) {
      // A part and its value stay on one line; those of a narrow window stand below each other.
      const pair = create("span", { class: "pair" });
      if (part !== "") pair.append(create("span", { class: coloured ? `part axis-${part}` : "part" }, part));
      const cell = create("span", { class: "value" }, NONE);
      this.cells.set(`${testId} ${part}`, cell);
      pair.append(cell);
      values.append(pair);
    }
    if (unit !== "") {
      const cell = create("span", { class: "unit" }, unit);
      this.cells.set(`${testId} unit`, cell);
      values.append(cell);
    }
    const group = create(
      "div",
      { class: `group group-${testId}` },
      create("div", { class: "label" }, label),
      values,
    );
    this.block.append(group);
  }
}

/** mm, with the standard deviation where it is known. */
function centre(position: number, variance: number, decimals: number): string {
  const deviation = 1e3 * Math.sqrt(variance);
  if (!Number.isFinite(deviation)) return fixed(1e3 * position, decimals);
  return withDeviation(1e3 * position, deviation, decimals);
}
