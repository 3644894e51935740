// The last seconds of a few series in bounded memory: extremes in bins of device time, so that no peak is
// lost however many frames arrive.

/** Columns for a chart: times relative to the newest frame, s, and one array for each series. */
export type Columns = [number[], ...(number | null)[][]];

/** The last seconds of some series, as a chart takes them. */
export interface Recent {
  /** Device times, s; NaN without a frame. */
  readonly newest: number;
  readonly oldest: number;
  /** Wall clock of the newest, s since 1970. */
  readonly newestClock: number;
  columns(gap: number): Columns;
}

export class History {
  /** Length of the window, s. */
  readonly span: number;
  private readonly series: number;
  private readonly width: number;
  private readonly bins: number;
  /** Number of the bin (device time over width) that each slot holds; NaN when empty. */
  private readonly bin: Float64Array;
  private readonly lowest: Float64Array;
  private readonly highest: Float64Array;
  /** 1 where the lowest value came before the highest. */
  private readonly rising: Uint8Array;
  /** Device time of the newest frame, s; NaN without one. */
  newest = Number.NaN;
  /** Wall clock as it came, s since 1970. */
  newestClock = Number.NaN;

  constructor(series: number, span = 10, bins = 500) {
    this.series = series;
    this.span = span;
    this.bins = bins;
    this.width = span / bins;
    this.bin = new Float64Array(bins + 1).fill(Number.NaN);
    this.lowest = new Float64Array((bins + 1) * series);
    this.highest = new Float64Array((bins + 1) * series);
    this.rising = new Uint8Array((bins + 1) * series);
  }

  /** Adds the values of one frame; `time` is device time, s. A clock that was set back starts afresh. */
  push(time: number, values: ArrayLike<number>): void {
    if (time < this.newest - 0.5) this.clear();
    if (!(time <= this.newest)) {
      this.newest = time;
      this.newestClock = Date.now() / 1000;
    }
    const number = Math.floor(time / this.width);
    const slot = number % (this.bins + 1);
    const fresh = this.bin[slot] !== number;
    this.bin[slot] = number;
    for (let series = 0; series < this.series; series++) {
      const place = slot * this.series + series;
      const value = values[series] ?? Number.NaN;
      if (fresh || Number.isNaN(this.lowest[place])) {
        this.lowest[place] = value;
        this.highest[place] = value;
        this.rising[place] = 1;
      } else if (value < (this.lowest[place] as number)) {
        this.lowest[place] = value;
        this.rising[place] = 0;
      } else if (value > (this.highest[place] as number)) {
        this.highest[place] = value;
        this.rising[place] = 1;
      }
    }
  }

  clear(): void {
    this.bin.fill(Number.NaN);
    this.newest = Number.NaN;
  }

  /** Begin of the oldest bin, device time, s; NaN without one. */
  get oldest(): number {
    const last = Math.floor(this.newest / this.width);
    const kept = this.bin.filter((number) => number >= last - this.bins);
    return kept.length === 0 ? Number.NaN : this.width * Math.min(...kept);
  }

  /** Two points for each bin, its extremes in order; a line is broken where nothing came for `gap` s. */
  columns(gap: number, wanted: readonly number[] = Array.from({ length: this.series }, (_, series) => series)): Columns {
    const columns: (number | null)[][] = Array.from({ length: wanted.length + 1 }, () => []);
    const last = Math.floor(this.newest / this.width);
    let previous = Number.NaN;
    for (let number = last - this.bins; number <= last; number++) {
      const slot = ((number % (this.bins + 1)) + this.bins + 1) % (this.bins + 1);
      if (this.bin[slot] !== number) continue;
      const time = number * this.width - this.newest;
      if (time - previous > Math.max(gap, 1.5 * this.width)) {
        columns[0]?.push((time + previous) / 2);
        for (const column of columns.slice(1)) column.push(null);
      }
      previous = time;
      columns[0]?.push(time, Math.min(time + this.width / 2, 0));
      wanted.forEach((series, at) => {
        const place = slot * this.series + series;
        const ends = [finite(this.lowest[place]), finite(this.highest[place])];
        if (this.rising[place] === 0) ends.reverse();
        columns[at + 1]?.push(...ends);
      });
    }
    return columns as Columns;
  }
}

function finite(value: number | undefined): number | null {
  return value !== undefined && Number.isFinite(value) ? value : null;
}

/** Median and largest of what was measured during the last second, in bounded memory. */
export class LastSecond {
  private readonly times = new Float64Array(2048).fill(Number.NEGATIVE_INFINITY);
  private readonly values = new Float64Array(2048);
  private next = 0;

  /** `now` in ms. */
  push(now: number, value: number): void {
    this.times[this.next] = now;
    this.values[this.next] = value;
    this.next = (this.next + 1) % this.times.length;
  }

  summary(now: number): { median: number; largest: number } {
    const recent = this.values.filter((_, slot) => (this.times[slot] as number) > now - 1000).sort();
    const middle = recent[Math.floor(recent.length / 2)];
    const largest = recent[recent.length - 1];
    return { median: middle ?? Number.NaN, largest: largest ?? Number.NaN };
  }
}
