// Numbers and states in words.

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

/** A state of a taxel, for people. */
export function stateInWords(name: string): string {
  return WORDS[name] ?? name.replaceAll("_", " ");
}

const WORDS: Record<string, string> = {
  ok: "ok",
  unchecked: "unchecked: nothing left to check it against",
  contact: "contact: electrodes touch",
  out_of_range: "out of range of the model",
  not_converged: "not converged: no force found",
  inconsistent: "inconsistent: its capacitors disagree",
  faulty: "faulty: a capacitor does not read",
  masked: "masked: left out",
};

const CAPACITORS = ["11", "12", "21", "22"];

/** Capacitors by name, from their bits. */
export function capacitorNames(bits: number): string {
  const names = CAPACITORS.filter((_, bit) => (bits & (1 << bit)) !== 0);
  return names.length === 0 ? "none" : names.join(", ");
}
