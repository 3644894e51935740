// Tabs of the sensors of a service with several: each leads to a page of its own, and says how its source stands.

import { byId, create, setText } from "./dom";
import type { SensorNow, Status } from "./protocol";

export class SensorTabs {
  private readonly root = byId("sensors");
  private shown = "";

  take(status: Status | null): void {
    const sensors = status?.sensors ?? [];
    this.root.hidden = sensors.length < 2;
    const names = sensors.map(({ name, path }) => `${path} ${name}`).join();
    if (names !== this.shown) {
      this.shown = names;
      this.root.replaceChildren(...sensors.map(link));
    }
    sensors.forEach(({ state }, at) => {
      const tab = this.root.children[at] as HTMLElement;
      tab.dataset["source"] = state;
      setText(tab.lastElementChild as HTMLElement, state);
    });
  }
}

function link({ name, path, here }: SensorNow): HTMLElement {
  const address = new URL(path, location.href);
  address.search = location.search;
  const tab = create("a", { href: address.href, ...(here ? { "aria-current": "page" } : {}) }, name);
  tab.append(create("span", { class: "source-state" }));
  return tab;
}
