// What the kinds of device have in common on the screen.

import type { Cell, Panel } from "./panel";
import type { Frame } from "./protocol";
import type { Theme } from "./theme";

/** What is to be drawn. */
export interface Scene {
  frame: Frame;
  selected: Cell | null;
  theme: Theme;
  /** ms */
  now: number;
}

export interface View {
  readonly panels: readonly Panel[];
  /** Takes every frame that arrives: for the strip chart. */
  record(frame: Frame): void;
  /** Takes new rest capacitances, SI. */
  takeRest(capacitance: readonly (number | null)[]): void;
  drawImages(scene: Scene): void;
  drawStrip(now: number): void;
  /** Shows the taxel in the inspector; returns the sentence for screen readers. */
  inspect(frame: Frame, cell: Cell): string;
  clearInspector(): void;
  /** Takes the colours of a new theme. */
  recolour(): void;
  /** Sum of the values of a frame in shown units; NaN where that means nothing. */
  sum(frame: Frame): number;
}
