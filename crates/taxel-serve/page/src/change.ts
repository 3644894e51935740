// The change of each channel of a device with one value per taxel against rest.

/** A rest value below this part of the usual change is an offset about zero, which nothing can be related to. */
const ZERO_SHARE = 0.02;
/** How a change that was seen fades with each frame. */
const FADE = 0.9995;

interface Changes {
  /** Of each channel, in per cent or in the shown unit. */
  values: Float64Array;
  perCent: boolean[];
}

/** Changes against rest: in per cent, or in the unit of the signal where the rest value is zero or not known. */
export class ChangeMeter {
  private readonly per: number;
  private readonly swing: Float64Array;

  constructor(channels: number, per: number) {
    this.per = per;
    this.swing = new Float64Array(channels);
  }

  /** Takes each frame: remembers how far the channels move. */
  record(signal: Float32Array, rest: Float32Array): void {
    for (let channel = 0; channel < this.swing.length; channel++) {
      const change = Math.abs(inUnit(signal[channel] as number, rest[channel] as number));
      const faded = (this.swing[channel] as number) * FADE;
      this.swing[channel] = change > faded ? change : faded;
    }
  }

  measure(signal: Float32Array, rest: Float32Array): Changes {
    const known = Array.from(rest, (value) => Number.isFinite(value) && value !== 0);
    // One channel with a wild reading must not change the unit of all others.
    const about0 = rest.filter((value, channel) => Math.abs(value) < ZERO_SHARE * (this.swing[channel] as number));
    const noneInPerCent = 2 * about0.length > rest.length;
    const perCent = known.map((relative) => relative && !noneInPerCent);
    const values = Float64Array.from(rest, (value, channel) => {
      const change = inUnit(signal[channel] as number, value);
      return perCent[channel] === true ? (100 * change) / Math.abs(value) : change / this.per;
    });
    return { values, perCent };
  }

  /** All channels in the unit of the signal, for lines that share one axis. */
  inUnit(signal: Float32Array, rest: Float32Array): Float64Array {
    return Float64Array.from(rest, (value, channel) => inUnit(signal[channel] as number, value) / this.per);
  }
}

/** Without a rest value a signal is its own change. */
function inUnit(signal: number, rest: number): number {
  return Number.isFinite(rest) ? signal - rest : signal;
}
