// Light or dark: the system's choice unless the person chose.

import { forgetCssValues } from "./dom";
import { recall, remember } from "./store";

export type ThemeChoice = "auto" | "light" | "dark";
export type Theme = "light" | "dark";

const NEXT: Record<ThemeChoice, ThemeChoice> = { auto: "light", light: "dark", dark: "auto" };

export class ThemeSwitch {
  theme: Theme = "light";
  private choice: ThemeChoice = chosen(recall("theme"));
  private readonly system = matchMedia("(prefers-color-scheme: dark)");
  /** Colours of the system's own: then light and dark are too, or lines of one would lie on the ground of the other. */
  private readonly forced = matchMedia("(forced-colors: active)");
  private readonly button: HTMLButtonElement;
  private readonly changed: () => void;

  constructor(button: HTMLButtonElement, changed: () => void) {
    this.button = button;
    this.changed = changed;
    this.apply();
    this.system.addEventListener("change", () => this.apply());
    this.forced.addEventListener("change", () => this.apply());
    button.addEventListener("click", () => {
      this.choice = NEXT[this.choice];
      remember("theme", this.choice);
      this.apply();
    });
  }

  private apply(): void {
    const follows = this.choice === "auto" || this.forced.matches;
    this.theme = follows ? (this.system.matches ? "dark" : "light") : (this.choice as Theme);
    document.documentElement.dataset["theme"] = this.theme;
    forgetCssValues();
    this.button.textContent = `Theme: ${this.choice}`;
    this.changed();
  }
}

function chosen(kept: string | null): ThemeChoice {
  return kept === "light" || kept === "dark" ? kept : "auto";
}
