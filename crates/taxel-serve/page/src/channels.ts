// The readings of a device of few channels: a table with their change against rest, and a chart of that change.

import { create, setText } from "./dom";
import { decimalsFor, fixed } from "./format";
import { History } from "./history";
import type { Frame, Hello } from "./protocol";
import { dashOf, lineKey } from "./strip";
import { Timeline } from "./timeline";

/** More channels than this are not listed; then the image shows how they compare. */
const MOST_LISTED = 32;
/** More lines than this cannot be distinguished. */
const MOST_LINES = 8;
/** Smallest width of the scale of the chart: in per cent, or of the largest reading that was seen. */
const FLOOR_PER_CENT = 1;
const FLOOR_SHARE = 0.02;

/** Whether the readings are listed: they are few, and neither the values themselves nor an image of their own. */
export function listsChannels({ channels, components, picture }: Hello): boolean {
  return components === 1 && picture !== "map" && channels.length <= MOST_LISTED;
}

export interface Change {
  value: number;
  /** Otherwise in the shown unit of the reading. */
  perCent: boolean;
}

/**
 * Against rest in per cent; in the unit of the reading where the rest value is zero or not known, or where values of
 * either sign occur: there rest is a small offset about zero.
 */
export function changeOf({ reading: unit, signed }: Pick<Hello, "reading" | "signed">, reading: number, rest: number): Change {
  if (!signed && Number.isFinite(rest) && rest !== 0) {
    return { value: (100 * (reading - rest)) / Math.abs(rest), perCent: true };
  }
  return { value: changeInUnit(unit.si_per_unit, reading, rest), perCent: false };
}

/** Without a rest value a reading is its own change. */
function changeInUnit(per: number, reading: number, rest: number): number {
  return (Number.isFinite(rest) ? reading - rest : reading) / per;
}

interface Row {
  reading: HTMLElement;
  change: HTMLElement;
}

export class ChannelList {
  readonly root: HTMLElement;
  readonly timeline: Timeline;
  private readonly hello: Hello;
  private readonly lines: number;
  private readonly history: History;
  private readonly rows: Row[] = [];
  /** SI; null before the server has sent them. */
  private rest: readonly (number | null)[] | null = null;
  /** Whether the lines are in per cent; null before the first frame. */
  private perCent: boolean | null = null;
  /** Largest reading that was seen, in the shown unit. */
  private largest = 0;

  constructor(hello: Hello) {
    this.hello = hello;
    const { channels } = hello;
    this.lines = Math.min(MOST_LINES, channels.length);
    this.history = new History(this.lines);
    const series = channels.slice(0, this.lines).map((name, line) => ({
      label: name,
      signal: `channel ${name}`,
      colour: `--line-${line + 1}`,
      width: 1.5,
      ...dashOf(line),
    }));
    this.timeline = new Timeline({
      title: "Change",
      label: "Change of each channel against rest",
      keys: [],
      series,
      signals: "channels,totals",
      shown: (reading, line) => this.shown(reading, line),
      floor: FLOOR_PER_CENT,
      recent: this.history,
    });
    this.root = this.table();
  }

  takeRest(rest: readonly (number | null)[]): void {
    this.rest = rest;
  }

  record(frame: Frame): void {
    const { channels, reading: unit } = this.hello;
    const changes = channels.map((_, channel) => this.change(frame, channel));
    // One unit for all lines: per cent only if every channel has a rest value to relate to.
    const perCent = changes.every((change) => change.perCent);
    if (perCent !== this.perCent) {
      this.perCent = perCent;
      this.history.clear();
      const all = this.lines === channels.length;
      this.timeline.setUnit(perCent ? "%" : unit.symbol, all ? "" : `, first ${this.lines} channels`);
    }
    const values = Array.from({ length: this.lines }, (_, line) => this.shown(frame.reading[line] as number, line));
    this.history.push(frame.header.time, values);
  }

  /** A reading as its line shows it: its change against the rest value of now. */
  private shown(reading: number, line: number): number {
    const { value } = changeOf(this.hello, reading, this.restOf(line));
    return this.perCent === true ? value : changeInUnit(this.hello.reading.si_per_unit, reading, this.restOf(line));
  }

  drawStrip(now: number, gap: number): void {
    if (this.perCent === false) this.timeline.strip.floor = Math.max(1e-9, FLOOR_SHARE * this.largest);
    this.timeline.draw(now, gap);
  }

  show(frame: Frame): void {
    const { symbol, si_per_unit: per } = this.hello.reading;
    for (const reading of [...frame.reading, ...(this.rest ?? [])]) {
      const size = Math.abs((reading ?? Number.NaN) / per);
      if (size > this.largest) this.largest = size;
    }
    const decimals = decimalsFor(this.largest, 5);
    this.rows.forEach((row, channel) => {
      const reading = frame.reading[channel] as number;
      const { value, perCent } = this.change(frame, channel);
      setText(row.reading, fixed(reading / per, decimals));
      setText(row.change, perCent ? `${fixed(value, 2)} %` : `${fixed(value, decimals)} ${symbol}`);
    });
  }

  private restOf(channel: number): number {
    return this.rest?.[channel] ?? Number.NaN;
  }

  private change(frame: Frame, channel: number): Change {
    return changeOf(this.hello, frame.reading[channel] as number, this.restOf(channel));
  }

  /** One row for each channel; its first field is the key of its line in the chart. */
  private table(): HTMLElement {
    const { channels, reading } = this.hello;
    const head = create("tr", { class: "units" }, create("td"), create("td"));
    head.append(create("th", { scope: "col" }, reading.symbol), create("th", { scope: "col" }, "change"));
    const table = create("table", { class: "channels", "data-testid": "channels" }, head);
    channels.forEach((name, channel) => {
      const key = create("td", {});
      if (channel < this.lines) key.append(lineKey(channel, `--line-${channel + 1}`));
      const row = { reading: create("td"), change: create("td") };
      this.rows.push(row);
      table.append(create("tr", {}, key, create("th", { scope: "row" }, name), row.reading, row.change));
    });
    const title = channels.length === 1 ? "Channel" : "Channels";
    const heading = create("div", { class: "panel-head" }, create("h2", {}, title));
    heading.append(create("span", { class: "note" }, reading.quantity));
    // More rows than there is room for are scrolled to, also by key.
    const scroll = create("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": title }, table);
    return create("section", { class: "panel channels-panel", "aria-label": title }, heading, scroll);
  }
}
