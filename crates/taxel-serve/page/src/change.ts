// The change of each channel of a device with one value per taxel against rest.

import type { SignalsMeaning } from "./protocol";

export interface Change {
  value: number;
  /** Otherwise in the shown unit of the signal. */
  perCent: boolean;
}

/**
 * Against rest in per cent; in the unit of the signal where the rest value is zero or not known, or where values of
 * either sign occur: there rest is a small offset about zero.
 */
export function changeOf({ signal: unit, signed }: SignalsMeaning, signal: number, rest: number): Change {
  if (!signed && Number.isFinite(rest) && rest !== 0) {
    return { value: (100 * (signal - rest)) / Math.abs(rest), perCent: true };
  }
  return { value: changeInUnit(unit.si_per_unit, signal, rest), perCent: false };
}

/** Without a rest value a signal is its own change. */
export function changeInUnit(per: number, signal: number, rest: number): number {
  return (Number.isFinite(rest) ? signal - rest : signal) / per;
}
