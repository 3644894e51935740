// The values at rest that the page compares with: the mean of its first frames, then of every tare.

/** Frames at the beginning that are averaged. */
const FIRST_FRAMES = 10;

export class RestValues {
  /** In shown units; null before the first frame. */
  values: Float64Array | null = null;
  private readonly sums: Float64Array;
  private count = 0;
  private wasTaring = false;
  private settled = false;

  constructor(size: number) {
    this.sums = new Float64Array(size);
  }

  /** Takes one frame, `per` SI units to a shown one. Returns the mean of the values when they changed. */
  take(readings: Float32Array, per: number, taring: boolean): number | null {
    if (taring !== this.wasTaring) {
      if (taring) {
        this.sums.fill(0);
        this.count = 0;
      }
      this.settled = !taring && this.count > 0;
      this.wasTaring = taring;
    }
    if (this.settled) return null;
    this.count += 1;
    for (let index = 0; index < this.sums.length; index++) {
      this.sums[index] = (this.sums[index] as number) + (readings[index] as number) / per;
    }
    if (!taring && this.count >= FIRST_FRAMES) this.settled = true;
    this.values = this.sums.map((sum) => sum / this.count);
    const known = this.values.filter(Number.isFinite);
    return known.length > 0 ? known.reduce((total, value) => total + value, 0) / known.length : null;
  }
}
