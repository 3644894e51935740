// Keys, the meaning of the marks, and settings, in a dialog.

import { byId, create } from "./dom";
import type { Legend } from "./legend";

const KEYS: readonly (readonly [keys: string, does: string])[] = [
  ["T", "tare: take the next frames as rest"],
  ["P, space", "freeze the display; of a replay, pause it"],
  ["M", "mark this moment with words"],
  ["R", "record the run, or stop"],
  ["L", "keep the colour scale as it is, or let it follow"],
  ["D", "drawing of the device"],
  ["1 to 6", "the tabs: channels, taxel, events, tares, link, condition"],
  ["Arrows, Home, End, Page up and down", "in the image: go from taxel to taxel; Escape leaves"],
  [", and .", "in the image: turn a cylinder"],
  ["Arrows, +, \u2212, Home, End", "in the chart: pan and zoom; with shift the cursor"],
  ["?", "this list"],
];

export class Help {
  private readonly dialog = byId<HTMLDialogElement>("help-dialog");

  constructor() {
    const list = create("dl", { class: "facts keys-list" });
    for (const [keys, does] of KEYS) list.append(create("dt", {}, create("kbd", {}, keys)), create("dd", {}, does));
    byId("help-keys").replaceChildren(list);
    byId("help").addEventListener("click", () => this.toggle());
    byId("help-close").addEventListener("click", () => this.dialog.close());
  }

  get open(): boolean {
    return this.dialog.open;
  }

  takeLegend(legend: Legend): void {
    byId("help-legend").replaceChildren(legend.root);
  }

  toggle(): void {
    if (this.dialog.open) this.dialog.close();
    else this.dialog.showModal();
  }
}
