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

/** As many decimals as show `size` in this number of digits. */
export function decimalsFor(size: number, digits = 4): number {
  if (!(size > 0) || !Number.isFinite(size)) return 2;
  return Math.min(6, Math.max(0, digits - 1 - Math.floor(Math.log10(size) + 1e-9)));
}

/** Device time, s. */
export function seconds(timeNs: number): string {
  return `${fixed(timeNs / 1e9, 2)} s`;
}

/** A length of time, in the unit that fits it. */
export function durationInWords(seconds: number): string {
  const [size, unit] = seconds < 120 ? [1, "s"] : seconds < 7200 ? [60, "min"] : [3600, "h"];
  return `${Number((seconds / size).toPrecision(2))} ${unit}`;
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
