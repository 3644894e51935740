// Numbers and states in words.

import type { BelowZero, Status } from "./protocol";

/** Stands for a number that is not known. */
export const NONE = "–";

/** A number with fixed decimals, a true minus sign and no negative zero. */
export function fixed(value: number, decimals: number): string {
  if (!Number.isFinite(value)) return NONE;
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? `\u2212${text}` : text;
}

/** Three to four significant digits, for limits and values of unknown size. */
export function compact(value: number): string {
  if (!Number.isFinite(value)) return NONE;
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-3)) return value.toExponential(2).replaceAll("-", "\u2212");
  return fixed(value, size >= 1000 ? 0 : size >= 100 ? 1 : size >= 0.1 || size === 0 ? 2 : 4);
}

/** A limit of a scale without trailing zeros. */
export function limit(value: number): string {
  if (!Number.isFinite(value)) return NONE;
  return String(Number(value.toPrecision(5))).replace("-", "\u2212");
}

/** Reads what a person typed as a limit; NaN if it is no number. */
export function parseLimit(text: string): number {
  const plain = text.trim().replace("\u2212", "-").replace(",", ".");
  return plain === "" ? Number.NaN : Number(plain);
}

/** Value and one standard deviation. */
export function withDeviation(value: number, deviation: number, decimals: number): string {
  if (!Number.isFinite(value)) return NONE;
  return `${fixed(value, decimals)} ± ${fixed(deviation, decimals)}`;
}

/** As many decimals as show `size` in this number of digits. */
export function decimalsFor(size: number, digits = 4): number {
  if (!(size > 0) || !Number.isFinite(size)) return 2;
  return Math.min(6, Math.max(0, digits - 1 - Math.floor(Math.log10(size))));
}

/** Newtons, or millinewtons below one newton: number and unit; at least one digit of the deviation if `all` is true. */
export function newtons(force: number, deviation: number, all = false): [string, string] {
  const [per, symbol, least] = Math.abs(force) >= 1 ? [1, "N", 3] : [1e-3, "mN", 2];
  const decimals = all ? Math.max(least, decimalsFor(deviation / per, 1)) : least;
  return [withDeviation(force / per, deviation / per, decimals), symbol];
}

/** A value of an event with its deviation and unit, in units that people read. */
export function eventValue(value: number | null, deviation: number | null, unit: string): string {
  if (value === null) return NONE;
  const known = deviation ?? Number.NaN;
  if (unit === "N") {
    const [text, symbol] = newtons(value, known, true);
    return Number.isFinite(known) ? `${text} ${symbol}` : `${text.split(" ")[0]} ${symbol}`;
  }
  const per = unit === "m/s" ? 1e-3 : 1;
  const [shown, spread] = [value / per, known / per];
  const symbol = unit === "m/s" ? " mm/s" : unit === "1" ? "" : ` ${unit}`;
  if (!Number.isFinite(spread)) return `${compact(shown)}${symbol}`;
  return `${withDeviation(shown, spread, Math.min(4, Math.max(1, decimalsFor(spread, 2))))}${symbol}`;
}

/** Device time, s. */
export function seconds(timeNs: number): string {
  return `${fixed(timeNs / 1e9, 2)} s`;
}

/** Time of day on the clock of this computer, such as 14:03; with seconds where they matter. */
export function clockTime(unixSeconds: number, withSeconds = false): string {
  const date = new Date(1000 * unixSeconds);
  const parts = [date.getHours(), date.getMinutes(), ...(withSeconds ? [date.getSeconds()] : [])];
  return parts.map((part) => String(part).padStart(2, "0")).join(":");
}

/** How many taxels read below zero, since when the zero is wrong, and what to do. */
export function belowZeroInWords({ taxels, cause, zero_unix_s: at }: BelowZero): string {
  const count = taxels === 1 ? "1 taxel reads" : `${taxels} taxels read`;
  // The moment belongs to the taking of the zero, which the first part of every cause with a moment names.
  const when = at === null ? "" : ` at ${clockTime(at)}`;
  const [first, ...more] = cause.split(",");
  return `${count} below zero: ${[`${first}${when}`, ...more].join(",")}. With nothing on the sensor, tare again.`;
}

/** A state of the rest values, for people. */
export function tareInWords(tare: Status["tare"]): string {
  if (tare === "waiting") return "tare: not taken yet";
  return tare === "loaded" ? "tare: from a recording" : `tare: ${tare}`;
}

/** A state of a taxel, for people. */
export function stateInWords(name: string): string {
  return WORDS[name] ?? name.replaceAll("_", " ");
}

const WORDS: Record<string, string> = {
  ok: "ok",
  unchecked: "unchecked: no second reading to check it, or not to be relied on yet",
  closed: "closed: electrodes touch each other, the value is a bound",
  out_of_range: "out of range of the model",
  not_converged: "not converged: no value found",
  inconsistent: "inconsistent: its readings disagree",
  faulty: "faulty: a channel does not read",
  masked: "masked: left out",
  saturated: "saturated: at the end of what can be read, the value is a bound",
  ambiguous: "ambiguous: one of several positions that explain the readings equally well",
  below_zero: "below zero: pressing reads less than nothing, so the zero is wrong",
};
