// The history of the rest values, the newest first, with the way back to each of them.

import { create } from "./dom";
import { seconds } from "./format";
import type { BaselineChanges, Hello, TareEntry } from "./protocol";
import { Quantity } from "./units";

/** What one can ask for. */
export interface TareActions {
  /** Go back to the rest values after an entry. */
  goBack(to: number): void;
  /** Tare although something presses. */
  force(): void;
  /** Return to the rest values of the calibration. */
  clear(): void;
}

export class TareList {
  readonly root: HTMLElement;
  private readonly list = create("ol", { class: "tares" });
  private readonly own = create("div", { class: "baseline", "data-testid": "baseline" });
  private readonly actions: TareActions;
  private quantity = Quantity.of("");

  constructor(actions: TareActions) {
    this.actions = actions;
    const clear = create("button", { type: "button", class: "small", "data-testid": "clear-tare", title: "Return to the rest values of the calibration" }, "Clear tare");
    clear.addEventListener("click", () => actions.clear());
    const list = create("div", { class: "scroll", tabindex: "0", "data-testid": "tares" }, this.list, this.own);
    this.root = create("div", { class: "table-page" }, create("div", { class: "table-bar" }, clear), list);
  }

  greet(hello: Hello): void {
    this.quantity = new Quantity(hello.reading);
    this.list.replaceChildren();
    this.own.replaceChildren();
  }

  take(entries: readonly TareEntry[]): void {
    // The focus stays on the button of the same entry.
    const focused = document.activeElement?.getAttribute("data-entry");
    const newest = entries[entries.length - 1]?.index;
    const lines = [...entries].reverse().map((entry) => this.line(entry, entry.index === newest));
    this.list.replaceChildren(...lines);
    if (focused != null) this.list.querySelector<HTMLElement>(`[data-entry="${focused}"]`)?.focus();
  }

  takeBaseline({ changes, last }: BaselineChanges): void {
    const items = [...last]
      .reverse()
      .map(({ time_ns: time, name, change, reason }) =>
        create("li", {}, `${seconds(time)}  ${name}  ${this.change(change)}: ${reason}`),
      );
    const count = changes === 1 ? "1 change" : `${changes} changes`;
    this.own.replaceChildren(create("p", {}, `Baseline followed by itself: ${count}, the last ones:`), create("ul", {}, ...items));
  }

  private line(entry: TareEntry, newest: boolean): HTMLElement {
    const { index, time_ns: time, kind } = entry;
    const text = create("span", { class: "tare-text" }, `${time === null ? "start" : seconds(time)}  ${this.words(entry)}`);
    const item = create("li", { "data-kind": kind }, text);
    if (newest && kind === "refused") {
      item.append(this.button(index, "force", "Tare anyway", "Tare although something presses", () => this.actions.force()));
    } else if (newest) item.append(create("span", { class: "now" }, "in force"));
    else if (kind !== "refused") {
      const label = `Go back to the rest values after: ${text.textContent}`;
      item.append(this.button(index, "undo", "Go back", label, () => this.actions.goBack(index)));
    }
    return item;
  }

  private button(entry: number, action: string, words: string, label: string, act: () => void): HTMLElement {
    const attributes = { type: "button", class: "small", "data-entry": String(entry), "data-testid": `${action}-${entry}` };
    const button = create("button", { ...attributes, "aria-label": label }, words);
    button.addEventListener("click", act);
    return button;
  }

  private words({ kind, by, largest_change: largest, to, message }: TareEntry): string {
    const who = by === "page" ? "by the page" : "at the start";
    const most =
      largest === null || kind === "begun" || kind === "refused"
        ? ""
        : `, largest change ${this.change(largest.change)} (${largest.name})`;
    switch (kind) {
      case "begun":
        return "rest values of the calibration";
      case "captured":
        return `tare ${who}${most}${message === "" ? "" : `; ${message}`}`;
      case "cleared":
        return `cleared ${who}${most}`;
      case "undone":
        return `${who} back to ${to === 0 ? "the calibration" : `entry ${to}`}${most}`;
      default:
        return `refused, asked for ${who}: ${message.replace(/^rest capture refused: /, "")}`;
    }
  }

  private change(change: number): string {
    return `${change > 0 ? "+" : ""}${this.quantity.text(change)}`;
  }
}
