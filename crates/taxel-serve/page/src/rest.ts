// The values at rest that the estimator works with, as the server sends them.

export class RestValues {
  /** In shown units; null before the server has sent them. */
  values: Float64Array | null = null;

  /** Takes values in SI units, `per` to a shown one. Returns the mean of those that are known. */
  set(readings: readonly (number | null)[], per: number): number | null {
    const values = Float64Array.from(readings, (reading) => (reading === null ? Number.NaN : reading / per));
    this.values = values;
    const known = values.filter(Number.isFinite);
    return known.length > 0 ? known.reduce((total, value) => total + value, 0) / known.length : null;
  }
}
