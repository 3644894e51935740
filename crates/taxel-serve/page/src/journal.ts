// Everything that is not skin, now or time, in tabs: channels, the inspected taxel, events, tares, condition, link.

import type { ChannelTable } from "./channels";
import { ConditionView } from "./condition";
import { create, setText } from "./dom";
import { EventList } from "./events";
import { Inspector } from "./inspect";
import { LinkView } from "./link_view";
import type { PanelListener } from "./panel";
import type { BaselineChanges, Health, Hello, TareEntry, TouchEvent } from "./protocol";
import { type TareActions, TareList } from "./tares";

const TABS = ["channels", "taxel", "events", "tares", "link", "condition"] as const;
export type Tab = (typeof TABS)[number];
const TITLES: Record<Tab, string> = { channels: "Channels", taxel: "Taxel", events: "Events", tares: "Tares", condition: "Condition", link: "Link" };

export class Journal {
  readonly root: HTMLElement;
  readonly condition: ConditionView;
  readonly inspector = new Inspector();
  readonly link = new LinkView();
  readonly events = new EventList();
  private readonly tares: TareList;
  private readonly buttons = new Map<Tab, HTMLButtonElement>();
  private readonly pages: Record<Tab, HTMLElement>;
  private tab: Tab = "events";

  constructor(listener: PanelListener, tares: TareActions) {
    this.condition = new ConditionView(listener);
    this.tares = new TareList(tares);
    const events = create("div", { class: "table-page" }, create("div", { class: "table-bar" }, this.events.filter), this.events.root);
    this.pages = {
      channels: create("div", { class: "table-page" }),
      taxel: this.inspector.root,
      events,
      tares: this.tares.root,
      condition: this.condition.root,
      link: this.link.root,
    };
    const tabs = create("div", { class: "tabs", role: "tablist", "aria-label": "More" });
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
    this.root = create("section", { class: "panel journal", "aria-label": "More" }, tabs);
    this.root.append(...Object.values(this.pages));
    this.open("events");
  }

  /** Begins anew for a connection: the server sends everything again. */
  greet(hello: Hello): void {
    this.events.clear();
    this.tares.greet(hello);
    this.condition.greet(hello);
    this.link.greet(hello);
  }

  /** Takes the table of the channels, or null where it has an area of its own. */
  takeChannels(table: ChannelTable | null): void {
    this.pages.channels.replaceChildren(...(table === null ? [] : [table.root]));
    this.hide("channels", table === null);
  }

  /** Whether there is a tab for a taxel: a table of channels says all. */
  hide(tab: Tab, hidden: boolean): void {
    const button = this.buttons.get(tab);
    if (button !== undefined) button.hidden = hidden;
    if (hidden && this.tab === tab) this.open("events");
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
    this.tab = tab;
    for (const name of TABS) {
      const chosen = name === tab;
      this.pages[name].hidden = !chosen;
      const button = this.buttons.get(name);
      button?.setAttribute("aria-selected", String(chosen));
      button?.setAttribute("tabindex", chosen ? "0" : "-1");
    }
    if (tab === "condition") this.condition.draw();
  }

  /** Opens a tab and brings it into view, for whoever asked for it elsewhere on the page. */
  reveal(tab: Tab): void {
    this.open(tab);
    this.root.scrollIntoView({ block: "nearest" });
  }

  /** Arrow keys go from tab to tab. */
  private step(tab: Tab, event: KeyboardEvent): void {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by === undefined) return;
    const shown = TABS.filter((name) => this.buttons.get(name)?.hidden === false);
    const next = shown[(shown.indexOf(tab) + by + shown.length) % shown.length] as Tab;
    this.open(next);
    this.buttons.get(next)?.focus();
    event.preventDefault();
  }
}
