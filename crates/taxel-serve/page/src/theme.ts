// Light or dark: the system's choice unless the person chose.

import { forgetCssValues } from "./dom";

export type ThemeChoice = "auto" | "light" | "dark";
export type Theme = "light" | "dark";

const KEY = "taxel-theme";
const NEXT: Record<ThemeChoice, ThemeChoice> = { auto: "light", light: "dark", dark: "auto" };

export class ThemeSwitch {
  theme: Theme = "light";
  private choice: ThemeChoice = stored();
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
      store(this.choice);
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

/** Storage may be forbidden; then the choice lasts as long as the page. */
function stored(): ThemeChoice {
  try {
    const choice = localStorage.getItem(KEY);
    return choice === "light" || choice === "dark" ? choice : "auto";
  } catch {
    return "auto";
  }
}

function store(choice: ThemeChoice): void {
  try {
    localStorage.setItem(KEY, choice);
  } catch {
    // The choice is kept in memory.
  }
}
