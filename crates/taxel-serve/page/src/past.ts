// The history that the server keeps: asking for a part of it, and what is seen of it. No drawing.

import type { Columns } from "./history";

/** A part of the history (docs/live-protocol.md); times of the device in s, values SI. */
export interface Past {
  from: number;
  to: number;
  /** Of a row, s. */
  width: number;
  /** Of the whole history; NaN before the first frame. */
  oldest: number;
  newest: number;
  /** Begin of each row. */
  times: number[];
  /** Wall clock at the first frame of each row, s since 1970. */
  clock: number[];
  /** Of each signal, by name. */
  signals: Map<string, Rows>;
  tares: { time: number; kind: string }[];
}

/** The rows of a signal: their first, smallest, largest and last value, null where there is none. */
export interface Rows {
  first: (number | null)[];
  min: (number | null)[];
  max: (number | null)[];
  last: (number | null)[];
  /** Whether the smallest came before the largest. */
  rises: boolean[];
}

/** Reads an answer of the server. */
export function parsePast(answer: unknown): Past {
  const { from_ns, to_ns, width_ns, oldest_ns, newest_ns, time_ns, unix_s, signals, tares } = answer as {
    from_ns: number;
    to_ns: number;
    width_ns: number;
    oldest_ns: number | null;
    newest_ns: number | null;
    time_ns: number[];
    unix_s: number[];
    signals: ({ name: string } & Rows)[];
    tares: { time_ns: number; kind: string }[];
  };
  const seconds = (time: number | null): number => (time === null ? Number.NaN : time / 1e9);
  return {
    from: seconds(from_ns),
    to: seconds(to_ns),
    width: seconds(width_ns),
    oldest: seconds(oldest_ns),
    newest: seconds(newest_ns),
    times: time_ns.map(seconds),
    clock: unix_s,
    signals: new Map(signals.map(({ name, ...rows }) => [name, rows])),
    tares: tares.map(({ time_ns: time, kind }) => ({ time: seconds(time), kind })),
  };
}

const RISING = ["first", "min", "max", "last"] as const;
const FALLING = ["first", "max", "min", "last"] as const;

/** Wall clock at a device time, s since 1970: between two rows in proportion, outside at the pace of the device. */
export function clockAt({ times, clock }: Pick<Past, "times" | "clock">, time: number): number {
  const last = times.length - 1;
  if (last < 0) return Number.NaN;
  const [first, end] = [times[0] as number, times[last] as number];
  if (time <= first) return (clock[0] as number) + time - first;
  if (time >= end) return (clock[last] as number) + time - end;
  let [low, high] = [0, last];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((times[middle] as number) <= time) low = middle;
    else high = middle;
  }
  const share = (time - (times[low] as number)) / ((times[high] as number) - (times[low] as number));
  return (clock[low] as number) + share * ((clock[high] as number) - (clock[low] as number));
}

/**
 * Columns for a chart, their times relative to `origin`: four points for each row before `until`, its first, smallest,
 * largest and last value in their order, as `shown` makes them of SI. A line is broken where nothing came for `gap` s.
 */
export function pastColumns(
  past: Past,
  names: readonly string[],
  shown: (value: number, series: number) => number,
  origin: number,
  until: number,
  gap: number,
): Columns {
  const columns: (number | null)[][] = [[], ...names.map(() => [])];
  const parts = names.map((name) => past.signals.get(name));
  let previous = Number.NaN;
  past.times.forEach((time, row) => {
    if (time + past.width > until) return;
    if (time - previous > Math.max(gap, 1.5 * past.width)) {
      columns[0]?.push((time + previous) / 2 - origin);
      for (const column of columns.slice(1)) column.push(null);
    }
    previous = time;
    columns[0]?.push(...[0, 1, 2, 3].map((quarter) => time + (quarter * past.width) / 4 - origin));
    parts.forEach((part, series) => {
      const order = part?.rises[row] === false ? FALLING : RISING;
      const values = order.map((of) => part?.[of][row] ?? null);
      columns[series + 1]?.push(...values.map((value) => (value === null ? null : shown(value, series))));
    });
  });
  return columns as Columns;
}

