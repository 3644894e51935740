// One rule for units: what a number is comes from the protocol, its prefix from its size. No unit is written elsewhere.

import { decimalsFor, fixed, NONE } from "./format";
import type { Certainty, Hello, Unit } from "./protocol";

/** Prefixes by factor, the smallest first; the protocol writes µ as u. */
const PREFIXES: readonly (readonly [number, string, string])[] = [
  [1e-15, "f", "f"],
  [1e-12, "p", "p"],
  [1e-9, "n", "n"],
  [1e-6, "µ", "u"],
  [1e-3, "m", "m"],
  [1, "", ""],
  [1e3, "k", "k"],
  [1e6, "M", "M"],
  [1e9, "G", "G"],
];

/** What is counted takes no prefix. */
const COUNTED: readonly string[] = ["", "1", "counts", "raw", "cells", "cells/s"];

/** A unit with its prefix: shown = SI / `per`. */
export interface Shown {
  per: number;
  symbol: string;
}

/** A number in words. */
export interface Words {
  number: string;
  /** Its standard deviation; empty where it is not known, and of a bound. */
  deviation: string;
  symbol: string;
}

/** What a number is, without a prefix. */
export class Quantity {
  readonly base: string;
  /** The usual unit, for numbers that are zero. */
  private readonly usual: Shown;

  constructor({ symbol, si_per_unit: per }: Pick<Unit, "symbol" | "si_per_unit">) {
    const prefix = PREFIXES.find(([factor, , letter]) => Math.abs(factor / per - 1) < 1e-9 && symbol.startsWith(letter));
    this.base = COUNTED.includes(symbol) || prefix === undefined ? symbol : symbol.slice(prefix[2].length);
    this.usual = COUNTED.includes(symbol) || prefix === undefined ? { per, symbol: symbol === "1" ? "" : symbol } : this.with(prefix);
  }

  /** That of a unit without a prefix. */
  static of(symbol: string): Quantity {
    return new Quantity({ symbol, si_per_unit: 1 });
  }

  /** The unit in which numbers up to `size` have one to three digits before the point. */
  at(size: number): Shown {
    if (COUNTED.includes(this.base) || !(size > 0) || !Number.isFinite(size)) return this.usual;
    const fits = PREFIXES.filter(([factor]) => size >= factor * 0.9995);
    return this.with(fits[fits.length - 1] ?? (PREFIXES[0] as (typeof PREFIXES)[0]));
  }

  /** A number in the unit of `size`, by default its own, with as many digits as its deviation allows. */
  words(value: number, deviation = Number.NaN, size = Math.max(Math.abs(value), Number.isFinite(deviation) ? deviation : 0)): Words {
    const { per, symbol } = this.at(size);
    const known = deviation > 0 && Number.isFinite(deviation);
    const whole = !known && COUNTED.includes(this.base) && Number.isInteger(value);
    const decimals = whole ? 0 : known ? decimalsFor(deviation / per, 2) : Math.max(0, decimalsFor(size / per, 4));
    return {
      number: fixed(value / per, decimals),
      deviation: known && Number.isFinite(value) ? `± ${fixed(deviation / per, decimals)}` : "",
      symbol,
    };
  }

  /** The same as one text. */
  text(value: number, deviation?: number, size?: number): string {
    const { number, deviation: spread, symbol } = this.words(value, deviation, size);
    if (number === NONE) return NONE;
    return [number, spread, symbol].filter((part) => part !== "").join(" ");
  }

  private with([per, prefix]: readonly [number, string, string]): Shown {
    return { per, symbol: `${prefix}${this.base}` };
  }
}

/** The quantities of a device. */
export class Quantities {
  readonly reading: Quantity;
  readonly value: Quantity;
  readonly force: Quantity;
  readonly length: Quantity;
  readonly moment: Quantity;

  constructor({ reading, value, force_unit: force, length_unit: length }: Hello) {
    this.reading = new Quantity(reading);
    this.value = new Quantity(value);
    this.force = Quantity.of(force);
    this.length = Quantity.of(length);
    this.moment = Quantity.of(`${force}·${length}`);
  }
}

/** A number that may be a bound, or none. */
export function certain(text: string, certainty: Certainty | null): string {
  if (certainty === "unknown") return "not known";
  return certainty === "at_least" ? `≥ ${text}` : text;
}
