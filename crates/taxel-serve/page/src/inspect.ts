// The page that says everything about one taxel.

import { create, symbol } from "./dom";
import { fixed, NONE, stateInWords } from "./format";
import { named } from "./layers";
import type { Cell } from "./panel";
import type { Frame, Hello } from "./protocol";
import type { Quantities } from "./units";

const AXES = ["x", "y", "z"] as const;

/** A taxel by the name of its channel, or by its row and column where the channel is named after them. */
export function taxelName({ wiring, channels, columns }: Pick<Hello, "wiring" | "channels" | "columns">, { row, column }: Cell): string {
  const name = wiring.kind === "per_taxel" && wiring.channels === 1 ? (channels[row * columns + column] ?? "") : "";
  return name === "" || /^r\d+c\d+$/.test(name) ? `row ${row}, column ${column}` : name;
}

export class Inspector {
  readonly root: HTMLElement;
  private readonly content = create("div", { class: "inspect-content" });
  private readonly title = create("h2");

  constructor() {
    this.root = create("div", { class: "inspect scroll", tabindex: "0", "data-testid": "inspect" }, this.title, this.content);
    this.clear();
  }

  clear(): void {
    this.title.textContent = "";
    this.content.replaceChildren(
      create("p", { class: "hint" }, "Point at a taxel, tap it, or move with the arrow keys in the image."),
    );
  }

  /** Adds what is against the taxel's channels; returns the sentence with it. */
  withCondition(sentence: string, words: readonly string[]): string {
    if (words.length === 0) return sentence;
    const text = words.join("; ");
    this.content.querySelector(".state")?.after(create("p", { class: "against", "data-testid": "inspect-condition" }, text));
    return `${sentence}, ${text}`;
  }

  /** One line about a taxel. */
  brief(hello: Hello, quantities: Quantities, frame: Frame, cell: Cell): string {
    const taxel = cell.row * hello.columns + cell.column;
    const state = hello.states[frame.state[taxel] as number] ?? "unknown";
    const of = (axis: number): string => valueInWords(hello, quantities, frame, hello.components * taxel + axis);
    const values = hello.components === 3 ? `pressing ${of(2)}` : of(0);
    return `${taxelName(hello, cell)}: ${values}, ${state.replaceAll("_", " ")}`;
  }

  /** Shows a taxel, with its channels against `rest`, SI; returns the sentence for screen readers. */
  show(hello: Hello, quantities: Quantities, frame: Frame, cell: Cell, rest: readonly (number | null)[] | null): string {
    const taxel = cell.row * hello.columns + cell.column;
    const state = hello.states[frame.state[taxel] as number] ?? "unknown";
    const name = taxelName(hello, cell);
    this.title.textContent = name;
    const facts: [string, string][] = [];
    const parts: HTMLElement[] = [];
    const spoken: string[] = [];
    if (hello.components === 3) parts.push(vectorTable(hello, quantities, frame, taxel, spoken));
    else {
      const shown = valueInWords(hello, quantities, frame, taxel);
      facts.push([hello.value.quantity === "raw" ? "Value" : named(hello.value.quantity), shown]);
      spoken.push(shown);
    }
    const { wiring } = hello;
    if (wiring.kind === "per_taxel" && hello.picture !== "map") {
      const own = Array.from({ length: wiring.channels }, (_, index) => wiring.channels * taxel + index);
      parts.push(channelTable(hello, quantities, frame, own, rest));
    }
    if (wiring.kind === "per_taxel" && wiring.channels > 1) {
      const residual = frame.residual[taxel] as number;
      facts.push(["Residual", Number.isFinite(residual) ? `${fixed(residual, 2)} σ` : "no check"]);
    }
    const contact = frame.contacts.find(({ peakTaxel }) => peakTaxel === taxel);
    if (contact !== undefined && hello.components === 1) facts.push(["Contact", contact.id > 0 ? `peak of contact ${contact.id}` : "peak of a contact"]);
    const line = create("p", { class: state === "ok" ? "state good" : "state", "data-testid": "inspect-state" }, stateInWords(state));
    this.content.replaceChildren(line, create("div", { class: "inspect-columns" }, ...parts, factList(facts)));
    return `${name}: ${spoken.join(", ")}, ${stateInWords(state)}`;
  }
}

/** A value with its deviation; until there is a zero it is none. */
function valueInWords(hello: Hello, { value: quantity }: Quantities, { header, value, deviation }: Frame, at: number): string {
  const number = value[at] as number;
  if (!header.zeroKnown) return "no zero yet";
  // Of one device all values are in one unit.
  return Number.isFinite(number) ? quantity.text(number, deviation[at] as number, Math.max(Math.abs(number), hello.full_scale ?? 0)) : "no value";
}

/** Force along each axis with its deviation. */
function vectorTable(hello: Hello, quantities: Quantities, frame: Frame, taxel: number, spoken: string[]): HTMLElement {
  const forces = create("table", { class: "forces" });
  AXES.forEach((axis, index) => {
    const words = valueInWords(hello, quantities, frame, 3 * taxel + index);
    forces.append(create("tr", {}, create("th", { scope: "row" }, symbol("F", axis)), create("td", {}, words)));
    spoken.push(`F ${axis} ${words}`);
  });
  return forces;
}

/** Readings of the channels of a taxel, their change against rest, and their state. */
function channelTable(hello: Hello, { reading: quantity }: Quantities, frame: Frame, channels: readonly number[], rest: readonly (number | null)[] | null): HTMLElement {
  const table = create("table", { class: "readings" });
  const heads = ["channel", "reading", "change", "state"].map((name) => create("th", { scope: "col" }, name));
  table.append(create("tr", { class: "units" }, ...heads));
  for (const channel of channels) {
    const value = frame.reading[channel] as number;
    const zero = rest?.[channel] ?? null;
    const state = hello.channel_states[frame.channelState[channel] as number] ?? "";
    const row = create("tr", {}, create("th", { scope: "row" }, hello.channels[channel] ?? ""));
    if (!USABLE.includes(state)) row.className = "bad";
    const change = zero === null ? NONE : quantity.text(value - zero, Number.NaN, Math.max(Math.abs(value - zero), Math.abs(zero) / 1000));
    row.append(create("td", {}, quantity.text(value)), create("td", {}, change), create("td", {}, state));
    table.append(row);
  }
  return table;
}

/** States of channels whose reading is used. */
const USABLE = ["ok", "closed"];

function factList(facts: [string, string][]): HTMLElement {
  const list = create("dl", { class: "facts" });
  for (const [name, value] of facts) list.append(create("dt", {}, name), create("dd", {}, value));
  return list;
}
