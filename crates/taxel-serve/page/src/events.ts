// The list of events of contacts, the newest first.

import { create, setText } from "./dom";
import { fixed, NONE, seconds } from "./format";
import type { TouchEvent } from "./protocol";
import { certain, Quantity } from "./units";

/** Rows of the list; older events are dropped. */
const MOST_ROWS = 200;
/** A clock that goes back by more than this was set back, ns. */
const SET_BACK = 0.5e9;
const KINDS = ["touch", "release", "split", "merged", "step", "impact", "cyclic", "slip", "saturated", "closed", "overload", "mark"];

export class EventList {
  readonly root: HTMLElement;
  readonly filter: HTMLSelectElement;
  private readonly body = create("tbody");
  private readonly hint = create("p", { class: "hint" }, "No event yet.");
  private events: TouchEvent[] = [];

  constructor() {
    this.filter = create("select", { class: "filter", "aria-label": "Events shown", "data-testid": "event-filter" });
    for (const kind of ["", ...KINDS]) {
      this.filter.append(create("option", { value: kind }, kind === "" ? "all" : kind));
    }
    this.filter.addEventListener("change", () => this.fill());
    const table = create("table", { class: "events" }, this.body);
    this.root = create("div", { class: "scroll", tabindex: "0", "data-testid": "events" }, this.hint, table);
  }

  /** All that are kept, the oldest first. */
  get all(): readonly TouchEvent[] {
    return this.events;
  }

  clear(): void {
    this.events = [];
    this.fill();
  }

  /** Takes new events, the oldest first; `missed` earlier ones are not kept any more. */
  take(events: readonly TouchEvent[], missed: number): void {
    // The clock was set back, as by going back in a replay: what was before lies on another time axis.
    const [newest, next] = [this.events[this.events.length - 1], events[0]];
    if (newest !== undefined && next !== undefined && next.time_ns < newest.time_ns - SET_BACK) this.clear();
    this.events.push(...events);
    this.events.splice(0, this.events.length - MOST_ROWS);
    if (missed > 0) setText(this.hint, `${missed} earlier events are not kept.`);
    const shown = events.slice(-MOST_ROWS).filter((event) => this.shows(event));
    this.body.prepend(...shown.reverse().map(row));
    while (this.body.rows.length > MOST_ROWS) this.body.deleteRow(-1);
    this.hint.hidden = this.body.rows.length > 0;
  }

  private shows({ kind }: TouchEvent): boolean {
    return this.filter.value === "" || this.filter.value === kind;
  }

  private fill(): void {
    const shown = this.events.filter((event) => this.shows(event));
    this.body.replaceChildren(...shown.reverse().map(row));
    setText(this.hint, this.events.length === 0 ? "No event yet." : "No such event.");
    this.hint.hidden = shown.length > 0;
  }
}

function row(event: TouchEvent): HTMLTableRowElement {
  const { time_ns: time, contact, value, deviation, unit, certainty } = event;
  const what = eventInWords(event);
  const cells = [seconds(time), contact === 0 ? "" : String(contact), what];
  // Where there is no room for both, the deviation stands below the value.
  const words = Quantity.of(unit).words(value ?? Number.NaN, deviation ?? Number.NaN);
  const exact = certainty === null || certainty === "exact";
  const text = [words.number, ...(exact && words.deviation !== "" ? [] : [words.symbol])].join(" ");
  const shown = value === null ? (event.kind === "mark" ? "" : NONE) : certain(text, certainty);
  const last = value === null || !exact || words.deviation === "" ? [shown] : [`${shown} `, create("span", { class: "spread" }, `${words.deviation} ${words.symbol}`)];
  const line = create("tr", {}, ...cells.map((text) => create("td", {}, text)), create("td", {}, ...last));
  if (contact !== 0) line.title = `contact ${contact}: ${what}`;
  return line;
}

/** What happened, with what belongs to it beside its value. */
export function eventInWords(event: TouchEvent): string {
  if (event.text !== undefined) return `mark: ${event.text}`;
  const { kind, parent, into, rise_time_s: rise, symmetry, direction, score } = event;
  if (parent !== undefined) return `split from ${parent}`;
  if (into !== undefined) return `merged into ${into}`;
  if (rise !== undefined) return `impact, rise ${fixed(1e3 * rise, 1)} ms`;
  if (symmetry !== undefined) return `cyclic, symmetry ${fixed(symmetry, 2)}`;
  if (direction === undefined) return kind;
  const along = score === undefined ? "" : ` along the row, score ${fixed(score, 2)}`;
  return `slip ${arrow(direction)}${along}`;
}

const ARROWS = ["→", "↗", "↑", "↖", "←", "↙", "↓", "↘"];

/** The arrow nearest to a direction, y upwards. */
function arrow([x, y]: readonly [number, number]): string {
  const eighth = Math.round(Math.atan2(y, x) / (Math.PI / 4));
  return ARROWS[(eighth + 8) % 8] as string;
}