/** One after the other; the second begins after the first, with a break between them if that is longer than `gap` s. */
export function joined(first: Columns, second: Columns, gap: number): Columns {
  const [end, begin] = [first[0][first[0].length - 1], second[0][0]];
  const apart = end !== undefined && begin !== undefined && begin - end > gap;
  return first.map((column, index) => {
    const bridge = apart ? [index === 0 ? ((begin as number) + (end as number)) / 2 : null] : [];
    return [...column, ...bridge, ...(second[index] as (number | null)[])];
  }) as Columns;
}

/** What is seen at first, s, and the ends of zooming. */
export const LIVE_SPAN = 10;
const LEAST_SPAN = 2;
const MOST_SPAN = 12 * 3600;

/** The part of the time axis that is seen. */
export class View {
  span = LIVE_SPAN;
  /** Its end, device time, s; null while it follows the newest frame. */
  end: number | null = null;

  get live(): boolean {
    return this.end === null;
  }

  range(newest: number): [number, number] {
    const end = this.end ?? newest;
    return [end - this.span, end];
  }

  /** Zooms out by a factor. While it follows, now stays where it is; otherwise the point at this share does. */
  zoom(factor: number, at = 0.5): void {
    const span = Math.min(MOST_SPAN, Math.max(LEAST_SPAN, this.span * factor));
    if (this.end !== null) this.end += (1 - at) * (span - this.span);
    this.span = span;
  }

  /** Goes to a time; one at the newest frame or after it follows it, and none lies before the oldest. */
  goTo(end: number, oldest: number, newest: number): void {
    const least = Math.min((Number.isFinite(oldest) ? oldest : 0) + this.span, newest);
    this.end = end >= newest ? null : Math.max(end, least);
  }

  follow(): void {
    this.end = null;
  }
}

/** Rows that are asked for, for a span and half a span on either side. */
const POINTS = 1600;
const MOST_POINTS = 10_000;
/** Time before a server that did not answer is asked again, ms. */
const PAUSE_FAILED = 5000;

/** Asks the server for parts of the history, one at a time. */
export class PastSource {
  past: Past | null = null;
  private readonly address: URL;
  private readonly signals: string;
  private asking = false;
  private askedAt = Number.NEGATIVE_INFINITY;
  private failed = false;

  /** `signals` as the server takes them. */
  constructor(page: Location, signals: string) {
    this.address = new URL("history", page.href);
    this.address.search = "";
    this.address.hash = "";
    this.address.searchParams.set("token", new URLSearchParams(page.search).get("token") ?? "");
    this.signals = signals;
  }

  /** Makes sure of a range of device time, no oftener than every `pause` ms; `changed` is told of an answer. */
  want([from, to]: readonly [number, number], pause: number, changed: () => void): void {
    const now = performance.now();
    if (this.asking || now - this.askedAt < (this.failed ? PAUSE_FAILED : pause)) return;
    this.asking = true;
    this.askedAt = now;
    const margin = (to - from) / 2;
    void this.ask(this.part([Math.max(0, from - margin), to + margin], POINTS, "json")).then((past) => {
      this.asking = false;
      this.failed = past === null;
      if (past === null) return;
      this.past = past;
      changed();
    });
  }

  /** Whether the range is there, as fine as it is seen. */
  covers([from, to]: readonly [number, number]): boolean {
    if (this.past === null) return false;
    const { past } = this;
    const fine = past.width <= 0.11 || past.to - past.from <= 4.5 * (to - from);
    return fine && past.from <= Math.max(from, 0) && past.to >= Math.min(to, past.newest);
  }

  /** Address of this range as a CSV file. */
  export(range: readonly [number, number]): string {
    return this.part(range, MOST_POINTS, "csv").href;
  }

  forget(): void {
    this.past = null;
  }

  private part([from, to]: readonly [number, number], points: number, format: string): URL {
    const address = new URL(this.address);
    address.searchParams.set("from", Math.max(0, from).toFixed(6));
    address.searchParams.set("to", Math.max(0, to).toFixed(6));
    address.searchParams.set("points", String(points));
    address.searchParams.set("signals", this.signals);
    address.searchParams.set("format", format);
    return address;
  }

  /** Null when the server does not answer: the badge says so, and the next time it is asked again. */
  private async ask(address: URL): Promise<Past | null> {
    try {
      const response = await fetch(address, { cache: "no-store" });
      return response.ok ? parsePast(await response.json()) : null;
    } catch {
      return null;
    }
  }
}
