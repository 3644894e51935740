// What lasts longer than a frame, in one panel: events, history of the rest values, condition of the channels.

import { ConditionView } from "./condition";
import { create, setText } from "./dom";
import { EventList } from "./events";
import type { PanelListener } from "./panel";
import type { BaselineChanges, Health, Hello, TareEntry, TouchEvent } from "./protocol";
import { type TareActions, TareList } from "./tares";

const TABS = ["events", "tares", "condition"] as const;
type Tab = (typeof TABS)[number];
const TITLES: Record<Tab, string> = { events: "Events", tares: "Tares", condition: "Condition" };

export class Journal {
  readonly root: HTMLElement;
  readonly condition: ConditionView;
  private readonly events = new EventList();
  private readonly tares: TareList;
  private readonly buttons = new Map<Tab, HTMLButtonElement>();
  private readonly pages: Record<Tab, HTMLElement>;

  constructor(listener: PanelListener, tares: TareActions) {
    this.condition = new ConditionView(listener);
    this.tares = new TareList(tares);
    this.pages = { events: this.events.root, tares: this.tares.root, condition: this.condition.root };
    const tabs = create("div", { class: "segments tabs", role: "tablist", "aria-label": "Journal" });
    for (const tab of TABS) {
      const page = this.pages[tab];
      page.id = `journal-${tab}`;
      page.setAttribute("role", "tabpanel");
      page.setAttribute("aria-label", TITLES[tab]);
      const button = create(
        "button",
        { type: "button", role: "tab", "aria-controls": page.id, "data-testid": `tab-${tab}` },
        TITLES[tab],
      );
      button.addEventListener("click", () => this.open(tab));
      button.addEventListener("keydown", (event) => this.step(tab, event));
      this.buttons.set(tab, button);
      tabs.append(button);
    }
    const head = create("div", { class: "panel-head" }, tabs, this.events.filter);
    this.root = create("section", { class: "panel journal", "aria-label": "Journal" }, head);
    this.root.append(...Object.values(this.pages));
    this.open("events");
  }

  /** Begins anew for a connection: the server sends everything again. */
  greet(hello: Hello): void {
    this.events.clear();
    this.tares.greet(hello);
    this.condition.greet(hello);
  }

  takeEvents(events: readonly TouchEvent[], missed: number): void {
    this.events.take(events, missed);
  }

  takeTares(entries: readonly TareEntry[]): void {
    this.tares.take(entries);
  }

  takeBaseline(baseline: BaselineChanges): void {
    this.tares.takeBaseline(baseline);
  }

  takeHealth(health: Health): void {
    this.condition.take(health);
    const count = health.wrong_channels;
    setText(this.buttons.get("condition") as HTMLElement, count === 0 ? "Condition" : `Condition (${count})`);
  }

  open(tab: Tab): void {
    for (const name of TABS) {
      const chosen = name === tab;
      this.pages[name].hidden = !chosen;
      const button = this.buttons.get(name);
      button?.setAttribute("aria-selected", String(chosen));
      button?.setAttribute("tabindex", chosen ? "0" : "-1");
    }
    this.events.filter.hidden = tab !== "events";
    if (tab === "condition") this.condition.draw();
  }

  /** Arrow keys go from tab to tab. */
  private step(tab: Tab, event: KeyboardEvent): void {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by === undefined) return;
    const next = TABS[(TABS.indexOf(tab) + by + TABS.length) % TABS.length] as Tab;
    this.open(next);
    this.buttons.get(next)?.focus();
    event.preventDefault();
  }
}
