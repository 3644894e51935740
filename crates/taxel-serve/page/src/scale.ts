// The scale of an image: follows the values with a floor, or is fixed by hand.

/** `positive` runs from 0 to a limit, `symmetric` from minus to plus a limit, `range` between two values. */
export type ScaleKind = "positive" | "symmetric" | "range";

/** How long a peak is remembered before the scale shrinks, s. */
const HOLD = 4;

const MANTISSAS = [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];

/** The next round number that is not smaller; `value` is positive. */
export function roundUp(value: number): number {
  const decade = 10 ** Math.floor(Math.log10(value));
  const mantissa = MANTISSAS.find((candidate) => candidate * decade >= value * (1 - 1e-9)) ?? 10;
  return Number((mantissa * decade).toPrecision(6));
}

export class Scale {
  readonly kind: ScaleKind;
  low: number;
  high: number;
  /** A fixed scale stays until it is released. */
  fixed = false;
  /** Smallest limit (`positive`, `symmetric`) or smallest width (`range`) that is taken by itself. */
  floor: number;
  private heldLow = Number.NaN;
  private heldHigh = Number.NaN;
  private lastTime = Number.NaN;

  constructor(kind: ScaleKind, floor: number) {
    this.kind = kind;
    this.floor = floor;
    this.low = kind === "symmetric" ? -floor : 0;
    this.high = floor;
  }

  /** Takes the extremes of one picture; `time` in s, from any clock that does not go back. */
  follow(low: number, high: number, time: number): void {
    if (this.fixed || !Number.isFinite(low) || !Number.isFinite(high)) return;
    const elapsed = Number.isFinite(this.lastTime) ? Math.max(0, time - this.lastTime) : 0;
    this.lastTime = time;
    if (this.kind === "range") this.followRange(low, high, elapsed);
    else this.followLimit(Math.max(high, this.kind === "symmetric" ? -low : 0), elapsed);
  }

  /** Fixes the scale at these ends. Returns false, and changes nothing, if they do not make a scale. */
  fix(low: number, high: number): boolean {
    if (!Number.isFinite(low) || !Number.isFinite(high) || high <= low) return false;
    this.low = low;
    this.high = high;
    this.fixed = true;
    return true;
  }

  /** Follows the values again. */
  release(): void {
    this.fixed = false;
    this.heldLow = Number.NaN;
    this.heldHigh = Number.NaN;
  }

  private followLimit(peak: number, elapsed: number): void {
    const faded = Number.isFinite(this.heldHigh) ? this.heldHigh * Math.exp(-elapsed / HOLD) : 0;
    this.heldHigh = Math.max(peak, faded, 0);
    const wanted = (size: number): number => Math.max(this.floor, size > 0 ? roundUp(size) : 0);
    let limit = this.high;
    if (wanted(this.heldHigh) > limit) limit = wanted(this.heldHigh);
    else if (wanted(1.25 * this.heldHigh) < limit) limit = wanted(1.25 * this.heldHigh);
    this.high = limit;
    this.low = this.kind === "symmetric" ? -limit : 0;
  }

  private followRange(low: number, high: number, elapsed: number): void {
    const fade = 1 - Math.exp(-elapsed / HOLD);
    const first = !Number.isFinite(this.heldLow);
    this.heldLow = first ? low : Math.min(low, this.heldLow + (low - this.heldLow) * fade);
    this.heldHigh = first ? high : Math.max(high, this.heldHigh + (high - this.heldHigh) * fade);
    const width = Math.max(this.heldHigh - this.heldLow, this.floor);
    const spare = (width - (this.heldHigh - this.heldLow)) / 2;
    const step = roundUp(width / 8);
    const below = Math.floor((this.heldLow - spare) / step) * step;
    const above = Math.ceil((this.heldHigh + spare) / step) * step;
    const outside = low < this.low || high > this.high;
    if (first || outside || above - below < 0.7 * (this.high - this.low)) {
      this.low = Number(below.toPrecision(6));
      this.high = Number(above.toPrecision(6));
    }
  }
}
